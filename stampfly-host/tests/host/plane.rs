//! The fixed-wing aircraft as people meet it: flights and their logs, and campaigns with faults.

use super::program::{campaign_of_faults, folder, stampfly};
use super::thorough::thorough;

const PLANE: [&str; 4] = ["--vehicle", "plane", "--mission", "hop"];

#[test]
fn a_flight_is_replayed_bit_for_bit() {
    let folder = folder("plane", "flight");
    let options = [
        &["--seed", "3"][..],
        &["--seed", "5", "--jitter", "7", "--fault", "pitot-blocked@move", "--fault", "gnss-lost@40+30"],
        &["--seed", "4", "--jitter", "2", "--wind", "0,3"],
    ];
    for options in options.into_iter().take(thorough(2, 3)) {
        stampfly(&folder, &[&["fly"][..], &PLANE, options].concat());
        assert!(stampfly(&folder, &["replay", "flight.ulg"]).contains("identical"), "{options:?}");
        assert!(stampfly(&folder, &["replay", "flight.ulg", "--from", "30"]).contains("identical"), "{options:?}");
        assert!(folder.join("flight.html").exists());
    }
}

/// The flights of its first cells: each of ten faults twice, in the small size once, the moments in turn.
#[test]
fn a_campaign_of_faults_judges_its_flights_and_repeats_them() {
    let folder = folder("plane", "faults");
    campaign_of_faults(&folder, "plane", thorough((10, 0), (20, 0)));
}

#[test]
fn campaigns_succeed() {
    let folder = folder("plane", "campaign");
    let flights = thorough("3", "6");
    let printed = stampfly(&folder, &[&["campaign", "--flights", flights][..], &PLANE].concat());
    assert!(printed.contains(&format!("{flights} of {flights} flights succeeded")), "{printed}");
}
