//! Tunes the rate loops of a vehicle that is not the one its gains were made for, and prints margins before and after.
//!
//! `cargo run -p stampfly-control --example autotune [INERTIA]`: how many times the airframe's moments of inertia the vehicle has,
//! 1.6 if nothing is said. A battery under it, a camera on it: nobody has measured that.

use stampfly_control::autotune::{Autotune, AutotuneAxis, AutotuneInput, AutotuneStage, Margins};
use stampfly_control::{Airframe, CascadeConfig, Pid, pid::Integration, rate::RateConfig};
use stampfly_types::messages::{
    Alerts, CommandSetpoint, FlightMode, FlightPhase, FlightStatus, GroundContact, LandDetected, StateEstimate,
    Validity,
};
use stampfly_types::{Duration, Instant, Quat, Vec3};

const AIRFRAME: Airframe = Airframe::EXAMPLE;
const PERIOD: Duration = Duration::from_micros(2_500);

/// One axis of a vehicle that hovers: its motors lag, and the gyro is two control periods late and noisy.
struct Vehicle {
    inertia: f32,
    rotors: f32,
    rate: [f32; 3],
    angle: f32,
    random: u32,
}

impl Vehicle {
    fn step(&mut self, torque: f32) {
        let dt = PERIOD.seconds();
        self.rotors += (torque - self.rotors) * dt / (AIRFRAME.motor_lag + dt);
        let [_, last, rate] = self.rate;
        self.rate = [last, rate, rate + self.rotors / self.inertia * dt];
        self.angle += rate * dt;
    }

    fn gyro(&mut self) -> f32 {
        self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        self.rate[0] + 0.1 * ((self.random >> 8) as f32 / (1 << 23) as f32 - 1.0)
    }
}

fn said(margins: Margins) -> String {
    let (phase, gain) = (margins.phase.to_degrees(), margins.gain_db());
    format!("{phase:3.0} deg {gain:5.1} dB at {:3.0} rad/s", margins.crossover)
}

fn main() {
    let inertia = std::env::args().nth(1).and_then(|number| number.parse().ok()).unwrap_or(1.6f32);
    let config = CascadeConfig::for_airframe(&AIRFRAME);
    let mut autotune = Autotune::for_airframe(&AIRFRAME);
    let mut rate_config: RateConfig = config.rate;
    let mut now = Instant::from_secs(10);
    for &axis in AutotuneAxis::ALL {
        let (gains, limit) = (axis.gains(&config.rate), axis.of(&config.rate.torque_max));
        let attitude_gain = autotune.config(axis).attitude_gain;
        let mut pid = Pid::new(gains, limit);
        let inertia = inertia * axis.of(&AIRFRAME.inertia);
        let mut vehicle = Vehicle { inertia, rotors: 0.0, rate: [0.0; 3], angle: 0.0, random: 1 };
        let mut flight_status = FlightStatus {
            phase: FlightPhase::Flying,
            mode: FlightMode::PosHold,
            armed: true,
            ..FlightStatus::default()
        };
        let land_detected = LandDetected { contact: GroundContact::Air, ..LandDetected::default() };
        let mut begun = false;
        while !matches!(autotune.stage(), AutotuneStage::Done | AutotuneStage::Stopped) || !begun {
            let mut estimate = StateEstimate { height: 1.0, valid: Validity::ALL, ..StateEstimate::default() };
            *axis.of_mut(&mut estimate.angular_rate) = vehicle.gyro();
            let mut angles = Vec3::zeros();
            *axis.of_mut(&mut angles) = vehicle.angle;
            estimate.attitude = Quat::from_euler_angles(angles.x, angles.y, angles.z);
            let input = AutotuneInput {
                estimate: &estimate,
                command: &CommandSetpoint::default(),
                flight_status: &flight_status,
                land_detected: &land_detected,
                alerts: Alerts::default(),
                unmet: [0.0; 4],
            };
            if !begun {
                if let Err(refused) = autotune.start(now, axis, gains, &input) {
                    println!("{axis:?}: {refused}");
                    return;
                }
                begun = true;
            }
            // The rate loop under its attitude loop, and the excitation on top.
            let target = -attitude_gain * vehicle.angle;
            let mut torque = Vec3::zeros();
            *axis.of_mut(&mut torque) =
                pid.step(target, axis.of(&estimate.angular_rate), PERIOD.seconds(), Integration::Free);
            vehicle.step(axis.of(&autotune.step(now, &input, &torque)));
            now += PERIOD;
        }
        if let Some(stop) = autotune.stopped() {
            println!("{axis:?}: {stop}; the gains stay as they are");
            continue;
        }
        // Landed.
        flight_status.armed = false;
        let Some(report) = autotune.report().copied() else { continue };
        let Ok((axis, gains)) = autotune.accept(&flight_status) else { continue };
        *axis.gains_mut(&mut rate_config) = gains;
        let model = report.model;
        println!(
            "{:5} {} windows: inertia {:.2e} kg*m^2 ({:.2e} in truth), motors {:.1} ms, delay {:.1} ms",
            format!("{axis:?}"),
            report.windows,
            1.0 / model.gain,
            vehicle.inertia,
            1e3 * model.lag,
            1e3 * model.delay
        );
        let before = report.before.map_or("unknown".to_owned(), said);
        println!(
            "      before {before}, kp {:.4} ti {:.2} td {:.4}",
            report.present.kp, report.present.ti, report.present.td
        );
        println!("      after  {}, kp {:.4} ti {:.2} td {:.4}", said(report.after), gains.kp, gains.ti, gains.td);
    }
}
