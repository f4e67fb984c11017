//! What stations at the line and on the radio are told and do: questions, changed parameters, the flight record.

use super::{Console, newest_mode, put};
use crate::actions::Later;
use crate::changes;
use crate::clock::Clock;
use crate::memory::restart;
use crate::radio::POST;
use crate::record::Line;
use stampfly_board::messages::ParameterChange;
use stampfly_board::parameters;
use stampfly_drivers::Timebase;
use stampfly_flight::console::Request;
use stampfly_flight::live::Change;
use stampfly_services::cable::{BODY, PART, TUNNEL};
use stampfly_services::requests::{QueuedPayload, Room};

/// Bytes of the frames of a chunk of the flight record.
const CHUNK: usize = BODY.div_ceil(PART) * (TUNNEL + 32);
/// Bytes of the flight record that are worth a chunk: what comes in a turn.
const LEAST_CHUNK: usize = 256;
/// So many times in a turn are frames made of it: 60 kB a second and more. A key frame is gone in a tenth of a second.
const ROUNDS: usize = 4;

impl Console {
    /// Tells what of the parameters has changed, whoever has changed it.
    pub(super) fn tell_changes(&mut self) {
        let Self { known, detector, flown: (flown, was_armed), config, ends, .. } = self;
        let is_armed = newest_mode(known.memory).is_some_and(|mode| mode.armed);
        let was_armed = core::mem::replace(was_armed, is_armed);
        if is_armed && !was_armed {
            flown.clone_from(detector.last());
        }
        let lines = |name: &str| parameters::holders(name).iter().map(|line| *line as usize);
        let change = Change::detect(detector, config, lines, &mut |index, value| {
            ends.parameter_change.publish(Clock.now(), &ParameterChange { index: index as u32, value });
        });
        change.into_iter().for_each(changes::hand_over);
    }

    /// Passes the flight record on to whoever asks for it at the cable; the radio's task does so by radio.
    pub(super) async fn send_record(&mut self) {
        for _ in 0..ROUNDS {
            self.make_record();
            if self.frames.is_empty() {
                return;
            }
            self.send_frames().await;
        }
    }

    /// Makes frames of it, as far as there is room for them.
    pub(super) fn make_record(&mut self) {
        let Self { cable, requests, taken, frames, .. } = self;
        let (mut taken, mut room, now) = (taken.borrow_mut(), [0; BODY], Clock.now());
        taken.ask(now, Line::Cable, cable.record());
        taken.ask(now, Line::Radio, requests.borrow_mut().questions.record());
        taken.poll(now);
        while frames.capacity() - frames.len() >= CHUNK
            && let Some(chunk) = taken.chunk(Line::Cable, &mut room, LEAST_CHUNK)
        {
            cable.send_chunk(chunk, &mut |frame| put(frames, frame));
        }
    }

    /// Answers what stations ask, on the line and on the radio, and does what they ask for.
    pub(super) async fn answer_stations(&mut self) {
        let Self { known, config, cable, frames, .. } = self;
        let now = Clock.now();
        let request = known.vehicle(config, |vehicle| cable.answer(now, vehicle, &mut |frame| put(frames, frame)));
        self.send_frames().await;
        if request != Request::Nothing {
            let said = self.carry_out(request, true).await;
            self.cable.report(&said);
        }
        // The radio has sent those before.
        if POST.is_empty() {
            let Self { known, config, requests, .. } = self;
            let answered = known.vehicle(config, |vehicle| {
                let mut room = Room::default();
                let answer = requests.borrow_mut().questions.answer(now, vehicle, &mut room)?;
                Some((QueuedPayload::of(&answer.payload), answer.request))
            });
            if let Some((post, request)) = answered {
                if let Some(post) = post {
                    let _ = POST.try_send(post);
                }
                if request != Request::Nothing {
                    let said = self.carry_out(request, false).await;
                    self.requests.borrow_mut().questions.report(&said);
                }
            }
        }
        match self.later.take() {
            Some(Later::Save) => {
                let _ = self.carry_out(Request::SaveParameters, true).await;
            }
            Some(Later::Restart) if newest_mode(self.known.memory).is_some_and(|mode| !mode.armed) => restart(),
            _ => {}
        }
    }
}
