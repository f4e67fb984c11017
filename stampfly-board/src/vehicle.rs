//! The assembly: every end of every topic handed to whoever owns it, once.

use crate::config::VehicleConfig;
use crate::flight_loop::FlightLoop;
use crate::plan;
use crate::runnables::*;
use crate::wiring;
use stampfly_bus::AnyTopic;
use stampfly_types::Instant;

/// The ends that belong to the world outside the runnables: drivers, links, motors, lights.
pub struct Outside<'b> {
    /// From the inertial sensor.
    pub imu: wiring::sensor_imu::Tx<'b>,
    /// From the range finder.
    pub tof: wiring::sensor_tof::Tx<'b>,
    /// From the front range finder.
    pub tof_front: wiring::sensor_tof_front::Tx<'b>,
    /// From the flow sensor.
    pub flow: wiring::sensor_flow::Tx<'b>,
    /// From the magnetometer.
    pub mag: wiring::sensor_mag::Tx<'b>,
    /// From the barometer.
    pub baro: wiring::sensor_baro::Tx<'b>,
    /// From a motion capture system.
    pub cameras: wiring::external_pose::Tx<'b>,
    /// From the self test at power-on.
    pub self_test: wiring::self_test::Tx<'b>,
    /// From the battery monitor.
    pub power: wiring::sensor_power::Tx<'b>,
    /// From the pilot's radio.
    pub pilot: wiring::command_pilot::Tx<'b>,
    /// From programs.
    pub guided: wiring::command_guided::Tx<'b>,
    /// From the button's pin.
    pub button: wiring::button_contact::Tx<'b>,
    /// To the motors.
    pub motors: wiring::actuator_motor::Rx<'b>,
    /// To the lights and the buzzer.
    pub indicator: wiring::signal::Rx<'b>,
    /// To the ground station.
    pub telemetry: wiring::telemetry::Rx<'b>,
}

impl Outside<'_> {
    /// Publishes a recorded sample on the end it came from, by its topic's place in the table. Returns its generation,
    /// or `None` when the topic's publisher is not outside or the words are not the topic's.
    pub fn publish_words(&mut self, topic: usize, at: Instant, words: &[u32]) -> Option<u32> {
        macro_rules! by_topic {
            ($($topic:ident => $end:ident),+ $(,)?) => {
                $(if topic == wiring::Id::$topic as usize { return self.$end.publish_words(at, words) })+
            };
        }
        by_topic! {
            sensor_imu => imu,
            sensor_tof => tof,
            sensor_tof_front => tof_front,
            sensor_flow => flow,
            sensor_mag => mag,
            sensor_baro => baro,
            external_pose => cameras,
            self_test => self_test,
            sensor_power => power,
            command_pilot => pilot,
            command_guided => guided,
            button_contact => button,
        }
        None
    }
}

/// A vehicle at power-on: what drives it, and what the world outside has in hand.
///
/// The first is large. Whoever has little stack borrows it from here instead of moving it.
pub struct Assembled<'b> {
    /// Every runnable, with the scheduler.
    pub flight_loop: FlightLoop<'b>,
    /// The other ends.
    pub outside: Outside<'b>,
}

/// Builds the vehicle from the ends of a fresh bus. Its scheduler counts from `start`.
#[must_use]
pub fn assemble<'b>(
    ports: wiring::Ports<'b>,
    heads: [&'b dyn AnyTopic; wiring::COUNT],
    config: &VehicleConfig,
    start: Instant,
) -> Assembled<'b> {
    // Taken apart without `..`: an end that nobody gets is an unused variable.
    let wiring::Ports {
        sensor_imu,
        sensor_tof,
        sensor_tof_front,
        sensor_flow,
        sensor_mag,
        sensor_baro,
        external_pose,
        self_test,
        sensor_power,
        command_pilot,
        command_guided,
        button_contact,
        button_event,
        command_setpoint,
        calibration,
        estimate_state,
        estimate_status,
        estimator_command,
        system_alert,
        system_mode,
        vehicle_status,
        setpoint,
        control_output,
        actuator_motor,
        signal,
        telemetry,
    } = ports;
    let vehicle = plan::Vehicle {
        estimation: Estimation::new(
            EstimationPorts {
                imu: sensor_imu.estimation,
                tof: sensor_tof.estimation,
                flow: sensor_flow.estimation,
                mag: sensor_mag.estimation,
                baro: sensor_baro.estimation,
                pose: external_pose.estimation,
                calibration: calibration.estimation,
                command: estimator_command.estimation,
                state: estimate_state.tx,
                status: estimate_status.tx,
            },
            config,
        ),
        failsafe: FailsafeMonitor::new(FailsafePorts {
            imu: sensor_imu.failsafe,
            tof: sensor_tof.failsafe,
            flow: sensor_flow.failsafe,
            power: sensor_power.failsafe,
            pilot: command_pilot.failsafe,
            guided: command_guided.failsafe,
            estimate: estimate_state.failsafe,
            status: estimate_status.failsafe,
            self_test: self_test.failsafe,
            mode: system_mode.failsafe,
            alert: system_alert.tx,
        }),
        landing: LandingManager::new(LandingPorts {
            estimate: estimate_state.landing,
            mode: system_mode.landing,
            setpoint: setpoint.landing,
            demand: control_output.landing,
            status: vehicle_status.tx,
        }),
        mode: ModeManager::new(ModePorts {
            alert: system_alert.mode,
            estimate: estimate_state.mode,
            calibration: calibration.mode,
            status: vehicle_status.mode,
            pilot: command_pilot.mode,
            guided: command_guided.mode,
            button: button_event.mode,
            mode: system_mode.tx,
            estimator: estimator_command.tx,
        }),
        navigation: Navigation::new(NavigationPorts {
            guided: command_guided.navigation,
            mode: system_mode.navigation,
            estimate: estimate_state.navigation,
            status: vehicle_status.navigation,
            command: command_setpoint.navigation,
            setpoint: setpoint.tx,
        }),
        control: Control::new(
            ControlPorts {
                estimate: estimate_state.control,
                command: command_setpoint.control,
                setpoint: setpoint.control,
                mode: system_mode.control,
                status: vehicle_status.control,
                motors: actuator_motor.control,
                output: control_output.tx,
            },
            config,
        ),
        actuation: Actuation::new(
            ActuationPorts {
                control: control_output.actuation,
                mode: system_mode.actuation,
                power: sensor_power.actuation,
                motor: actuator_motor.tx,
            },
            config,
        ),
        calibration: Calibration::new(CalibrationPorts {
            imu: sensor_imu.calibration,
            mag: sensor_mag.calibration,
            baro: sensor_baro.calibration,
            result: calibration.tx,
        }),
        command: Command::new(CommandPorts {
            pilot: command_pilot.command,
            guided: command_guided.command,
            setpoint: command_setpoint.tx,
        }),
        button: ButtonReader::new(ButtonPorts { contact: button_contact.button, event: button_event.tx }),
        notification: Notification::new(NotificationPorts {
            mode: system_mode.notification,
            alert: system_alert.notification,
            signal: signal.tx,
        }),
        telemetry: Telemetry::new(TelemetryPorts {
            mode: system_mode.telemetry,
            alert: system_alert.telemetry,
            estimate: estimate_state.telemetry,
            setpoint: setpoint.telemetry,
            power: sensor_power.telemetry,
            frame: telemetry.tx,
        }),
    };
    let outside = Outside {
        imu: sensor_imu.tx,
        tof: sensor_tof.tx,
        tof_front: sensor_tof_front.tx,
        flow: sensor_flow.tx,
        mag: sensor_mag.tx,
        baro: sensor_baro.tx,
        cameras: external_pose.tx,
        self_test: self_test.tx,
        power: sensor_power.tx,
        pilot: command_pilot.tx,
        guided: command_guided.tx,
        button: button_contact.tx,
        motors: actuator_motor.motors,
        indicator: signal.indicator,
        telemetry: telemetry.link,
    };
    Assembled { flight_loop: FlightLoop::new(vehicle, heads, start), outside }
}
