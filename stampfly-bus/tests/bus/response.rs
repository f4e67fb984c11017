//! Response times beside a cooperative executor that is tried out: random tables, random phases, late samples.

use proptest::prelude::*;
use stampfly_bus::{ActivationInfo, Band, JITTER, TopicInfo, Trigger, Unbounded, response_time};
use stampfly_types::Duration;

const LINES: usize = 6;
type Table = [ActivationInfo; LINES];

const fn line(band: Band, trigger: Trigger, budget: u64) -> ActivationInfo {
    ActivationInfo { name: "line", doc: &[], trigger, at_latest: None, band, budget: Duration::from_micros(budget) }
}

const fn every(period: u64) -> Trigger {
    Trigger::Every(Duration::from_micros(period))
}

const fn topic(period: Option<u64>) -> TopicInfo {
    TopicInfo {
        name: "topic",
        doc: &[],
        message: "",
        policy: "latest",
        depth: 8,
        rate: "",
        period: match period {
            Some(period) => Some(Duration::from_micros(period)),
            None => None,
        },
        publisher: "",
        is_outside: true,
        readers: &[],
        words: 0,
        fields: &[],
    }
}

/// A vehicle like the StampFly: a chain on a sample, a deadline of silence in it, and a slow background.
fn vehicle() -> Table {
    let mut table = [
        line(Band::Flight, Trigger::On(&[0]), 300),
        line(Band::Flight, Trigger::After(0), 100),
        line(Band::Flight, Trigger::After(1), 200),
        line(Band::Background, every(20_000), 40),
        line(Band::Background, every(20_000), 30),
        line(Band::Background, every(30_000), 70),
    ];
    table[1].at_latest = Some(Duration::from_micros(5_000));
    table
}

fn responses(table: &Table, topics: &[TopicInfo]) -> [Result<u64, Unbounded>; LINES] {
    std::array::from_fn(|index| response_time(table, topics, index).map(|time| time.as_micros()))
}

#[test]
fn the_bounds_are_those_worked_out_by_hand() {
    // 70 µs of background have just begun, silence has just ended (the second and third line), then its own pass.
    let expected = [
        70 + 300 + 300,
        70 + 300 + 400,
        70 + 300 + 600,
        // A background activation of its own band, then everything that flies, twice where silence ends, then itself.
        70 + 600 + 300 + 40,
        70 + 600 + 300 + 40 + 30,
        70 + 600 + 300 + 40 + 30 + 70,
    ];
    assert_eq!(responses(&vehicle(), &[topic(Some(2_500))]), expected.map(Ok));
}

#[test]
fn too_much_is_refused_and_so_is_a_topic_without_a_rate() {
    let mut table = vehicle();
    table[2].budget = Duration::from_micros(1_000);
    // 70 + 300 + 2·100 + 2·1000 µs, within 2500 µs less a tenth? No.
    assert_eq!(responses(&table, &[topic(Some(2_500))])[2], Err(Unbounded::TooLate));
    assert_eq!(responses(&vehicle(), &[topic(None)]), [Err(Unbounded::NoRate); LINES]);
}

/// What the cooperative executor does in `length` µs: the longest response of each line. `phases` are the first triggers,
/// `late` what each of a topic's samples is late by, as a share of its jitter.
fn try_out(table: &Table, period: u64, phases: &[u64; LINES], late: &[f64], length: u64) -> [u64; LINES] {
    /// When a line was triggered; `None` while it is not.
    type Pending = [Option<u64>; LINES];
    let mut triggers: Vec<(u64, usize)> = Vec::new();
    for (index, info) in table.iter().enumerate() {
        let (period, jitter) = match info.trigger {
            Trigger::Every(period) => (period.as_micros(), 0.0),
            Trigger::On(_) => (period, (period / JITTER) as f64),
            _ => continue,
        };
        let mut shares = late.iter().cycle();
        for tick in (phases[index] + period..length).step_by(period as usize) {
            let share = shares.next().copied().unwrap_or_default();
            triggers.push(((tick as f64 + share * jitter) as u64, index));
        }
    }
    triggers.sort_unstable();
    let mut triggers = triggers.into_iter().peekable();
    let (mut clock, mut pending, mut longest): (u64, Pending, _) = (0, [None; LINES], [0; LINES]);
    let run = |index: usize, clock: &mut u64, pending: &mut Pending, longest: &mut [u64; LINES]| {
        let since = pending[index].take().expect("is pending");
        *clock += table[index].budget.as_micros();
        longest[index] = longest[index].max(*clock - since);
        for (after, info) in table.iter().enumerate() {
            if info.trigger == Trigger::After(index) {
                pending[after] = Some(since);
            }
        }
    };
    loop {
        let mut arrive = |clock: u64, pending: &mut Pending| {
            while let Some((at, index)) = triggers.next_if(|(at, _)| *at <= clock) {
                pending[index].get_or_insert(at);
            }
        };
        arrive(clock, &mut pending);
        let mut flew = false;
        for index in (0..LINES).filter(|index| table[*index].band == Band::Flight) {
            if pending[index].is_some() {
                run(index, &mut clock, &mut pending, &mut longest);
                arrive(clock, &mut pending);
                flew = true;
            }
        }
        if flew {
            continue;
        }
        match (0..LINES).find(|index| pending[*index].is_some()) {
            Some(index) => run(index, &mut clock, &mut pending, &mut longest),
            None => match triggers.peek() {
                Some((next, _)) => clock = *next,
                None => return longest,
            },
        }
    }
}

proptest! {
    #[test]
    fn nothing_ever_takes_longer(
        budgets in prop::array::uniform6(10u64..400),
        periods in prop::array::uniform6(8u64..60),
        phases in prop::array::uniform6(0u64..6_000),
        late in prop::collection::vec(0.0..1.0f64, 1..40),
    ) {
        // Two chains that fly, one on a topic and one on a clock, and a background of two.
        let period = periods[0] * 300;
        let table = [
            line(Band::Flight, Trigger::On(&[0]), budgets[0]),
            line(Band::Flight, Trigger::After(0), budgets[1]),
            line(Band::Flight, every(periods[2] * 300), budgets[2]),
            line(Band::Flight, Trigger::After(1), budgets[3]),
            line(Band::Background, every(periods[4] * 500), budgets[4]),
            line(Band::Background, every(periods[5] * 500), budgets[5]),
        ];
        let bounds = responses(&table, &[topic(Some(period))]);
        prop_assume!(bounds.iter().all(Result::is_ok));
        let longest = try_out(&table, period, &phases, &late, 400_000);
        for (index, (bound, longest)) in bounds.iter().zip(longest).enumerate() {
            prop_assert!(bound.is_ok_and(|bound| longest <= bound), "line {}: {} > {:?}", index, longest, bound);
        }
        // The bound is not idle either: within a factor of a few of what happens by chance.
        prop_assert!(bounds[3].is_ok_and(|bound| bound <= 8 * longest[3] + 2_000));
    }
}
