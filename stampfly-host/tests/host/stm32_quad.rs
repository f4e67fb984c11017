//! The STM32 quadcopter as people meet it: flights and their logs, campaigns, and a serial line in real time.

use super::program::{Program, campaign_of_faults, folder, stampfly};
use super::thorough::thorough;
use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::time::Duration;

const QUAD: [&str; 3] = ["--vehicle", "stm32-quad", "--mission"];

#[test]
fn a_flight_is_replayed_bit_for_bit() {
    let folder = folder("stm32_quad", "flight");
    let all =
        [&["--pilot", "--mode", "acro", "--wind", "0,2"][..], &["--seed", "4", "--jitter", "2"], &["--seed", "3"]];
    for options in all.into_iter().take(thorough(2, 3)) {
        stampfly(&folder, &[&["fly"][..], &QUAD, &["0,0,1,2"], options].concat());
        assert!(stampfly(&folder, &["replay", "flight.ulg"]).contains("identical"), "{options:?}");
        assert!(stampfly(&folder, &["replay", "flight.ulg", "--from", "3"]).contains("identical"), "{options:?}");
        assert!(folder.join("flight.html").exists());
    }
}

/// The flights of its first cells: each of six faults at seven moments, in the small size at one.
#[test]
fn a_campaign_of_faults_judges_its_flights_and_repeats_them() {
    let folder = folder("stm32_quad", "faults");
    // A gyro that is off by 6 deg/s, or an accelerometer by 1 m/s², leans the vehicle when it
    // lands. Under a ceiling its pilot goes on climbing. A motor that cannot be switched off turns
    // it over on the ground.
    campaign_of_faults(&folder, "stm32-quad", thorough((6, 1), (42, 7)));
}

#[test]
fn campaigns_succeed() {
    let folder = folder("stm32_quad", "campaign");
    let printed = stampfly(&folder, &[&["campaign", "--flights", "6"][..], &QUAD, &["0,0,1,1"]].concat());
    assert!(printed.contains("6 of 6 flights succeeded"), "{printed}");
}

#[test]
fn a_configurator_reads_its_gains() {
    let folder = folder("stm32_quad", "serve");
    let (_program, place) = Program::serve(&folder, "msp=0", &["--vehicle", "stm32-quad", "--for", "20"]);
    let mut line = TcpStream::connect(place).expect("it listens");
    line.set_read_timeout(Some(Duration::from_secs(10))).expect("a time limit");
    // MSP_PID.
    line.write_all(b"$M<\x00\x70\x70").expect("it takes a question");
    let mut answer = [0; 5 + 30 + 1];
    line.read_exact(&mut answer).expect("it answers");
    assert_eq!(answer[..5], *b"$M>\x1E\x70");
    // 0.2, 0.02 and 0.002 about roll and pitch.
    assert_eq!(answer[5..11], [20; 6]);
}
