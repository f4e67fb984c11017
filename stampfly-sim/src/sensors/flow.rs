//! Optical flow sensor PMW3901: it compares pictures at 121 Hz and accumulates counts. The driver
//! reads at 100 Hz, so a read contains the motion of one or two pictures.

use super::schedule::Schedule;
use super::swept::MotionError;
use crate::noise::{Noise, Stream};
use crate::plant::Motion;
use crate::time::Clock;
use crate::world::World;
use core::convert::Infallible;
use stampfly_drivers::{OpticalFlow, Sample};
use stampfly_types::messages::FlowData;
use stampfly_types::{Duration, Instant};

/// Pictures per second.
const FRAME_RATE: f64 = 121.0;
/// Reads per second by the processor's clock.
const READ_RATE: f64 = 100.0;
/// Angle of one count, rad.
const COUNT: f64 = 0.00222;
/// Height below which the picture is out of focus, m (data sheet).
const FOCUS: f64 = 0.08;
/// Height at which the picture contains no motion any more, m: the vehicle stands.
const BLIND: f64 = 0.035;
/// Height above which quality falls, down to zero at [`FAR`], m.
const DIM: f64 = 2.5;
const FAR: f64 = 4.5;
/// Least quality of a sample that the driver marks as valid.
const MINIMUM_QUALITY: u8 = 25;

/// Exposure and counting, shared by the model and the register-level emulator.
#[derive(Debug)]
pub(crate) struct FlowPhysics {
    world: World,
    noise: Noise,
    frames: Schedule,
    /// Number of the next picture.
    frame: u64,
    /// Counts not yet read, including the fraction carried over.
    counts: [f64; 2],
    /// Scale and mounting error of this specimen: rows x and y.
    mounting: [[f64; 2]; 2],
    motion: MotionError,
    /// Delay from the last counted picture to the read, beyond half a picture.
    delay: Duration,
    texture: f64,
}

/// Model of the flow sensor. Implements [`OpticalFlow`].
///
/// `Sample::at` is the instant of the read, because a driver knows no other; the newest picture is
/// on average half a picture older.
#[derive(Debug)]
pub struct FlowModel {
    clock: Clock,
    physics: FlowPhysics,
    reads: Schedule,
    last_read: Instant,
}

impl FlowPhysics {
    /// The physics, and the schedule of the processor's reads.
    pub(crate) fn new(world: &World, start: Instant, seed: u64) -> (Self, Schedule) {
        let mut noise = Noise::stream(seed, Stream::Flow);
        let conditions = world.conditions();
        // Scale common to both axes, with a stream of its own so that the other draws are
        // independent of it.
        let common = 1.0 + Noise::stream(seed, Stream::FlowSpecimen).within(conditions.flow_scale);
        let mut scale = || common * (1.0 + noise.within(conditions.flow_axis_scale));
        let (scale_x, scale_y) = (scale(), scale());
        let (sin, cos) = libm::sincos(noise.within(conditions.flow_mounting));
        let frames = Schedule::new(start, FRAME_RATE, 0.02, &mut noise);
        let reads = Schedule::new(start, READ_RATE, 0.0, &mut noise);
        let physics = Self {
            frames,
            frame: 0,
            counts: [0.0; 2],
            mounting: [[scale_x * cos, scale_x * sin], [-scale_y * sin, scale_y * cos]],
            motion: MotionError::new(&conditions, seed),
            delay: Duration::from_micros((1e6 * conditions.flow_delay) as u64),
            texture: 140.0 + noise.within(40.0),
            noise,
            world: world.clone(),
        };
        (physics, reads)
    }

    /// Exposes the pictures up to `at` and returns the whole counts since the last call, in the
    /// convention of [`FlowData`].
    pub(crate) fn read(&mut self, at: Instant) -> [f64; 2] {
        while self.frames.instant(self.frame) + self.delay <= at {
            self.expose(self.frame);
            self.frame += 1;
        }
        // The chip has 16-bit registers; the fraction stays for the next read.
        let whole = self.counts.map(|counts| counts.round().clamp(-32768.0, 32767.0));
        for (counts, whole) in self.counts.iter_mut().zip(whole) {
            *counts -= whole;
        }
        whole
    }

    /// Adds the motion between the previous picture and picture `number`.
    fn expose(&mut self, number: u64) {
        let end = self.frames.instant(number);
        let period = self.frames.period();
        let begin = end - Duration::from_micros(period as u64);
        let middle = begin + end.since(begin) / 2;
        // Begin, middle and end of the interval between the pictures.
        let motions = [begin, middle, end].map(|instant| over_floor(&self.world, instant));
        let rates = motions.map(|motion| angular_flow(&motion));
        let height = slant_height(&motions[1]);
        // Linear loss of contrast below the focus distance.
        let sharp = ((height - BLIND) / (FOCUS - BLIND)).clamp(0.0, 1.0);
        let deviation = 0.25 + 0.15 * height.min(FAR);
        // Simpson's rule over the time between the pictures.
        let swept: [f64; 2] =
            core::array::from_fn(|axis| (rates[0][axis] + 4.0 * rates[1][axis] + rates[2][axis]) / 6.0 * period * 1e-6);
        let swept = self.motion.of(swept, period * 1e-6);
        // Beyond the range there are no counts at all, not even noise.
        let seen = f64::from(u8::from(height < FAR));
        for (row, counts) in self.mounting.iter().zip(&mut self.counts) {
            let angle = row[0] * swept[0] + row[1] * swept[1];
            *counts += seen * (sharp * angle / COUNT + deviation * self.noise.normal());
        }
    }

    /// Number of features in the picture: the chip's SQUAL.
    pub(crate) fn quality(&mut self, instant: Instant) -> u8 {
        let height = slant_height(&over_floor(&self.world, instant));
        let near = 0.5 + 0.5 * ((height - BLIND) / (FOCUS - BLIND)).clamp(0.0, 1.0);
        let far = 1.0 - ((height - DIM) / (FAR - DIM)).clamp(0.0, 1.0);
        (self.texture * near * far * (1.0 + 0.04 * self.noise.normal())) as u8
    }
}

impl FlowModel {
    pub(crate) fn new(world: &World, clock: &Clock, seed: u64) -> Self {
        let (physics, reads) = FlowPhysics::new(world, clock.now(), seed);
        Self { physics, reads, last_read: clock.now(), clock: clock.clone() }
    }
}

/// Motion relative to the floor below.
fn over_floor(world: &World, instant: Instant) -> Motion {
    let mut motion = world.motion_at(instant);
    world.inspect(|plant| {
        let [north, east] = plant.scene().floor_velocity;
        motion.position.z -= plant.scene().floor(&motion.position);
        motion.velocity -= nalgebra::Vector3::new(north, east, 0.0);
    });
    motion
}

/// Distance to the floor along the optical axis, m; 1000 m if the axis points near or above the
/// horizon.
fn slant_height(motion: &Motion) -> f64 {
    let down = (motion.attitude * nalgebra::Vector3::z()).z;
    if down > 0.1 { (-motion.position.z / down).max(0.001) } else { 1e3 }
}

/// Angular rate of the picture about body x and y, rad/s, in the convention of [`FlowData`].
fn angular_flow(motion: &Motion) -> [f64; 2] {
    let velocity = motion.attitude.inverse_transform_vector(&motion.velocity);
    let height = slant_height(motion);
    [velocity.x / height + motion.rate.y, velocity.y / height - motion.rate.x]
}

impl OpticalFlow for FlowModel {
    type Error = Infallible;

    async fn next(&mut self) -> Result<Sample<FlowData>, Infallible> {
        let number = self.reads.upcoming(self.clock.now(), 0.0);
        let at = self.reads.instant(number);
        self.clock.sleep_until(at).await;
        self.reads.reported(number);
        let whole = self.physics.read(at);
        let interval = at.since(self.last_read).seconds();
        self.last_read = at;
        let quality = self.physics.quality(at);
        let [delta_x, delta_y] = whole.map(|counts| (counts * COUNT) as f32);
        Ok(Sample { at, data: FlowData { delta_x, delta_y, interval, quality, valid: quality >= MINIMUM_QUALITY } })
    }
}
