//! Tuning a whole vehicle: six degrees of freedom, cascade, mixer, wind.

use crate::flight::plant::{AIRFRAME, Flight, Spread, Vehicle, gust};
use stampfly_control::autotune::{Autotune, AutotuneAxis, AutotuneInput, AutotuneReport, AutotuneStage};
use stampfly_control::intent::Intent;
use stampfly_control::rate::RateConfig;
use stampfly_control::{CascadeConfig, CascadeController, ControlInput, Controller};
use stampfly_types::messages::{Alerts, ControlOutput};
use stampfly_types::{Instant, frame};

/// A controller with the tuning on top of it.
struct Tuned {
    inner: CascadeController,
    autotune: Autotune,
    begin: Option<AutotuneAxis>,
}

impl Controller for Tuned {
    fn follow(&mut self, now: Instant, intent: Option<Intent>, input: &ControlInput<'_>) -> ControlOutput {
        let output = self.inner.follow(now, intent, input);
        let conditions = AutotuneInput::of(input, Alerts::default());
        if let Some(axis) = self.begin.take() {
            let gains = axis.gains(&RateConfig::for_airframe(&AIRFRAME));
            self.autotune.start(now, axis, gains, &conditions).expect("it hovers");
        }
        ControlOutput { torque: self.autotune.step(now, &conditions, &output.torque), ..output }
    }

    fn reset(&mut self) {
        self.inner.reset();
    }
}

/// The report, the largest tilt, rad, and the largest distance from the place, m, meanwhile.
fn tuned(vehicle: Vehicle, axis: AutotuneAxis, wind: f32) -> (Option<AutotuneReport>, f32, f32) {
    let inner = CascadeController::new(&CascadeConfig::for_airframe(&AIRFRAME));
    let controller = Tuned { inner, autotune: Autotune::for_airframe(&AIRFRAME), begin: None };
    let mut flight = Flight::hovering(controller, vehicle);
    flight.fly(3.0, |f| gust(f, wind));
    let place = flight.setpoint.position;
    let (mut tilt, mut away) = (Spread::default(), Spread::default());
    flight.controller.begin = Some(axis);
    flight.fly(45.0, |f| {
        gust(f, wind);
        if f.controller.autotune.stage() == AutotuneStage::Exciting {
            tilt.add(frame::tilt(&f.state.attitude));
            away.add((f.state.position - place).norm());
        }
    });
    let autotune = &flight.controller.autotune;
    if let Some(stop) = autotune.stopped() {
        println!("{axis:?}: {stop}");
    }
    (autotune.report().copied(), tilt.largest, away.largest)
}

#[test]
fn every_axis_of_a_vehicle_of_unknown_inertia_is_tuned_in_hover() {
    for &axis in AutotuneAxis::ALL {
        for (inertia, wind) in [(0.6, 0.0), (1.0, 0.0), (1.0, 0.3), (1.6, 0.0)] {
            let vehicle =
                Vehicle { inertia: inertia * AIRFRAME.inertia, noise: [0.05, 0.02, 0.01], ..Vehicle::default() };
            let (report, tilt, away) = tuned(vehicle, axis, wind);
            let report = report.expect("it is measured");
            let found = 1.0 / (report.model.gain * axis.of(&AIRFRAME.inertia));
            println!(
                "{axis:?} inertia x{inertia}, wind {wind} m/s: found x{found:.2}, lag {:.1} ms, delay {:.1} ms, kp x{:.2}; tilts by {:.1} deg, leaves its place by {away:.2} m",
                1e3 * report.model.lag,
                1e3 * report.model.delay,
                report.proposed.kp / report.present.kp,
                tilt.to_degrees()
            );
            assert!((found / inertia - 1.0).abs() < 0.08, "{axis:?} x{inertia}: {found}");
            assert!((report.model.lag / AIRFRAME.motor_lag - 1.0).abs() < 0.2, "{report:?}");
            assert!(tilt < 0.2 && away < 0.3, "{axis:?} x{inertia}: {tilt} rad, {away} m");
        }
    }
}
