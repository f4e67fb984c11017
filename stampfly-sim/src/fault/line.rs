//! Path of one kind of sample to the bus, with the faults that can act on it.

use super::{Distortion, Effect, Injector};
use crate::noise::Noise;
use core::marker::PhantomData;
use stampfly_types::{FieldInfo, FieldKind, Instant, Message};

/// First random number stream of lines.
const STREAM: u64 = 1_300;

struct Acting {
    /// Index of its fault in the injector.
    place: usize,
    effect: Effect,
    /// Remaining samples to affect.
    left: Option<u32>,
    /// Indices of the affected words.
    words: Vec<usize>,
    noise: Noise,
}

/// Applies distortions to samples of one kind on their way to the bus. Without active faults
/// samples pass unchanged.
///
/// ```
/// use stampfly_sim::fault::{Class, Distortion, Effect, Fault, FaultKind, Injector, Line};
/// use stampfly_types::{Instant, messages::TofData};
/// const TABLE: &[FaultKind] = &[FaultKind::plain("tof-bias", Class::Degraded, "The range is 0.3 m too long.")];
/// let injector = Injector::new(Instant::ZERO, &[Fault::parse("tof-bias@2", TABLE)?]);
/// let mut line = Line::new(&injector, &[(0, Distortion::of(&["distance"], Effect::Add(0.3)))], 1);
/// let range = TofData { distance: 0.5, valid: true, ..Default::default() };
/// assert_eq!(line.pass(Instant::from_secs(1), &range), Some(range));
/// assert_eq!(line.pass(Instant::from_secs(2), &range).unwrap().distance, 0.8);
/// assert_eq!(injector.changes(0), 1);
/// # Ok::<(), stampfly_sim::fault::FaultError>(())
/// ```
pub struct Line<M: Message> {
    injector: Injector,
    acting: Vec<Acting>,
    /// The last sample unaffected by faults.
    healthy: Option<M::Words>,
    message: PhantomData<M>,
}

impl<M: Message> Line<M> {
    /// A line with these distortions, each with the index of its fault in the injector. `seed`
    /// feeds the random effects.
    ///
    /// # Panics
    /// If a distortion names a field that the message does not have.
    #[must_use]
    pub fn new(injector: &Injector, distortions: &[(usize, Distortion)], seed: u64) -> Self {
        let acting = distortions.iter().enumerate().map(|(number, (place, distortion))| Acting {
            place: *place,
            effect: distortion.effect,
            left: distortion.samples,
            words: words_of::<M>(distortion),
            // A stream per fault and distortion: adding a fault changes no other fault's draws.
            noise: Noise::new(seed, STREAM + 100 * *place as u64 + number as u64),
        });
        Self { injector: injector.clone(), acting: acting.collect(), healthy: None, message: PhantomData }
    }

    /// A line without distortions.
    #[must_use]
    pub fn clear() -> Self {
        Self::new(&Injector::new(Instant::ZERO, &[]), &[], 0)
    }

    /// The sample as it arrives; `None` if it is lost.
    pub fn pass(&mut self, at: Instant, message: &M) -> Option<M> {
        if self.acting.is_empty() {
            return Some(*message);
        }
        let original = message.to_words();
        let mut words = original;
        let mut touched = false;
        for acting in &mut self.acting {
            if !self.injector.is_active(acting.place, at) || acting.left == Some(0) {
                continue;
            }
            // An active fault counts even if it has not changed this sample, so that `Stuck` keeps
            // the value from before the fault.
            touched = true;
            acting.left = acting.left.map(|left| left - 1);
            let before = words;
            let since = self.injector.begins(acting.place).map_or(0.0, |begun| at.since(begun).seconds_f64());
            let arrives = acting.act(words.as_mut(), self.healthy.as_ref().map(AsRef::as_ref), since);
            if !arrives || before.as_ref() != words.as_ref() {
                self.injector.note_change(acting.place);
            }
            if !arrives {
                return None;
            }
        }
        // A value that sticks from the first sample on sticks at that sample.
        if !touched || self.healthy.is_none() {
            self.healthy = Some(original);
        }
        // Words that are not a valid message any more could not have come from a driver: the sample
        // is lost.
        M::from_words(&words)
    }
}

impl Acting {
    /// Changes the words; `false` if the sample is lost.
    fn act(&mut self, words: &mut [u32], healthy: Option<&[u32]>, since: f64) -> bool {
        let Self { effect, words: places, noise, .. } = self;
        let mut each = |change: &mut dyn FnMut(f32) -> f32| {
            for place in places.iter() {
                words[*place] = change(f32::from_bits(words[*place])).to_bits();
            }
        };
        match *effect {
            Effect::Silent => return false,
            Effect::Gaps { off, on } => return since % (off + on) >= off,
            Effect::Stuck => {
                if let Some(healthy) = healthy {
                    places.iter().for_each(|place| words[*place] = healthy[*place]);
                }
            }
            Effect::Set(value) => each(&mut |_| value),
            Effect::Word(value) => places.iter().for_each(|place| words[*place] = value),
            Effect::Add(value) => each(&mut |number| number + value),
            Effect::Scale(factor) => each(&mut |number| number * factor),
            Effect::Wrap(period) => each(&mut |number| number % period),
            Effect::Outliers { share, value } => {
                if noise.chance(share) {
                    each(&mut |_| value);
                }
            }
            Effect::Spikes { share, size } => each(&mut |number| {
                let (hit, sign) = (noise.chance(share), if noise.chance(0.5) { 1.0 } else { -1.0 });
                if hit { number + sign * size } else { number }
            }),
            Effect::Swap => {
                let half = places.len() / 2;
                (0..half).for_each(|index| words.swap(places[index], places[half + index]));
            }
        }
        true
    }
}

/// Indices of the words that a distortion changes. On a whole message only `f32` fields are changed
/// numerically.
fn words_of<M: Message>(distortion: &Distortion) -> Vec<usize> {
    if distortion.fields.is_empty() {
        let any = matches!(distortion.effect, Effect::Stuck | Effect::Silent);
        let fields = starts(M::FIELDS).filter(|(_, field)| any || field.kind == FieldKind::F32);
        return fields.flat_map(|(start, field)| start..start + field.words).collect();
    }
    let named = distortion.fields.iter().flat_map(|text| {
        let (name, index) = match text.strip_suffix(']').and_then(|text| text.split_once('[')) {
            Some((name, index)) => (name, index.parse::<usize>().ok()),
            None => (*text, None),
        };
        let found = starts(M::FIELDS).find(|(_, field)| field.name == name);
        let (start, field) = found.unwrap_or_else(|| panic!("{} has no field {name}", M::NAME));
        match index {
            Some(index) => start + index..start + index + 1,
            None => start..start + field.words,
        }
    });
    named.collect()
}

/// Each field with the index of its first word.
fn starts(fields: &'static [FieldInfo]) -> impl Iterator<Item = (usize, &'static FieldInfo)> {
    fields.iter().scan(0, |next, field| {
        let start = *next;
        *next += field.words;
        Some((start, field))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fault::{Class, Fault, FaultKind};
    use stampfly_types::messages::{FlowData, ImuData};
    use stampfly_types::{Duration, Vec3};

    const TABLE: &[FaultKind] = &[FaultKind::plain("x", Class::Cut, "Something.")];

    fn line<M: Message>(distortion: Distortion) -> (Injector, Line<M>) {
        let fault = Fault::parse("x@1+1", TABLE).expect("a fault");
        let injector = Injector::new(Instant::ZERO, &[fault]);
        let line = Line::new(&injector, &[(0, distortion)], 7);
        (injector, line)
    }

    fn imu(number: f32) -> ImuData {
        ImuData {
            accel: Vec3::new(number, 2.0, 3.0),
            gyro: Vec3::new(4.0, 5.0, number),
            temperature: 25.0,
            ..Default::default()
        }
    }

    /// Samples before, during and after a fault of one second.
    fn passed(distortion: Distortion) -> [Option<ImuData>; 3] {
        let (injector, mut line) = line(distortion);
        let out = [0, 1, 2].map(|second| line.pass(Instant::from_secs(second), &imu(second as f32)));
        assert_eq!(injector.changes(0), 1, "only the one during the fault is changed");
        assert_eq!([out[0], out[2]], [Some(imu(0.0)), Some(imu(2.0))]);
        out
    }

    #[test]
    fn each_effect_changes_what_it_says_and_nothing_else() {
        let gyro_z = |effect| passed(Distortion::of(&["gyro[2]"], effect))[1].expect("it arrives").gyro;
        assert_eq!(gyro_z(Effect::Set(9.0)), Vec3::new(4.0, 5.0, 9.0));
        assert_eq!(gyro_z(Effect::Add(0.5)), Vec3::new(4.0, 5.0, 1.5));
        assert_eq!(gyro_z(Effect::Scale(-2.0)), Vec3::new(4.0, 5.0, -2.0));
        assert_eq!(gyro_z(Effect::Wrap(0.75)), Vec3::new(4.0, 5.0, 0.25));
        assert_eq!(gyro_z(Effect::Stuck), Vec3::new(4.0, 5.0, 0.0));
        assert_eq!(gyro_z(Effect::Outliers { share: 1.0, value: 7.0 }), Vec3::new(4.0, 5.0, 7.0));
        assert_eq!((gyro_z(Effect::Spikes { share: 1.0, size: 2.0 }).z - 1.0).abs(), 2.0);
        let swapped = passed(Distortion::of(&["accel", "gyro"], Effect::Swap))[1].expect("it arrives");
        assert_eq!((swapped.accel, swapped.gyro), (imu(1.0).gyro, imu(1.0).accel));
        assert_eq!(passed(Distortion::SILENT)[1], None);
        let lost = passed(Distortion::whole(Effect::Set(f32::NAN)))[1].expect("it arrives");
        assert!(lost.accel.iter().chain(lost.gyro.iter()).all(|number| number.is_nan()) && lost.temperature.is_nan());
    }

    #[test]
    fn a_burst_ends_by_itself_and_gaps_come_again() {
        let at = |milliseconds| Instant::from_secs(1) + Duration::from_millis(milliseconds);
        let (_, mut burst) = line::<FlowData>(Distortion::of(&["quality"], Effect::Word(3)).for_samples(2));
        let burst = [0, 10, 20].map(|time| burst.pass(at(time), &FlowData::default()).map(|flow| flow.quality));
        assert_eq!(burst, [Some(3), Some(3), Some(0)]);
        let (_, mut gaps) = line::<FlowData>(Distortion::whole(Effect::Gaps { off: 0.2, on: 0.1 }));
        let gaps = [0, 150, 250, 350, 550].map(|time| gaps.pass(at(time), &FlowData::default()).is_some());
        assert_eq!(gaps, [false, false, true, false, true]);
    }

    #[test]
    fn a_value_that_sticks_from_the_first_sample_on_is_that_one() {
        let (_, mut line) = line(Distortion::whole(Effect::Stuck));
        assert_eq!(line.pass(Instant::from_secs(1), &imu(1.0)), Some(imu(1.0)));
        let later = Instant::from_secs(1) + Duration::from_millis(500);
        assert_eq!(line.pass(later, &imu(2.0)), Some(imu(1.0)));
    }

    #[test]
    #[should_panic(expected = "FlowData has no field distance")]
    fn a_field_that_is_not_there_is_named() {
        line::<FlowData>(Distortion::of(&["distance"], Effect::Set(0.0)));
    }
}
