//! Questions, and the state that is sent ten times a second.

use crate::view::View;
use stampfly_link::tello::{TelloQuery, TelloReply, TelloState};
use stampfly_types::{Duration, Vec3, frame};

/// Rest voltage of a lithium cell that is empty and one that is full, V.
const CELL: [f32; 2] = [3.3, 4.2];

/// Per cent of the battery, by its voltage: a straight line, which is what one can say of a cell under load.
fn battery(view: &View<'_>) -> u8 {
    let [empty, full] = CELL;
    let share = view.power().map_or(0.0, |(_, power)| (power.voltage - empty) / (full - empty));
    (share.clamp(0.0, 1.0) * 100.0) as u8
}

pub(super) fn answer(query: TelloQuery, speed: f32, in_air: Duration, view: &View<'_>) -> TelloReply<'static> {
    let state = state(in_air, view);
    match query {
        TelloQuery::Battery => TelloReply::Number(state.battery.into()),
        // In decimetres, as DJI's guide has it.
        TelloQuery::Height => TelloReply::Number((state.height * 10.0) as i32),
        TelloQuery::Attitude => TelloReply::Attitude(state.attitude),
        TelloQuery::Speed => TelloReply::Number((speed * 100.0 + 0.5) as i32),
        TelloQuery::SerialNumber => TelloReply::Text("STAMPFLY"),
        TelloQuery::Time => TelloReply::Number(state.time as i32),
        TelloQuery::Temperature => TelloReply::Number(state.temperature[0].into()),
        TelloQuery::Barometer => TelloReply::Number(state.barometer as i32),
        TelloQuery::Distance => TelloReply::Distance(state.below),
        TelloQuery::Acceleration => TelloReply::Acceleration(state.force),
        TelloQuery::Sdk => TelloReply::Number(20),
        TelloQuery::Active | TelloQuery::Hardware | TelloQuery::Wifi => TelloReply::Error("not supported"),
        _ => TelloReply::Error("not supported"),
    }
}

pub(super) fn state(in_air: Duration, view: &View<'_>) -> TelloState {
    let estimate = view.estimate().map(|(_, estimate)| estimate).unwrap_or_default();
    let degrees = view.imu().map_or(0, |(_, imu)| imu.temperature as i16);
    TelloState {
        attitude: frame::roll_pitch_yaw(&estimate.attitude).into(),
        velocity: estimate.velocity,
        temperature: [degrees; 2],
        below: view.tof().map_or(0.0, |(_, tof)| tof.distance),
        height: -estimate.position.z,
        battery: battery(view),
        barometer: view.baro().map_or(0.0, |(_, baro)| baro.altitude),
        time: (in_air.as_millis() / 1_000) as u32,
        force: view.imu().map(|(_, imu)| imu.accel).unwrap_or(Vec3::zeros()),
    }
}
