//! The data stream: every control cycle of a flight, for whoever asked for it, fifty packets a second.
//!
//! Call [`DataStream::cycle`] when a control cycle has ended and [`DataStream::poll`] about two hundred times a second; a packet is
//! ready after eight cycles, and lost when it was not fetched before the next one is. Which cycles arrived is seen by the packets' numbers.
//! What the controllers want of each other inside a cycle is on no topic: the wanted rates are zero, and there is no entry of what was wanted.

use crate::view::View;
use stampfly_link::stream::{CYCLES, LONGEST, StreamBuilder, StreamCycle, StreamEntry, StreamOutput, StreamRequest};
use stampfly_link::stream::{StreamSink, StreamStatus};
use stampfly_types::{Duration, Instant, Vec3};

/// Between two status packets.
const STATUS: Duration = Duration::from_secs(1);

/// The data stream of one vehicle. `A` is the address of a program.
#[derive(Clone, Debug)]
pub struct DataStream<A> {
    sink: StreamSink<A>,
    builder: StreamBuilder,
    ready: [u8; LONGEST],
    ready_length: usize,
    outputs: [StreamOutput; CYCLES],
    duties: [[f32; 4]; CYCLES],
    /// When each sensor's entry was measured that was sent last.
    sent: [Option<Instant>; 5],
    /// Packets that nobody fetched in time.
    missed: u32,
    next_status: Instant,
    statuses: u16,
    /// Angle of a count of the flow sensor, rad.
    count: f32,
}

impl<A: Copy + PartialEq> DataStream<A> {
    /// Nobody has asked. A count of the flow sensor is this angle, rad.
    #[must_use]
    pub const fn new(count: f32) -> Self {
        Self {
            sink: StreamSink::new(),
            builder: StreamBuilder::new(0),
            ready: [0; LONGEST],
            ready_length: 0,
            outputs: [StreamOutput { thrust: 0.0, torque: Vec3::zeros() }; CYCLES],
            duties: [[0.0; 4]; CYCLES],
            sent: [None; 5],
            missed: 0,
            next_status: Instant::ZERO,
            statuses: 0,
            count,
        }
    }

    /// Takes what a program has asked.
    pub fn hear(&mut self, now: Instant, from: A, bytes: &[u8]) {
        if let Some(request) = StreamRequest::decode(bytes) {
            self.sink.take(now, from, request);
        }
    }

    /// Packets that were not fetched in time. Wraps around.
    #[must_use]
    pub const fn missed(&self) -> u32 {
        self.missed
    }

    /// A control cycle has ended.
    pub fn cycle(&mut self, now: Instant, view: &View<'_>) {
        if self.sink.address(now).is_none() {
            return;
        }
        let (Some((at, imu)), Some((estimated, estimate))) = (view.imu(), view.estimate()) else { return };
        let place = self.builder.cycles();
        let taken = self.builder.cycle(&StreamCycle {
            time: micros(at),
            rate: estimate.angular_rate,
            force: estimate.specific_force,
            raw_rate: imu.gyro,
            raw_force: imu.accel,
            attitude: estimate.attitude,
            rate_bias: estimate.gyro_bias,
            force_bias: estimate.accel_bias,
            position_time: micros(estimated),
            position: estimate.position,
            velocity: estimate.velocity,
            wanted_rate: Vec3::zeros(),
        });
        if taken.is_err() {
            return;
        }
        let [a, b, c, d, ..] = view.motors().map(|(_, motors)| motors.duty).unwrap_or_default();
        let control = view.control().map(|(_, control)| control).unwrap_or_default();
        if let (Some(output), Some(duty)) = (self.outputs.get_mut(place), self.duties.get_mut(place)) {
            *output = StreamOutput { thrust: control.thrust, torque: control.torque };
            *duty = [a, b, c, d];
        }
        self.entries(view);
        if self.builder.cycles() == CYCLES {
            self.close(now, view);
        }
    }

    /// What sensors have said since the last cycle.
    fn entries(&mut self, view: &View<'_>) {
        let count = self.count;
        let entries = [
            view.flow().map(|(at, flow)| {
                // Whole counts, as the chip reports them.
                let counts =
                    [flow.delta_x, flow.delta_y].map(|angle| stampfly_types::math::round(angle / count) as i16);
                (at, StreamEntry::Flow { time: micros(at), counts, surface_quality: flow.quality })
            }),
            view.tof().map(|(at, tof)| {
                (at, StreamEntry::Below { time: micros(at), distance: tof.distance, status: tof.status })
            }),
            view.tof_front().map(|(at, tof)| {
                (at, StreamEntry::InFront { time: micros(at), distance: tof.distance, status: tof.status })
            }),
            view.baro().map(|(at, baro)| {
                // The format has hectopascal.
                let pressure = baro.pressure / 100.0;
                (at, StreamEntry::Barometer { time: micros(at), height: baro.altitude, pressure })
            }),
            view.mag().map(|(at, mag)| (at, StreamEntry::Magnetometer { time: micros(at), field: mag.field })),
        ];
        for (entry, sent) in entries.into_iter().zip(&mut self.sent) {
            if let Some((at, entry)) = entry.filter(|(at, _)| *sent != Some(*at)) {
                *sent = Some(at);
                // What does not fit is counted by the builder.
                _ = self.builder.entry(&entry);
            }
        }
    }

    /// Ends the packet with what it has once.
    fn close(&mut self, now: Instant, view: &View<'_>) {
        let sticks = view.sticks().map(|(_, sticks)| sticks).unwrap_or_default();
        let (time, throttle) = (micros(now), 0.5 + 0.5 * sticks.throttle);
        for entry in [
            StreamEntry::Output(self.outputs),
            StreamEntry::Duty(self.duties),
            StreamEntry::Pilot { time, throttle, roll: sticks.roll, pitch: sticks.pitch, yaw: sticks.yaw },
        ] {
            _ = self.builder.entry(&entry);
        }
        if self.ready_length > 0 {
            self.missed = self.missed.wrapping_add(1);
        }
        self.ready_length = self.builder.finish().map_or(0, |packet| {
            self.ready.iter_mut().zip(packet).for_each(|(to, from)| *to = *from);
            packet.len()
        });
        self.builder.restart();
    }

    /// Sends what is ready to whoever asked for it.
    pub fn poll(&mut self, now: Instant, view: &View<'_>, put: &mut dyn FnMut(&A, &[u8])) {
        let Some(address) = self.sink.address(now) else {
            self.ready_length = 0;
            return;
        };
        let length = core::mem::take(&mut self.ready_length);
        if let Some(packet) = self.ready.get(..length).filter(|packet| !packet.is_empty()) {
            put(&address, packet);
        }
        if now >= self.next_status {
            self.next_status = now + STATUS;
            self.statuses = self.statuses.wrapping_add(1);
            let status = StreamStatus {
                sequence: self.statuses,
                uptime: (now.as_micros() / 1_000) as u32,
                voltage: view.power().map_or(0.0, |(_, power)| power.voltage),
                state: view.state().phase as u8,
                health: health(view),
                estimator: view.estimate().is_some().into(),
                ..Default::default()
            };
            let mut bytes = [0; StreamStatus::LONGEST];
            if let Some(packet) = status.write(&mut bytes).and_then(|length| bytes.get(..length)) {
                put(&address, packet);
            }
        }
    }
}

fn micros(at: Instant) -> u32 {
    at.as_micros() as u32
}

/// Sensors that have ever said anything, in the order of the ecosystem's firmware: inertial, magnetometer, barometer, range, flow, battery.
fn health(view: &View<'_>) -> u8 {
    let there = [
        view.imu().is_some(),
        view.mag().is_some(),
        view.baro().is_some(),
        view.tof().is_some(),
        view.flow().is_some(),
        view.power().is_some(),
    ];
    there.iter().rev().fold(0, |bits, there| bits << 1 | u8::from(*there))
}
