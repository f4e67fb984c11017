//! A stranger's program: a name's number, and who may write.

use stampfly_param::{Disarmed, key};
use stampfly_types::messages::FlightStatus;

fn main() {
    assert_eq!(key("foobar"), 0xBF9C_F968);
    assert!(Disarmed::proven_by(&FlightStatus { armed: true, ..Default::default() }).is_none());
}
