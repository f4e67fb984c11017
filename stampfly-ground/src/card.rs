//! What a page is told of a vehicle once: its topics, parameters, faults, missions, looks, and what it can be asked.
//!
//! [`VehicleCard::of`] fills in what every [`Vehicle`] says of itself. What only the flight knows, which asks it carries out,
//! its owner adds.

use crate::ask::Ask;
use serde_json::{Value, json};
use stampfly_bus::{Schedule, TopicInfo, TopicTable};
use stampfly_sim::fault::FaultKind;
use stampfly_sim::vehicle::{Motion, Page, Setting, Vehicle};
use stampfly_types::messages::{Alerts, ArmBlocks, CalibrationKind};
use stampfly_types::schema::{FieldKind, Leaf};
use stampfly_types::{FieldInfo, leaves};

/// One vehicle, for pages.
#[derive(Clone, Debug)]
pub struct VehicleCard {
    /// What people call it.
    pub name: String,
    /// The vehicle's kind: [`Vehicle::NAME`].
    pub kind: String,
    /// The topics of its bus in the table's order, then those beside it.
    pub topics: Vec<TopicCard>,
    /// Its parameters.
    pub parameters: Vec<ParameterCard>,
    /// What can go wrong in its flight.
    pub faults: &'static [FaultKind],
    /// Missions it can fly, by name.
    pub missions: Vec<String>,
    /// What it carries out, see [`Ask::name`]. The rest is refused, and pages show it as not offered.
    pub offers: Vec<&'static str>,
    /// The calibrations it offers, and the console line that begins each.
    pub calibrations: Vec<Calibration>,
    /// What to show, and what it looks like.
    pub page: &'static Page,
    /// Where the origin of its world lies among the others', north and east, m: vehicles that were simulated apart are not
    /// drawn on top of each other.
    pub place: [f32; 2],
    /// How many of the topics are on the bus.
    pub on_bus: usize,
}

/// One topic, for pages.
#[derive(Clone, Debug)]
pub struct TopicCard {
    /// Its name.
    pub name: &'static str,
    /// What it is.
    pub doc: String,
    /// Nominal rate, in words.
    pub rate: &'static str,
    /// Words per sample.
    pub words: usize,
    leaves: Vec<Leaf>,
}

/// One parameter, for pages.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterCard {
    /// Name, default, unit, meaning.
    pub setting: Setting,
    /// Value now.
    pub value: f64,
    /// Lowest and highest, where the vehicle says it.
    pub range: Option<[f64; 2]>,
}

/// One calibration that a vehicle offers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Calibration {
    /// What is calibrated.
    pub kind: CalibrationKind,
    /// The console line that begins it.
    pub line: String,
}

/// Its name in JSON.
const fn name(kind: CalibrationKind) -> &'static str {
    match kind {
        CalibrationKind::None => "none",
        CalibrationKind::Level => "level",
        CalibrationKind::SixPositions => "six_positions",
        CalibrationKind::Magnetometer => "compass",
        CalibrationKind::Temperature => "temperature",
    }
}

impl VehicleCard {
    /// What a vehicle says of itself, with the parameters of this configuration.
    ///
    /// ```
    /// use stampfly_board::simulation::StampFly;
    /// use stampfly_ground::VehicleCard;
    /// use stampfly_sim::vehicle::Vehicle;
    ///
    /// let card = VehicleCard::of::<StampFly>("StampFly 1", &StampFly::default_config());
    /// assert!(card.topics.iter().any(|topic| topic.name == "estimate_state"));
    /// assert_eq!(card.topics.last().map(|topic| topic.name), Some("truth"));
    /// ```
    #[must_use]
    pub fn of<V: Vehicle>(name: &str, config: &<V::Runnables as Schedule>::Config) -> Self {
        let topics = <<V::Runnables as Schedule>::Topics as TopicTable>::TOPICS.iter().map(TopicCard::new);
        let beside = V::BESIDE.iter().map(|topic| TopicCard::beside(topic.name, topic.fields));
        let defaults = V::parameters(&V::default_config());
        let parameters = V::parameters(config).into_iter().zip(defaults);
        let parameters = parameters
            .map(|(now, setting)| ParameterCard { value: now.value, range: V::parameter_range(setting.name), setting })
            .collect();
        Self {
            name: name.to_owned(),
            kind: V::NAME.to_owned(),
            topics: topics.chain(beside).collect(),
            parameters,
            faults: V::FAULTS,
            missions: V::VARIETY.missions.iter().map(|mission| (*mission).to_owned()).collect(),
            offers: Vec::new(),
            calibrations: V::PAGE
                .calibrations
                .iter()
                .map(|(kind, line)| Calibration { kind: *kind, line: (*line).into() })
                .collect(),
            page: const { &V::PAGE },
            place: [0.0; 2],
            on_bus: <<V::Runnables as Schedule>::Topics as TopicTable>::TOPICS.len(),
        }
    }

    /// The same, carrying out these asks, see [`Ask::name`]; [`ask::NAMES`](crate::ask::NAMES) are all of them.
    #[must_use]
    pub fn offering(self, offers: &[&'static str]) -> Self {
        Self { offers: offers.to_vec(), ..self }
    }

    /// Does it say that it carries this out?
    #[must_use]
    pub fn does_offer(&self, ask: &Ask) -> bool {
        self.offers.contains(&ask.name())
    }

    pub(crate) fn json(&self, number: usize) -> Value {
        json!({
            "number": number, "name": self.name, "kind": self.kind,
            "topics": self.topics.iter().map(TopicCard::json).collect::<Vec<_>>(),
            "parameters": self.parameters.iter().map(ParameterCard::json).collect::<Vec<_>>(),
            "faults": self.faults.iter().map(fault).collect::<Vec<_>>(),
            "place": self.place, "missions": self.missions, "offers": self.offers,
            "calibrations": self.calibrations.iter()
                .map(|calibration| json!({ "kind": name(calibration.kind), "line": calibration.line }))
                .collect::<Vec<_>>(),
            "page": page(self.page),
        })
    }
}

impl TopicCard {
    fn new(info: &'static TopicInfo) -> Self {
        let doc: Vec<_> = info.doc.iter().map(|line| line.trim()).collect();
        Self { doc: doc.join(" "), rate: info.rate, ..Self::beside(info.name, info.fields) }
    }

    /// A topic that is on no bus.
    #[must_use]
    pub fn beside(name: &'static str, fields: &'static [FieldInfo]) -> Self {
        let words = fields.iter().map(|field| field.words).sum();
        Self { name, doc: String::new(), rate: "", words, leaves: leaves(fields).collect() }
    }

    /// The numbers in these words, in the order of the schema's leaves.
    pub fn numbers<'w>(&'w self, words: &'w [u32]) -> impl Iterator<Item = stampfly_types::schema::Value> + 'w {
        self.leaves.iter().flat_map(|leaf| (0..leaf.count).filter_map(|element| leaf.value(words, element)))
    }

    fn json(&self) -> Value {
        json!({
            "name": self.name, "doc": self.doc, "rate": self.rate,
            "fields": self.leaves.iter().map(field).collect::<Vec<_>>(),
        })
    }
}

impl ParameterCard {
    fn json(&self) -> Value {
        let Setting { name, value, unit, meaning } = self.setting;
        json!({
            "name": name, "unit": unit, "meaning": meaning, "default": value, "value": self.value, "range": self.range,
        })
    }
}

fn field(leaf: &Leaf) -> Value {
    let (kind, names): (_, &[(&str, u32)]) = match leaf.kind {
        FieldKind::Bool => ("bool", &[]),
        FieldKind::Enum(names) => ("enum", names),
        FieldKind::Flags(names) => ("flags", names),
        _ => ("number", &[]),
    };
    json!({ "name": leaf.name.to_string(), "unit": leaf.unit, "count": leaf.count, "kind": kind, "names": names })
}

fn fault(kind: &FaultKind) -> Value {
    json!({
        "name": kind.name, "unit": kind.value.unit(), "default": kind.value.default(), "range": kind.value.range(),
        "meaning": kind.meaning,
    })
}

fn page(page: &Page) -> Value {
    let body = page.body;
    let observers = page.observers.iter().map(|observer| {
        let plane = observer.motion == Motion::Plane;
        json!({ "topic": observer.topic, "role": observer.role, "name": observer.name, "plane": plane })
    });
    json!({
        "observers": observers.collect::<Vec<_>>(), "setpoint": page.setpoint, "alerts": page.alerts, "bands": page.bands,
        "panels": page.panels.iter().map(|panel| json!({
            "group": panel.group, "title": panel.title, "unit": panel.unit, "topic": panel.topic, "lines": panel.lines,
            "factor": panel.factor, "limit": panel.limit,
        })).collect::<Vec<_>>(),
        "body": {
            "rings": body.rings, "radius": body.radius, "outline": body.outline, "down": body.down, "nose": body.nose,
            "reach": body.reach,
        },
    })
}

/// What the flags of alerts and arming say, in words, by the flag's name.
pub fn words() -> Value {
    let words = |meanings: &[(&str, &str)]| {
        let words = meanings.iter().map(|(name, meaning)| ((*name).to_owned(), Value::from(plain(meaning))));
        Value::Object(words.collect())
    };
    json!({ "alerts": words(Alerts::MEANINGS), "blocks": words(ArmBlocks::MEANINGS) })
}

/// Documentation without its marks: `` [`X`](Self::X) `` is X.
fn plain(doc: &str) -> String {
    let mut text = doc.trim().to_owned();
    while let Some((before, rest)) = text.split_once("[`")
        && let Some((name, rest)) = rest.split_once("`]")
    {
        let after = rest.strip_prefix('(').and_then(|rest| rest.split_once(')')).map_or(rest, |(_, after)| after);
        text = format!("{before}{}{after}", name.to_lowercase().replace('_', " "));
    }
    text.replace('`', "")
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_board::simulation::StampFly;
    use stampfly_rover::simulation::Rover;

    #[test]
    fn cards_of_all_vehicles_say_what_a_page_needs() {
        let card = VehicleCard::of::<StampFly>("one", &StampFly::default_config()).json(3);
        assert_eq!((&card["number"], &card["name"], &card["kind"]), (&json!(3), &json!("one"), &json!("stampfly")));
        let gate = card["parameters"].as_array().and_then(|list| list.iter().find(|row| row["name"] == "eskf.gate"));
        let gate = gate.expect("a parameter");
        assert_eq!(gate["value"], gate["default"]);
        assert!(gate["range"][0].as_f64() < gate["value"].as_f64(), "{gate}");
        assert_eq!(card["calibrations"][1], json!({ "kind": "six_positions", "line": "calibrate six" }));
        let card = VehicleCard::of::<Rover>("two", &Rover::default_config()).json(0);
        assert_eq!(card["page"]["observers"][0]["plane"], json!(true));
    }

    #[test]
    fn words_are_plain() {
        let words = words();
        assert_eq!(words["blocks"]["NOT_ON_GROUND"], "Not standing on the ground.");
        assert_eq!(words["alerts"]["IMU_NOISY"], "Many inertial samples are garbage, too few for imu faulty.");
    }
}
