//! A stranger's program: a loop and a mixer.

use stampfly_control::pid::{Integration, Pid, PidGains};
use stampfly_control::{Airframe, Mixer, MultirotorMixer};
use stampfly_types::{Vec3, messages::ControlOutput};

fn main() {
    let mut pid = Pid::new(PidGains::proportional(2e-2), 1.0);
    let torque = pid.step(0.5, 0.0, 0.0025, Integration::Free);
    let airframe = Airframe { mass: 0.45, ..Airframe::EXAMPLE };
    let mixer = MultirotorMixer::for_airframe(&airframe).expect("it can be controlled");
    let thrust = airframe.hover_thrust();
    let mixed = mixer.mix(&ControlOutput { thrust, torque: Vec3::new(torque, 0.0, 0.0) });
    assert!((mixed.thrust.iter().sum::<f32>() - thrust).abs() < 1e-5, "{mixed:?}");
}
