//! Whatever it is told, numbers that are none included: a demand is finite, nothing panics, and a failure is for good.

use proptest::prelude::*;
use stampfly_fixed_wing::messages::{AirState, CycleStatus, EditKind, Home, Safety, Troubles, WayPointEdit};
use stampfly_fixed_wing::types::messages::{GuidedCommand, GuidedKind, PowerData, StateEstimate, Validity};
use stampfly_fixed_wing::types::{Instant, Quat, Vec3};
use stampfly_fixed_wing::{Config, PathManager, Sensed, Watch, Watched};

/// A number as a broken sensor or program has it.
fn number() -> impl Strategy<Value = f32> {
    prop_oneof![4 => -2_000.0f32..2_000.0, 1 => Just(f32::NAN), 1 => Just(f32::INFINITY), 1 => Just(f32::MAX), 2 => Just(0.0)]
}

fn vector() -> impl Strategy<Value = Vec3> {
    [number(), number(), number()].prop_map(|[x, y, z]| Vec3::new(x, y, z))
}

fn kind() -> impl Strategy<Value = GuidedKind> {
    use GuidedKind::*;
    prop::sample::select(vec![Arm, TakeOff, WayPoint, Hold, Land, Disarm, Kill])
}

fn edit() -> impl Strategy<Value = WayPointEdit> {
    use EditKind::*;
    let kinds = prop::sample::select(vec![Append, Insert, Update, Delete, Init, Nuke]);
    (kinds, any::<[u32; 2]>(), any::<[i32; 2]>(), number()).prop_map(
        |(kind, [id, before], [latitude, longitude], height)| WayPointEdit {
            kind,
            id: id % 8,
            before: before % 8,
            latitude,
            longitude,
            height,
        },
    )
}

/// What one period brings.
#[derive(Clone, Debug)]
struct Period {
    milliseconds: u64,
    estimate: StateEstimate,
    air: AirState,
    home: Home,
    troubles: Option<Troubles>,
    voltage: f32,
    commands: Vec<GuidedCommand>,
    edits: Vec<WayPointEdit>,
}

fn period() -> impl Strategy<Value = Period> {
    let estimate = (vector(), vector(), [number(), number(), number(), number()], prop::bool::weighted(0.8)).prop_map(
        |(position, velocity, [w, x, y, z], valid)| StateEstimate {
            position,
            velocity,
            attitude: Quat::new_unchecked(w, x, y, z),
            valid: if valid { Validity::ALL } else { Validity::NONE },
            ..StateEstimate::default()
        },
    );
    let air = (number(), [number(), number()], any::<bool>()).prop_map(|(airspeed, wind, measured)| AirState {
        airspeed,
        wind,
        measured,
        ..AirState::default()
    });
    let home = (any::<[i32; 2]>(), prop::bool::weighted(0.9)).prop_map(|([latitude, longitude], known)| Home {
        latitude,
        longitude,
        altitude: 0,
        known,
    });
    let command =
        (kind(), vector()).prop_map(|(kind, position)| GuidedCommand { kind, position, ..Default::default() });
    let troubles = prop::option::of(prop::sample::select(vec![
        Troubles::NONE,
        Troubles::FENCE,
        Troubles::BATTERY,
        Troubles::LINK,
    ]));
    (
        0u64..30_000,
        estimate,
        air,
        home,
        troubles,
        number(),
        prop::collection::vec(command, 0..4),
        prop::collection::vec(edit(), 0..3),
    )
        .prop_map(|(milliseconds, estimate, air, home, troubles, voltage, commands, edits)| Period {
            milliseconds,
            estimate,
            air,
            home,
            troubles,
            voltage,
            commands,
            edits,
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn a_demand_is_finite(periods in prop::collection::vec(period(), 1..40)) {
        let (mut manager, mut watch, config) = (PathManager::default(), Watch::default(), Config::default());
        let (mut now, mut failed) = (Instant::ZERO, false);
        for period in &periods {
            now += stampfly_fixed_wing::types::Duration::from_millis(period.milliseconds);
            let power = PowerData { voltage: period.voltage, ..PowerData::default() };
            let Period { estimate, air, home, commands, edits, .. } = period;
            let watched = Watched {
                estimate: Some(estimate),
                air,
                power: Some(&power),
                heard: Some(now),
                heights: [Some((now, estimate.velocity.x)), None],
                place: manager.status().place,
                armed: manager.is_armed(),
                blow: false,
                config: &config,
            };
            let found = watch.step(now, &watched);
            let safety = Safety { troubles: period.troubles.unwrap_or(found.troubles), ..found };
            let sensed = Sensed { estimate, air, home, safety: &safety, config: &config, commands, edits };
            let demand = manager.cycle(now, &sensed);
            let numbers = [demand.bank, demand.bank_max, demand.pitch, demand.climb, demand.height, demand.speed, demand.throttle,
                demand.course, demand.radius, demand.place[0], demand.place[1]];
            prop_assert!(numbers.iter().all(|number| number.is_finite()), "{demand:?} in {:?}", manager.status());
            prop_assert!(safety.link.is_finite() && safety.position.is_finite());
            failed |= manager.status().cycle == CycleStatus::FailureMode;
            prop_assert_eq!(failed, manager.status().cycle == CycleStatus::FailureMode);
        }
    }
}
