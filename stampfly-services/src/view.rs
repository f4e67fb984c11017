//! The newest sample of what every vehicle publishes, whatever its topic table.
//!
//! Services know topics by name and message, because they serve more than one vehicle. [`Places`] looks the names up once; a
//! [`View`] decodes a sample when it is asked for. Not for runnables: they read the topics that the table gives them.

use stampfly_bus::TopicInfo;
use stampfly_flight::NewestSamples;
use stampfly_types::Instant;
use stampfly_types::messages::*;

/// Where the newest sample of every topic is kept.
pub trait Samples {
    /// The newest sample of the topic at this place of the table.
    fn words(&self, topic: usize) -> Option<(Instant, &[u32])>;
}

impl<const TOPICS: usize, const WORDS: usize> Samples for NewestSamples<TOPICS, WORDS> {
    fn words(&self, topic: usize) -> Option<(Instant, &[u32])> {
        NewestSamples::words(self, topic)
    }
}

macro_rules! views {
    ($($(#[$doc:meta])* $name:ident: $Message:ty = $topic:literal;)+) => {
        /// Where a vehicle's topic table has the topics that services read. A topic that it does not have is never seen.
        ///
        /// ```
        /// mod topics {
        ///     use stampfly_types::messages::TofData;
        ///     stampfly_bus::topics! {
        ///         outside tof, display;
        ///         /// Range to the ground.
        ///         sensor_tof: TofData = latest @ 30 Hz from tof => [display];
        ///     }
        /// }
        /// use stampfly_flight::newest::{NewestSamples, longest_message};
        /// use stampfly_services::{Places, View};
        /// use stampfly_types::{Instant, Message, messages::TofData};
        ///
        /// # fn main() {
        /// let places = Places::of(&topics::TOPICS);
        /// let mut newest = NewestSamples::<{ topics::COUNT }, { longest_message(&topics::TOPICS) }>::new();
        /// let range = TofData { distance: 0.31, valid: true, ..Default::default() };
        /// newest.note(0, Instant::from_millis(1), &range.to_words());
        /// let view = View::new(&newest, &places);
        /// assert_eq!(view.tof(), Some((Instant::from_millis(1), range)));
        /// assert_eq!(view.imu(), None);
        /// # }
        /// ```
        #[derive(Clone, Debug, Default)]
        pub struct Places {
            $($name: Option<usize>,)+
        }

        impl Places {
            /// Looks them up.
            #[must_use]
            pub fn of(topics: &[TopicInfo]) -> Self {
                let place = |name: &str| topics.iter().position(|topic| topic.name == name);
                Self { $($name: place($topic),)+ }
            }
        }

        impl View<'_> {
            $($(#[$doc])*
            #[must_use]
            pub fn $name(&self) -> Option<(Instant, $Message)> {
                let (at, words) = self.samples.words(self.places.$name?)?;
                Some((at, stampfly_flight::newest::message(words)?))
            })+
        }
    };
}

views! {
    /// Inertial sample.
    imu: ImuData = "sensor_imu";
    /// Range to the ground.
    tof: TofData = "sensor_tof";
    /// Range ahead.
    tof_front: TofData = "sensor_tof_front";
    /// Optical flow.
    flow: FlowData = "sensor_flow";
    /// Magnetic field.
    mag: MagData = "sensor_mag";
    /// Air pressure.
    baro: BaroData = "sensor_baro";
    /// Battery.
    power: PowerData = "sensor_power";
    /// The estimate.
    estimate: StateEstimate = "estimate_state";
    /// The still-calibration.
    calibration: CalibrationResult = "calibration";
    /// How far a calibration is that somebody has asked for, and what it has found.
    calibration_report: CalibrationReport = "calibration_report";
    /// Phase, mode, armed, why it would not arm.
    status: FlightStatus = "flight_status";
    /// What the failsafe has found.
    alert: SystemAlert = "system_alert";
    /// Why it did not arm when it was asked to.
    refusals: ArmRefusals = "arm_refusals";
    /// Frames of the pilot.
    pilot: PilotInput = "command_pilot";
    /// The arbitrated sticks.
    sticks: CommandSetpoint = "command_setpoint";
    /// Where it should be.
    setpoint: Setpoint = "setpoint";
    /// Contact with the ground.
    land: LandDetected = "land_detected";
    /// Thrust and torque.
    control: ControlOutput = "control_output";
    /// Duty of every motor.
    motors: MotorOutput = "actuator_motor";
}

/// The newest samples of a vehicle, each with the instant for which it is valid. `None` before the first.
#[derive(Clone, Copy)]
pub struct View<'v> {
    samples: &'v dyn Samples,
    places: &'v Places,
}

impl<'v> View<'v> {
    /// What these samples say.
    #[must_use]
    pub const fn new(samples: &'v dyn Samples, places: &'v Places) -> Self {
        Self { samples, places }
    }

    /// Phase, mode, armed; what a vehicle is before it has said anything.
    #[must_use]
    pub fn state(&self) -> FlightStatus {
        self.status().map(|(_, status)| status).unwrap_or_default()
    }
}
