//! Broadcast telemetry: the [broadcast packet](BroadcastPacket) for whoever listens, fifty times a second.
//!
//! For displays. It says nothing of what was lost on the way; [`DataStream`](crate::DataStream) is for finding out how a vehicle flew.

use crate::view::View;
use stampfly_link::{BroadcastPacket, BroadcastSensors};
use stampfly_types::messages::FlowData;
use stampfly_types::{Duration, Instant, frame};

/// Of the ecosystem's vehicle.
const PERIOD: Duration = Duration::from_millis(20);

/// Makes the packets.
///
/// ```
/// use stampfly_link::BroadcastPacket;
/// use stampfly_services::{Places, Telemetry, View};
/// use stampfly_types::Instant;
/// # struct Nothing;
/// # impl stampfly_services::Samples for Nothing {
/// #     fn words(&self, _: usize) -> Option<(Instant, &[u32])> { None }
/// # }
/// let places = Places::default();
/// let view = View::new(&Nothing, &places);
/// let (mut telemetry, mut sent) = (Telemetry::new(0.0022), Vec::new());
/// for ms in 0..100 {
///     telemetry.poll(Instant::from_millis(ms), &view, &mut |bytes| sent.push(bytes.to_vec()));
/// }
/// assert_eq!(sent.len(), 5);
/// assert_eq!(sent[1].len(), BroadcastPacket::LONGEST);
/// ```
#[derive(Clone, Debug)]
pub struct Telemetry {
    next: Instant,
    /// Angle of a count of the flow sensor, rad.
    count: f32,
    /// Counts so far, with what is less than one.
    flow: [f32; 2],
    counted: [u16; 2],
}

impl Telemetry {
    /// For a flow sensor of which a count is this angle, rad.
    #[must_use]
    pub const fn new(count: f32) -> Self {
        Self { next: Instant::ZERO, count, flow: [0.0; 2], counted: [0; 2] }
    }

    /// The flow sensor has measured. Call it with every sample: the packet counts them up.
    pub fn flow(&mut self, flow: &FlowData) {
        let deltas = [flow.delta_x, flow.delta_y];
        for ((rest, counted), delta) in self.flow.iter_mut().zip(&mut self.counted).zip(deltas) {
            let counts = *rest + delta / self.count;
            if counts.abs() < 32_768.0 {
                let whole = counts as i32;
                *rest = counts - whole as f32;
                *counted = counted.wrapping_add(whole as u16);
            }
        }
    }

    /// Sends what is due: one packet in 20 ms.
    pub fn poll(&mut self, now: Instant, view: &View<'_>, put: &mut dyn FnMut(&[u8])) {
        if now < self.next {
            return;
        }
        let planned = self.next + PERIOD;
        self.next = if planned > now { planned } else { now + PERIOD };
        let mut bytes = [0; BroadcastPacket::LONGEST];
        if let Some(packet) = self.packet(now, view).write(&mut bytes).and_then(|length| bytes.get(..length)) {
            put(packet);
        }
    }

    fn packet(&self, now: Instant, view: &View<'_>) -> BroadcastPacket {
        let imu = view.imu().map(|(_, imu)| imu).unwrap_or_default();
        let estimate = view.estimate().map(|(_, estimate)| estimate).unwrap_or_default();
        let control = view.control().map(|(_, control)| control).unwrap_or_default();
        let [a, b, c, d, ..] = view.motors().map(|(_, motors)| motors.duty).unwrap_or_default();
        BroadcastPacket {
            time: now.as_micros() as u32,
            attitude: frame::roll_pitch_yaw(&estimate.attitude).into(),
            rate: imu.gyro,
            force: imu.accel,
            position: estimate.position,
            velocity: estimate.velocity,
            thrust: control.thrust,
            torque: control.torque,
            duty: [a, b, c, d],
            state: view.state().phase as u8,
            sensors: Some(self.sensors(view)),
        }
    }

    fn sensors(&self, view: &View<'_>) -> BroadcastSensors {
        let (tof, front) = (view.tof(), view.tof_front());
        let (mag, baro, power, flow) = (view.mag(), view.baro(), view.power(), view.flow());
        let flags = [
            (BroadcastSensors::BELOW, tof.is_some_and(|(_, tof)| tof.valid)),
            (BroadcastSensors::IN_FRONT, front.is_some_and(|(_, tof)| tof.valid)),
            (BroadcastSensors::FLOW, flow.is_some_and(|(_, flow)| flow.valid)),
            (BroadcastSensors::FIELD, mag.is_some()),
            (BroadcastSensors::HEIGHT, baro.is_some()),
            (BroadcastSensors::VOLTAGE, power.is_some()),
        ];
        BroadcastSensors {
            voltage: power.map_or(0.0, |(_, power)| power.voltage),
            below: tof.map_or(0.0, |(_, tof)| tof.distance),
            in_front: front.map_or(-1.0, |(_, tof)| tof.distance),
            flow: self.counted,
            surface_quality: flow.map_or(0, |(_, flow)| flow.quality),
            valid: flags.iter().filter(|(_, valid)| *valid).fold(0, |flags, (flag, _)| flags | flag),
            field: mag.map(|(_, mag)| mag.field).unwrap_or_default(),
            height: baro.map_or(0.0, |(_, baro)| baro.altitude),
        }
    }
}
