//! Changes by request: what waits, what is shown, and what happens without room.

use crate::set::{Crane, Hoist};
use stampfly_param::types::Instant;
use stampfly_param::{
    ParameterAction, ParameterError, ParameterRequest, ParameterSet, Parameters, RequestedParameters, parameters,
};

fn sent<const N: usize>(crane: &mut RequestedParameters<Crane, N>, room: usize) -> Vec<ParameterRequest> {
    let mut queue = Vec::new();
    crane.send(|request| {
        let has_room = queue.len() < room;
        if has_room {
            queue.push(request);
        }
        has_room
    });
    queue
}

#[test]
fn without_room_it_is_busy_and_the_value_stays() {
    let mut crane = RequestedParameters::<Crane, 1>::new(Crane::default());
    assert_eq!(parameters::set(&mut crane, "slew.rate", 0.9), Ok(2));
    assert_eq!(parameters::set(&mut crane, "hoist.fast", 0.7), Err(ParameterError::Busy));
    assert_eq!(crane.get(1), Some(0.5));
    assert_eq!(parameters::set(&mut crane, "slew.rate", 0.8), Ok(2), "it waits already");
    assert_eq!(sent(&mut crane, 9).iter().map(|request| request.value).collect::<Vec<_>>(), [0.8, 0.0]);
    assert_eq!(parameters::set(&mut crane, "hoist.fast", 0.7), Ok(1), "there is room again");
}

#[test]
fn a_refused_combination_requests_what_was_before() {
    let mut crane = RequestedParameters::<Crane, 1>::new(Crane::default());
    assert!(matches!(parameters::set(&mut crane, "hoist.slow", 0.9), Err(ParameterError::Conflict(_))));
    assert_eq!(*crane.values(), Crane::default());
    let mut vehicle = ParameterSet::<Crane>::default();
    let in_use = vehicle.period(Instant::from_millis(10), true, sent(&mut crane, 9)).expect("news").0;
    assert_eq!(in_use, Crane::default());
}

#[test]
fn requests_without_room_in_the_queue_follow_and_are_applied_together() {
    let mut crane = RequestedParameters::<Crane, 8>::new(Crane::default());
    let wanted = Crane { hoist: Hoist { slow: 0.3, fast: 0.4 }, ..Crane::default() };
    crane.set_all(&wanted).expect("in range, and there is room");
    let mut vehicle = ParameterSet::<Crane>::default();
    let first = sent(&mut crane, 1);
    assert_eq!(first.len(), 1);
    assert_eq!(vehicle.period(Instant::from_millis(10), true, first).expect("the first time").0, Crane::default());
    let rest = sent(&mut crane, 9);
    assert_eq!(
        rest.iter().map(|request| request.action).collect::<Vec<_>>(),
        [ParameterAction::Set, ParameterAction::Apply],
        "the rate was as wanted"
    );
    assert_eq!(vehicle.period(Instant::from_millis(20), true, rest).expect("news").0, wanted);
    assert_eq!(sent(&mut crane, 9), []);
}
