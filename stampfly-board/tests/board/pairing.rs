//! Button, mode machine, radio and arm switch together, as the firmware joins them: a vehicle changes its transmitter.

use crate::bench::{Bench, NEW, OLD, VEHICLE};
use stampfly_board::console::Command;
use stampfly_board::link::Outgoing;
use stampfly_board::topics::{self, Id};
use stampfly_link::secure::NotTaken;
use stampfly_link::{Address, PairingPacket, Rejected, TelemetryPacket};
use stampfly_types::messages::{Alerts, ArmBlocks, GuidedKind, SystemAlert};

#[test]
fn a_vehicle_changes_its_transmitter() {
    let mut bus = topics::Bus::new();
    let mut bench = Bench::new(&mut bus, Some(OLD));
    assert_eq!(bench.pass(6_000, false, &[(OLD, false)]), Some(Ok(())));
    assert_eq!(bench.blocks(), ArmBlocks::NONE, "calibrated and ready");

    // Three seconds on the button, with the old transmitter still on.
    bench.pass(3_500, true, &[(OLD, false)]);
    assert!(bench.link.guarded.session().is_pairing() && bench.blocks().contains(ArmBlocks::PAIRING));
    assert_eq!(
        bench.pass(1_000, false, &[(OLD, true)]),
        Some(Err(NotTaken::Unauthenticated(Rejected::Stranger))),
        "not heard any more"
    );
    assert!(!bench.armed(), "nor obeyed");

    // The new one comes with its arm switch on, and has to switch it off first.
    assert_eq!(
        bench.pass(500, false, &[(OLD, false), (NEW, true)]),
        Some(Err(NotTaken::Unauthenticated(Rejected::ArmSwitch)))
    );
    assert_eq!(bench.pass(500, false, &[(OLD, false), (NEW, false)]), Some(Ok(())));
    assert_eq!(bench.link.guarded.session().peer(), Some(NEW));
    assert!(!bench.link.guarded.session().is_pairing());
    assert_eq!(bench.blocks(), ArmBlocks::NONE, "pairing is over, without another touch of the button");

    bench.pass(200, false, &[(OLD, true), (NEW, false)]);
    assert!(!bench.armed(), "the old transmitter's switch does nothing");
    bench.pass(200, false, &[(OLD, false), (NEW, true)]);
    assert!(bench.armed(), "the new one's does");

    // A hand on the button stops the motors within a moment, and this touch does nothing else, however long it is.
    bench.pass(100, true, &[(NEW, true)]);
    assert!(!bench.armed());
    bench.pass(3_500, true, &[(NEW, true)]);
    assert!(!bench.link.guarded.session().is_pairing() && bench.link.guarded.session().peer() == Some(NEW));
    bench.pass(1_000, false, &[(NEW, true)]);
    assert!(!bench.armed());
}

#[test]
fn a_vehicle_that_never_had_a_transmitter_takes_none_while_a_program_flies_it() {
    let mut bus = topics::Bus::new();
    let mut bench = Bench::new(&mut bus, None);
    bench.program = true;
    bench.pass(6_000, false, &[]);
    assert_eq!(bench.blocks(), ArmBlocks::NONE);
    bench.command(GuidedKind::Arm);
    bench.pass(100, false, &[]);
    assert!(bench.armed());
    assert_eq!(bench.pass(2_000, false, &[(NEW, false)]), Some(Err(NotTaken::Unauthenticated(Rejected::Stranger))));
    assert!(bench.armed() && bench.link.guarded.session().peer().is_none());
    bench.command(GuidedKind::Disarm);
    bench.pass(100, false, &[(NEW, false)]);
    assert_eq!((bench.armed(), bench.link.guarded.session().peer()), (false, Some(NEW)), "on the ground it does");
}

#[test]
fn at_the_console_pairing_is_asked_for_and_called_off() {
    let mut bus = topics::Bus::new();
    let mut bench = Bench::new(&mut bus, Some(OLD));
    bench.program = true;
    bench.pass(6_000, false, &[(OLD, false)]);
    bench.console(Command::Pair(true));
    bench.pass(100, false, &[(OLD, false)]);
    assert!(bench.link.guarded.session().is_pairing());
    bench.command(GuidedKind::Arm);
    bench.pass(100, false, &[]);
    assert_eq!((bench.armed(), bench.blocks()), (false, ArmBlocks::PAIRING), "no program arms a vehicle that looks");
    bench.console(Command::Pair(false));
    assert_eq!(bench.pass(500, false, &[(OLD, false)]), Some(Ok(())));
    assert_eq!((bench.blocks(), bench.link.guarded.session().peer()), (ArmBlocks::NONE, Some(OLD)));

    // In flight it keeps its transmitter, whatever is asked at the console, and does not look for one after landing.
    bench.command(GuidedKind::Arm);
    bench.pass(100, false, &[(OLD, false)]);
    bench.console(Command::Pair(true));
    assert_eq!(bench.pass(500, false, &[(NEW, false), (OLD, false)]), Some(Ok(())));
    assert!(bench.armed());
    bench.command(GuidedKind::Disarm);
    bench.pass(100, false, &[(OLD, false)]);
    assert!(!bench.armed() && !bench.link.guarded.session().is_pairing());
}

#[test]
fn d16_pairing_ends_though_the_new_transmitter_talks_all_the_while() {
    for old in [None, Some(OLD)] {
        let mut bus = topics::Bus::new();
        let mut bench = Bench::new(&mut bus, old);
        let before: &[_] = &[(OLD, false), (NEW, false)];
        bench.pass(6_000, false, &before[..usize::from(old.is_some())]);
        // The new one is on while the button is still held: the session pairs with its next frame.
        bench.pass(3_500, true, before);
        bench.pass(500, false, before);
        assert_eq!((bench.link.guarded.session().is_pairing(), bench.blocks()), (false, ArmBlocks::NONE));
    }
}

#[test]
fn d16_pairing_that_finds_no_transmitter_ends_and_says_so_until_then() {
    let mut bus = topics::Bus::new();
    let mut bench = Bench::new(&mut bus, Some(OLD));
    bench.pass(6_000, false, &[(OLD, false)]);
    bench.console(Command::Pair(true));
    bench.pass(59_000, false, &[(OLD, false)]);
    assert_eq!(bench.blocks(), ArmBlocks::PAIRING, "not NO_LINK: no other transmitter is to be heard");
    bench.pass(2_000, false, &[(OLD, false)]);
    assert_eq!(
        (bench.blocks(), bench.link.guarded.session().is_pairing()),
        (ArmBlocks::NONE, false),
        "the old one is back"
    );
}

#[test]
fn a_new_transmitter_is_published_once_and_gets_telemetry() {
    let mut bus = topics::Bus::new();
    let mut bench = Bench::new(&mut bus, None);
    bench.pass(1_000, false, &[]);
    let call = (0..30).find_map(|_| {
        bench.pass(20, false, &[]);
        // Half a second later the next call is due, and nothing else.
        bench.say(bench.now + stampfly_types::Duration::from_millis(500), Outgoing::Call)
    });
    assert_eq!(PairingPacket::decode(&call.expect("twice a second").1).map(|packet| packet.vehicle), Ok(VEHICLE));
    assert!(bench.ends.storage.link_peer.latest().is_none());

    bench.pass(1_000, false, &[(NEW, false)]);
    let published = bench.ends.storage.link_peer.latest().expect("paired");
    assert_eq!((Address::from(published.data), published.generation), (NEW, 1), "once, though it sends on");
    let call = bench.say(bench.now, Outgoing::Call);
    let (to, bytes) = bench.say(bench.now, Outgoing::Telemetry).expect("paired");
    let telemetry = TelemetryPacket::decode(&bytes).expect("a packet");
    assert_eq!((call, to), (None, NEW));
    assert!((telemetry.battery - 4.1).abs() < 0.01 && telemetry.calibrating, "{telemetry:?}");
}

#[test]
fn a_click_without_a_transmitter_does_nothing() {
    for peer in [None, Some(OLD)] {
        let mut bus = topics::Bus::new();
        let mut bench = Bench::new(&mut bus, peer);
        bench.pass(6_000, false, &[]);
        assert_eq!(bench.blocks(), ArmBlocks::NO_LINK);
        bench.pass(200, true, &[]);
        bench.pass(1_000, false, &[]);
        assert!(!bench.armed(), "never heard");
        bench.pass(1_000, false, &[(OLD, false)]);
        assert_eq!(bench.blocks(), ArmBlocks::NONE);
        bench.pass(1_000, false, &[]);
        bench.pass(200, true, &[]);
        bench.pass(1_000, false, &[]);
        assert_eq!((bench.armed(), bench.blocks()), (false, ArmBlocks::NO_LINK), "switched off again");
        bench.pass(200, true, &[(OLD, false)]);
        bench.pass(600, false, &[(OLD, false)]);
        assert!(bench.armed(), "heard");
    }
}

#[test]
fn a_silent_battery_monitor_refuses_arming() {
    let mut bus = topics::Bus::new();
    let mut bench = Bench::new(&mut bus, Some(OLD));
    bench.monitor = false;
    bench.pass(6_000, false, &[(OLD, false)]);
    bench.pass(200, false, &[(OLD, true)]);
    assert_eq!((bench.armed(), bench.blocks()), (false, ArmBlocks::SENSOR));
    assert_eq!(bench.newest::<SystemAlert>(Id::system_alert).active, Alerts::POWER_LOST);
    bench.monitor = true;
    bench.pass(200, false, &[(OLD, false)]);
    bench.pass(200, false, &[(OLD, true)]);
    assert!(bench.armed());
    bench.monitor = false;
    bench.pass(2_000, false, &[(OLD, true)]);
    assert!(bench.armed(), "it is no reason to stop");
}

#[test]
fn who_changes_his_mind_keeps_his_transmitter() {
    let mut bus = topics::Bus::new();
    let mut bench = Bench::new(&mut bus, Some(OLD));
    bench.pass(6_000, false, &[(OLD, false)]);
    bench.pass(3_500, true, &[(OLD, false)]);
    assert!(bench.link.guarded.session().is_pairing());
    bench.pass(300, false, &[(OLD, false)]);
    bench.pass(3_500, true, &[(OLD, false)]);
    assert!(!bench.link.guarded.session().is_pairing());
    assert_eq!(bench.pass(500, false, &[(OLD, false)]), Some(Ok(())));
    assert_eq!(bench.blocks(), ArmBlocks::NONE);
}
