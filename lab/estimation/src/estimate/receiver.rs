//! How far from a recording's satellite receiver estimates are.
//!
//! The receiver is no reference: the filter uses it. Its difference to the estimate says whether the estimate follows it as
//! closely as another filter does that had the same samples. So each figure is there for the estimate and for the recording
//! device's own filter, at the same instants. Heading is compared with the magnetometer in the same way.
//!
//! The device's states are taken to be as late as the receiver: EKF2 writes those of its fusion horizon. An estimate is the
//! one that a vehicle had at that time, before the fix came.

use super::Receiver;
use super::accuracy::{Accuracy, Rms};
use super::drive::{Drive, Instance};
use super::start::Start;
use crate::dataset::{DevicePoint, Recording};
use serde::Serialize;
use stampfly_drivers::Sample;
use stampfly_types::messages::Validity;
use stampfly_types::{Duration, Instant, Quat, Vec3, math};

/// After the start so much is left out: filters look for their heading and their first fix. EKF2 takes eight seconds.
const SETTLED: Duration = Duration::from_secs(10);
/// An estimate, or a state of the device, older than this is not compared: EKF2 writes ten a second.
const STALE: Duration = Duration::from_millis(150);

/// Root mean square differences, at least ten seconds after the start.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct AgainstReceiver {
    /// Fixes that were compared.
    pub fixes: usize,
    /// Position of the estimate less the receiver's.
    pub position_m: Option<f64>,
    /// Velocity of the estimate less the receiver's.
    pub velocity_mps: Option<f64>,
    /// Heading of the estimate less the magnetometer's, with the estimate's own tilt.
    pub heading_deg: Option<f64>,
    /// The same three of the device's own filter. EKF2's logs since 2025 hold no position.
    pub device_position_m: Option<f64>,
    /// Velocity of the device less the receiver's.
    pub device_velocity_mps: Option<f64>,
    /// Heading of the device less the magnetometer's.
    pub device_heading_deg: Option<f64>,
    /// Velocity of the estimate less the device's.
    pub velocity_to_device_mps: Option<f64>,
    /// Heading of the estimate less the device's.
    pub heading_to_device_deg: Option<f64>,
    /// Tilt of the estimate against the device's.
    pub tilt_to_device_deg: Option<f64>,
    /// Share of the fixes at which the estimate called its position not valid.
    pub invalid: f64,
}

impl AgainstReceiver {
    /// The figures of one way through a recording; `None` without a receiver.
    pub(super) fn of(recording: &Recording, start: &Start, drive: &Drive, receiver: &Receiver) -> Option<Self> {
        let own = recording.device.as_deref().unwrap_or_default();
        let (begin, late) = (start.at + SETTLED, receiver.delay);
        // The estimate of that time, and the state that the device wrote down `late` after it.
        let ours = |at: Instant| newest(&drive.instances, at, |instance| instance.at);
        let theirs = |at: Instant| newest(own, at + late, |point| point.at);

        let mut figures = Self::default();
        let [mut place, mut speed, mut own_place, mut own_speed, mut apart] = [Rms::default(); 5];
        let mut attitude = Accuracy::default();
        for Sample { at, data: fix } in &recording.gnss {
            let at = *at - late;
            let Some(Instance { state, .. }) = ours(at).filter(|_| at >= begin) else { continue };
            figures.fixes += 1;
            figures.invalid += f64::from(u8::from(!state.valid.contains(Validity::POSITION_XY | Validity::POSITION_Z)));
            place.add_vector(&(state.position - fix.position));
            speed.add_vector(&(state.velocity - fix.velocity));
            if let Some(DevicePoint { attitude: turned, position, velocity, .. }) = theirs(at) {
                if let Some(position) = position {
                    own_place.add_vector(&(position - fix.position));
                }
                own_speed.add_vector(&(velocity - fix.velocity));
                apart.add_vector(&(state.velocity - velocity));
                attitude.attitude(&state.attitude, turned);
            }
        }
        figures.invalid /= figures.fixes.max(1) as f64;
        let [mut north, mut own_north] = [Rms::default(); 2];
        for Sample { at, data: mag } in recording.mag.iter().filter(|sample| sample.at >= begin) {
            let Some(Instance { state, .. }) = ours(*at) else { continue };
            north.add_angle(north_of(&state.attitude, &mag.field));
            if let Some(point) = theirs(*at) {
                own_north.add_angle(north_of(&point.attitude, &mag.field));
            }
        }
        let figures = Self {
            position_m: place.get(),
            velocity_mps: speed.get(),
            heading_deg: north.get(),
            device_position_m: own_place.get(),
            device_velocity_mps: own_speed.get(),
            device_heading_deg: own_north.get(),
            velocity_to_device_mps: apart.get(),
            heading_to_device_deg: attitude.heading(),
            tilt_to_device_deg: attitude.tilt(),
            ..figures
        };
        (!recording.gnss.is_empty()).then_some(figures)
    }
}

impl Rms {
    fn add_vector(&mut self, difference: &Vec3) {
        self.add(f64::from(difference.norm_squared()));
    }

    /// An angle in radians; the mean is in degrees.
    fn add_angle(&mut self, angle: f32) {
        let degrees = f64::from(angle).to_degrees();
        self.add(degrees * degrees);
    }
}

/// How far from north a field points in the world of this attitude, rad.
fn north_of(attitude: &Quat, field: &Vec3) -> f32 {
    let field = attitude * *field;
    math::atan2(field.y, field.x)
}

/// The newest of these up to `at`, if it is not stale.
fn newest<T>(list: &[T], at: Instant, stamp: impl Fn(&T) -> Instant) -> Option<&T> {
    let index = list.partition_point(|item| stamp(item) <= at).checked_sub(1)?;
    list.get(index).filter(|item| at.since(stamp(item)) < STALE)
}
