//! The flight record, as the vehicle keeps it: a ULog with every sample of every topic and every activation.

use stampfly_board::vehicle::assemble;
use stampfly_board::{VehicleConfig, parameters, plan, wiring};
use stampfly_bus::Activation;
use stampfly_log::ulog::{Definitions, Ram, Sample, Topic, Writer};
use stampfly_log::{ActivationTopic, Input};
use stampfly_types::Instant;

/// The record's topics are the bus's.
static TOPICS: [Topic; wiring::COUNT] = {
    let mut topics = [Topic { name: "", fields: &[] }; wiring::COUNT];
    let mut index = 0;
    while index < topics.len() {
        topics[index] = Topic { name: wiring::TOPICS[index].name, fields: wiring::TOPICS[index].fields };
        index += 1;
    }
    topics
};

/// The record's activations. How many inputs each has is counted on a vehicle that never flies.
pub fn activations() -> [ActivationTopic; plan::COUNT] {
    let mut bus = wiring::Bus::new();
    let wiring::Split { ports, heads, .. } = bus.split(None);
    let inputs = assemble(ports, heads, &VehicleConfig::default(), Instant::ZERO).flight_loop.count_inputs();
    core::array::from_fn(|index| ActivationTopic {
        name: plan::ACTIVATIONS[index].name,
        index: index as u8,
        inputs: inputs[index],
    })
}

/// A flight record that is being written into memory.
pub struct Record<'t>(Writer<'t, Ram<'t>>);

impl<'t> Record<'t> {
    /// Facts, parameters and formats. `None` when there is no room for them.
    pub fn begin(memory: &'t mut [u8], activations: &'t [ActivationTopic]) -> Option<Self> {
        let mut head = Definitions::start(Ram::new(memory), Instant::ZERO).ok()?;
        head.info("sys_name", "StampFly").ok()?;
        for parameter in parameters::PARAMETERS {
            head.parameter(parameter.name, parameter.get(&VehicleConfig::default()).into()).ok()?;
        }
        head.data(&TOPICS, activations).ok().map(Self)
    }

    /// One sample of a topic. What does not fit any more is counted.
    pub fn sample(&mut self, topic: wiring::Id, at: Instant, generation: u32, words: &[u32]) {
        let _ = self.0.sample(topic as usize, &Sample { at, generation, words });
    }

    /// One activation of a runnable.
    pub fn activation(&mut self, index: usize, activation: &Activation) {
        let mut record = stampfly_log::Activation::new(index as u8, activation.now());
        for input in activation.inputs() {
            let _ = record.read(Input { generation: input.generation, taken: input.taken });
        }
        let _ = self.0.activation(&record);
    }

    /// What was written.
    pub fn bytes(&self) -> &[u8] {
        self.0.sink().written()
    }

    /// Messages that found no room.
    pub fn lost(&self) -> u32 {
        self.0.lost()
    }
}
