//! What mixers of all kinds of airframes promise.

use super::geometry::Shares;
use super::multirotor::Limits;
use super::*;
use crate::airframe::{Airframe, Rotor, Spin};
use proptest::prelude::*;
use stampfly_types::Vec3;
use std::vec::Vec;

const QUADROTOR: Airframe = Airframe::EXAMPLE;
const MIXER: MultirotorMixer = match MultirotorMixer::for_airframe(&QUADROTOR) {
    Ok(mixer) => mixer,
    Err(_) => panic!("it flies"),
};

/// Thrust and torque that the rotors produce: the definition, not the inverse.
fn produced(rotors: &[Rotor], mixed: &Mixed) -> ControlOutput {
    rotors.iter().zip(mixed.thrust).fold(ControlOutput::default(), |sum, (rotor, thrust)| ControlOutput {
        thrust: sum.thrust + thrust,
        torque: sum.torque + Vec3::new(-rotor.y, rotor.x, rotor.yaw_arm()) * thrust,
    })
}

fn hexacopter() -> Vec<Rotor> {
    ring(6)
}

/// So many rotors on a circle.
fn ring(count: u8) -> Vec<Rotor> {
    (0..count)
        .map(|n| {
            let angle = f64::from(n) * core::f64::consts::TAU / f64::from(count) + 0.3;
            Rotor {
                x: 0.2 * angle.cos() as f32,
                y: 0.2 * angle.sin() as f32,
                spin: if n % 2 == 0 { Spin::Clockwise } else { Spin::CounterClockwise },
                kappa: 0.016,
            }
        })
        .collect()
}

/// Four rotors at four distances, each with a share of its own.
fn askew() -> Vec<Rotor> {
    let spins = [Spin::CounterClockwise, Spin::Clockwise, Spin::CounterClockwise, Spin::Clockwise];
    let places = [(0.05, 0.06), (-0.04, 0.05), (-0.06, -0.04), (0.045, -0.055)];
    let drags = [0.01, 0.012, 0.009, 0.011];
    places.into_iter().zip(spins).zip(drags).map(|(((x, y), spin), kappa)| Rotor { x, y, spin, kappa }).collect()
}

#[test]
fn rotors_that_stand_nearly_in_line_are_refused() {
    let squeezed = |share: f32| Rotor::quadrotor_x(0.05, 0.01).map(|rotor| Rotor { y: rotor.y * share, ..rotor });
    assert_eq!(MultirotorMixer::from_rotors(&squeezed(3e-4), 0.2), Err(GeometryError::Uncontrollable));
    assert!(MultirotorMixer::from_rotors(&squeezed(0.01), 0.2).is_ok());
}

#[test]
fn a_square_has_the_inverse_that_can_be_written_down() {
    let Shares { thrust, roll, pitch, yaw, .. } = MIXER.shares;
    for (n, rotor) in QUADROTOR.rotors.iter().enumerate() {
        let closed = [0.25, -0.25 / rotor.y, 0.25 / rotor.x, 0.25 / rotor.yaw_arm()];
        for (a, b) in [thrust, roll, pitch, yaw].map(|share| share[n]).into_iter().zip(closed) {
            assert!((a - b).abs() <= 1e-6 * b.abs(), "{a} against {b}");
        }
    }
}

#[test]
fn airframes_that_cannot_fly_are_refused() {
    let rotors = Rotor::quadrotor_x(0.05, 0.01);
    assert_eq!(MultirotorMixer::from_rotors(&rotors[..3], 0.2), Err(GeometryError::Count));
    let one_way = rotors.map(|rotor| Rotor { spin: Spin::Clockwise, ..rotor });
    assert_eq!(MultirotorMixer::from_rotors(&one_way, 0.2), Err(GeometryError::Uncontrollable));
    let in_line = rotors.map(|rotor| Rotor { y: 0.0, ..rotor });
    assert_eq!(MultirotorMixer::from_rotors(&in_line, 0.2), Err(GeometryError::Uncontrollable));
    let broken = rotors.map(|rotor| Rotor { x: f32::NAN, ..rotor });
    assert_eq!(MultirotorMixer::from_rotors(&broken, 0.2), Err(GeometryError::Uncontrollable));
    let beside = rotors.map(|rotor| Rotor { x: rotor.x + 0.2, ..rotor });
    assert_eq!(MultirotorMixer::from_rotors(&beside, 0.2), Err(GeometryError::Unbalanced));
}

#[test]
fn four_to_eight_rotors_fly() {
    for (count, flies) in [(3, false), (4, true), (8, true), (9, false)] {
        let made = MultirotorMixer::from_rotors(&ring(count), 4.0).map(|mixer| mixer.count);
        assert_eq!(made, if flies { Ok(count.into()) } else { Err(GeometryError::Count) }, "{count}");
    }
    assert_eq!(MultirotorMixer::from_rotors(&ring(4), f32::INFINITY), Err(GeometryError::Uncontrollable));
}

#[cfg(feature = "serde")]
#[test]
fn what_is_read_has_no_more_rotors_than_shares() {
    let mut stored = serde_json::to_value(&MIXER).expect("a value");
    let mut read = |count: usize| {
        stored["count"] = count.into();
        serde_json::from_value::<MultirotorMixer>(stored.clone()).ok()
    };
    assert_eq!(read(MIXER.count), Some(MIXER));
    assert_eq!([MAX_MOTORS, MAX_MOTORS + 1].map(|count| read(count).is_some()), [true, false]);
}

#[test]
fn a_least_thrust_that_leaves_nothing_is_refused() {
    for wrong in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, QUADROTOR.motor_thrust_max, 9.0] {
        assert_eq!(MIXER.with_thrust_min(wrong), Err(GeometryError::Uncontrollable), "{wrong}");
    }
    assert_eq!(MIXER.with_thrust_min(0.0), Ok(MIXER));
}

#[test]
fn broken_demands_are_zero() {
    let mixed = MIXER.mix(&ControlOutput { thrust: f32::NAN, torque: Vec3::repeat(f32::INFINITY) });
    assert_eq!(mixed.thrust, [0.0; MAX_MOTORS]);
}

prop_compose! {
    /// In shares of what the rotors can do, and beyond.
    fn demands()(thrust in -0.3f32..1.8, x in -2.6f32..2.6, y in -2.6f32..2.6, z in -3.0f32..3.0)
        -> ControlOutput
    {
        ControlOutput { thrust, torque: Vec3::new(x, y, z) }
    }
}

/// A demand in N and N·m from its shares.
fn demand_on(rotors: &[Rotor], thrust_max: f32, shares: &ControlOutput) -> ControlOutput {
    let reach = rotors.iter().fold(Vec3::zeros(), |sum, r| sum + Vec3::new(r.y.abs(), r.x.abs(), r.kappa));
    ControlOutput {
        thrust: shares.thrust * thrust_max * rotors.len() as f32,
        torque: shares.torque.component_mul(&reach) * (0.5 * thrust_max),
    }
}

/// Each rotor's part of roll and pitch.
fn parts(mixer: &MultirotorMixer, demand: &ControlOutput) -> Vec<f32> {
    let shares = mixer.shares.roll.iter().zip(&mixer.shares.pitch).take(mixer.count);
    shares.map(|(roll, pitch)| roll * demand.torque.x + pitch * demand.torque.y).collect()
}

/// Checks all promises for one airframe.
fn keeps_its_promises(rotors: &[Rotor], thrust_max: f32, shares: &ControlOutput) -> Result<(), TestCaseError> {
    let demand = &demand_on(rotors, thrust_max, shares);
    let mixer = MultirotorMixer::from_rotors(rotors, thrust_max).expect("flies");
    // One whose battery gives no more is as one whose motors can do no more.
    let stronger = MultirotorMixer::from_rotors(rotors, 1.7 * thrust_max).expect("flies");
    let mixed = mixer.mix(demand);
    prop_assert_eq!(stronger.mix_within(demand, thrust_max), mixed);
    let got = produced(rotors, &mixed);
    let arm = rotors.iter().fold(0.0f32, |arm, r| arm.max(r.x.abs()).max(r.y.abs()));
    let fine = 1e-4 * thrust_max;
    for thrust in mixed.thrust {
        prop_assert!((0.0..=thrust_max).contains(&thrust));
    }
    // Roll and pitch keep their direction, and their size unless no collective at all could give it.
    let kept = 1.0 - mixed.unmet[0];
    prop_assert!((got.torque.x - kept * demand.torque.x).abs() < fine * arm);
    prop_assert!((got.torque.y - kept * demand.torque.y).abs() < fine * arm);
    let part = parts(&mixer, demand);
    let feasible = |scale: f32| {
        (0..1000).any(|n| {
            let collective = n as f32 / 999.0 * thrust_max * rotors.len() as f32;
            let fits = |(share, p): (&f32, &f32)| (0.0..=thrust_max).contains(&(share * collective + scale * p));
            mixer.shares.thrust.iter().zip(&part).all(fits)
        })
    };
    prop_assert!(!feasible(1.0) || mixed.unmet[0] < 1e-4, "roll and pitch were possible and given up");
    prop_assert!(mixed.unmet[0] == 0.0 || !feasible(1.0));
    prop_assert!(mixed.unmet[0] == 0.0 || !feasible(1.01 * kept), "more of roll and pitch was possible: {kept}");
    prop_assert_eq!((mixed.count as usize, mixed.unmet[0]), (rotors.len(), mixed.unmet[1]));
    // Yaw keeps its sign.
    let yaw_kept = 1.0 - mixed.unmet[2];
    prop_assert!((-1e-6..=1.0).contains(&yaw_kept));
    prop_assert!((got.torque.z - yaw_kept * demand.torque.z).abs() < fine * 0.02);
    // Thrust: the report is right.
    let missing = mixed.unmet[3] * demand.thrust.abs().max(1e-3);
    if mixed.unmet[3].abs() < 1.0 {
        prop_assert!((demand.thrust - got.thrust - missing).abs() < 10.0 * fine);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]
    #[test]
    fn a_quadrotor_keeps_its_promises(demand in demands()) {
        keeps_its_promises(QUADROTOR.rotors, QUADROTOR.motor_thrust_max, &demand)?;
    }

    #[test]
    fn a_hexacopter_keeps_them_too(demand in demands()) {
        keeps_its_promises(&hexacopter(), 4.0, &demand)?;
    }

    #[test]
    fn rotors_that_stand_askew_keep_them_too(demand in demands()) {
        keeps_its_promises(&askew(), 0.3, &demand)?;
    }

    #[test]
    fn a_demand_that_fits_is_met_exactly(
        thrust in 0.38f32..0.65, x in -0.12f32..0.12, y in -0.12f32..0.12, z in -0.12f32..0.12,
    ) {
        let shares = ControlOutput { thrust, torque: Vec3::new(x, y, z) };
        let demand = demand_on(QUADROTOR.rotors, QUADROTOR.motor_thrust_max, &shares);
        let mixed = MIXER.mix(&demand);
        let got = produced(QUADROTOR.rotors, &mixed);
        prop_assert_eq!(mixed.unmet, [0.0; 4]);
        prop_assert!((got.thrust - demand.thrust).abs() < 1.4e-6 * QUADROTOR.full_thrust());
        prop_assert!((got.torque - demand.torque).norm() < 2e-6 * QUADROTOR.torque_limit().x);
    }

    #[test]
    fn motors_that_idle_or_reverse_keep_within_their_limits(
        shares in demands(), low in -1f32..0.2, which in 0usize..3,
    ) {
        let rotors = [QUADROTOR.rotors.to_vec(), hexacopter(), ring(8)][which].clone();
        let (max, min) = (2.3, 2.3 * low);
        let mixer = MultirotorMixer::from_rotors(&rotors, max).and_then(|mixer| mixer.with_thrust_min(min)).expect("flies");
        let demand = demand_on(&rotors, max, &shares);
        let mixed = mixer.mix(&demand);
        let got = produced(&rotors, &mixed);
        for thrust in mixed.thrust.iter().take(rotors.len()) {
            prop_assert!((min..=max).contains(thrust), "{thrust} below {min}");
        }
        // Roll and pitch first: what is reported is what is made, and all of it while any collective thrust gives it.
        let kept = 1.0 - mixed.unmet[0];
        prop_assert!((got.torque.x - kept * demand.torque.x).abs() < 1e-3 * max);
        prop_assert!((got.torque.y - kept * demand.torque.y).abs() < 1e-3 * max);
        prop_assert!((got.torque.z - (1.0 - mixed.unmet[2]) * demand.torque.z).abs() < 1e-4 * max);
        let parts = parts(&mixer, &demand);
        let spread = parts.iter().fold(f32::MIN, |a, b| a.max(*b)) - parts.iter().fold(f32::MAX, |a, b| a.min(*b));
        prop_assert!(spread > 0.999 * (max - min) || mixed.unmet[0] < 1e-3, "given up without need");
    }

    /// What fits is asked first, and apart from the search for what to give up. The search, asked as well, gives up nothing then.
    #[test]
    fn the_search_agrees_with_what_fits(shares in demands(), low in -1f32..0.2, which in 0usize..3) {
        let (rotors, max) = ([QUADROTOR.rotors.to_vec(), askew(), ring(8)][which].clone(), 2.3);
        let mixer = MultirotorMixer::from_rotors(&rotors, max).and_then(|mixer| mixer.with_thrust_min(max * low)).expect("flies");
        let demand = demand_on(&rotors, max, &shares);
        let unmet = mixer.mix(&demand).unmet;
        let mut tilt = [0.0; MAX_MOTORS];
        tilt.iter_mut().zip(parts(&mixer, &demand)).for_each(|(part, asked)| *part = asked);
        let found = mixer.compromise(tilt, demand.thrust, Limits { least: max * low, most: max });
        prop_assert_eq!(found == (demand.thrust, 1.0), (unmet[0], unmet[3]) == (0.0, 0.0), "{:?} {:?}", found, unmet);
    }

    #[test]
    fn any_bits_give_possible_thrusts(thrust: f32, x: f32, y: f32, z: f32, available: f32) {
        let mixed = MIXER.mix_within(&ControlOutput { thrust, torque: Vec3::new(x, y, z) }, available);
        for thrust in mixed.thrust {
            prop_assert!((0.0..=QUADROTOR.motor_thrust_max).contains(&thrust));
        }
        prop_assert!(mixed.unmet.iter().all(|share| share.is_finite()));
    }
}

#[test]
fn rotors_that_cannot_control_are_refused_with_the_reason() {
    let made = |rotors: &[Rotor], thrust| MultirotorMixer::from_rotors(rotors, thrust).map(|_| ());
    let rotors = QUADROTOR.rotors;
    let flat: Vec<_> = rotors.iter().map(|rotor| Rotor { x: 0.0, y: 0.0, ..*rotor }).collect();
    let with_x = |x: f32| rotors.iter().map(|rotor| Rotor { x, ..*rotor }).collect::<Vec<_>>();
    let with_kappa = |kappa: f32| rotors.iter().map(|rotor| Rotor { kappa, ..*rotor }).collect::<Vec<_>>();
    let without_drag: Vec<_> = rotors.iter().map(|rotor| Rotor { kappa: 0.0, ..*rotor }).collect();
    for (case, reason) in [
        (made(&rotors[..3], 0.1), GeometryError::Count),
        (made(rotors, f32::NAN), GeometryError::Uncontrollable),
        (made(rotors, 0.0), GeometryError::Uncontrollable),
        (made(&flat, 0.1), GeometryError::Uncontrollable),
        (made(&without_drag, 0.1), GeometryError::Uncontrollable),
        (made(&with_x(f32::INFINITY), 0.1), GeometryError::Uncontrollable),
        (made(&with_x(f32::NAN), 0.1), GeometryError::Uncontrollable),
        (made(&with_kappa(f32::INFINITY), 0.1), GeometryError::Uncontrollable),
        (made(&with_kappa(f32::NAN), 0.1), GeometryError::Uncontrollable),
    ] {
        assert_eq!(case, Err(reason));
    }
    let words =
        [GeometryError::Count, GeometryError::Uncontrollable, GeometryError::Unbalanced].map(|e| std::format!("{e}"));
    assert!(
        words[0].contains("four and eight") && words[1].contains("torque") && words[2].contains("share"),
        "{words:?}"
    );
}
