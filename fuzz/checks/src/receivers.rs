//! Serial receivers and configurators: bytes at a UART.

use stampfly_link::msp::MspDecoder;
use stampfly_link::serial::crsf::{CrsfDecoder, CrsfFrame};
use stampfly_link::serial::ibus::{IbusDecoder, IbusFrame};
use stampfly_link::serial::sbus::{SbusDecoder, SbusFrame};
use stampfly_types::{Duration, Instant};

/// Longest frame of MSP, bytes.
const MSP: usize = 64;

/// Bytes on the wire to all four decoders. A frame means the same when it is sent again, and no byte is lost count of.
pub fn receiver_bytes(data: &[u8]) {
    let (mut sbus, mut crsf, mut ibus) = (SbusDecoder::new(), CrsfDecoder::new(), IbusDecoder::new());
    let mut msp = MspDecoder::<MSP>::new();
    let [mut in_sbus, mut in_crsf, mut in_ibus] = [0; 3];
    let mut now = Instant::ZERO;
    for byte in data {
        // Now and then a pause, as the bytes will have it.
        now += Duration::from_micros(if byte % 64 == 63 { 700 } else { 120 });
        if let Some(frame) = sbus.feed(now, *byte) {
            assert_eq!(SbusFrame::decode(&frame.to_bytes()), Ok(frame));
            in_sbus += SbusFrame::LENGTH;
        }
        if let Some(frame) = ibus.feed(*byte) {
            assert_eq!(IbusFrame::decode(&frame.to_bytes()), Ok(frame));
            in_ibus += IbusFrame::LENGTH;
        }
        if let Some(frame) = msp.feed(*byte) {
            let mut written = [0; MSP];
            // A short frame may have come with the header of a long one, and is shorter without it.
            let length = frame.write(&mut written).expect("it came from no less");
            let mut again = MspDecoder::<MSP>::new();
            assert!(written[..length].iter().any(|byte| again.feed(*byte) == Some(frame)));
        }
        if let Some(frame) = crsf.feed(*byte) {
            let mut again = [0; CrsfFrame::LONGEST];
            let length = frame.write(&mut again).expect("it came from no more");
            assert_eq!(CrsfFrame::decode(&again[..length]), Ok(frame));
            // What is understood is written, and is understood again; numbers keep their steps.
            if let Some(length) = frame.message().write(&mut again) {
                let meant = CrsfFrame::decode(&again[..length]).expect("our own frame").message();
                assert_eq!(meant, frame.message());
            }
            in_crsf += length;
        }
    }
    for (in_frames, discarded, longest) in [
        (in_sbus, sbus.discarded(), SbusFrame::LENGTH),
        (in_crsf, crsf.discarded(), CrsfFrame::LONGEST),
        (in_ibus, ibus.discarded(), IbusFrame::LENGTH),
    ] {
        let known = in_frames + discarded as usize;
        assert!(known <= data.len() && data.len() - known < longest, "bytes that are nowhere");
    }
    assert!(msp.discarded() as usize <= data.len());
    by_buffer(data);
}

/// The same frames, when the bytes come in buffers. The first byte says how long these are.
fn by_buffer(data: &[u8]) {
    let size = 1 + usize::from(data.first().copied().unwrap_or(0));
    let (mut sbus, mut crsf) = (SbusDecoder::new(), CrsfDecoder::new());
    let (mut one_sbus, mut one_crsf) = (SbusDecoder::new(), CrsfDecoder::new());
    let (mut sticks, mut frames) = (Vec::new(), Vec::new());
    for buffer in data.chunks(size) {
        let (mut for_sbus, mut for_crsf) = (buffer, buffer);
        while let Some(frame) = sbus.read(Instant::ZERO, &mut for_sbus) {
            sticks.push(frame);
        }
        while let Some(frame) = crsf.read(&mut for_crsf) {
            frames.push((frame.kind, frame.payload.to_vec()));
        }
        assert!(for_sbus.is_empty() && for_crsf.is_empty());
    }
    let expected: Vec<_> = data.iter().filter_map(|byte| one_sbus.feed(Instant::ZERO, *byte)).collect();
    assert_eq!((sticks, sbus.discarded()), (expected, one_sbus.discarded()));
    let mut expected = Vec::new();
    for byte in data {
        expected.extend(one_crsf.feed(*byte).map(|frame| (frame.kind, frame.payload.to_vec())));
    }
    while let Some(frame) = one_crsf.read(&mut &[][..]) {
        expected.push((frame.kind, frame.payload.to_vec()));
    }
    assert_eq!((frames, crsf.discarded()), (expected, one_crsf.discarded()));
}
