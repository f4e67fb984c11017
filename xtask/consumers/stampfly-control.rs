//! A stranger's program: a loop and a mixer.

use stampfly_control::pid::{Integration, Pid, PidGains};
use stampfly_control::{Mixer, MultirotorMixer};
use stampfly_types::{Vec3, messages::ControlOutput};

fn main() {
    let mut pid = Pid::new(PidGains::proportional(2e-3), 1.0);
    let torque = pid.step(0.5, 0.0, 0.0025, Integration::Free);
    let mixed = MultirotorMixer::stampfly().mix(&ControlOutput { thrust: 0.36, torque: Vec3::new(torque, 0.0, 0.0) });
    assert!((mixed.thrust.iter().sum::<f32>() - 0.36).abs() < 1e-5, "{mixed:?}");
}
