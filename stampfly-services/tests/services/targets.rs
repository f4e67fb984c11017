//! Set-points, sticks and other messages without an acknowledgement: flown, answered, or refused
//! aloud.
#![allow(deprecated, reason = "programs send what the protocol has superseded")]

use crate::common::{Id, Vehicle};
use stampfly_control::guidance::{Navigator, NavigatorInput};
use stampfly_link::mavlink::dialects::common::*;
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkVersion, MavlinkWriter};
use stampfly_services::mavlink::{Identity, Mavlink};
use stampfly_types::messages::*;
use stampfly_types::{Instant, Quat, Vec3};

const IDENTITY: Identity =
    Identity { system: 7, kind: MavType::MAV_TYPE_QUADROTOR, take_off_height: 0.5, reach: 0.25, version: [1, 2, 3] };
/// Velocities alone, with and without a heading or a rate of turn.
const VELOCITY: u16 = 0b1101_1100_0111;
const VELOCITY_AND_RATE: u16 = 0b0101_1100_0111;
const VELOCITY_AND_HEIGHT: u16 = 0b1101_1110_0011;
/// Accelerations alone, with velocities, with a height, and as forces.
const ACCELERATION: u16 = 0b1100_0011_1111;
const VELOCITY_AND_ACCELERATION: u16 = 0b1100_0000_0111;
const ACCELERATION_AND_HEIGHT: u16 = 0b1101_0011_1011;
const FORCE: u16 = 0b1110_0011_1111;
const WORLD: MavFrame = MavFrame::MAV_FRAME_LOCAL_NED;
const BODY: MavFrame = MavFrame::MAV_FRAME_BODY_NED;
/// ms.
const CYCLE: f32 = 2.5;

/// A vehicle that follows its path, and a station.
struct Scene {
    mavlink: Mavlink<u8>,
    vehicle: Vehicle,
    navigator: Navigator,
    /// Cycles.
    now: u64,
    done: usize,
    path: Setpoint,
    texts: Vec<String>,
}

impl Scene {
    fn new() -> Self {
        let mut scene = Self {
            mavlink: Mavlink::new(IDENTITY),
            vehicle: Vehicle::flying(),
            navigator: Navigator::default(),
            now: 0,
            done: 0,
            path: Setpoint::default(),
            texts: Vec::new(),
        };
        // It has taken off.
        scene.vehicle.publish(Id::estimate_state, &StateEstimate { valid: Validity::ALL, ..Default::default() });
        scene.vehicle.guided.push(GuidedCommand {
            kind: GuidedKind::WayPoint,
            position: Vec3::new(0.0, 0.0, -1.0),
            ..Default::default()
        });
        scene.passes(4_000, None);
        scene.asked();
        scene
    }

    /// Lets so much time pass, ms, while a station says something twenty times a second.
    fn passes(&mut self, ms: u64, says: Option<&MavMessage>) {
        use stampfly_services::VehicleAccess as _;
        for _ in 0..(ms as f32 / CYCLE) as u64 {
            self.now += 1;
            if let Some(message) = says.filter(|_| self.now.is_multiple_of(20)) {
                self.says(message);
            }
            let now = self.instant();
            let mut sent = Vec::new();
            if self.now.is_multiple_of(8) {
                self.mavlink.poll(now, &mut self.vehicle, &mut |_, frame| sent.extend(frame));
            }
            self.read(&sent);
            for command in &self.vehicle.guided[self.done..] {
                self.navigator.accept(command).expect("taken");
            }
            self.done = self.vehicle.guided.len();
            let status = FlightStatus { mode: FlightMode::PosHold, ..self.vehicle.view().state() };
            let command = CommandSetpoint { source: status.commander, ..Default::default() };
            let (_, mut estimate) = self.vehicle.view().estimate().expect("one");
            let land_detected = LandDetected::default();
            let input = NavigatorInput {
                flight_status: &status,
                estimate: &estimate,
                land_detected: &land_detected,
                command: &command,
            };
            self.path = self.navigator.step(now, &input);
            (estimate.position, estimate.velocity) = (self.path.position, self.path.velocity);
            estimate.attitude = Quat::from_euler_angles(0.0, 0.0, self.path.yaw);
            self.vehicle.publish(Id::setpoint, &self.path);
            self.vehicle.publish(Id::estimate_state, &estimate);
        }
    }

    fn instant(&self) -> Instant {
        Instant::from_micros(2_500 * self.now)
    }

    /// A station says something. Returns the answers that come at once, but for texts.
    fn says(&mut self, message: &MavMessage) -> Vec<MavMessage> {
        let mut bytes = [0; LONGEST];
        let frame = MavlinkWriter::new(255, 190).write(MavlinkVersion::V2, message, &mut bytes);
        self.hears(frame.expect("a frame"))
    }

    fn hears(&mut self, frame: &[u8]) -> Vec<MavMessage> {
        let mut sent = Vec::new();
        let now = self.instant();
        self.mavlink.hear(now, 1, frame, &mut self.vehicle, &mut |_, frame| sent.extend(frame));
        self.read(&sent)
    }

    fn read(&mut self, bytes: &[u8]) -> Vec<MavMessage> {
        let mut decoder = MavlinkDecoder::<MavMessage>::new();
        let all = bytes.iter().filter_map(|byte| decoder.feed(*byte).map(|frame| frame.message().expect("a message")));
        let mut rest = Vec::new();
        for message in all {
            match message {
                MavMessage::STATUSTEXT(text) if text.chunk_seq > 0 => {
                    let last = self.texts.last_mut().expect("a beginning");
                    last.push_str(text.text.to_str().expect("UTF-8"));
                }
                MavMessage::STATUSTEXT(text) => self.texts.push(text.text.to_str().expect("UTF-8").to_owned()),
                message => rest.push(message),
            }
        }
        rest
    }

    fn texts(&mut self) -> Vec<String> {
        std::mem::take(&mut self.texts)
    }

    /// What the vehicle was asked for since.
    fn asked(&mut self) -> Vec<GuidedCommand> {
        self.done = 0;
        std::mem::take(&mut self.vehicle.guided)
    }
}

fn near(one: Vec3, other: [f32; 3]) {
    let other = Vec3::from(other);
    assert!((one - other).norm() < 0.03, "{one:?} for {other:?}");
}

fn target(mask: u16, frame: MavFrame, [vx, vy, vz]: [f32; 3]) -> SET_POSITION_TARGET_LOCAL_NED_DATA {
    SET_POSITION_TARGET_LOCAL_NED_DATA {
        vx,
        vy,
        vz,
        type_mask: PositionTargetTypemask::from_bits_truncate(mask),
        coordinate_frame: frame,
        target_system: 7,
        target_component: 1,
        ..Default::default()
    }
}

fn velocity(velocity: [f32; 3]) -> MavMessage {
    MavMessage::SET_POSITION_TARGET_LOCAL_NED(target(VELOCITY, WORLD, velocity))
}

#[test]
fn velocities_are_flown_in_their_direction_and_half_a_second_after_the_last_one_it_holds() {
    let mut scene = Scene::new();
    near(scene.path.position, [0.0, 0.0, -1.0]);
    for wanted in [[0.3, 0.4, 0.0], [-0.3, 0.4, 0.0], [0.1, -0.05, -0.2], [0.0, 0.0, 0.25], [0.0; 3]] {
        scene.passes(2_000, Some(&velocity(wanted)));
        near(scene.path.velocity, wanted);
    }
    // Faster than it may fly: as fast as it may, and it stops without creeping.
    scene.passes(2_000, Some(&velocity([5.0, 0.0, 0.0])));
    near(scene.path.velocity, [1.0, 0.0, 0.0]);
    let before = scene.path.position;
    scene.passes(2_000, Some(&velocity([0.0; 3])));
    near(scene.path.velocity, [0.0; 3]);
    let way = (scene.path.position - before).norm();
    assert!((0.3..0.9).contains(&way), "{way}");

    scene.passes(2_000, Some(&velocity([0.5, 0.0, 0.0])));
    scene.asked();
    scene.passes(460, None);
    near(scene.path.velocity, [0.5, 0.0, 0.0]);
    scene.passes(100, None);
    assert_eq!(scene.asked().last().map(|command| command.kind), Some(GuidedKind::Hold));
    scene.passes(1_000, None);
    near(scene.path.velocity, [0.0; 3]);
    assert_eq!((scene.asked(), scene.texts()), (vec![], vec![]), "nothing is asked for any more");
}

#[test]
fn a_velocity_may_be_the_vehicles_own_have_a_height_and_turn() {
    let mut scene = Scene::new();
    // To the right of a nose that points east: south.
    let east = SET_POSITION_TARGET_LOCAL_NED_DATA {
        yaw: core::f32::consts::FRAC_PI_2,
        ..target(0b1001_1100_0111, WORLD, [0.0; 3])
    };
    scene.passes(3_000, Some(&MavMessage::SET_POSITION_TARGET_LOCAL_NED(east)));
    let right = target(VELOCITY, BODY, [0.0, 0.3, 0.0]);
    scene.passes(2_000, Some(&MavMessage::SET_POSITION_TARGET_LOCAL_NED(right)));
    near(scene.path.velocity, [-0.3, 0.0, 0.0]);
    let high = SET_POSITION_TARGET_LOCAL_NED_DATA { z: -1.5, ..target(VELOCITY_AND_HEIGHT, WORLD, [0.0, 0.2, 9.0]) };
    scene.passes(4_000, Some(&MavMessage::SET_POSITION_TARGET_LOCAL_NED(high)));
    near(scene.path.velocity, [0.0, 0.2, 0.0]);
    assert!((scene.path.position.z + 1.5).abs() < 0.01, "{:?}", scene.path);
    let turns =
        SET_POSITION_TARGET_LOCAL_NED_DATA { yaw_rate: -0.7, ..target(VELOCITY_AND_RATE, WORLD, [0.2, 0.0, 0.0]) };
    scene.passes(2_000, Some(&MavMessage::SET_POSITION_TARGET_LOCAL_NED(turns)));
    near(scene.path.velocity, [0.2, 0.0, 0.0]);
    assert!((scene.path.yaw_rate + 0.7).abs() < 0.02, "{:?}", scene.path);
    assert_eq!(scene.texts(), [""; 0]);
}

fn acceleration(mask: u16, frame: MavFrame, velocity: [f32; 3], [afx, afy, afz]: [f32; 3]) -> MavMessage {
    let target = target(mask, frame, velocity);
    MavMessage::SET_POSITION_TARGET_LOCAL_NED(SET_POSITION_TARGET_LOCAL_NED_DATA { afx, afy, afz, ..target })
}

/// An acceleration alone.
fn accelerates(wanted: [f32; 3]) -> MavMessage {
    acceleration(ACCELERATION, WORLD, [f32::NAN; 3], wanted)
}

#[test]
fn an_acceleration_changes_the_velocity_for_as_long_as_it_is_said_and_half_a_second_after_the_last_one_it_holds() {
    let mut scene = Scene::new();
    // Half a metre a second more in each second; then as fast as it is.
    for (wanted, [north, east, down]) in [
        ([0.5, 0.0, 0.0], [0.5, 0.0, 0.0]),
        ([0.0, 0.3, 0.0], [0.5, 0.3, 0.0]),
        ([-0.5, 0.0, -0.2], [0.0, 0.3, -0.2]),
        ([-0.5, -0.6, 0.2], [-0.5, -0.3, 0.0]),
        ([0.5, 0.3, 0.0], [0.0, 0.0, 0.0]),
    ] {
        let before = scene.path.velocity;
        scene.passes(500, Some(&accelerates(wanted)));
        let half = (before + Vec3::new(north, east, down)) * 0.5;
        assert!((scene.path.velocity - half).norm() < 0.13, "{:?} for {half:?}", scene.path.velocity);
        scene.passes(500, Some(&accelerates(wanted)));
        let end = Vec3::new(north, east, down);
        assert!((scene.path.velocity - end).norm() < 0.13, "{:?} for {end:?}", scene.path.velocity);
        scene.passes(1_000, Some(&accelerates([0.0; 3])));
        near(scene.path.velocity, [north, east, down]);
    }
    // No faster than it may fly, and then it brakes as it is asked to: nothing has added up.
    scene.passes(6_000, Some(&accelerates([0.5, 0.0, 0.0])));
    near(scene.path.velocity, [1.0, 0.0, 0.0]);
    scene.passes(1_000, Some(&accelerates([-0.5, 0.0, 0.0])));
    let left = scene.path.velocity.x;
    assert!((0.45..0.7).contains(&left), "{left}");
    scene.passes(1_000, Some(&accelerates([0.0; 3])));

    scene.asked();
    scene.passes(460, None);
    assert!(
        scene.asked().iter().all(|command| command.kind == GuidedKind::WayPoint || command.kind == GuidedKind::Hold)
    );
    scene.passes(100, None);
    assert_eq!(scene.asked().last().map(|command| command.kind), Some(GuidedKind::Hold));
    scene.passes(1_500, None);
    near(scene.path.velocity, [0.0; 3]);
    assert_eq!((scene.asked(), scene.texts()), (vec![], vec![]), "nothing is asked for any more");
}

#[test]
fn an_acceleration_is_bounded_by_the_path_and_stands_beside_velocities_heights_and_frames() {
    let mut scene = Scene::new();
    // As hard as the path may, 1.5 m/s²: what leans the vehicle by less than nine degrees.
    let mut hardest = 0.0_f32;
    for _ in 0..40 {
        scene.passes(25, Some(&accelerates([19.0, 0.0, 0.0])));
        hardest = hardest.max(scene.path.acceleration.norm());
    }
    assert!((0.5..1.51).contains(&hardest), "{hardest}");
    near(scene.path.velocity, [1.0, 0.0, 0.0]);
    scene.passes(3_000, Some(&velocity([0.0; 3])));
    // Between two messages, a velocity goes on as its acceleration says.
    let both = acceleration(VELOCITY_AND_ACCELERATION, WORLD, [0.3, 0.0, 0.0], [0.4, 0.0, 0.0]);
    scene.says(&both);
    scene.passes(450, None);
    let fast = scene.path.velocity.x;
    assert!((0.33..0.49).contains(&fast), "{fast}");
    scene.passes(2_000, Some(&velocity([0.0; 3])));
    // A height holds while it accelerates, to the right of a nose that points east.
    let east = SET_POSITION_TARGET_LOCAL_NED_DATA {
        yaw: core::f32::consts::FRAC_PI_2,
        ..target(0b1001_1100_0111, WORLD, [0.0; 3])
    };
    scene.passes(3_000, Some(&MavMessage::SET_POSITION_TARGET_LOCAL_NED(east)));
    scene.passes(1_000, Some(&acceleration(ACCELERATION, BODY, [0.0; 3], [0.0, 0.4, 0.0])));
    scene.passes(800, Some(&accelerates([0.0; 3])));
    near(scene.path.velocity, [-0.4, 0.0, 0.0]);
    let high = target(ACCELERATION_AND_HEIGHT, WORLD, [0.0; 3]);
    let high = SET_POSITION_TARGET_LOCAL_NED_DATA { z: -1.6, afx: 0.0, afy: 0.2, afz: 9.0, ..high };
    scene.passes(2_000, Some(&MavMessage::SET_POSITION_TARGET_LOCAL_NED(high)));
    assert!((scene.path.position.z + 1.6).abs() < 0.03, "{:?}", scene.path);
    assert!((scene.path.velocity.y - 0.4).abs() < 0.1, "{:?}", scene.path);
    assert_eq!(scene.texts(), [""; 0]);
}

#[test]
fn accelerations_that_are_no_numbers_or_more_than_any_vehicle_can_are_refused() {
    for wanted in [[f32::NAN, 0.0, 0.0], [0.0, f32::INFINITY, 0.0], [0.0, 0.0, 21.0], [1e30, 1e30, 0.0]] {
        for mask in [ACCELERATION, VELOCITY_AND_ACCELERATION] {
            let mut scene = Scene::new();
            scene.passes(500, Some(&acceleration(mask, WORLD, [0.1; 3], wanted)));
            assert_eq!(scene.texts(), ["set-point not flown: a number is out of range"]);
            assert_eq!(scene.asked(), []);
        }
    }
}

#[test]
fn a_stream_does_not_take_the_vehicle_back_from_a_pilot() {
    let mut scene = Scene::new();
    let north = velocity([0.3, 0.0, 0.0]);
    scene.passes(1_000, Some(&north));
    scene.vehicle.status(|status| status.commander = CommandSource::Pilot);
    scene.asked();
    scene.passes(5_000, Some(&north));
    assert_eq!(scene.asked(), []);
    assert_eq!(scene.texts(), ["set-point not flown: a pilot flies"]);
    // The same in silence: nothing is asked of a vehicle that a pilot flies.
    scene.passes(1_000, None);
    assert_eq!(scene.asked(), []);
    scene.passes(100, Some(&north));
    assert_eq!(
        scene.asked().iter().map(|command| command.kind).collect::<Vec<_>>()[..2],
        [GuidedKind::Hold, GuidedKind::WayPoint]
    );
    // A command ends it, and a place does.
    scene.vehicle.status(|status| status.commander = CommandSource::Guided);
    scene.passes(500, Some(&north));
    let land = COMMAND_LONG_DATA {
        command: MavCmd::MAV_CMD_NAV_LAND,
        target_system: 7,
        target_component: 1,
        ..Default::default()
    };
    scene.says(&MavMessage::COMMAND_LONG(land));
    scene.asked();
    scene.passes(400, None);
    assert_eq!(scene.asked(), []);
    scene.passes(500, Some(&north));
    scene.says(&MavMessage::SET_POSITION_TARGET_LOCAL_NED(target(0b1101_1111_1000, WORLD, [0.0; 3])));
    assert_eq!(scene.asked().last().map(|command| command.position), Some(Vec3::zeros()));
    scene.passes(2_000, None);
    assert_eq!(scene.asked(), []);
}

#[test]
fn what_is_not_flown_is_refused_aloud_once_in_a_while() {
    let mut scene = Scene::new();
    let (target_system, target_component) = (7, 1);
    let unknown = SET_POSITION_TARGET_LOCAL_NED_DATA {
        coordinate_frame: MavFrame::MAV_FRAME_GLOBAL,
        ..target(VELOCITY, WORLD, [1.0; 3])
    };
    let attitude = SET_ATTITUDE_TARGET_DATA { target_system, target_component, thrust: 0.5, ..Default::default() };
    let channels =
        RC_CHANNELS_OVERRIDE_DATA { target_system, target_component, chan3_raw: 2_000, ..Default::default() };
    let on_earth = SET_POSITION_TARGET_GLOBAL_INT_DATA { target_system, target_component, ..Default::default() };
    let local = |target| MavMessage::SET_POSITION_TARGET_LOCAL_NED(target);
    let table = [
        (local(target(FORCE, WORLD, [0.0; 3])), "set-point not flown: forces are not flown"),
        (local(unknown), "set-point not flown: not in this frame"),
        (
            local(target(0b1111_1111_1111, WORLD, [0.0; 3])),
            "set-point not flown: no place, velocity or acceleration in it",
        ),
        (local(target(VELOCITY, WORLD, [f32::NAN; 3])), "set-point not flown: a number is out of range"),
        (local(target(0, WORLD, [0.0; 3]).clone()), ""),
        (
            MavMessage::SET_POSITION_TARGET_GLOBAL_INT(on_earth.clone()),
            "set-point not flown: where on Earth it is, is not known",
        ),
        (MavMessage::SET_ATTITUDE_TARGET(attitude), "attitude not flown: send places or velocities"),
        (MavMessage::RC_CHANNELS_OVERRIDE(channels), "RC override not flown: send MANUAL_CONTROL"),
    ];
    for (message, text) in table {
        scene.passes(10_000, None);
        scene.asked();
        scene.passes(9_000, Some(&message));
        let texts = scene.texts();
        assert_eq!(texts, if text.is_empty() { vec![] } else { vec![text] }, "{message:?}");
        assert_eq!(scene.asked().is_empty(), !text.is_empty(), "{message:?}");
        scene.passes(2_000, Some(&message));
        assert_eq!(scene.texts().len(), texts.len(), "again after ten seconds");
    }
    assert!(scene.vehicle.steered.is_empty());
    // In a frame of another dialect. The mask, system, component and frame stand behind twelve
    // numbers.
    let mut payload = [0; 53];
    payload[48..53].copy_from_slice(&[0xC7, 0x0D, 7, 1, 99]);
    let mut bytes = [0; LONGEST];
    let frame = MavlinkWriter::new(255, 190).write_payload::<MavMessage>(84, &payload, &mut bytes).expect("a frame");
    scene.passes(10_000, None);
    scene.hears(frame);
    assert_eq!(scene.texts(), ["set-point not flown: not in this frame"]);
    assert_eq!(scene.asked(), []);
    // For another vehicle.
    let others = SET_ATTITUDE_TARGET_DATA { target_system: 8, target_component, ..Default::default() };
    scene.passes(10_000, Some(&MavMessage::SET_ATTITUDE_TARGET(others)));
    assert_eq!(scene.texts(), [""; 0]);
    // Nothing flies on the ground, and a vehicle of whose path nothing is known does not fly
    // velocities.
    scene.vehicle.status(|status| status.phase = FlightPhase::Armed);
    scene.says(&velocity([1.0; 3]));
    assert_eq!(scene.texts(), ["set-point not flown: take off first"]);
    scene.vehicle.status(|status| status.phase = FlightPhase::Flying);
    scene.passes(10_000, None);
    scene.vehicle.publish(Id::setpoint, &Setpoint::default());
    scene.says(&velocity([1.0; 3]));
    assert_eq!(scene.texts(), ["set-point not flown: its place is not known"]);
}

#[test]
fn a_place_on_earth_is_flown_to_once_it_is_known_where_that_is() {
    let mut scene = Scene::new();
    let origin = SET_GPS_GLOBAL_ORIGIN_DATA {
        latitude: 473_977_418,
        longitude: 85_455_939,
        altitude: 488_000,
        target_system: 7,
        ..Default::default()
    };
    scene.says(&MavMessage::SET_GPS_GLOBAL_ORIGIN(origin));
    let mut target = SET_POSITION_TARGET_GLOBAL_INT_DATA {
        lat_int: 473_977_418 + 180,
        lon_int: 85_455_939,
        alt: 1.2,
        coordinate_frame: MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT,
        type_mask: PositionTargetTypemask::from_bits_truncate(0b1101_1111_1000),
        target_system: 7,
        target_component: 1,
        ..Default::default()
    };
    scene.passes(8_000, Some(&MavMessage::SET_POSITION_TARGET_GLOBAL_INT(target.clone())));
    near(scene.path.position, [2.0, 0.0, -1.2]);
    (target.alt, target.coordinate_frame) = (489.0, MavFrame::MAV_FRAME_GLOBAL);
    scene.passes(3_000, Some(&MavMessage::SET_POSITION_TARGET_GLOBAL_INT(target)));
    near(scene.path.position, [2.0, 0.0, -1.0]);
}

#[test]
fn a_ping_is_answered_a_log_is_not_there_and_a_mode_is_set() {
    let mut scene = Scene::new();
    let ping = PING_DATA { time_usec: 12_345, seq: 6, ..Default::default() };
    let answer = PING_DATA { target_system: 255, target_component: 190, ..ping.clone() };
    assert_eq!(scene.says(&MavMessage::PING(ping.clone())), [MavMessage::PING(answer.clone())]);
    assert_eq!(scene.says(&MavMessage::PING(answer)), [], "an answer to another program");
    let list = LOG_REQUEST_LIST_DATA { end: u16::MAX, target_system: 7, target_component: 1, ..Default::default() };
    assert_eq!(scene.says(&MavMessage::LOG_REQUEST_LIST(list)), [MavMessage::LOG_ENTRY(LOG_ENTRY_DATA::default())]);
    let sync = TIMESYNC_DATA { ts1: 99, ..Default::default() };
    let answers = scene.says(&MavMessage::TIMESYNC(sync.clone()));
    let [MavMessage::TIMESYNC(answer)] = &answers[..] else { panic!("{answers:?}") };
    assert_eq!((answer.ts1, answer.target_system, answer.target_component), (99, 255, 190));
    assert_eq!(scene.says(&MavMessage::TIMESYNC(TIMESYNC_DATA { target_system: 8, ..sync })), []);

    // PX4's number of holding, in the upper half of its own mode.
    let custom = MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED;
    let mode =
        |custom_mode, base_mode| MavMessage::SET_MODE(SET_MODE_DATA { custom_mode, target_system: 7, base_mode });
    let result = |answers: &[MavMessage]| match answers {
        [MavMessage::COMMAND_ACK(ack)] => (ack.command, ack.result, ack.target_system),
        other => panic!("{other:?}"),
    };
    let command = MavCmd::MAV_CMD_DO_SET_MODE;
    let answers = scene.says(&mode(0x0304_0000, custom));
    assert_eq!(result(&answers), (command, MavResult::MAV_RESULT_ACCEPTED, 255));
    assert_eq!(scene.asked().iter().map(|command| command.kind).collect::<Vec<_>>(), [GuidedKind::Hold]);
    // And of set-points.
    assert_eq!(result(&scene.says(&mode(0x0006_0000, custom))), (command, MavResult::MAV_RESULT_ACCEPTED, 255));
    scene.asked();
    // ArduPilot's number of something.
    let answers = scene.says(&mode(4, custom));
    assert_eq!(result(&answers), (command, MavResult::MAV_RESULT_UNSUPPORTED, 255));
    assert_eq!(scene.texts(), ["mode not set: this vehicle does not have it"]);
    assert_eq!(scene.asked(), []);
}

#[test]
fn a_parameter_that_is_not_there_is_said_not_to_be() {
    let mut scene = Scene::new();
    let (target_system, target_component) = (7, 1);
    let read = |name: &str, param_index| {
        let param_id = name.into();
        MavMessage::PARAM_REQUEST_READ(PARAM_REQUEST_READ_DATA {
            param_index,
            target_system,
            target_component,
            param_id,
        })
    };
    let set = MavMessage::PARAM_SET(PARAM_SET_DATA {
        param_value: 1.0,
        target_system,
        target_component,
        param_id: "NONSENSE".into(),
        param_type: MavParamType::MAV_PARAM_TYPE_REAL32,
    });
    let error = |answers: &[MavMessage]| match answers {
        [MavMessage::PARAM_ERROR(error)] => {
            assert_eq!(error.error, MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST);
            assert_eq!((error.target_system, error.target_component), (255, 190));
            (error.param_id.to_str().expect("UTF-8").to_owned(), error.param_index)
        }
        other => panic!("{other:?}"),
    };
    for (message, name, index) in
        [(read("NONSENSE", -1), "NONSENSE", -1), (read("", 99), "", 99), (set, "NONSENSE", -1)]
    {
        scene.passes(10_000, None);
        assert_eq!(error(&scene.says(&message)), (name.to_owned(), index));
        let what = if name.is_empty() { "99" } else { name };
        assert_eq!(scene.texts(), [format!("no such parameter: {what}")]);
        assert_eq!(error(&scene.says(&message)), (name.to_owned(), index), "programs are told each time");
        assert_eq!(scene.texts(), [""; 0]);
    }
    assert!(matches!(&scene.says(&read("gain", -1))[..], [MavMessage::PARAM_VALUE(_)]));
}
