//! Emulator of the range finder VL53L3CX: ST DS13204 ("DS" below), with ranging on one target, or
//! histograms.
//!
//! ST publishes only drivers of this part, no register map. The map here is that of the VL53L1
//! family, as named by public drivers and application notes (ST UM2510, UM2356), and *all of it is
//! unverified* on this part, except for observations on a running StampFly: model 0xEA, module type
//! 0xAA and a one in bit 0 of 0x0010 after its start.
//!
//! | register | content | after reset |
//! |---|---|---|
//! | 0x0000 | 0 holds the chip in reset, 1 then restarts it at 0x29, as ST's drivers of the VL53L1 do | 1 |
//! | 0x0001 | address, 7 bits; acts from the end of the transfer | 0x29 |
//! | 0x0006 | fast oscillator as the factory measured it, 4.12 MHz | the specimen's |
//! | 0x0010, 0x00E5 | bit 0: the firmware runs | 1, 3 |
//! | 0x001E | added to every distance, quarters of a millimetre, 13 bits | the specimen's |
//! | 0x0022 | what the factory found to be missing from this specimen's distances, mm | the specimen's |
//! | 0x0024 | wanted signal rate of a histogram, 9.7 Mcps | 0 |
//! | 0x0030 | bit 4: interrupt line active low | 0x11 |
//! | 0x0031 | bit 0: level of the interrupt line | |
//! | 0x0034, 0x004A | length of the laser's pulse: sixteenths, and whole pixel clocks | 0 |
//! | 0x0046 | interrupt at: 0x20 a new measurement | 0 |
//! | 0x0047 | start of the laser, pixel clocks | 0 |
//! | 0x005E, 0x0061 | time-outs A and B, macro periods, coded | 0 |
//! | 0x0060, 0x0063 | periods of the laser A and B, half pixel clocks less one | 0x0B, 0x09 |
//! | 0x0064–0x0069 | groups of bins that a histogram counts: three bytes of even ones, three of odd ones | 0 |
//! | 0x006C–0x006F | period of measurements, ticks of the slow oscillator | 0 |
//! | 0x0082 | bit 1: number of the group of settings | 0 |
//! | 0x0085 | bit 0: the firmware may run | 1 |
//! | 0x0086 | bit 0 clears the interrupt and lets the next measurement begin | |
//! | 0x0087 | 0x40 measures again and again, 0x10 once, 0x26 a histogram, 0x80 and 0 stop | 0 |
//! | 0x0088 | interrupt status, (2:0); number of the group of settings, (5:4) | 0 |
//! | 0x0089 | (4:0) 9 valid, 6 sigma, 4 signal, 5 phase, 3 no bias voltage, 18 first histogram | 0 |
//! | 0x008B | number of the measurement, 0 to 255 and then from 128 | 0 |
//! | 0x008C | spads that saw something, 8.8 | 0 |
//! | 0x008E, 0x0090 | signal and ambient rate, 9.7 Mcps | 0 |
//! | 0x0092 | sigma, 14.2 mm | 0 |
//! | 0x0096 | distance, mm | 0 |
//! | 0x0098 | signal rate less crosstalk, 9.7 Mcps | 0 |
//! | 0x008E–0x00D5 | of a histogram: 24 bins, 3 bytes each, but for the last byte, whose bits are (7:2) in 0x00D9 and (1:0) in 0x00DA | 0 |
//! | 0x00D6, 0x00D8 | phase of the reference pulse, 2048ths of a pixel clock; where the laser started for it | 0 |
//! | 0x00DE | slow oscillator: ticks per 1.075⁻¹ ms | |
//! | 0x010F, 0x0110, 0x0111 | model 0xEA, module type 0xAA, revision 0x10 | |
//! | 0x011E–0x013D | detectors that work, a bit each | all |
//! | 0x013E, 0x013F | centre and size of the inner detectors | 0xC7, 0x33 |
//! | 0x0470–0x04B5 | patch of the firmware; kept, without effect | 0 |
//!
//! Register addresses have two bytes, and values of several bytes begin with the most significant
//! (DS 3.2). Reads and writes continue with the next register. The first answer comes 1.2 ms after
//! the release of XSHUT or after power-on (DS 2.8); until then the chip does not acknowledge. A
//! measurement takes the two timeouts plus 14 ms, *unverified*. The next one does not begin before
//! the interrupt of the previous one has been cleared and its period is over. Settings changed
//! during a measurement act on the next one. XSHUT must not rise during a transfer on the bus (DS,
//! "Power sequence"); otherwise the chip stays mute until XSHUT's next edge, *unverified*. All
//! state is in these registers: an edge of XSHUT or a dip of the supply returns the chip to 0x29. A
//! broken detector is one for which no bias voltage is found, so it counts nothing.
//!
//! A specimen measures too short by the value in 0x0022, unless that value is in 0x001E, where ST's
//! core puts it when no measurement of the mode is corrected (`vl53lx_api_core.c`), and public
//! drivers of the VL53L1X do, too. The core takes the content of 0x001E after a start as the offset
//! of histograms (`VL53LX_get_customer_nvm_managed`), so it is stored there. *Unverified*: its
//! size, here some millimetres.
//!
//! One histogram is measured for each 0x26, as ST's driver does (VL53LX bare driver, BSD-3-Clause;
//! its core runs on this emulator). The settings are sent for each histogram; those sent before the
//! previous start are in effect. The first histogram after a stop has status 18 and number 0, and
//! the next one has number 0 as well; after 255 numbers continue with 128. Even histograms use
//! laser period and timeout A, odd ones B. A histogram takes six timeouts and 1.7 ms, by that
//! driver's calculation. The counts are computed in `photons.rs`.
//!
//! Not modelled: selection among several targets, thresholds, groups of bins for bright light,
//! other calibration data, the region of interest.

mod photons;

use super::{Chip, Flaw, I2cChip, Nonsense};
use crate::noise::Noise;
use crate::sensors::schedule::Schedule;
use crate::sensors::tof::{Mount, RATE, RangePhysics, STATUS_OUT_OF_BOUNDS, STATUS_SIGMA, STATUS_SIGNAL, STATUS_VALID};
use crate::time::Clock;
use crate::world::World;
use core::cell::{Cell, RefCell};
use core::convert::Infallible;
use embedded_hal::digital::{ErrorType, OutputPin};
use photons::{BINS, Photons, Shot};
use stampfly_types::messages::TofData;
use stampfly_types::{Duration, Instant};
use std::rc::Rc;

const SOFT_RESET: u16 = 0x0000;
const ADDRESS: u16 = 0x0001;
const FIRMWARE: [(u16, u8); 2] = [(0x0010, 1), (0x00E5, 3)];
const FAST_OSCILLATOR: u16 = 0x0006;
const RANGE_OFFSET: u16 = 0x001E;
const FACTORY_OFFSET: u16 = 0x0022;
const WANTED_RATE: u16 = 0x0024;
const PULSE_SIXTEENTHS: u16 = 0x0034;
const LASER_START: u16 = 0x0047;
const PULSE_CLOCKS: u16 = 0x004A;
const GROUPS_OF_BINS: [u16; 2] = [0x0064, 0x0067];
const GROUP: u16 = 0x0082;
const ENABLE: u16 = 0x0085;
const BINS_FROM: u16 = 0x008E;
const REFERENCE: u16 = 0x00D6;
const LAST_BYTE: u16 = 0x00D9;
const DETECTORS: core::ops::RangeInclusive<u16> = 0x011E..=0x013D;
const INNER_DETECTORS: u16 = 0x013E;
const PATCH: core::ops::RangeInclusive<u16> = 0x0470..=0x04B5;
const POLARITY: u16 = 0x0030;
const LINE: u16 = 0x0031;
const INTERRUPT_AT: u16 = 0x0046;
const TIMEOUT_A: u16 = 0x005E;
const PERIOD_A: u16 = 0x0060;
const TIMEOUT_B: u16 = 0x0061;
const PERIOD_B: u16 = 0x0063;
const TIMES: [[u16; 2]; 2] = [[TIMEOUT_A, PERIOD_A], [TIMEOUT_B, PERIOD_B]];
const PERIOD: u16 = 0x006C;
const CLEAR: u16 = 0x0086;
const MODE: u16 = 0x0087;
const RESULT: u16 = 0x0088;
const OSCILLATOR: u16 = 0x00DE;
const MODEL: u16 = 0x010F;
/// Status of a measurement without bias voltage for the detector.
const NO_BIAS: u8 = 3;
/// Status of the first histogram after a stop.
const FIRST_OF_GROUP: u8 = 18;
/// Bit of [`MODE`] that selects histograms.
const HISTOGRAM: u8 = 0x02;
/// Size of the register space that a driver may write.
const SIZE: usize = 0x04B6;

const FIRST_ADDRESS: u8 = 0x29;
const BOOT: Duration = Duration::from_micros(1_200);
/// Random stream of the specimens' offsets, not used by any sensor, and the standard deviation of
/// the offsets, mm.
const STREAM: u64 = 104;
const OFFSETS: f64 = 8.0;
/// Random stream of the specimens' photons, plus the mount.
const PHOTONS: u64 = 106;
/// Nominal frequency of the fast oscillator, MHz, and pixel clocks per period of it.
const FAST: f64 = 11.8;
const CLOCKS: f64 = 64.0;
/// Ready time of a chip that left its reset during a transfer.
const NEVER: Instant = Instant::from_secs(u64::MAX / 2_000_000);
/// Slow oscillator of this specimen.
const SLOW_OSCILLATOR: u16 = 0x03C0;
/// Duration of a macro period per pixel clock of the laser period, µs: 2304 clocks of the fast
/// oscillator, 11.8 MHz, in 64 phases.
const MACRO_PERIOD: f64 = 2304.0 / 11.8 / 64.0;
/// Duration of a histogram beyond its timeouts, µs, and number of timeouts.
const HISTOGRAM_OVERHEAD: f64 = 1_700.0;
const HISTOGRAM_PARTS: f64 = 6.0;
/// Duration of a measurement beyond its two timeouts, µs.
const OVERHEAD: f64 = 14_000.0;

/// Decodes a number of macro periods: the low byte shifted left by the high byte, plus one.
fn macro_periods(code: u16) -> f64 {
    let [shift, mantissa] = code.to_be_bytes();
    f64::from(mantissa) * libm::exp2(f64::from(shift)) + 1.0
}

/// Distance by which the specimen of this seed measures too short, mm; never 0.
fn specimen_offset(seed: u64, mount: Mount) -> i16 {
    let place = match mount {
        Mount::Bottom => 0,
        Mount::Front => 1,
    };
    let drawn = (Noise::new(seed, STREAM + place).normal() * OFFSETS).clamp(-25.0, 25.0).round() as i16;
    if drawn == 0 { 7 } else { drawn }
}

/// The emulator. The same seed gives the same specimen as
/// [`RangeModel`](crate::sensors::RangeModel).
///
/// ```
/// use embedded_hal::i2c::I2c;
/// use stampfly_sim::chips::{I2cBus, Vl53l3cx};
/// use stampfly_sim::sensors::Mount;
/// use stampfly_sim::{Simulation, SimulationConfig};
/// use stampfly_types::Instant;
///
/// let simulation = Simulation::new(&SimulationConfig::example());
/// let clock = simulation.clock.clone();
/// let mut bus = I2cBus::new(&clock, 1);
/// let (chip, _shutdown) = Vl53l3cx::new(&simulation.world, &clock, 1, Mount::Bottom);
/// bus.attach(0x29, chip);
/// clock.advance_to(Instant::from_millis(2));
/// bus.write(0x29, &[0x00, 0x01, 0x30])?; // move to another address
/// let mut id = [0; 2];
/// bus.write_read(0x30, &[0x01, 0x0F], &mut id)?;
/// assert_eq!(id, [0xEA, 0xAA]);
/// # Ok::<(), stampfly_sim::chips::BusError>(())
/// ```
#[derive(Debug)]
pub struct Vl53l3cx(Rc<RefCell<State>>);

/// The chip's XSHUT pin as the processor drives it: low holds the chip in reset.
#[derive(Clone, Debug)]
pub struct ShutdownPin {
    clock: Clock,
    state: Rc<RefCell<State>>,
}

#[derive(Debug)]
struct State {
    clock: Clock,
    physics: RangePhysics,
    /// True time per time of the chip's clock.
    pace: f64,
    id: u8,
    /// Distance by which it measures too short, mm.
    short: i16,
    /// Instant from which the chip answers; `None` while XSHUT is low.
    ready: Option<Instant>,
    /// End of the present transfer on its bus.
    busy_until: Option<Rc<Cell<Instant>>>,
    registers: Box<[u8; SIZE]>,
    /// Begin of the running or next measurement.
    begin: Option<Instant>,
    /// A measurement is waiting for its interrupt to be cleared.
    pending: bool,
    photons: Photons,
    /// Number of histograms since the last stop, and the groups of settings in effect and sent for
    /// the next; `None` outside histogram mode.
    histograms: Option<(u32, [u8; 2])>,
    /// The detector is broken.
    broken: bool,
    flaw: Option<Flaw>,
    pointer: u16,
}

impl State {
    fn word(&self, register: u16) -> u16 {
        u16::from_be_bytes([self.byte(register), self.byte(register + 1)])
    }

    fn byte(&self, register: u16) -> u8 {
        self.registers.get(usize::from(register)).copied().unwrap_or(0)
    }

    fn set(&mut self, register: u16, bytes: &[u8]) {
        for (slot, byte) in self.registers[usize::from(register)..].iter_mut().zip(bytes) {
            *slot = *byte;
        }
    }

    /// True if the chip answers at this instant.
    fn answers(&self, now: Instant) -> bool {
        self.ready.is_some_and(|ready| ready <= now)
    }

    fn restart(&mut self, ready: Option<Instant>) {
        self.ready = ready;
        self.registers.fill(0);
        self.begin = None;
        self.pending = false;
        self.histograms = None;
        self.set(SOFT_RESET, &[1]);
        self.set(ADDRESS, &[FIRST_ADDRESS]);
        for (register, value) in FIRMWARE {
            self.set(register, &[value]);
        }
        // The specimen's clock error is that of its oscillator.
        self.set(FAST_OSCILLATOR, &((FAST / self.pace * 4096.0).round() as u16).to_be_bytes());
        self.set(FACTORY_OFFSET, &self.short.to_be_bytes());
        self.set(RANGE_OFFSET, &((self.short * 4) & 0x1FFF).to_be_bytes());
        DETECTORS.for_each(|register| self.set(register, &[0xFF]));
        self.set(INNER_DETECTORS, &[0xC7, 0x33]);
        self.set(ENABLE, &[1]);
        self.set(POLARITY, &[0x11]);
        self.set(PERIOD_A, &[0x0B]);
        self.set(PERIOD_B, &[0x09]);
        self.set(OSCILLATOR, &SLOW_OSCILLATOR.to_be_bytes());
        self.set(MODEL, &[self.id, 0xAA, 0x10]);
    }

    /// True while the soft reset register holds the chip: it acknowledges but ignores accesses.
    fn stands_still(&self) -> bool {
        self.byte(SOFT_RESET) & 1 == 0
    }

    fn true_time(&self, microseconds: f64) -> Duration {
        Duration::from_micros((microseconds * self.pace) as u64)
    }

    /// Number of the present or last histogram, and its part: 0 for A, 1 for B.
    fn histogram_number(count: u32) -> (u8, usize) {
        let number = match count.saturating_sub(1) {
            early @ 0..=255 => early as u8,
            late => 128 + ((late - 256) % 128) as u8,
        };
        (number, usize::from(number & 1))
    }

    /// Duration of a measurement.
    fn duration(&self) -> Duration {
        let range = |timeout, period| {
            let clocks = 2.0 * (f64::from(self.byte(period)) + 1.0);
            macro_periods(self.word(timeout)) * clocks * MACRO_PERIOD
        };
        if let Some((count, _)) = self.histograms {
            let [timeout, period] = TIMES[Self::histogram_number(count).1];
            return self.true_time(HISTOGRAM_OVERHEAD + HISTOGRAM_PARTS * range(timeout, period));
        }
        self.true_time(OVERHEAD + range(TIMEOUT_A, PERIOD_A) + range(TIMEOUT_B, PERIOD_B))
    }

    /// Period of measurements.
    fn period(&self) -> Duration {
        let ticks = f64::from(u32::from_be_bytes(core::array::from_fn(|n| self.byte(PERIOD + n as u16))));
        self.true_time(ticks / (f64::from(SLOW_OSCILLATOR) * 1.075) * 1e3).max(self.duration())
    }

    fn update(&mut self, now: Instant) {
        while let Some(begin) = self.begin.filter(|begin| !self.pending && *begin + self.duration() <= now) {
            if self.histograms.is_some() {
                self.measure_histogram(begin);
                self.pending = true;
                self.begin = None;
                return;
            }
            self.measure(begin);
            self.pending = self.flaw != Some(Flaw::LightMode(Nonsense::Silent));
            // In continuous mode the next begins after the period, once this interrupt has been
            // cleared.
            self.begin = (self.byte(MODE) == 0x40).then(|| begin + self.period());
        }
    }

    fn measure_histogram(&mut self, begin: Instant) {
        let Some((count, [group, _])) = self.histograms else { return };
        let (number, part) = Self::histogram_number(count);
        let [timeout, period] = TIMES[part];
        let mut echoes = self.physics.optical_echoes(begin + self.duration() / 2);
        match self.flaw {
            Some(Flaw::Offset(metres)) => echoes.iter_mut().for_each(|echo| echo.distance += metres),
            Some(Flaw::Covered(metres)) => echoes = self.physics.covered(metres),
            _ => {}
        }
        let from = GROUPS_OF_BINS[part];
        let shot = Shot {
            echoes,
            ambient: self.physics.ambient(),
            short: f64::from(self.short) * 1e-3,
            bin: self.pace / (CLOCKS * FAST),
            period: 2 * (usize::from(self.byte(period)) + 1),
            macro_periods: macro_periods(self.word(timeout)),
            width: f64::from(self.byte(PULSE_CLOCKS)) + f64::from(self.byte(PULSE_SIXTEENTHS)) / 16.0,
            wanted: f64::from(self.word(WANTED_RATE)) / 128.0,
            groups: core::array::from_fn(|n| self.byte(from + n as u16 / 2) >> (4 * (n % 2)) & 0xF),
        };
        let (bins, detectors) = self.photons.count(&shot);
        let (phase, start) = self.photons.reference(self.byte(LASER_START));
        let code = match count {
            _ if self.broken => NO_BIAS,
            0 => FIRST_OF_GROUP,
            _ => 9,
        };
        self.set(RESULT, &[3 | group << 4, code, 0, number]);
        self.set(0x008C, &((detectors * 256.0) as u16).to_be_bytes());
        for (place, bin) in (BINS_FROM..).step_by(3).zip(if self.broken { [0; BINS] } else { bins }) {
            self.set(place, &bin.to_be_bytes()[1..]);
        }
        // The last bin's low byte has its bits in two registers of their own; its usual place reads
        // zero.
        let lowest = self.byte(REFERENCE - 1);
        self.set(REFERENCE - 1, &[0]);
        self.set(REFERENCE, &phase.to_be_bytes());
        self.set(REFERENCE + 2, &[start]);
        self.set(LAST_BYTE, &[lowest >> 2, lowest & 3]);
        self.histograms = Some((count + 1, self.histograms.map_or([0; 2], |(_, groups)| groups)));
    }

    fn measure(&mut self, begin: Instant) {
        let mut reading = self.physics.measure(begin + self.duration() / 2);
        match self.flaw {
            Some(Flaw::Offset(metres)) => reading.distance += metres as f32,
            Some(Flaw::Covered(metres)) => {
                let distance = self.photons.near(metres) as f32;
                reading = TofData { distance, sigma: 0.001, status: STATUS_VALID, valid: true };
            }
            _ => {}
        }
        let number = match self.byte(RESULT + 3) {
            255 => 128,
            number => number + 1,
        };
        if self.broken || self.flaw == Some(Flaw::LightMode(Nonsense::Failing)) {
            self.set(RESULT, &[3, NO_BIAS, 0, number]);
            (0x008C..0x009A).for_each(|register| self.set(register, &[0]));
            return;
        }
        match self.flaw {
            Some(Flaw::LightMode(Nonsense::Frozen)) => {
                reading = TofData { distance: 0.255, sigma: 0.001, status: STATUS_VALID, valid: true };
            }
            Some(Flaw::LightMode(Nonsense::Unseen)) => {
                reading = TofData { distance: 0.255, sigma: 0.5, status: STATUS_SIGMA, valid: false };
            }
            Some(Flaw::LightMode(Nonsense::Blind)) => {
                reading = TofData { distance: 0.0, sigma: 0.0, status: STATUS_SIGNAL, valid: false };
            }
            _ => {}
        }
        // Signed 13 bits, quarters of a millimetre.
        let added = ((self.word(RANGE_OFFSET) << 3) as i16) >> 3;
        let millimetres = (reading.distance * 1e3 + 0.5) as i16 - self.short + added / 4;
        let code = match reading.status {
            STATUS_VALID => 9,
            STATUS_SIGMA => 6,
            STATUS_SIGNAL => 4,
            STATUS_OUT_OF_BOUNDS => 5,
            _ => 0,
        };
        // Inverse square law: 40 Mcps at 0.1 m over a bright floor.
        let metres = f64::from(reading.distance).max(0.1);
        let signal = if reading.status == STATUS_SIGNAL { 0.1 } else { 0.4 / (metres * metres) };
        let rate = |mega_counts: f64| ((mega_counts * 128.0) as u16).to_be_bytes();
        self.set(RESULT, &[3, code, 0, number]);
        self.set(0x008C, &(200u16 << 8).to_be_bytes());
        self.set(0x008E, &rate(signal));
        self.set(0x0090, &rate(0.5));
        self.set(0x0092, &((f64::from(reading.sigma) * 4e3 + 0.5) as u16).to_be_bytes());
        self.set(0x0096, &millimetres.to_be_bytes());
        self.set(0x0098, &rate(signal));
    }
}

impl Vl53l3cx {
    /// A chip after power-on with XSHUT high, and that pin.
    #[must_use]
    pub fn new(world: &World, clock: &Clock, seed: u64, mount: Mount) -> (Self, ShutdownPin) {
        let (physics, schedule): (_, Schedule) = RangePhysics::new(world, clock.now(), seed, mount);
        let mut state = State {
            clock: clock.clone(),
            physics,
            pace: schedule.period() * RATE * 1e-6,
            id: 0xEA,
            short: specimen_offset(seed, mount),
            ready: None,
            busy_until: None,
            registers: Box::new([0; SIZE]),
            begin: None,
            pending: false,
            photons: Photons::new(Noise::new(
                seed,
                PHOTONS
                    + match mount {
                        Mount::Bottom => 0,
                        Mount::Front => 1,
                    },
            )),
            histograms: None,
            broken: false,
            flaw: None,
            pointer: 0,
        };
        state.restart(Some(clock.now() + BOOT));
        let state = Rc::new(RefCell::new(state));
        (Self(state.clone()), ShutdownPin { clock: clock.clone(), state })
    }
}

impl ErrorType for ShutdownPin {
    type Error = Infallible;
}

impl OutputPin for ShutdownPin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.state.borrow_mut().restart(None);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        let mut state = self.state.borrow_mut();
        let now = self.clock.now();
        if state.ready.is_none() {
            // Traffic at this instant disturbs the boot of the chip.
            let in_traffic = state.busy_until.as_ref().is_some_and(|busy_until| busy_until.get() > now);
            state.ready = Some(if in_traffic { NEVER } else { now + BOOT });
        }
        Ok(())
    }
}

impl Chip for Vl53l3cx {
    fn read(&mut self, register: u16, now: Instant) -> u16 {
        let mut state = self.0.borrow_mut();
        state.update(now);
        if state.stands_still() {
            return 0;
        }
        if register == LINE {
            let asserted = state.pending && state.byte(INTERRUPT_AT) & 0x20 != 0;
            return u16::from(asserted != (state.byte(POLARITY) & 0x10 != 0));
        }
        u16::from(state.byte(register))
    }

    fn write(&mut self, register: u16, value: u16, now: Instant) {
        let mut state = self.0.borrow_mut();
        state.update(now);
        let byte = value as u8;
        match register {
            SOFT_RESET if byte & 1 == 0 => {
                state.set(SOFT_RESET, &[byte]);
                state.begin = None;
            }
            SOFT_RESET if state.stands_still() => state.restart(Some(now + BOOT)),
            _ if state.stands_still() => {}
            CLEAR if byte & 1 != 0 => {
                state.pending = false;
                state.set(RESULT, &[0]);
                // A measurement delayed by the interrupt begins now.
                state.begin = state.begin.map(|begin| begin.max(now));
            }
            MODE => {
                state.set(MODE, &[byte]);
                let group = state.byte(GROUP) & 2;
                state.histograms = match state.histograms {
                    _ if byte & HISTOGRAM == 0 => None,
                    None => Some((0, [group; 2])),
                    Some((count, [_, sent])) => Some((count, [sent, group])),
                };
                state.begin = match byte {
                    _ if state.byte(ENABLE) & 1 == 0 => None,
                    0x40 | 0x10 | 0x26 => Some(now),
                    _ => None,
                };
            }
            // Results, identity and registers that do not exist are read-only.
            LINE | RESULT..MODEL => {}
            ADDRESS => state.set(ADDRESS, &[byte & 0x7F]),
            _ if register < RESULT || PATCH.contains(&register) => state.set(register, &[byte]),
            _ => {}
        }
    }

    fn reset(&mut self, now: Instant) {
        let mut state = self.0.borrow_mut();
        if state.ready.is_some() {
            state.restart(Some(now + BOOT));
        }
    }

    fn set_id(&mut self, id: u16) {
        let mut state = self.0.borrow_mut();
        state.id = id as u8;
        state.set(MODEL, &[id as u8]);
    }

    fn set_flaw(&mut self, flaw: Option<Flaw>) {
        self.0.borrow_mut().flaw = flaw;
    }

    fn set_broken(&mut self, broken: bool) {
        self.0.borrow_mut().broken = broken;
    }
}

impl I2cChip for Vl53l3cx {
    fn wire(&mut self, busy_until: &Rc<Cell<Instant>>) {
        self.0.borrow_mut().busy_until = Some(busy_until.clone());
    }

    fn address(&self, _: u8) -> Option<u8> {
        let state = self.0.borrow();
        state.answers(state.clock.now()).then(|| state.byte(ADDRESS))
    }

    fn receive(&mut self, index: usize, byte: u8, now: Instant) -> bool {
        if index < 2 {
            let mut state = self.0.borrow_mut();
            state.pointer = state.pointer << 8 | u16::from(byte);
        } else {
            let register = self.0.borrow().pointer;
            self.write(register, u16::from(byte), now);
            self.0.borrow_mut().pointer = register.wrapping_add(1);
        }
        true
    }

    fn send(&mut self, _: usize, now: Instant) -> u8 {
        let register = self.0.borrow().pointer;
        let byte = self.read(register, now) as u8;
        self.0.borrow_mut().pointer = register.wrapping_add(1);
        byte
    }
}
