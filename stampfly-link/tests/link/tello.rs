//! Tello's words: each command with its limits, each error, and the text that programs read back.

use proptest::prelude::*;
use stampfly_link::tello::{
    TelloAxis, TelloCommand, TelloDirection, TelloError, TelloOther, TelloQuery, TelloReply, TelloState, TelloWave,
};
use stampfly_types::Vec3;
use stampfly_types::messages::FlipDirection;

fn parse(text: &str) -> Result<TelloCommand, TelloError> {
    TelloCommand::parse(text.as_bytes())
}

const DEGREE: f32 = core::f32::consts::PI / 180.0;

/// Every command that djitellopy 2.5.0 sends, in the order of its source, with usual arguments.
const DJITELLOPY: [(&str, TelloCommand); 52] = {
    use TelloCommand as C;
    const fn go(direction: TelloDirection) -> TelloCommand {
        TelloCommand::Move { direction, distance: 100.0 * 0.01 }
    }
    [
        ("command", C::Command),
        ("keepalive", C::KeepAlive),
        ("motoron", C::Other(TelloOther::IdleMotors)),
        ("motoroff", C::Other(TelloOther::IdleMotors)),
        ("throwfly", C::Other(TelloOther::ThrowToFly)),
        ("takeoff", C::TakeOff),
        ("land", C::Land),
        ("streamon", C::Video { on: true }),
        ("streamoff", C::Video { on: false }),
        ("emergency", C::Emergency),
        ("stop", C::Stop),
        ("up 100", go(TelloDirection::Up)),
        ("down 100", go(TelloDirection::Down)),
        ("left 100", go(TelloDirection::Left)),
        ("right 100", go(TelloDirection::Right)),
        ("forward 100", go(TelloDirection::Forward)),
        ("back 100", go(TelloDirection::Back)),
        ("cw 90", C::Rotate { angle: 90.0 * DEGREE }),
        ("ccw 90", C::Rotate { angle: -90.0 * DEGREE }),
        ("flip l", C::Flip(FlipDirection::Left)),
        ("flip r", C::Flip(FlipDirection::Right)),
        ("flip f", C::Flip(FlipDirection::Forward)),
        ("flip b", C::Flip(FlipDirection::Back)),
        (
            "go 100 50 -50 100",
            C::Go { offset: Vec3::new(100.0 * 0.01, -50.0 * 0.01, 50.0 * 0.01), speed: 100.0 * 0.01 },
        ),
        ("curve 50 50 0 100 0 0 30", C::Other(TelloOther::Curve)),
        ("go 0 0 100 30 m1", C::Other(TelloOther::MissionPad)),
        ("curve 50 50 0 100 0 0 30 m1", C::Other(TelloOther::Curve)),
        ("jump 100 0 100 50 90 m1 m2", C::Other(TelloOther::MissionPad)),
        ("mon", C::Other(TelloOther::MissionPad)),
        ("moff", C::Other(TelloOther::MissionPad)),
        ("mdirection 2", C::Other(TelloOther::MissionPad)),
        ("speed 50", C::Speed { speed: 50.0 * 0.01 }),
        (
            "rc -100 100 0 50",
            C::Sticks { right: -100.0 * 0.01, forward: 100.0 * 0.01, up: 0.0, clockwise: 50.0 * 0.01 },
        ),
        ("wifi name password", C::Other(TelloOther::Network)),
        ("ap name password", C::Other(TelloOther::Network)),
        ("port 8890 11112", C::Other(TelloOther::Port)),
        ("reboot", C::Other(TelloOther::Reboot)),
        ("setbitrate 5", C::Other(TelloOther::VideoSetting)),
        ("setresolution high", C::Other(TelloOther::VideoSetting)),
        ("setfps middle", C::Other(TelloOther::VideoSetting)),
        ("downvision 1", C::Other(TelloOther::VideoSetting)),
        ("EXT led 255 0 0", C::Other(TelloOther::Expansion)),
        ("speed?", C::Query(TelloQuery::Speed)),
        ("battery?", C::Query(TelloQuery::Battery)),
        ("time?", C::Query(TelloQuery::Time)),
        ("height?", C::Query(TelloQuery::Height)),
        ("temp?", C::Query(TelloQuery::Temperature)),
        ("attitude?", C::Query(TelloQuery::Attitude)),
        ("baro?", C::Query(TelloQuery::Barometer)),
        ("tof?", C::Query(TelloQuery::Distance)),
        ("wifi?", C::Query(TelloQuery::Wifi)),
        ("sdk?", C::Query(TelloQuery::Sdk)),
    ]
};

#[test]
fn all_that_djitellopy_sends_is_understood() {
    for (text, command) in DJITELLOPY {
        assert_eq!(parse(text), Ok(command), "{text}");
        assert_eq!(parse(&format!("  {text} \r\n")), Ok(command), "{text}");
        assert_eq!(parse(&format!("{text}\0")), Ok(command), "{text}");
    }
    for (text, query) in [
        ("sn?", TelloQuery::SerialNumber),
        ("active?", TelloQuery::Active),
        ("acceleration?", TelloQuery::Acceleration),
        ("hardware?", TelloQuery::Hardware),
    ] {
        assert_eq!(parse(text), Ok(TelloCommand::Query(query)));
    }
}

#[test]
fn the_ecosystems_own_commands() {
    let (axis, wave) = (TelloAxis::Roll, TelloWave::Doublet);
    let identify = TelloCommand::Identify { axis, wave, amplitude: 86.0 * DEGREE, duration: 2.5 };
    assert_eq!(parse("sysid roll doublet 86 2.5"), Ok(identify));
    assert!(matches!(parse("sysid pitch chirp 1 10"), Ok(TelloCommand::Identify { wave: TelloWave::Chirp, .. })));
    let tune = |bandwidth, phase_margin| Ok(TelloCommand::Autotune { axis: TelloAxis::Yaw, bandwidth, phase_margin });
    assert_eq!(parse("autotune yaw"), tune(None, None));
    assert_eq!(parse("autotune yaw 18"), tune(Some(18.0), None));
    assert_eq!(parse("autotune yaw 18 60"), tune(Some(18.0), Some(60.0 * DEGREE)));
}

#[test]
fn limits_are_taken_and_what_is_beyond_them_is_not() {
    for (command, least, most) in [
        ("up *", 10.0, 500.0),
        ("back *", 10.0, 500.0),
        ("cw *", 1.0, 3_600.0),
        ("ccw *", 1.0, 3_600.0),
        ("go * 300 0 50", -500.0, 500.0),
        ("go 300 * 0 50", -500.0, 500.0),
        ("go 300 0 * 50", -500.0, 500.0),
        ("go 300 0 0 *", 10.0, 100.0),
        ("speed *", 10.0, 100.0),
        ("rc * 0 0 0", -100.0, 100.0),
        ("rc 0 * 0 0", -100.0, 100.0),
        ("rc 0 0 * 0", -100.0, 100.0),
        ("rc 0 0 0 *", -100.0, 100.0),
        ("sysid yaw chirp * 5", 0.001, 86.0),
        ("sysid yaw chirp 5 *", 0.001, 10.0),
        ("autotune roll *", 1.0, 100.0),
        ("autotune roll 25 *", 20.0, 80.0),
    ] {
        let with = |number: f32| parse(&command.replace('*', &number.to_string()));
        assert!(with(least).is_ok() && with(most).is_ok(), "{command}");
        for beyond in [least - 0.01, most + 0.01, -9_999_999.0, 9_999_999.0] {
            assert_eq!(with(beyond), Err(TelloError::Range), "{command} {beyond}");
        }
        for word in ["x", "1e2", "inf", "nan", "-", "99999999"] {
            assert_eq!(parse(&command.replace('*', word)), Err(TelloError::NotANumber), "{command} {word}");
        }
    }
    assert_eq!(parse("go 5 5 5 50"), Err(TelloError::Range), "no way at all");
    assert!(parse("go 0 0 -10 50").is_ok());
}

#[test]
fn each_flaw_has_its_name() {
    for text in ["", " ", "\r\n", "\0", "fly", "Takeoff", "COMMAND", "battery", "battery??", "rc?", "takeoff,"] {
        assert_eq!(parse(text), Err(TelloError::Unknown), "{text:?}");
    }
    for text in [
        "takeoff now",
        "up",
        "up 50 50",
        "go 1 2 3",
        "go 100 0 0 50 60",
        "rc 0 0 0",
        "rc 0 0 0 0 0",
        "flip",
        "flip l r",
        "speed",
        "sysid roll chirp 5",
        "autotune",
        "autotune yaw 18 60 1",
        "battery? 1",
        "cw",
    ] {
        assert_eq!(parse(text), Err(TelloError::Arguments), "{text:?}");
    }
    for text in ["flip x", "flip left", "sysid up chirp 5 5", "sysid roll sine 5 5", "autotune z"] {
        assert_eq!(parse(text), Err(TelloError::Word), "{text:?}");
    }
    for bytes in [&b"up\t50"[..], b"take\0off", b"up 5\xFF0", b"\x80", b"land\nland", "up ５０".as_bytes()] {
        assert_eq!(TelloCommand::parse(bytes), Err(TelloError::NotText), "{bytes:?}");
    }
    let padded = |length: usize| [&b"land"[..], &vec![b' '; length - 4]].concat();
    assert_eq!(TelloCommand::parse(&padded(TelloCommand::LONGEST)), Ok(TelloCommand::Land));
    assert_eq!(TelloCommand::parse(&padded(TelloCommand::LONGEST + 1)), Err(TelloError::TooLong));
}

#[test]
fn answers_are_what_programs_read() {
    let said = |reply: TelloReply<'_>| {
        let mut out = [0; 100];
        let length = reply.write(&mut out).expect("there is room");
        assert_eq!(reply.write(&mut out[..length - 1]), None);
        String::from_utf8(out[..length].to_vec()).expect("text")
    };
    assert_eq!(said(TelloReply::Ok), "ok");
    assert_eq!(said(TelloReply::Error("not flying")), "error not flying");
    assert_eq!(said(TelloReply::Refused(TelloError::Unknown)), "error unknown command");
    assert_eq!(said(TelloReply::Number(-7)), "-7");
    assert_eq!(said(TelloReply::Distance(0.801)), "801mm");
    assert_eq!(said(TelloReply::Attitude(Vec3::new(0.1, -0.2, 3.0))), "pitch:-11;roll:6;yaw:172;");
    let force = Vec3::new(0.098_066_5, -0.000_049, -9.806_65);
    assert_eq!(said(TelloReply::Acceleration(force)), "agx:10.00;agy:0.00;agz:-1000.00;");
    assert_eq!(said(TelloReply::Text("STAMPFLY0001")), "STAMPFLY0001");
    let most = Vec3::repeat(f32::NEG_INFINITY);
    for reply in [
        TelloReply::Number(i32::MIN),
        TelloReply::Distance(f32::NEG_INFINITY),
        TelloReply::Attitude(most),
        TelloReply::Acceleration(most),
        TelloReply::Refused(TelloError::Arguments),
    ] {
        assert!(said(reply).len() <= TelloReply::LONGEST, "{reply}");
    }
}

#[test]
fn the_state_is_the_line_of_the_guide() {
    let state = TelloState {
        attitude: Vec3::new(-0.0349, 0.0524, -3.1),
        velocity: Vec3::new(0.1, -0.2, 0.016),
        temperature: [60, 62],
        below: 0.1,
        height: 0.52,
        battery: 87,
        barometer: 161.284,
        time: 42,
        force: Vec3::new(-0.05, 0.02, -9.81),
    };
    let expected = "pitch:3;roll:-2;yaw:-178;vgx:10;vgy:-20;vgz:2;templ:60;temph:62;tof:10;h:52;bat:87;baro:161.28;\
                    time:42;agx:-5.10;agy:2.04;agz:-1000.34;\r\n";
    assert_eq!(state.to_string(), expected);
    let mut out = [0; TelloState::LONGEST];
    assert_eq!(state.write(&mut out), Some(expected.len()));
    assert_eq!(state.write(&mut [0; 100]), None);

    let (least, nothing) = (Vec3::repeat(f32::NEG_INFINITY), Vec3::repeat(f32::NAN));
    let longest = TelloState {
        attitude: least,
        velocity: least,
        temperature: [i16::MIN; 2],
        below: f32::MIN,
        height: f32::MIN,
        battery: u8::MAX,
        barometer: f32::MIN,
        time: u32::MAX,
        force: least,
    };
    assert!(longest.write(&mut out).is_some(), "{} bytes", longest.to_string().len());
    let none = TelloState { attitude: nothing, velocity: nothing, barometer: f32::NAN, force: nothing, ..state };
    assert!(none.to_string().contains("vgx:0;") && none.to_string().contains("baro:0.00;"));
}

proptest! {
    /// Whatever a line says, it has djitellopy's sixteen keys and numbers where it wants them.
    #[test]
    fn every_state_can_be_read(numbers in prop::array::uniform12(any::<f32>()), time: u32, battery: u8) {
        let [a, b, c, d, e, f, g, h, i, j, k, l] = numbers;
        let state = TelloState {
            attitude: Vec3::new(a, b, c),
            velocity: Vec3::new(d, e, f),
            below: g,
            height: h,
            barometer: i,
            force: Vec3::new(j, k, l),
            time,
            battery,
            ..Default::default()
        };
        let line = state.to_string();
        let fields: Vec<(&str, &str)> =
            line.trim().split(';').filter_map(|field| field.split_once(':')).collect();
        let keys: Vec<&str> = fields.iter().map(|(key, _)| *key).collect();
        prop_assert_eq!(keys, ["pitch", "roll", "yaw", "vgx", "vgy", "vgz", "templ", "temph", "tof", "h", "bat", "baro",
            "time", "agx", "agy", "agz"]);
        for (key, value) in fields {
            let decimal = ["baro", "agx", "agy", "agz"].contains(&key);
            let whole = value.parse::<i64>().is_ok();
            prop_assert!(whole || decimal && value.parse::<f64>().is_ok_and(f64::is_finite));
        }
    }

    #[test]
    fn any_words_are_looked_at_without_harm(words in prop::collection::vec(prop_oneof![
        prop::sample::select(&["go", "rc", "up", "cw", "flip", "speed", "sysid", "autotune", "roll", "chirp", "l", "m1", "?"][..]).prop_map(str::to_owned),
        (-600i32..600).prop_map(|number| number.to_string()),
        "[ -~]{0,6}",
    ], 0..8)) {
        if let Ok(TelloCommand::Go { offset, speed }) = parse(&words.join(" ")) {
            prop_assert!(offset.amax() <= 5.0 && (0.1..=1.0).contains(&speed));
        }
    }
}
