//! Spreads magnetometer and barometer updates over steps, to bound the execution time of a step.
//!
//! Aiding sensors are slower than the loop, and now and then all of them have a new sample in the
//! same step. Fusing all of them takes three times as long as usual, and the period of the loop has
//! to hold the longest step. A [`Pacer`] delays magnetometer and barometer until a step in which
//! nothing else is fused: at most 5 ms at the StampFly's rates. The filter then compares the
//! samples with the state at their own time, as it does with late samples. Range and flow are not
//! delayed, because they hold the position: with ranges 2.5 ms later, one of two thousand
//! fault-injection flights ended differently.
//!
//! Use it in a loop with a deadline. For replays, estimator comparisons and loops without a
//! deadline use [`feed`].

use crate::estimator::{Estimator, Fusion};
use crate::measurements::{Aiding, Measurements, feed};
use stampfly_types::messages::{BaroData, MagData};
use stampfly_types::{Instant, Stamped};

/// Feeds an estimator, with magnetometer and barometer updates in steps of their own.
///
/// Inertial samples, ranges, optical flow and external poses are passed on at once. A magnetometer
/// or barometer sample waits for a step without any other aiding, or until the next sample of its
/// own sensor arrives. No sample is dropped, and the samples of one sensor stay in order.
///
/// ```
/// use stampfly_eskf::{Aiding, Eskf, EskfConfig, Estimator, Measurements, Pacer};
/// use stampfly_types::{Instant, Stamped, messages::{BaroData, CalibrationResult, TofData}};
///
/// let mut estimator = Eskf::new(EskfConfig::default());
/// estimator.initialize(Instant::ZERO, &CalibrationResult::default());
/// let at = Instant::from_micros(2_000);
/// let tof = [Stamped { at, generation: 1, data: TofData::default() }];
/// let baro = [Stamped { at, generation: 1, data: BaroData::default() }];
///
/// let mut pacer = Pacer::default();
/// let mut told = Vec::new();
/// pacer.feed(&mut estimator, &Measurements { tof: &tof, baro: &baro, ..Default::default() }, |from, _, _| told.push(from));
/// assert_eq!(told, [Aiding::Tof]);
/// // In the next step there is time.
/// pacer.feed(&mut estimator, &Measurements::default(), |from, _, _| told.push(from));
/// assert_eq!(told, [Aiding::Tof, Aiding::Baro]);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pacer {
    mag: Option<Stamped<MagData>>,
    baro: Option<Stamped<BaroData>>,
}

impl Pacer {
    /// Feeds the samples since the last step. `fused` is called with the result of each measurement
    /// in the step in which it is fused.
    pub fn feed<E: Estimator + ?Sized>(
        &mut self,
        estimator: &mut E,
        measurements: &Measurements<'_>,
        mut fused: impl FnMut(Aiding, Instant, Fusion),
    ) {
        let Measurements { imu, tof, flow, mag, baro, pose } = *measurements;
        feed(estimator, &Measurements { imu, tof, flow, pose, ..Measurements::default() }, &mut fused);
        // A step that has fused one of these has no time for another update.
        let mut has_time = tof.is_empty() && flow.is_empty() && pose.is_empty();
        next(&mut self.mag, mag, &mut has_time, |Stamped { at, data, .. }| {
            fused(Aiding::Mag, at, estimator.fuse_mag(at, &data));
        });
        next(&mut self.baro, baro, &mut has_time, |Stamped { at, data, .. }| {
            fused(Aiding::Baro, at, estimator.fuse_baro(at, &data));
        });
    }
}

/// Fuses the waiting sample if the step is free, and at once if a newer sample of the sensor has
/// arrived.
#[inline]
fn next<T: Copy>(
    waiting: &mut Option<Stamped<T>>,
    new: &[Stamped<T>],
    has_time: &mut bool,
    mut fuse: impl FnMut(Stamped<T>),
) {
    for sample in new {
        // A newer sample has arrived: the waiting one must go first, in order.
        if let Some(before) = waiting.replace(*sample) {
            fuse(before);
            *has_time = false;
        }
    }
    if *has_time && let Some(sample) = waiting.take() {
        fuse(sample);
        *has_time = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::Refusal;
    use proptest::prelude::*;
    use stampfly_types::Vec3;
    use stampfly_types::messages::*;
    use std::vec::Vec;

    /// An estimator that records what it receives.
    #[derive(Default)]
    struct Given(Vec<(Aiding, Instant)>);

    impl Given {
        fn take(&mut self, from: Aiding, at: Instant) -> Fusion {
            self.0.push((from, at));
            Fusion::Refused(Refusal::NotUsed)
        }
    }

    impl Estimator for Given {
        fn initialize(&mut self, _: Instant, _: &CalibrationResult) {}
        fn command(&mut self, _: Instant, _: &EstimatorCommand) {}
        fn predict(&mut self, _: Instant, _: &ImuData) {}
        fn fuse_tof(&mut self, at: Instant, _: &TofData) -> Fusion {
            self.take(Aiding::Tof, at)
        }
        fn fuse_flow(&mut self, at: Instant, _: &FlowData) -> Fusion {
            self.take(Aiding::Flow, at)
        }
        fn fuse_baro(&mut self, at: Instant, _: &BaroData) -> Fusion {
            self.take(Aiding::Baro, at)
        }
        fn fuse_mag(&mut self, at: Instant, _: &MagData) -> Fusion {
            self.take(Aiding::Mag, at)
        }
        fn fuse_velocity(&mut self, at: Instant, _: &Vec3, _: &Vec3) -> Fusion {
            self.take(Aiding::Velocity, at)
        }
        fn estimate(&self) -> StateEstimate {
            StateEstimate::default()
        }
        fn status(&self) -> EstimatorStatus {
            EstimatorStatus::default()
        }
    }

    fn samples<T: Default + Copy>(at: Instant, count: usize) -> Vec<Stamped<T>> {
        (0..count)
            .map(|n| Stamped { at: at + stampfly_types::Duration::from_micros(n as u64), ..Default::default() })
            .collect()
    }

    /// One step with the given number of new samples of each sensor. Returns what is fused in it.
    fn step(pacer: &mut Pacer, now: Instant, [tof, flow, mag, baro]: [usize; 4]) -> Vec<(Aiding, Instant)> {
        let mut given = Given::default();
        let (tof, flow) = (samples(now, tof), samples(now, flow));
        let (mag, baro) = (samples(now, mag), samples(now, baro));
        let measurements = Measurements { tof: &tof, flow: &flow, mag: &mag, baro: &baro, ..Measurements::default() };
        let mut told = Vec::new();
        pacer.feed(&mut given, &measurements, |from, at, _| told.push((from, at)));
        assert_eq!(told, given.0);
        told
    }

    #[test]
    fn at_a_vehicles_rates_field_and_pressure_have_steps_of_their_own_within_5_ms() {
        let mut pacer = Pacer::default();
        let mut fused = 0;
        for n in 0..4_000u64 {
            let now = Instant::from_micros(n * 2_500);
            // Flow at 100 Hz, range at 33, field and pressure at 25: all of them coincide every 48
            // steps.
            let new = [12, 4, 16, 16].map(|period| usize::from(n.is_multiple_of(period)));
            let told = step(&mut pacer, now, new);
            let waits = |from: &Aiding| matches!(from, Aiding::Mag | Aiding::Baro);
            assert!(told.len() == 1 || told.iter().all(|(from, _)| !waits(from)), "{told:?}");
            let longest = |from: &Aiding| if waits(from) { 5_000 } else { 0 };
            let late = |(from, at): &(Aiding, Instant)| now.since(*at).as_micros() > longest(from);
            assert!(!told.iter().any(late), "{told:?} at {now:?}");
            fused += told.len();
        }
        assert_eq!(fused, 1_000 + 334 + 250 + 250);
    }

    proptest! {
        #[test]
        fn whatever_comes_is_fused_once_and_in_order(
            steps in prop::collection::vec([0usize..3, 0usize..3, 0usize..3, 0usize..3], 1..50),
        ) {
            let mut pacer = Pacer::default();
            let mut told = Vec::new();
            let mut came = [0; 4];
            let idle = [[0; 4]; 3];
            for (n, new) in steps.iter().chain(&idle).enumerate() {
                told.extend(step(&mut pacer, Instant::from_micros(n as u64 * 2_500), *new));
                came.iter_mut().zip(new).for_each(|(sum, new)| *sum += new);
            }
            for (from, came) in [Aiding::Tof, Aiding::Flow, Aiding::Mag, Aiding::Baro].into_iter().zip(came) {
                let of: Vec<_> = told.iter().filter(|(it, _)| *it == from).map(|(_, at)| *at).collect();
                prop_assert_eq!(of.len(), came);
                prop_assert!(of.is_sorted_by(|a, b| a < b), "{:?}", of);
            }
        }
    }
}
