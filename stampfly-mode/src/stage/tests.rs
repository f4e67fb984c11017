//! A vehicle of two modes with three stages each that do whatever a script says, and a journal of what was called.

use super::*;
use crate::stages;
use core::cell::RefCell;
use core::convert::Infallible;
use proptest::prelude::*;
use std::string::ToString;
use std::vec::Vec;

/// What was called, on what. A mode has no stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Call {
    Enter,
    Execute,
    Exit,
}

/// One line of the journal: mode 0 or 1, stage 0 to 2 of it.
type Line = (Call, usize, Option<usize>);

/// What the script lets a stage do when it is executed.
#[derive(Clone, Copy, Debug)]
enum Act {
    Stay,
    To(usize),
    End,
    Fail,
}

/// What somebody outside does before a cycle.
#[derive(Clone, Copy, Debug)]
enum Outside {
    Nothing,
    Switch(usize),
    Abort,
}

/// One cycle's input: the acts of the stages executed in it, in order, and the journal.
struct World<'a> {
    acts: RefCell<Vec<Act>>,
    journal: &'a RefCell<Vec<Line>>,
}

impl World<'_> {
    fn write(&self, call: Call, mode: usize, stage: Option<usize>) {
        self.journal.borrow_mut().push((call, mode, stage));
    }
}

/// A vehicle that answers with the mode and the stage that answered.
struct Puppet;

impl Vehicle for Puppet {
    type Input<'a> = World<'a>;
    type Output = (usize, usize);
}

/// The mode with this number.
#[derive(Clone, Debug, PartialEq)]
struct Part<const MODE: usize> {
    /// Stages entered in this visit.
    entered: usize,
}

/// The stage with this number.
#[derive(Clone, Debug, PartialEq)]
struct Scene<const STAGE: usize> {
    executed: usize,
}

/// The limit of the last stage of every mode.
const LIMIT: Duration = Duration::from_millis(50);

macro_rules! part {
    ($mode:literal, $Names:ident, $Memory:ident) => {
        stages! {
            /// Three stages.
            enum $Names for Part<$mode> { Zero: Scene<0>, One: Scene<1>, Two: Scene<2> }
            enum $Memory;
        }

        impl Mode for Part<$mode> {
            type Vehicle = Puppet;
            type Stage = $Names;
            type End = usize;
            const FIRST: $Names = $Names::Zero;

            fn enter(_: Instant, world: &World<'_>) -> Self {
                world.write(Call::Enter, $mode, None);
                Self { entered: 0 }
            }

            fn exit(&mut self, _: Instant, world: &World<'_>) {
                world.write(Call::Exit, $mode, None);
            }
        }

        impl<const STAGE: usize> Stage<Part<$mode>> for Scene<STAGE> {
            fn enter(part: &mut Part<$mode>, _: Instant, world: &World<'_>) -> Self {
                world.write(Call::Enter, $mode, Some(STAGE));
                part.entered += 1;
                Self { executed: 0 }
            }

            fn limit(&self, _: &Part<$mode>) -> Limit<Part<$mode>> {
                match STAGE {
                    1 => Limit::Stage(LIMIT, $Names::Two),
                    2 => Limit::End(LIMIT, 1 - $mode),
                    _ => Limit::Unlimited("a test"),
                }
            }

            fn execute(&mut self, _: &mut Part<$mode>, _: Instant, world: &World<'_>) -> Step<Part<$mode>> {
                world.write(Call::Execute, $mode, Some(STAGE));
                self.executed += 1;
                match world.acts.borrow_mut().pop().unwrap_or(Act::Stay) {
                    Act::Stay => Step::Stay(($mode, STAGE)),
                    Act::To(0) => Step::Stage($Names::Zero),
                    Act::To(1) => Step::Stage($Names::One),
                    Act::To(_) => Step::Stage($Names::Two),
                    Act::End => Step::End(1 - $mode),
                    Act::Fail => Step::Fail(Failure::Stage),
                }
            }

            fn exit(&mut self, _: &mut Part<$mode>, _: Instant, world: &World<'_>) {
                world.write(Call::Exit, $mode, Some(STAGE));
            }
        }

        impl HandOver<Part<$mode>> for Play {
            fn after(&mut self, next: usize) -> PlayMode {
                PLAY[next]
            }
        }
    };
}

part!(0, FirstStage, FirstMemory);
part!(1, SecondStage, SecondMemory);

/// The vehicle.
#[derive(Clone, Debug, PartialEq)]
struct Play;

impl Mode for Play {
    type Vehicle = Puppet;
    type Stage = PlayMode;
    type End = Infallible;
    const FIRST: PlayMode = PlayMode::First;

    fn enter(_: Instant, _: &World<'_>) -> Self {
        Self
    }
}

stages! {
    enum PlayMode for Play { First: Active<Part<0>>, Second: Active<Part<1>> }
    enum PlayMemory;
}

const PLAY: [PlayMode; 2] = [PlayMode::First, PlayMode::Second];

/// Checks the journal as it is written.
#[derive(Default)]
struct Reader {
    mode: Option<usize>,
    stage: Option<usize>,
}

impl Reader {
    fn read(&mut self, (call, mode, stage): Line) {
        match (call, stage) {
            (Call::Enter, None) => {
                assert_eq!((self.mode, self.stage), (None, None), "a mode is entered when the last one has been left");
                self.mode = Some(mode);
            }
            (Call::Enter, Some(_)) => {
                assert_eq!(
                    (self.mode, self.stage),
                    (Some(mode), None),
                    "a stage is entered in its mode, after the last"
                );
                self.stage = stage;
            }
            (Call::Execute, _) => assert_eq!((self.mode, self.stage), (Some(mode), stage), "only what was entered"),
            (Call::Exit, Some(_)) => {
                assert_eq!((self.mode, self.stage), (Some(mode), stage), "left once, by what was entered");
                self.stage = None;
            }
            (Call::Exit, None) => {
                assert_eq!((self.mode, self.stage), (Some(mode), None), "a mode is left after its stage");
                self.mode = None;
            }
        }
    }
}

fn act() -> impl Strategy<Value = Act> {
    prop_oneof![5 => Just(Act::Stay), 4 => (0usize..3).prop_map(Act::To), 2 => Just(Act::End), 1 => Just(Act::Fail)]
}

fn outside() -> impl Strategy<Value = Outside> {
    prop_oneof![8 => Just(Outside::Nothing), 1 => (0usize..2).prop_map(Outside::Switch), 1 => Just(Outside::Abort)]
}

proptest! {
    /// Entered once before the first cycle and left once after the last one, mode around stage, whatever happens. The demand
    /// is the current stage's, made in this cycle.
    #[test]
    fn entered_once_and_left_once(
        cycles in prop::collection::vec((outside(), prop::collection::vec(act(), 0..12), 0u64..40), 1..60)
    ) {
        let journal = RefCell::new(Vec::new());
        let (mut selector, mut reader) = (Selector::<Play>::new(), Reader::default());
        let mut now = Instant::ZERO;
        for (outside, acts, wait) in cycles {
            now += Duration::from_millis(wait);
            let world = World { acts: RefCell::new(acts), journal: &journal };
            match outside {
                Outside::Nothing => {}
                Outside::Switch(mode) => selector.switch(PLAY[mode], now, &world),
                Outside::Abort => selector.abort(now, &world),
            }
            let outcome = selector.execute(now, &world);
            let lines = journal.take();
            let executed = lines.iter().rev().find_map(|line| match line {
                (Call::Execute, mode, Some(stage)) => Some((*mode, *stage)),
                _ => None,
            });
            lines.into_iter().for_each(|line| reader.read(line));
            let active = selector.active().expect("it runs");
            prop_assert_eq!(active.stage(), PLAY[reader.mode.expect("a mode")]);
            match outcome {
                Ok(answer) => {
                    prop_assert_eq!(Some(answer), executed);
                    prop_assert_eq!(Some(answer), reader.mode.zip(reader.stage));
                    prop_assert_eq!((selector.cycle(), selector.is_error()), (Cycle::Completed, false));
                }
                Err(failure) => {
                    prop_assert_eq!((selector.cycle(), selector.is_error()), (Cycle::Failed(failure), true));
                }
            }
        }
        selector.abort(now, &World { acts: RefCell::default(), journal: &journal });
        journal.take().into_iter().for_each(|line| reader.read(line));
        prop_assert_eq!((reader.mode, reader.stage), (None, None));
    }
}

/// Runs cycles with one act each, 10 ms apart, and says where the vehicle is after each.
fn places(acts: &[Act]) -> Vec<std::string::String> {
    let (journal, mut selector) = (RefCell::default(), Selector::<Play>::new());
    let mut place = |(k, act): (usize, &Act)| {
        let world = World { acts: RefCell::new(std::vec![*act]), journal: &journal };
        let _ = selector.execute(Instant::from_millis(10 * k as u64), &world);
        selector.to_string()
    };
    acts.iter().enumerate().map(&mut place).collect()
}

#[test]
fn a_second_visit_begins_as_the_first_did() {
    let places = places(&[Act::Stay, Act::To(2), Act::End, Act::To(1), Act::End, Act::Stay]);
    assert_eq!(places, ["First/Zero", "First/Two", "Second/Zero", "Second/One", "First/Zero", "First/Zero"]);
}

#[test]
fn a_stage_ends_by_itself_when_its_time_is_over() {
    let mut acts = std::vec![Act::To(1)];
    acts.extend([Act::Stay; 10]);
    let places = places(&acts);
    assert_eq!((&*places[4], &*places[5], &*places[9]), ("First/One", "First/Two", "First/Two"));
    assert_eq!(places[10], "Second/Zero", "a mode, too");
}

#[test]
fn a_circle_is_a_failure_and_not_the_end() {
    let journal = RefCell::default();
    let chain = |changes| World {
        acts: RefCell::new([Act::Stay].into_iter().chain([Act::To(1)].repeat(changes)).collect()),
        journal: &journal,
    };
    assert_eq!(Selector::<Play>::new().execute(Instant::ZERO, &chain(8)), Ok((0, 1)));
    assert_eq!(Selector::<Play>::new().execute(Instant::ZERO, &chain(9)), Err(Failure::Circle));
    let circle = World { acts: RefCell::new([Act::To(0), Act::To(1)].repeat(20)), journal: &journal };
    let mut selector = Selector::<Play>::new();
    assert_eq!(selector.execute(Instant::ZERO, &circle), Err(Failure::Circle));
    let quiet = World { acts: RefCell::default(), journal: &journal };
    assert!(selector.execute(Instant::ZERO, &quiet).is_ok() && !selector.is_error());
    // From mode to mode, as well.
    let circle = World { acts: RefCell::new(std::vec![Act::End; 40]), journal: &journal };
    assert_eq!(selector.execute(Instant::ZERO, &circle), Err(Failure::Circle));
}

#[test]
fn selectors_compare_by_mode_stage_and_memory() {
    let journal = RefCell::default();
    let quiet = World { acts: RefCell::default(), journal: &journal };
    let mut one = Selector::<Play>::new();
    assert_eq!((one.mode(), one.cycle(), &*one.to_string()), (None, Cycle::None, "-"));
    let _ = one.execute(Instant::ZERO, &quiet);
    let mut other = one.clone();
    assert_eq!(one, other);
    let _ = other.execute(Instant::ZERO, &quiet);
    assert_ne!(one, other, "executed twice");
    assert_eq!(one.mode(), other.mode());
    let Some(PlayMemory::First(first)) = one.active().map(Active::memory) else { panic!("{one}") };
    assert_eq!((first.stage(), first.mode().entered, first.since()), (FirstStage::Zero, 1, Instant::ZERO));
    other.switch(PlayMode::Second, Instant::ZERO, &quiet);
    assert_ne!(one.mode(), other.mode());
}

#[test]
fn failures_are_told_in_words() {
    assert_eq!(Failure::Stage.to_string(), "a stage cannot do its work");
    assert_eq!(Failure::Circle.to_string(), "stages hand over in a circle");
}
