//! Blows from above.

use super::*;

/// What is shown within half a second of a blow by this force, at this tilt.
fn after(force: [f32; 3], tilt: f32) -> Alerts {
    let mut rig = Rig::flying().settled();
    rig.estimate.attitude = Quat::from_euler_angles(tilt, 0.0, 0.0);
    (0..60).fold(Alerts::NONE, |seen, sample| {
        let blow = if sample < 4 { Vec3::from(force) } else { REST };
        seen | rig.sample(blow, Vec3::zeros())
    })
}

#[test]
fn a_ceiling_ends_the_flight_by_a_landing() {
    for force in [[0.0, 0.0, 60.0], [30.0, 0.0, 60.0], [0.0, -40.0, 50.0]] {
        assert_eq!(after(force, 0.3), Alerts::STRUCK, "{force:?}");
    }
    assert!(crate::decision::LAND.contains(Alerts::STRUCK) && !crate::decision::CUT.contains(Alerts::STRUCK));
}

#[test]
fn a_wall_the_ground_and_the_ground_above_one_on_its_back_are_a_crash() {
    for (force, tilt) in [([60.0, 0.0, 30.0], 0.0), ([0.0, 0.0, -80.0], 0.0), ([0.0, 0.0, 60.0], 3.0)] {
        let seen = after(force, tilt);
        assert!(seen.contains(Alerts::IMPACT) && !seen.contains(Alerts::STRUCK), "{force:?} at {tilt}");
    }
}
