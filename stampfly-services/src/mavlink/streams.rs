//! What is sent by itself: the messages that are made of a view, and how often.

use super::identity::Own;
use super::said::Said;
use crate::view::View;
use heapless::Vec;
use stampfly_link::mavlink::dialects::common::*;
use stampfly_types::Origin;
use stampfly_types::messages::{Alerts, ArmBlocks, CommandSource, FlightPhase, Validity};
use stampfly_types::{Duration, Instant, Quat, frame};

/// A message that is sent again and again.
#[derive(Clone, Copy)]
pub(super) struct Stream {
    /// Which message.
    pub id: u32,
    /// Between two, unless the client wants another time; `None` for only when asked for.
    pub every: Option<Duration>,
    /// The message, if there is anything to say.
    pub make: fn(Instant, &Own, &View<'_>) -> Option<Said>,
}

const fn every(id: u32, period_ms: u64, make: fn(Instant, &Own, &View<'_>) -> Option<Said>) -> Stream {
    Stream { id, every: Some(Duration::from_millis(period_ms)), make }
}

const fn asked(id: u32, make: fn(Instant, &Own, &View<'_>) -> Option<Said>) -> Stream {
    Stream { id, every: None, make }
}

/// Every one that there is: number, period in milliseconds, what it is made of.
pub(super) const STREAMS: [Stream; 16] = [
    every(0, 1_000, heartbeat),
    every(1, 1_000, sys_status),
    every(30, 50, attitude),
    asked(31, attitude_quaternion),
    every(32, 50, local_position),
    every(33, 200, global_position),
    every(36, 200, motors),
    asked(49, global_origin),
    every(74, 200, hud),
    asked(105, imu),
    every(132, 200, distance),
    every(147, 1_000, battery),
    asked(148, version),
    every(242, 1_000, home),
    every(245, 500, extended_state),
    asked(141, altitude),
];

/// The message with this number, now.
pub(super) fn make(id: u32, now: Instant, own: &Own, view: &View<'_>) -> Option<Said> {
    STREAMS.iter().find(|stream| stream.id == id).and_then(|stream| (stream.make)(now, own, view))
}

fn ms(now: Instant) -> u32 {
    (now.as_micros() / 1_000) as u32
}

fn heartbeat(_: Instant, own: &Own, view: &View<'_>) -> Option<Said> {
    let status = view.state();
    let alerts = view.alert().map(|(_, alert)| alert.active).unwrap_or_default();
    let mut base = MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | MavModeFlag::MAV_MODE_FLAG_STABILIZE_ENABLED;
    base.set(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED, status.armed);
    base.set(MavModeFlag::MAV_MODE_FLAG_GUIDED_ENABLED, status.commander == CommandSource::Guided);
    base.set(MavModeFlag::MAV_MODE_FLAG_MANUAL_INPUT_ENABLED, status.commander == CommandSource::Pilot);
    let emergency = Alerts::IMPACT | Alerts::IMU_LOST | Alerts::IMU_FAULTY | Alerts::TUMBLED | Alerts::MOTOR_LOST;
    let critical = Alerts::COMM_LOST
        | Alerts::CRITICAL_BATTERY
        | Alerts::ESTIMATE_DIVERGED
        | Alerts::ACCEL_FAULTY
        | Alerts::STRUCK;
    let system_status = match status.phase {
        FlightPhase::Init if status.blocks.contains(ArmBlocks::CALIBRATING) => MavState::MAV_STATE_CALIBRATING,
        FlightPhase::Init => MavState::MAV_STATE_BOOT,
        _ if status.armed && alerts.intersects(emergency) => MavState::MAV_STATE_EMERGENCY,
        _ if status.armed && alerts.intersects(critical) => MavState::MAV_STATE_CRITICAL,
        _ if status.armed => MavState::MAV_STATE_ACTIVE,
        _ => MavState::MAV_STATE_STANDBY,
    };
    Some(
        HEARTBEAT_DATA {
            custom_mode: status.mode as u32,
            mavtype: own.identity.kind,
            autopilot: MavAutopilot::MAV_AUTOPILOT_GENERIC,
            base_mode: base,
            system_status,
            mavlink_version: 3,
        }
        .into(),
    )
}

fn sys_status(_: Instant, _: &Own, view: &View<'_>) -> Option<Said> {
    let alerts = view.alert().map(|(_, alert)| alert.active).unwrap_or_default();
    let sensors = [
        (
            view.imu().is_some(),
            MavSysStatusSensor::MAV_SYS_STATUS_SENSOR_3D_GYRO,
            Alerts::IMU_LOST | Alerts::IMU_FAULTY,
        ),
        (
            view.imu().is_some(),
            MavSysStatusSensor::MAV_SYS_STATUS_SENSOR_3D_ACCEL,
            Alerts::IMU_LOST | Alerts::IMU_FAULTY | Alerts::ACCEL_FAULTY,
        ),
        (view.mag().is_some(), MavSysStatusSensor::MAV_SYS_STATUS_SENSOR_3D_MAG, Alerts::NONE),
        (view.baro().is_some(), MavSysStatusSensor::MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE, Alerts::BARO_LOST),
        (view.flow().is_some(), MavSysStatusSensor::MAV_SYS_STATUS_SENSOR_OPTICAL_FLOW, Alerts::FLOW_LOST),
        (view.tof().is_some(), MavSysStatusSensor::MAV_SYS_STATUS_SENSOR_LASER_POSITION, Alerts::TOF_LOST),
        (view.power().is_some(), MavSysStatusSensor::MAV_SYS_STATUS_SENSOR_BATTERY, Alerts::POWER_LOST),
    ];
    let (mut present, mut health) = (MavSysStatusSensor::empty(), MavSysStatusSensor::empty());
    for (is_there, sensor, failures) in sensors {
        present.set(sensor, is_there);
        health.set(sensor, is_there && !alerts.intersects(failures));
    }
    let arm_check = MavSysStatusSensor::MAV_SYS_STATUS_PREARM_CHECK;
    let mut healthy = health;
    healthy.set(arm_check, view.state().blocks.is_empty());
    let power = view.power().map(|(_, power)| power);
    Some(
        SYS_STATUS_DATA {
            onboard_control_sensors_present: present | arm_check,
            onboard_control_sensors_enabled: present | arm_check,
            onboard_control_sensors_health: healthy,
            voltage_battery: power.map_or(u16::MAX, |power| (power.voltage * 1e3) as u16),
            current_battery: power.map_or(-1, |power| (power.current * 1e2) as i16),
            battery_remaining: -1,
            ..Default::default()
        }
        .into(),
    )
}

fn attitude(now: Instant, _: &Own, view: &View<'_>) -> Option<Said> {
    let (_, estimate) = view.estimate().filter(|(_, estimate)| estimate.valid.contains(Validity::TILT))?;
    let [roll, pitch, yaw] = frame::roll_pitch_yaw(&estimate.attitude);
    let [rollspeed, pitchspeed, yawspeed] = estimate.angular_rate.into();
    let data = ATTITUDE_DATA { time_boot_ms: ms(now), roll, pitch, yaw, rollspeed, pitchspeed, yawspeed };
    Some(data.into())
}

fn attitude_quaternion(now: Instant, _: &Own, view: &View<'_>) -> Option<Said> {
    let (_, estimate) = view.estimate().filter(|(_, estimate)| estimate.valid.contains(Validity::TILT))?;
    let [q1, q2, q3, q4] = estimate.attitude.wxyz();
    let [rollspeed, pitchspeed, yawspeed] = estimate.angular_rate.into();
    Some(
        ATTITUDE_QUATERNION_DATA {
            time_boot_ms: ms(now),
            q1,
            q2,
            q3,
            q4,
            rollspeed,
            pitchspeed,
            yawspeed,
            ..Default::default()
        }
        .into(),
    )
}

fn local_position(now: Instant, _: &Own, view: &View<'_>) -> Option<Said> {
    let (_, estimate) = view.estimate()?;
    let usable = Validity::POSITION_XY | Validity::POSITION_Z;
    if !estimate.valid.contains(usable) {
        return None;
    }
    let ([x, y, z], [vx, vy, vz]): ([f32; 3], [f32; 3]) = (estimate.position.into(), estimate.velocity.into());
    let data = LOCAL_POSITION_NED_DATA { time_boot_ms: ms(now), x, y, z, vx, vy, vz };
    Some(data.into())
}

/// Degrees from north over east, below 360.
fn heading(attitude: &Quat) -> f32 {
    let degrees = frame::yaw(attitude).to_degrees();
    let around = if degrees < 0.0 { degrees + 360.0 } else { degrees };
    // What is all but north is rounded up to it.
    if around < 360.0 { around } else { 0.0 }
}

/// Only of a vehicle that knows, or was told, where on Earth it is.
fn global_position(now: Instant, own: &Own, view: &View<'_>) -> Option<Said> {
    let origin = own.origin?;
    let (_, estimate) = view.estimate()?;
    if !estimate.valid.contains(Validity::POSITION_XY | Validity::POSITION_Z) {
        return None;
    }
    let ([north, east, down], [vx, vy, vz]): ([f32; 3], [f32; 3]) =
        (estimate.position.into(), estimate.velocity.into());
    let (lat, lon) = origin.global([north, east]);
    let up = (-down * 1e3) as i32;
    let heading = heading(&estimate.attitude);
    Some(
        GLOBAL_POSITION_INT_DATA {
            time_boot_ms: ms(now),
            lat,
            lon,
            alt: origin.altitude.saturating_add(up),
            relative_alt: up,
            vx: (vx * 1e2) as i16,
            vy: (vy * 1e2) as i16,
            vz: (vz * 1e2) as i16,
            hdg: (heading * 1e2) as u16,
        }
        .into(),
    )
}

fn global_origin(_: Instant, own: &Own, _: &View<'_>) -> Option<Said> {
    let Origin { latitude, longitude, altitude } = own.origin?;
    let data = GPS_GLOBAL_ORIGIN_DATA { latitude, longitude, altitude, ..Default::default() };
    Some(data.into())
}

/// Home is where the vehicle was switched on: the origin.
fn home(_: Instant, own: &Own, _: &View<'_>) -> Option<Said> {
    let Origin { latitude, longitude, altitude } = own.origin?;
    let q = [1.0, 0.0, 0.0, 0.0];
    Some(HOME_POSITION_DATA { latitude, longitude, altitude, q, ..Default::default() }.into())
}

fn motors(now: Instant, _: &Own, view: &View<'_>) -> Option<Said> {
    let (_, motors) = view.motors()?;
    // As pulses of a servo, which is what the message holds.
    let [a, b, c, d, ..] = motors.duty.map(|duty| 1_000 + (duty.clamp(0.0, 1.0) * 1e3) as u16);
    Some(
        SERVO_OUTPUT_RAW_DATA {
            time_usec: now.as_micros() as u32,
            servo1_raw: a,
            servo2_raw: b,
            servo3_raw: c,
            servo4_raw: d,
            ..Default::default()
        }
        .into(),
    )
}

fn hud(_: Instant, _: &Own, view: &View<'_>) -> Option<Said> {
    let (_, estimate) = view.estimate()?;
    let heading = heading(&estimate.attitude);
    let throttle = view.motors().map_or(0.0, |(_, motors)| motors.duty.iter().take(4).sum::<f32>() / 4.0);
    Some(
        VFR_HUD_DATA {
            airspeed: 0.0,
            groundspeed: estimate.velocity.horizontal().norm(),
            alt: -estimate.position.z,
            climb: -estimate.velocity.z,
            heading: heading as i16,
            throttle: (throttle * 100.0) as u16,
        }
        .into(),
    )
}

fn imu(now: Instant, _: &Own, view: &View<'_>) -> Option<Said> {
    let (_, imu) = view.imu()?;
    let ([xacc, yacc, zacc], [xgyro, ygyro, zgyro]): ([f32; 3], [f32; 3]) = (imu.accel.into(), imu.gyro.into());
    let field = view.mag().map(|(_, mag)| mag.field).unwrap_or_default();
    let pressure = view.baro().map(|(_, baro)| baro);
    Some(
        HIGHRES_IMU_DATA {
            time_usec: now.as_micros(),
            xacc,
            yacc,
            zacc,
            xgyro,
            ygyro,
            zgyro,
            // The message is in gauss: a hundred microtesla.
            xmag: field.x / 100.0,
            ymag: field.y / 100.0,
            zmag: field.z / 100.0,
            // And in hectopascal.
            abs_pressure: pressure.map_or(0.0, |sample| sample.pressure / 100.0),
            temperature: imu.temperature,
            ..Default::default()
        }
        .into(),
    )
}

fn distance(now: Instant, _: &Own, view: &View<'_>) -> Option<Said> {
    let (_, tof) = view.tof().filter(|(_, tof)| tof.valid)?;
    Some(
        DISTANCE_SENSOR_DATA {
            time_boot_ms: ms(now),
            // Of the sensor's data sheet, cm.
            min_distance: 1,
            max_distance: 300,
            current_distance: (tof.distance * 100.0) as u16,
            mavtype: MavDistanceSensor::MAV_DISTANCE_SENSOR_LASER,
            orientation: MavSensorOrientation::MAV_SENSOR_ROTATION_PITCH_270,
            covariance: u8::MAX,
            ..Default::default()
        }
        .into(),
    )
}

fn battery(_: Instant, _: &Own, view: &View<'_>) -> Option<Said> {
    let (_, power) = view.power()?;
    let mut voltages = [u16::MAX; 10];
    if let Some(first) = voltages.first_mut() {
        *first = (power.voltage * 1e3) as u16;
    }
    Some(
        BATTERY_STATUS_DATA {
            current_consumed: -1,
            energy_consumed: -1,
            temperature: i16::MAX,
            voltages,
            current_battery: (power.current * 1e2) as i16,
            mavtype: MavBatteryType::MAV_BATTERY_TYPE_LIPO,
            battery_remaining: -1,
            ..Default::default()
        }
        .into(),
    )
}

fn version(_: Instant, own: &Own, _: &View<'_>) -> Option<Said> {
    let [major, minor, patch] = own.identity.version;
    Some(
        AUTOPILOT_VERSION_DATA {
            capabilities: MavProtocolCapability::MAV_PROTOCOL_CAPABILITY_MAVLINK2
                | MavProtocolCapability::MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST
                | MavProtocolCapability::MAV_PROTOCOL_CAPABILITY_MISSION_INT
                | MavProtocolCapability::MAV_PROTOCOL_CAPABILITY_COMMAND_INT
                | MavProtocolCapability::MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED,
            flight_sw_version: u32::from_be_bytes([major, minor, patch, 255]),
            uid: own.identity.system.into(),
            ..Default::default()
        }
        .into(),
    )
}

fn extended_state(_: Instant, _: &Own, view: &View<'_>) -> Option<Said> {
    let landed_state = match view.state().phase {
        FlightPhase::Init | FlightPhase::IdleGround | FlightPhase::IdleHeld | FlightPhase::Armed => {
            MavLandedState::MAV_LANDED_STATE_ON_GROUND
        }
        FlightPhase::TakeOff => MavLandedState::MAV_LANDED_STATE_TAKEOFF,
        FlightPhase::Flying | FlightPhase::Flip => MavLandedState::MAV_LANDED_STATE_IN_AIR,
        FlightPhase::Landing => MavLandedState::MAV_LANDED_STATE_LANDING,
    };
    let vtol_state = MavVtolState::MAV_VTOL_STATE_UNDEFINED;
    Some(EXTENDED_SYS_STATE_DATA { vtol_state, landed_state }.into())
}

fn altitude(now: Instant, _: &Own, view: &View<'_>) -> Option<Said> {
    let (_, estimate) = view.estimate()?;
    Some(
        ALTITUDE_DATA {
            time_usec: now.as_micros(),
            altitude_monotonic: -estimate.position.z,
            altitude_amsl: f32::NAN,
            altitude_local: -estimate.position.z,
            altitude_relative: -estimate.position.z,
            altitude_terrain: estimate.height,
            bottom_clearance: estimate.height,
        }
        .into(),
    )
}

/// One sentence of those, until it is sent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Notice {
    severity: MavSeverity,
    kind: &'static str,
    name: &'static str,
}

impl Notice {
    pub fn text(&self) -> Said {
        text(self.severity, self.kind, self.name)
    }
}

/// What people should read: alerts that came, and why arming was refused.
#[derive(Clone, Debug)]
pub(super) struct Notices {
    alerts: Alerts,
    attempts: u32,
}

impl Notices {
    pub const fn new() -> Self {
        Self { alerts: Alerts::NONE, attempts: 0 }
    }

    /// Those that are new since the last call: at most eight, the rest with the next.
    pub fn new_ones(&mut self, view: &View<'_>) -> Vec<Notice, 8> {
        let mut found = Vec::new();
        if let Some((_, alert)) = view.alert() {
            // One that went away is new when it comes back.
            self.alerts = self.alerts.without(Alerts::ALL.without(alert.active));
            let new = Alerts::EACH.iter().filter(|flag| alert.active.without(self.alerts).contains(**flag));
            let mut told = self.alerts;
            for flag in new {
                let name = flag.names().next().unwrap_or_default();
                if found.push(Notice { severity: MavSeverity::MAV_SEVERITY_WARNING, kind: "alert ", name }).is_ok() {
                    told |= *flag;
                }
            }
            self.alerts = told;
        }
        if let Some((_, refusals)) = view.refusals().filter(|(_, refusals)| refusals.attempts != self.attempts) {
            self.attempts = refusals.attempts;
            for name in refusals.blocks.names() {
                _ = found.push(Notice { severity: MavSeverity::MAV_SEVERITY_ERROR, kind: "not armed: ", name });
            }
        }
        found
    }
}

/// A text for people.
pub(super) fn text(severity: MavSeverity, kind: &str, words: &str) -> Said {
    let mut bytes = [0; 50];
    for (to, from) in bytes.iter_mut().zip(kind.bytes().chain(words.bytes())) {
        *to = from;
    }
    STATUSTEXT_DATA { severity, text: bytes.into(), ..Default::default() }.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_go_round_at_north() {
        for (yaw, expected) in [(0.0, 0.0), (-1e-7, 0.0), (-90.0, 270.0), (-0.5, 359.5), (179.0, 179.0)] {
            let found = heading(&Quat::from_euler_angles(0.0, 0.0, f32::to_radians(yaw)));
            assert!((found - expected).abs() < 1e-3 && found < 360.0, "{yaw}: {found}");
        }
    }
}
