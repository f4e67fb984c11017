//! The path manager alone: its cycle, changes of the way-points, and commands.

use stampfly_fixed_wing::Config;
use stampfly_fixed_wing::messages::*;
use stampfly_fixed_wing::modes::CAPACITY;
use stampfly_fixed_wing::path_manager::{PathManager, Sensed, State};
use stampfly_types::messages::{GuidedCommand, GuidedKind, StateEstimate, Validity};
use stampfly_types::{Duration, Instant, Vec3};

/// Ten-millionths of a degree of latitude for a hundred metres.
const HUNDRED: i32 = 8_983;

/// A path manager, and what it is told.
struct Desk {
    manager: PathManager,
    now: Instant,
    estimate: StateEstimate,
    air: AirState,
    home: Home,
    safety: Safety,
    config: Config,
}

impl Desk {
    fn new() -> Self {
        let valid = Validity::TILT
            | Validity::HEADING
            | Validity::VELOCITY_XY
            | Validity::VELOCITY_Z
            | Validity::POSITION_XY
            | Validity::POSITION_Z;
        Self {
            manager: PathManager::default(),
            now: Instant::ZERO,
            estimate: StateEstimate { valid, ..StateEstimate::default() },
            air: AirState { measured: true, ..AirState::default() },
            home: Home { latitude: 365_600_000, longitude: 1_367_000_000, altitude: 30_000, known: true },
            safety: Safety::default(),
            config: Config::default(),
        }
    }

    fn told(&mut self, commands: &[GuidedCommand], edits: &[WayPointEdit], one_state: bool) -> Demand {
        let sensed = Sensed {
            estimate: &self.estimate,
            air: &self.air,
            home: &self.home,
            safety: &self.safety,
            config: &self.config,
            commands,
            edits,
        };
        if one_state {
            self.manager.step(self.now, &sensed);
            return Demand::default();
        }
        self.now += Duration::from_millis(20);
        self.manager.cycle(self.now, &sensed)
    }

    fn cycles(&mut self, seconds: f32) -> Demand {
        (0..(seconds * 50.0) as u32).fold(Demand::default(), |_, _| self.told(&[], &[], false))
    }

    fn command(&mut self, kind: GuidedKind) -> Demand {
        self.told(&[GuidedCommand { kind, ..GuidedCommand::default() }], &[], false)
    }

    /// A way-point, so many hundred metres north of home.
    fn edit(&mut self, kind: EditKind, id: u32, before: u32, hundreds: i32) -> EditRefusal {
        let latitude = self.home.latitude + hundreds * HUNDRED;
        let edit = WayPointEdit { kind, id, before, latitude, longitude: self.home.longitude, height: 60.0 };
        self.told(&[], &[edit], false);
        self.manager.status().refusal
    }

    fn place(&self) -> Place {
        self.manager.status().place
    }

    fn ahead(&self) -> (u32, u32) {
        let status = self.manager.status();
        (status.way_point, status.remaining)
    }

    /// At height, cruising to the north.
    fn flying() -> Self {
        let mut desk = Self::new();
        desk.cycles(0.1);
        desk.command(GuidedKind::Arm);
        desk.command(GuidedKind::TakeOff);
        desk.cycles(0.2);
        assert_eq!(desk.place(), Place::TakeOffRoll);
        desk.air.airspeed = 17.0;
        desk.estimate.velocity = Vec3::new(17.0, 0.0, 0.0);
        desk.estimate.position = Vec3::new(10.0, 0.0, -60.0);
        desk.cycles(0.2);
        assert_eq!(desk.place(), Place::CruisingCruise);
        desk
    }
}

#[test]
fn a_cycle_has_five_states_and_the_fifth_completes_it() {
    let mut desk = Desk::new();
    for _ in 0..3 {
        let mut seen = Vec::new();
        for _ in 0..5 {
            desk.told(&[], &[], true);
            seen.push((desk.manager.state(), desk.manager.status().cycle));
        }
        // The status belongs to the state that was executed.
        let within = |state| (state, CycleStatus::InCycle);
        let states = [
            within(State::CommsWithTelemetry),
            within(State::SensorFusion),
            within(State::ModeExecutor),
            within(State::CoordinateTurnElevation),
            (State::CommsWithAttitude, CycleStatus::CompletedCycle),
        ];
        assert_eq!(seen, states);
    }
}

#[test]
fn an_attitude_that_is_lost_while_armed_is_a_failure_for_ever() {
    let mut desk = Desk::new();
    desk.safety.troubles = Troubles::ATTITUDE;
    desk.cycles(0.1);
    assert_eq!(desk.manager.status().cycle, CycleStatus::CompletedCycle, "disarmed it waits");
    let mut desk = Desk::flying();
    desk.safety.troubles = Troubles::ATTITUDE;
    desk.cycles(0.04);
    desk.safety.troubles = Troubles::NONE;
    for _ in 0..50 {
        let demand = desk.command(GuidedKind::Hold);
        assert_eq!(
            (desk.manager.state(), desk.manager.status().cycle),
            (State::FatalFailure, CycleStatus::FailureMode)
        );
        assert_eq!((demand.thrust, demand.throttle, demand.lateral), (Thrust::Throttle, 0.0, Lateral::Bank));
        assert!(demand.bank > 0.0 && demand.bank < demand.bank_max && demand.pitch < 0.0, "a turn, and a glide");
    }
    assert!(desk.manager.is_armed());
    let mut killed = Desk { manager: desk.manager.clone(), ..Desk::new() };
    killed.now = desk.now;
    killed.command(GuidedKind::Kill);
    assert!(!killed.manager.is_armed());
    let mut gone = Desk { manager: desk.manager.clone(), now: desk.now, ..Desk::new() };
    gone.safety.troubles = Troubles::ATTITUDE;
    gone.cycles(0.1);
    assert!(!gone.manager.is_armed(), "an attitude that does not come back glides nothing");
    desk.cycles(118.0);
    assert!(desk.manager.is_armed(), "it may still glide");
    desk.cycles(3.0);
    assert!(!desk.manager.is_armed());
    assert_eq!(desk.manager.status().cycle, CycleStatus::FailureMode);
}

#[test]
fn what_has_crashed_is_disarmed_in_any_state_and_armed_after_somebody_has_disarmed_it() {
    for lost in [Troubles::NONE, Troubles::ATTITUDE, Troubles::HEIGHT] {
        let mut desk = Desk::flying();
        desk.safety.troubles = lost;
        desk.cycles(0.1);
        assert_eq!(desk.manager.status().cycle == CycleStatus::FailureMode, !lost.is_empty(), "{lost:?}");
        assert!(desk.manager.is_armed());
        desk.safety.troubles = lost | Troubles::CRASH;
        desk.cycles(0.02);
        assert!(!desk.manager.is_armed(), "{lost:?}");
    }
    let mut desk = Desk::flying();
    desk.safety.troubles = Troubles::CRASH;
    desk.cycles(1.0);
    // It lies upright now, somewhere.
    (desk.safety.troubles, desk.air.airspeed, desk.estimate.velocity) = (Troubles::NONE, 0.0, Vec3::zeros());
    desk.cycles(5.0);
    desk.command(GuidedKind::Arm);
    assert!(!desk.manager.is_armed(), "nobody has looked at it");
    desk.command(GuidedKind::Disarm);
    desk.command(GuidedKind::Arm);
    assert!(desk.manager.is_armed());

    let mut carried = Desk::new();
    carried.safety.troubles = Troubles::CRASH;
    carried.cycles(1.0);
    carried.command(GuidedKind::Arm);
    assert!(!carried.manager.is_armed(), "it lies");
    carried.safety.troubles = Troubles::NONE;
    carried.command(GuidedKind::Arm);
    assert!(carried.manager.is_armed(), "and stands again");
}

#[test]
fn an_armed_aircraft_that_stands_and_hears_nobody_is_disarmed() {
    let mut desk = Desk::new();
    desk.cycles(0.1);
    desk.command(GuidedKind::Arm);
    assert!(desk.manager.is_armed());
    desk.safety.troubles = Troubles::LINK;
    desk.cycles(0.1);
    assert!(!desk.manager.is_armed());
}

#[test]
fn way_points_are_appended_inserted_moved_and_taken_out() {
    let mut desk = Desk::flying();
    assert_eq!(desk.edit(EditKind::Init, 10, 0, 5), EditRefusal::None);
    assert_eq!(desk.ahead(), (10, 1));
    assert_eq!(desk.edit(EditKind::Append, 20, 0, 9), EditRefusal::None);
    assert_eq!(desk.ahead(), (10, 2));
    assert_eq!(desk.edit(EditKind::Insert, 15, 20, 7), EditRefusal::None);
    assert_eq!(desk.ahead(), (10, 3), "it is behind the one ahead");
    assert_eq!(desk.edit(EditKind::Delete, 10, 0, 0), EditRefusal::None);
    assert_eq!(desk.ahead(), (15, 2), "the inserted one was before 20");
    assert_eq!(desk.edit(EditKind::Update, 15, 0, 8), EditRefusal::None);
    let demand = desk.cycles(0.02);
    assert!((demand.place[0] - 800.0).abs() < 1.0, "{:?}", demand.place);
    assert_eq!((demand.lateral, demand.height), (Lateral::Line, 60.0));
    assert_eq!(desk.edit(EditKind::Init, 30, 0, 6), EditRefusal::None);
    assert_eq!(desk.ahead(), (30, 1), "all others are forgotten");
    assert_eq!(desk.edit(EditKind::Nuke, 0, 0, 0), EditRefusal::None);
    assert_eq!(desk.ahead(), (0, 0));
    assert_eq!(desk.cycles(0.02).lateral, Lateral::Orbit, "nothing is ahead");
    assert_eq!(desk.manager.status().refused, 0);
}

#[test]
fn what_cannot_be_edited_is_refused_and_counted_and_changes_nothing() {
    let mut desk = Desk::flying();
    desk.edit(EditKind::Init, 10, 0, 5);
    let refusals = [
        (EditKind::Append, 10, 0, EditRefusal::Known),
        (EditKind::Insert, 10, 10, EditRefusal::Known),
        (EditKind::Insert, 11, 99, EditRefusal::Unknown),
        (EditKind::Update, 11, 0, EditRefusal::Unknown),
        (EditKind::Delete, 11, 0, EditRefusal::Unknown),
    ];
    for (count, (kind, id, before, refusal)) in (1..).zip(refusals) {
        assert_eq!(desk.edit(kind, id, before, 3), refusal, "{kind:?}");
        assert_eq!((desk.manager.status().refused, desk.ahead()), (count, (10, 1)));
    }
    desk.home.known = false;
    assert_eq!(desk.edit(EditKind::Append, 12, 0, 3), EditRefusal::NoPlace, "nobody knows where home is");
    desk.home.known = true;
    for id in 1..CAPACITY as u32 {
        assert_eq!(desk.edit(EditKind::Append, 100 + id, 0, 3), EditRefusal::None, "{id}");
    }
    assert_eq!(desk.edit(EditKind::Append, 900, 0, 3), EditRefusal::Full);
    assert_eq!(desk.ahead(), (10, CAPACITY as u32));
    assert_eq!(desk.edit(EditKind::Delete, 10, 0, 0), EditRefusal::None);
    assert_eq!(desk.edit(EditKind::Append, 900, 0, 3), EditRefusal::None);
}

#[test]
fn a_hold_forgets_the_way_points_and_circles_where_it_is() {
    let mut desk = Desk::flying();
    desk.edit(EditKind::Init, 10, 0, 5);
    let demand = desk.command(GuidedKind::Hold);
    assert_eq!((demand.lateral, demand.place), (Lateral::Orbit, [10.0, 0.0]));
    assert_eq!(desk.ahead().1, 0);
    // A place ends it.
    let position = Vec3::new(400.0, 100.0, -50.0);
    let command = GuidedCommand { kind: GuidedKind::WayPoint, position, ..GuidedCommand::default() };
    let demand = desk.told(&[command], &[], false);
    assert_eq!((demand.lateral, demand.place, demand.height), (Lateral::Line, [400.0, 100.0], 50.0));
}

#[test]
fn the_watch_brings_it_home_and_lands_when_nobody_wants_anything_else() {
    let mut desk = Desk::flying();
    desk.edit(EditKind::Init, 10, 0, 5);
    desk.safety.troubles = Troubles::LINK;
    let demand = desk.cycles(0.02);
    assert_eq!((demand.lateral, demand.place), (Lateral::Orbit, [0.0; 2]));
    assert!(desk.manager.is_overruled());
    desk.safety.troubles = Troubles::NONE;
    desk.cycles(30.0);
    assert_eq!((desk.place(), desk.manager.is_overruled()), (Place::CruisingCruise, true), "it stays at home");
    // Somebody takes it back.
    let mut taken = Desk { manager: desk.manager.clone(), estimate: desk.estimate, air: desk.air, ..Desk::new() };
    taken.now = desk.now;
    taken.command(GuidedKind::Hold);
    assert!(!taken.manager.is_overruled());
    taken.cycles(100.0);
    assert_eq!(taken.place(), Place::CruisingCruise);
    desk.cycles(desk.config.limits.link_land - 29.0);
    assert_eq!(desk.place(), Place::LandingTransition);
}

#[test]
fn disarming_in_flight_is_a_landing_and_a_kill_is_not() {
    let mut desk = Desk::flying();
    desk.command(GuidedKind::Disarm);
    desk.cycles(0.1);
    assert_eq!((desk.manager.is_armed(), desk.place()), (true, Place::LandingTransition));
    let mut desk = Desk::flying();
    desk.command(GuidedKind::Kill);
    assert!(!desk.manager.is_armed());
    // On the ground it is one.
    let mut desk = Desk::new();
    desk.command(GuidedKind::Arm);
    assert!(desk.manager.is_armed());
    desk.command(GuidedKind::Disarm);
    assert!(!desk.manager.is_armed());
}

#[test]
fn it_does_not_arm_or_take_off_before_it_knows_where_it_is() {
    let blocked = |change: fn(&mut Desk)| {
        let mut desk = Desk::new();
        change(&mut desk);
        desk.command(GuidedKind::Arm);
        desk.command(GuidedKind::TakeOff);
        desk.cycles(0.2);
        !desk.manager.is_armed() && desk.manager.status().place != Place::TakeOffRoll
    };
    assert!(!blocked(|_| {}), "it would");
    assert!(blocked(|desk| desk.home.known = false));
    assert!(
        blocked(|desk| desk.estimate.valid = desk.estimate.valid.without(Validity::POSITION_XY)),
        "no fix any more"
    );
    let heading = Validity::POSITION_XY | Validity::HEADING;
    let mut unsure = Desk::new();
    unsure.estimate.valid = unsure.estimate.valid.without(heading);
    unsure.command(GuidedKind::Arm);
    assert!(unsure.manager.is_armed(), "a heading comes with the roll");
    assert!(blocked(|desk| desk.safety.troubles = Troubles::AIRSPEED));
    assert!(blocked(|desk| desk.safety.troubles = Troubles::BATTERY));
    assert!(blocked(|desk| desk.safety.troubles = Troubles::ATTITUDE));
}

#[test]
fn a_take_off_whose_tube_shows_nothing_is_given_up_and_not_tried_again() {
    let mut desk = Desk::new();
    desk.command(GuidedKind::Arm);
    desk.command(GuidedKind::TakeOff);
    desk.cycles(0.2);
    assert_eq!(desk.place(), Place::TakeOffRoll);
    desk.estimate.velocity = Vec3::new(12.5, 0.0, 0.0);
    assert_eq!(desk.cycles(0.04).throttle, 0.0);
    assert_eq!(desk.place(), Place::TaxiingStop);
    desk.estimate.velocity = Vec3::zeros();
    desk.cycles(100.0);
    assert_eq!((desk.place(), desk.manager.is_armed()), (Place::TaxiingPark, false));
}
