//! Closed-loop flights: controllers, mixer and guidance against a vehicle that is not theirs.
mod plant;

use plant::{Airframe, Flight, gust};
use stampfly_control::guidance::{Navigator, NavigatorInput};
use stampfly_control::{CascadeController, Controller, GeometricController};
use stampfly_types::messages::*;
use stampfly_types::{Vec3, frame};

struct Rms {
    sum: f64,
    n: u32,
    max: f32,
}
impl Rms {
    fn new() -> Self {
        Rms { sum: 0.0, n: 0, max: 0.0 }
    }
    fn add(&mut self, x: f32) {
        self.sum += f64::from(x) * f64::from(x);
        self.n += 1;
        self.max = self.max.max(x.abs());
    }
    fn rms(&self) -> f32 {
        (self.sum / f64::from(self.n)).sqrt() as f32
    }
}

fn noisy() -> Airframe {
    Airframe { noise: [0.1, 0.03, 0.01], ..Airframe::default() }
}

fn square<C: Controller>(name: &str, controller: C, airframe: Airframe, wind: f32) {
    let mut f = Flight::standing(controller, airframe);
    let mut nav = Navigator::default();
    nav.accept(&GuidedCommand { kind: GuidedKind::TakeOff, position: Vec3::new(0., 0., -0.5), ..Default::default() })
        .unwrap();
    f.command.source = CommandSource::Guided;
    let mut alt_max = 0f32;
    let mut tilt_max = 0f32;
    f.mode.state = FlightState::Armed;
    f.fly(0.3, |f| {
        f.setpoint = nav.step(
            f.now,
            &NavigatorInput { mode: &f.mode, estimate: &f.estimate(), status: &f.status, command: &f.command },
        );
    });
    f.mode.state = FlightState::TakeOff;
    let mut lag = Rms::new();
    f.fly(5.0, |f| {
        gust(f, wind);
        f.setpoint = nav.step(
            f.now,
            &NavigatorInput { mode: &f.mode, estimate: &f.estimate(), status: &f.status, command: &f.command },
        );
        f.status.contact = if f.state.position.z < -0.05 { GroundContact::Air } else { GroundContact::Ground };
        lag.add(f.setpoint.position.z - f.state.position.z);
        alt_max = alt_max.max(-f.state.position.z);
        tilt_max = tilt_max.max(frame::tilt(&f.state.attitude));
    });
    f.mode.state = FlightState::Flying;
    let to = tilt_max;
    tilt_max = 0.0;
    for (x, y) in [(1., 0.), (1., 1.), (0., 1.), (0., 0.)] {
        nav.accept(&GuidedCommand {
            kind: GuidedKind::WayPoint,
            position: Vec3::new(x, y, -0.5),
            ..Default::default()
        })
        .unwrap();
    }
    let (mut xy, mut z, mut yaw) = (Rms::new(), Rms::new(), Rms::new());
    let mut arrived = None;
    let start = f.now;
    f.fly(20.0, |f| {
        gust(f, wind);
        f.setpoint = nav.step(
            f.now,
            &NavigatorInput { mode: &f.mode, estimate: &f.estimate(), status: &f.status, command: &f.command },
        );
        if f.setpoint.arrived && arrived.is_none() {
            arrived = Some(f.now.since(start).seconds());
        }
        xy.add((f.setpoint.position - f.state.position).xy().norm());
        z.add(f.setpoint.position.z - f.state.position.z);
        yaw.add(frame::yaw(&f.state.attitude) - f.setpoint.yaw);
        tilt_max = tilt_max.max(frame::tilt(&f.state.attitude));
    });
    println!(
        "{name:28} takeoff max {alt_max:.3} track {:.3} tilt {:.1}; square xy rms {:.3} max {:.3} z rms {:.4} max {:.3} yaw {:.2} deg tilt {:.1} arrived {arrived:?} hover {:.3}",
        lag.rms(),
        to.to_degrees(),
        xy.rms(),
        xy.max,
        z.rms(),
        z.max,
        yaw.rms().to_degrees(),
        tilt_max.to_degrees(),
        0.0
    );
}

#[test]
fn explore() {
    let d = Airframe::default();
    for (name, a) in [
        ("nominal", d),
        ("noisy", noisy()),
        ("mass +20", Airframe { mass: d.mass * 1.2, ..d }),
        ("mass -20", Airframe { mass: d.mass * 0.8, ..d }),
        ("inertia +30", Airframe { inertia: d.inertia * 1.3, ..d }),
        ("inertia -30", Airframe { inertia: d.inertia * 0.7, ..d }),
        ("lag +50", Airframe { motor_lag: d.motor_lag * 1.5, ..d }),
        ("lag -50", Airframe { motor_lag: d.motor_lag * 0.5, ..d }),
        ("weak motor", Airframe { motor_gain: [0.9, 1.0, 1.0, 1.0], ..d }),
        ("delay 4", Airframe { delay: 4, ..d }),
        ("delay 6", Airframe { delay: 6, ..d }),
        ("lag+50 I-30 noisy", Airframe { inertia: d.inertia * 0.7, motor_lag: d.motor_lag * 1.5, ..noisy() }),
    ] {
        square(&format!("cascade {name}"), CascadeController::default(), a, 0.0);
        square(&format!("cascade {name} gust"), CascadeController::default(), a, 0.5);
        square(&format!("geometric {name} gust"), GeometricController::default(), a, 0.5);
    }
}
