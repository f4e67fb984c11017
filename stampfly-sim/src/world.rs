//! The physical world shared by all sensors of one vehicle.
//!
//! A [`World`] is a handle; clones refer to the same vehicle. Physics runs lazily, in fixed steps,
//! up to the latest instant requested. The last 80 ms of motion are kept, so a sensor can report
//! the middle of its exposure after another sensor has already been read at a later instant. Worlds
//! are independent of each other.

use crate::conditions::Conditions;
use crate::plant::{Body, DT, Motion, Plant, ROTORS, RotorFault, STEP, Scene};
use crate::specimen::Specimen;
use core::any::Any;
use core::cell::RefCell;
use nalgebra::Vector3;
use stampfly_types::{Duration, Instant, Quat, Vec3, message};
use std::rc::Rc;

message! {
    /// True state of the vehicle: the reference for every estimate.
    pub struct Truth {
        /// Body FRD → world NED.
        attitude: Quat,
        /// World NED, ground at zero.
        position: Vec3 ["m"],
        /// World NED.
        velocity: Vec3 ["m/s"],
        /// Body FRD.
        angular_rate: Vec3 ["rad/s"],
        /// Specific force without any sensor's error, body FRD.
        specific_force: Vec3 ["m/s^2"],
        /// Velocity of the air at the vehicle, world NED.
        wind: Vec3 ["m/s"],
        /// Rotor speeds: front right, rear right, rear left, front left. An aeroplane has its
        /// propeller first and zeros after it.
        rotor_speed: [f32; 4] ["rad/s"],
        /// Battery voltage under load.
        battery_voltage: f32 ["V"],
        /// Battery current.
        battery_current: f32 ["A"],
        /// True while any part touches the ground.
        contact: bool,
    }
}

/// Number of past steps kept: 80 ms, longer than exposure and read-out of any sensor.
const HISTORY: usize = 128;

/// The Earth's field in Kanazawa, world NED, µT (World Magnetic Model, rounded): 49° of dip, 8°
/// west.
const KANAZAWA: [f64; 3] = [30.8, -4.3, 36.4];

#[derive(Debug)]
struct State {
    body: Box<dyn Body>,
    gravity: f64,
    field: Vector3<f64>,
    start: Instant,
    /// Steps since the start.
    steps: u64,
    /// Motion after step k at index k modulo the length. The motion after the last step is read
    /// from the body instead and is copied here when the next step begins.
    history: Box<[Motion; HISTORY]>,
    /// Strength of the sensors' imperfections.
    imperfections: f64,
    conditions: Conditions,
    specimen: Specimen,
    /// Heating: from and to, K; begin; duration.
    warmth: (f64, f64, Instant, Duration),
}

impl State {
    fn advance_to(&mut self, instant: Instant) {
        let wanted = instant.since(self.start).as_micros() / STEP.as_micros();
        while self.steps < wanted {
            // The motion is copied one step late: by now it has settled in memory, so the copy does
            // not wait for the physics that computed it.
            self.history[self.steps as usize % HISTORY] = *self.body.motion();
            self.body.step();
            self.steps += 1;
        }
    }

    /// The motion after the last step at or before `instant`, and the time since that step, s.
    fn before(&mut self, instant: Instant) -> (&Motion, f64) {
        self.advance_to(instant);
        let since_start = instant.since(self.start).as_micros();
        // Older steps have been overwritten: the oldest one kept stands in for them.
        let oldest = self.steps.saturating_sub(HISTORY as u64 - 1);
        let step = (since_start / STEP.as_micros()).max(oldest);
        let rest = since_start.saturating_sub(step * STEP.as_micros()) as f64 * 1e-6;
        // The newest motion is not in the history yet.
        let motion = if step == self.steps { self.body.motion() } else { &self.history[step as usize % HISTORY] };
        // `rest` exceeds a step only for an instant older than the history; the extrapolation is
        // valid for one step.
        (motion, rest.min(DT))
    }

    #[inline]
    fn motion_at(&mut self, instant: Instant) -> Motion {
        let gravity = self.gravity;
        let (motion, rest) = self.before(instant);
        motion.after(rest, gravity)
    }
}

/// Input of an inertial sensor, in the units and frames of [`Motion`].
pub(crate) struct Inertial {
    pub specific_force: Vector3<f64>,
    pub rate: Vector3<f64>,
    pub angular_acceleration: Vector3<f64>,
    pub rotor_speed: [f64; ROTORS],
}

/// A shared handle to one vehicle in its surroundings.
///
/// ```
/// use stampfly_sim::plant::{Plant, PlantParameters, Pose, WindConfig};
/// use stampfly_sim::World;
/// use stampfly_types::Instant;
///
/// let pose = Pose { rotors: 0.0, ..Pose::hovering(2.0) };
/// let plant = Plant::new(&PlantParameters::EXAMPLE, &WindConfig::CALM, Some(&pose), 1);
/// let world = World::new(plant, Instant::ZERO);
/// let later = world.truth_at(Instant::from_millis(100)).velocity.z;
/// let earlier = world.truth_at(Instant::from_millis(50)).velocity.z;
/// assert!((later - 0.98).abs() < 0.01 && (earlier - 0.49).abs() < 0.01, "the recent past is kept");
/// ```
#[derive(Clone, Debug)]
pub struct World(Rc<RefCell<State>>);

impl World {
    /// A world whose time begins at `start`.
    #[must_use]
    pub fn new(body: impl Body, start: Instant) -> Self {
        let history = Box::new([*body.motion(); HISTORY]);
        Self(Rc::new(RefCell::new(State {
            gravity: body.gravity(),
            field: KANAZAWA.into(),
            body: Box::new(body),
            start,
            steps: 0,
            history,
            imperfections: 0.0,
            conditions: Conditions::GENTLE,
            specimen: Specimen::default(),
            warmth: (0.0, 0.0, start, Duration::ZERO),
        })))
    }

    /// Sets the strength of sensor imperfections, see
    /// [`SimulationConfig::imperfections`](crate::SimulationConfig::imperfections).
    #[must_use]
    pub fn with_imperfections(self, strength: f64) -> Self {
        self.0.borrow_mut().imperfections = strength;
        self
    }

    /// Sets the conditions that act on sensors. Conditions that act on the body are given when it
    /// is [made](crate::plant::Airframe::body_under).
    #[must_use]
    pub fn with_conditions(self, conditions: Conditions) -> Self {
        self.0.borrow_mut().conditions = conditions;
        self
    }

    pub(crate) fn conditions(&self) -> Conditions {
        self.0.borrow().conditions.clone()
    }

    /// Replaces the magnetic field of Kanazawa, world NED, µT.
    #[must_use]
    pub fn with_field(self, field: [f64; 3]) -> Self {
        self.0.borrow_mut().field = field.into();
        self
    }

    pub(crate) fn field(&self) -> Vector3<f64> {
        self.0.borrow().field
    }

    pub(crate) fn imperfections(&self) -> f64 {
        self.0.borrow().imperfections
    }

    /// True errors of the sensors.
    #[must_use]
    pub fn specimen(&self) -> Specimen {
        self.0.borrow().specimen
    }

    pub(crate) fn note_specimen(&self, note: impl FnOnce(&mut Specimen)) {
        note(&mut self.0.borrow_mut().specimen);
    }

    /// Ramps the vehicle's temperature to `by` kelvins above its undisturbed temperature, linearly
    /// during `within` from `instant` on. A smaller value than the present one cools it.
    pub fn warm(&self, instant: Instant, by: f64, within: Duration) {
        let now = self.warmth_at(instant);
        self.0.borrow_mut().warmth = (now, by, instant, within);
    }

    /// Temperature above the undisturbed one, K.
    #[must_use]
    pub fn warmth_at(&self, instant: Instant) -> f64 {
        let (from, to, begun, length) = self.0.borrow().warmth;
        // The lower bound avoids a division by zero for a step change.
        let share = instant.since(begun).seconds_f64() / length.seconds_f64().max(1e-6);
        from + (to - from) * share.clamp(0.0, 1.0)
    }

    /// Runs the physics up to `instant`. An earlier instant has no effect.
    pub fn advance_to(&self, instant: Instant) {
        self.0.borrow_mut().advance_to(instant);
    }

    /// The motion at `instant`: in the future, to which the physics then advances, or up to 80 ms
    /// in the past.
    ///
    /// Between two physics steps the motion is extrapolated from the earlier step, so that a motor
    /// command of the same instant still acts on the next step.
    #[must_use]
    pub fn motion_at(&self, instant: Instant) -> Motion {
        self.0.borrow_mut().motion_at(instant)
    }

    /// Applies duty cycles, 0 to 1, from `instant` on.
    pub fn set_duty(&self, instant: Instant, duty: [f64; ROTORS]) {
        let mut state = self.0.borrow_mut();
        state.advance_to(instant);
        // The steps before the command have been computed with the old duty by now.
        state.body.set_duty(duty);
    }

    /// Sets the fault of a rotor from `instant` on; motors count from 0 in motor order.
    pub fn set_rotor_fault(&self, instant: Instant, rotor: usize, fault: RotorFault) {
        let mut state = self.0.borrow_mut();
        state.advance_to(instant);
        state.body.set_rotor_fault(rotor, fault);
    }

    /// Changes the scene around a multirotor from `instant` on. `change` receives the motion at
    /// that instant. Bodies of other kinds have no scene: nothing happens.
    pub fn change_scene(&self, instant: Instant, change: impl FnOnce(&mut Scene, &Motion)) {
        let motion = self.motion_at(instant);
        self.change(instant, |plant: &mut Plant| change(plant.scene_mut(), &motion));
    }

    /// Changes a body of type `B` from `instant` on. Returns `None` if the body has another type.
    pub fn change<B: Body, T>(&self, instant: Instant, change: impl FnOnce(&mut B) -> T) -> Option<T> {
        let mut state = self.0.borrow_mut();
        state.advance_to(instant);
        let body: &mut dyn Any = &mut *state.body;
        body.downcast_mut().map(change)
    }

    /// Height above the ground below the vehicle at `instant`, m.
    #[must_use]
    pub fn height_at(&self, instant: Instant) -> f64 {
        let mut state = self.0.borrow_mut();
        let gravity = state.gravity;
        let (motion, rest) = state.before(instant);
        let position = motion.position_after(rest, gravity);
        state.body.scene().floor(&position) - position.z
    }

    /// Acceleration, rate and rotor speeds at `instant`: [`motion_at`](Self::motion_at) restricted
    /// to what an inertial sensor needs.
    pub(crate) fn inertial_at(&self, instant: Instant) -> Inertial {
        let mut state = self.0.borrow_mut();
        let (motion, rest) = state.before(instant);
        Inertial {
            specific_force: motion.specific_force,
            rate: motion.rate_after(rest),
            angular_acceleration: motion.angular_acceleration,
            rotor_speed: motion.rotor_speed,
        }
    }

    /// Reads the body in its state after the last step.
    pub fn inspect<T>(&self, look: impl FnOnce(&dyn Body) -> T) -> T {
        look(&*self.0.borrow().body)
    }

    /// Reads a body of type `B` in its state after the last step. Returns `None` if the body has
    /// another type.
    pub fn inspect_as<B: Body, T>(&self, look: impl FnOnce(&B) -> T) -> Option<T> {
        let state = self.0.borrow();
        let body: &dyn Any = &*state.body;
        body.downcast_ref().map(look)
    }

    /// The true state at `instant`.
    #[must_use]
    pub fn truth_at(&self, instant: Instant) -> Truth {
        let motion = self.motion_at(instant);
        let state = self.0.borrow();
        Truth {
            attitude: motion.attitude.cast::<f32>().into(),
            position: motion.position.cast::<f32>().into(),
            velocity: motion.velocity.cast::<f32>().into(),
            angular_rate: motion.rate.cast::<f32>().into(),
            specific_force: motion.specific_force.cast::<f32>().into(),
            wind: state.body.air(-motion.position.z).cast::<f32>().into(),
            rotor_speed: motion.rotor_speed.map(|speed| speed as f32),
            battery_voltage: state.body.battery().voltage() as f32,
            battery_current: motion.current as f32,
            contact: state.body.contact(),
        }
    }
}
