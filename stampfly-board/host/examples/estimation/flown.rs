//! A simulated flight from the estimator's side: what each of its activations was given, and what was really the case.

use stampfly_eskf::Estimator;
use stampfly_host::recorder::{Recorder, TOPICS};
use stampfly_host::simulate::{FlightConfig, fly};
use stampfly_log::ulog::{Message as Entry, Reader};
use stampfly_sim::Truth;
use stampfly_types::messages::{
    BaroData, CalibrationResult, EstimatorCommand, FlowData, ImuData, MagData, StateEstimate, TofData,
};
use stampfly_types::{Instant, Message};
use std::collections::BTreeMap;
use std::error::Error;

type Samples<M> = Vec<(Instant, M)>;

/// What one activation of the estimation was given.
#[derive(Clone, Default)]
pub struct Given {
    pub now: Instant,
    pub calibration: Option<CalibrationResult>,
    pub command: Option<EstimatorCommand>,
    pub imu: Samples<ImuData>,
    pub tof: Samples<TofData>,
    pub flow: Samples<FlowData>,
    pub mag: Samples<MagData>,
    pub baro: Samples<BaroData>,
}

/// One flight.
pub struct Flown {
    pub given: Vec<Given>,
    pub truth: BTreeMap<Instant, Truth>,
    pub published: BTreeMap<Instant, StateEstimate>,
}

impl Given {
    /// Start, commands and inertial samples.
    pub fn predict(&self, estimator: &mut impl Estimator, started: &mut bool) {
        if let Some(calibration) = self.calibration.filter(|calibration| calibration.complete && !*started) {
            *started = true;
            estimator.initialize(self.now, &calibration);
        }
        if let Some(command) = self.command {
            estimator.command(self.now, &command);
        }
        self.imu.iter().for_each(|(at, sample)| estimator.predict(*at, sample));
    }

    /// The other sensors.
    pub fn fuse(&self, estimator: &mut impl Estimator) {
        for (at, sample) in &self.tof {
            estimator.fuse_tof(*at, sample);
        }
        for (at, sample) in &self.flow {
            estimator.fuse_flow(*at, sample);
        }
        for (at, sample) in &self.mag {
            estimator.fuse_mag(*at, sample);
        }
        for (at, sample) in &self.baro {
            estimator.fuse_baro(*at, sample);
        }
    }
}

impl Flown {
    /// Flies, and reads the log of it.
    pub fn new(config: &FlightConfig) -> Result<Self, Box<dyn Error>> {
        let mut recorder = Recorder::with_log(Vec::new());
        let outcome = fly(config, &mut recorder, &mut |_, _| {});
        if !outcome.finished {
            return Err("the mission was not flown to its end".into());
        }
        let mut flown = Self { given: Vec::new(), truth: BTreeMap::new(), published: BTreeMap::new() };
        let mut pending = Given::default();
        let mut names = BTreeMap::new();
        for entry in Reader::new(recorder.log()).map_err(|error| error.to_string())? {
            match entry.map_err(|error| error.to_string())? {
                Entry::Subscription { id, topic, .. } => {
                    names.insert(id, topic.to_owned());
                }
                Entry::Data { id, payload } => match names.get(&id).map(String::as_str) {
                    Some("activation_estimation") => {
                        // An activation begins with its instant.
                        let now = payload.first_chunk().map(|bytes| Instant::from_micros(u64::from_le_bytes(*bytes)));
                        pending.now = now.ok_or("an activation without an instant")?;
                        let Given { calibration, command, .. } = pending;
                        flown.given.push(std::mem::take(&mut pending));
                        // What is not a stream stays.
                        (pending.calibration, pending.command) = (calibration, command);
                    }
                    Some(name) => flown.take(name, payload, &mut pending),
                    None => {}
                },
                _ => {}
            }
        }
        Ok(flown)
    }

    fn take(&mut self, topic: &str, payload: &[u8], pending: &mut Given) {
        match topic {
            "sensor_imu" => pending.imu.extend(decode(topic, payload)),
            "sensor_tof" => pending.tof.extend(decode(topic, payload)),
            "sensor_flow" => pending.flow.extend(decode(topic, payload)),
            "sensor_mag" => pending.mag.extend(decode(topic, payload)),
            "sensor_baro" => pending.baro.extend(decode(topic, payload)),
            "calibration" => pending.calibration = decode(topic, payload).map(|(_, data)| data),
            "estimator_command" => pending.command = decode(topic, payload).map(|(_, data)| data),
            "truth" => self.truth.extend(decode::<Truth>(topic, payload)),
            "estimate_state" => self.published.extend(decode::<StateEstimate>(topic, payload)),
            _ => {}
        }
    }
}

/// A message of the log; `None` for one that is not as this program writes it.
fn decode<M: Message>(name: &str, payload: &[u8]) -> Option<(Instant, M)>
where
    M::Words: for<'w> TryFrom<&'w [u32]>,
{
    let topic = TOPICS.iter().find(|topic| topic.name == name)?;
    let mut words = vec![0; topic.words()];
    let stamp = topic.decode(payload, &mut words)?;
    let words = M::Words::try_from(&words).ok()?;
    Some((stamp.at, M::from_words(&words)?))
}
