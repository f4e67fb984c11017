//! What somebody does with the vehicle in his hand: poses, turns, heights, slides.

use super::Examination;
use crate::doctor::axes;
use crate::doctor::reading::{Reading, mean, newest, several};
use crate::doctor::visit::{Act, Lost, Visit};
use stampfly_flight::doctor::Verdict;
use std::f64::consts::{FRAC_PI_2, PI};
use std::time::Duration;

/// Samples of a mean.
const SAMPLES: usize = 5;
/// Samples of the mean of a pressure, whose noise is large.
const MANY: usize = 20;
/// Weaker than this an accelerometer feels nothing, m/s².
const WEIGHTLESS: f64 = 2.0;
/// A magnetometer that is turned round sees less than this only next to a magnet or not at all, µT.
const FIELD: f64 = 8.0;
/// A change smaller than any noise: the converter hangs, µT.
const HANGS: f64 = 0.05;
/// A compass indoors and a hand are not better, rad.
const COMPASS: f64 = 1.05;
/// A range finder on the legs of a vehicle that stands reads less than this, m.
const ON_THE_FLOOR: f64 = 0.12;
/// Half a metre by eye, m.
const HALF: std::ops::Range<f64> = 0.3..0.75;
/// 30 cm by eye, m.
const HAND: std::ops::Range<f64> = 0.12..0.6;
/// The air of one and a half metres by eye, Pa: 12 a metre.
const AIR: std::ops::Range<f64> = 8.0..35.0;
/// A slide turns the picture faster than this on average, rad/s.
const SEEN: f64 = 0.05;
/// Pause between two looks at something that moves.
const LOOK: Duration = Duration::from_millis(8);

const REWIRE: &str = "do not fly: it would flip at take-off. Is this a StampFly, and its firmware the StampFly's?";

impl<V: Visit> Examination<'_, V> {
    /// The accelerometer in three poses.
    pub(super) fn poses(&mut self) -> Result<(), Lost> {
        if !self.works("imu") {
            return Ok(());
        }
        let mut felt = [[0.0; 3]; 3];
        for (place, act) in [None, Some(Act::RightSideDown), Some(Act::NoseUp)].into_iter().enumerate() {
            if let Some(act) = act {
                self.visit.please(act);
            }
            felt[place] = mean(&several(self.visit, "sensor_imu", SAMPLES)?, "accel").unwrap_or_default();
            let weight = felt[place].iter().map(|part| part * part).sum::<f64>().sqrt();
            if weight < WEIGHTLESS {
                let seen = format!("accelerometer {:.1?} m/s^2", felt[place]);
                self.chart.note("imu-numb", Verdict::Fail, seen, "the chip answers and does not measure");
                self.measures.insert("imu".into(), false);
                break;
            }
        }
        self.visit.please(Act::PutDown);
        if !self.works("imu") {
            return Ok(());
        }
        let [level, right, nose] = felt;
        let seen = format!("level {level:.1?}, right side down {right:.1?}, nose up {nose:.1?} m/s^2");
        match axes::mounting(level, right, nose).map(axes::wrong) {
            Some(None) => self.chart.pass("accelerometer's axes", seen),
            Some(Some(how)) => self.chart.note(&format!("imu-{how}"), Verdict::Fail, seen, REWIRE),
            None => self.chart.note("poses-unclear", Verdict::Look, seen, "once more: was it held as it was asked?"),
        }
        Ok(())
    }

    /// Gyroscope and magnetometer while it is turned round once, in four quarters.
    pub(super) fn turns(&mut self) -> Result<(), Lost> {
        if !self.works("imu") && !self.works("mag") {
            return Ok(());
        }
        let mut fields = Vec::new();
        for quarter in 0..4 {
            if quarter > 0 {
                self.visit.please(Act::QuarterTurn);
                let turned = self.watch(Act::QuarterTurn, "sensor_imu", |reading| {
                    let [_, _, rate] = *reading.get("gyro") else { return None };
                    Some([rate, 0.0])
                })?;
                if quarter == 1 && self.works("imu") {
                    self.gyroscope(turned[0]);
                }
            }
            fields.push(mean(&several(self.visit, "sensor_mag", SAMPLES)?, "field").unwrap_or_default());
        }
        self.visit.please(Act::PutDown);
        if self.works("mag") {
            self.magnetometer(&fields);
        }
        Ok(())
    }

    /// `turned` is the mean rate over the turn's time, rad/s.
    fn gyroscope(&mut self, turned: f64) {
        let angle = turned * Act::QuarterTurn.moving().unwrap_or_default().as_secs_f64();
        let seen = format!("{:.0} degrees for a quarter turn clockwise", angle.to_degrees());
        // The mounting is found by the accelerometer on the same chip.
        let mounted = self.chart.findings().any(|row| row.name.starts_with("imu-"));
        match () {
            () if mounted => {}
            () if (0.4 * FRAC_PI_2..1.8 * FRAC_PI_2).contains(&angle) => self.chart.pass("gyroscope", seen),
            () if angle < -0.4 * FRAC_PI_2 => self.chart.note("imu-gyro-reversed", Verdict::Fail, seen, REWIRE),
            () => self.chart.note("gyro-unclear", Verdict::Look, seen, "once more: a quarter turn, clockwise"),
        }
    }

    fn magnetometer(&mut self, fields: &[[f64; 3]]) {
        let count = fields.len() as f64;
        let centre = [0, 1].map(|axis| fields.iter().map(|field| field[axis]).sum::<f64>() / count);
        let around: Vec<[f64; 2]> = fields.iter().map(|field| [field[0] - centre[0], field[1] - centre[1]]).collect();
        let radius = around.iter().map(|[x, y]| x.hypot(*y)).sum::<f64>() / count;
        let angles: Vec<f64> = around.iter().map(|[x, y]| y.atan2(*x)).collect();
        let steps: Vec<f64> = angles.windows(2).map(|pair| wrapped(pair[1] - pair[0])).collect();
        let turned = steps.iter().sum::<f64>();
        let first = angles.first().copied().unwrap_or_default();
        let size = fields.iter().flatten().map(|part| part.abs()).fold(0.0, f64::max);
        let seen = format!(
            "{radius:.0} uT, which went round by {:.0} degrees and began at {:.0}",
            turned.to_degrees(),
            first.to_degrees()
        );
        match () {
            () if size < WEIGHTLESS => {
                self.chart.note("mag-numb", Verdict::Fail, seen, "the chip answers and does not measure");
            }
            () if radius < HANGS => self.chart.note("mag-stuck", Verdict::Fail, seen, "it repeats one measurement"),
            () if radius < FIELD => {
                let advice = "a magnet or iron is near: once more, elsewhere";
                self.chart.note("mag-disturbed", Verdict::Look, seen, advice);
            }
            // What points north turns the other way round than the vehicle: three quarters.
            () if turned > PI => {
                let advice = "one of its axes points the other way: its heading would turn the wrong way";
                self.chart.note("mag-mirrored", Verdict::Fail, seen, advice);
            }
            () if turned > -PI => {
                let advice = "a magnet or iron is near: once more, elsewhere";
                self.chart.note("mag-disturbed", Verdict::Look, seen, advice);
            }
            () if first.abs() > COMPASS => {
                let advice = "it is soldered turned, or the nose did not point north";
                self.chart.note("mag-turned", Verdict::Fail, seen, advice);
            }
            () => self.chart.pass("magnetometer", seen),
        }
    }

    /// Range finder and barometer on the floor, at half a metre, and high.
    pub(super) fn heights(&mut self) -> Result<(), Lost> {
        let floor = newest(self.visit, "sensor_tof")?;
        let names: Vec<String> = self.measures.keys().filter(|name| self.works(name)).cloned().collect();
        let mut pressures = Vec::new();
        for name in names {
            let topic = format!("sensor_{name}");
            if newest(self.visit, &topic)?.number("pressure").is_some() {
                let below: Option<[f64; 1]> = mean(&several(self.visit, &topic, MANY)?, "pressure");
                pressures.push((name, topic, below.unwrap_or_default()[0]));
            }
        }
        if pressures.is_empty() && !self.works("tof") {
            return Ok(());
        }
        self.visit.please(Act::LiftHalf);
        if self.works("tof") {
            let lifted = several(self.visit, "sensor_tof", SAMPLES)?;
            self.range(&floor, &lifted);
        }
        if !pressures.is_empty() {
            self.visit.please(Act::LiftHigh);
        }
        for (name, topic, below) in pressures {
            let [above] = mean(&several(self.visit, &topic, MANY)?, "pressure").unwrap_or_default();
            let fell = below - above;
            let seen = format!("{fell:.1} Pa less at a metre and a half");
            if AIR.contains(&fell) {
                self.chart.pass(&format!("{name}'s height"), seen);
            } else if fell.abs() < AIR.start {
                let advice = "the air does not reach it, or it repeats one measurement";
                self.chart.note(&format!("{name}-stuck"), Verdict::Fail, seen, advice);
            } else {
                self.chart.note(&format!("{name}-unclear"), Verdict::Look, seen, "once more, doors and windows shut");
            }
        }
        Ok(())
    }

    fn range(&mut self, floor: &Reading, lifted: &[Reading]) {
        let valid: Vec<f64> = lifted
            .iter()
            .filter(|reading| reading.is("valid"))
            .filter_map(|reading| reading.number("distance"))
            .collect();
        let above = valid.iter().sum::<f64>() / valid.len().max(1) as f64;
        let below = floor.number("distance").filter(|_| floor.is("valid"));
        let seen = format!("{:.3} m on the floor, {above:.3} m at half a metre", below.unwrap_or_default());
        match () {
            () if valid.is_empty() => {
                self.chart.note("tof-numb", Verdict::Fail, &seen, "it sees nothing: its window, or its laser");
            }
            () if above < ON_THE_FLOOR => {
                self.chart.note("tof-covered", Verdict::Fail, &seen, "something lies in front of it: a foil, a cable");
            }
            () if below.is_some_and(|below| below > ON_THE_FLOOR) => {
                let advice = "it reads too much by this: its window, or it was pressed in";
                self.chart.note("tof-offset", Verdict::Fail, &seen, advice);
            }
            () if !HALF.contains(&above) => {
                self.chart.note("tof-unclear", Verdict::Look, &seen, "once more: half a metre above the floor");
            }
            () => self.chart.pass("range below", &seen),
        }
    }

    /// The flow sensor over a floor that goes by.
    pub(super) fn slides(&mut self) -> Result<(), Lost> {
        if !self.works("flow") {
            return Ok(());
        }
        self.visit.please(Act::HoldOver);
        let sees = several(self.visit, "sensor_flow", SAMPLES)?.iter().any(|reading| reading.is("valid"));
        if !sees {
            let advice = "is there light and a pattern on the floor? Else its lens, or its window";
            self.chart.note("flow-numb", Verdict::Fail, "no sample is valid", advice);
            return Ok(());
        }
        let mut seen = [[0.0; 2]; 2];
        for (seen, act) in seen.iter_mut().zip([Act::SlideForward, Act::SlideRight]) {
            self.visit.please(act);
            *seen = self.watch(act, "sensor_flow", |reading| {
                let interval = reading.number("interval").filter(|interval| *interval > 0.0)?;
                Some([reading.number("delta_x")? / interval, reading.number("delta_y")? / interval])
            })?;
        }
        let [[xx, xy], [yx, yy]] = seen;
        let said = format!("forward {xx:+.2} {xy:+.2}, right {yx:+.2} {yy:+.2} rad/s");
        let name = match () {
            () if xx.hypot(xy) < SEEN || yx.hypot(yy) < SEEN => {
                let advice = "once more: 40 cm, 30 cm above a floor with a pattern";
                self.chart.note("flow-unclear", Verdict::Look, said, advice);
                return Ok(());
            }
            () if xx.abs() < xy.abs() && yy.abs() < yx.abs() => "flow-axes-swapped",
            () if xx < 0.0 && yy < 0.0 => "flow-turned-180",
            () if xx < 0.0 => "flow-x-reversed",
            () if yy < 0.0 => "flow-y-reversed",
            () => {
                self.chart.pass("flow's axes", said);
                return Ok(());
            }
        };
        self.chart.note(name, Verdict::Fail, said, "do not hold a position with it: it would run away");
        Ok(())
    }

    /// The range finder that looks ahead, at the floor.
    pub(super) fn ahead(&mut self) -> Result<(), Lost> {
        if self.works("tof_front") {
            self.visit.please(Act::NoseDown);
            let readings = several(self.visit, "sensor_tof_front", SAMPLES)?;
            let valid: Vec<f64> = readings
                .iter()
                .filter(|reading| reading.is("valid"))
                .filter_map(|reading| reading.number("distance"))
                .collect();
            let distance = valid.iter().sum::<f64>() / valid.len().max(1) as f64;
            let seen = format!("{distance:.3} m");
            match () {
                () if valid.is_empty() => {
                    let advice = "it measures on battery only; else its window, or its laser";
                    self.chart.note("tof-front-numb", Verdict::Look, &seen, advice);
                }
                () if distance < HAND.start => {
                    self.chart.note("tof-front-covered", Verdict::Fail, &seen, "something lies in front of it");
                }
                () if !HAND.contains(&distance) => {
                    self.chart.note("tof-front-unclear", Verdict::Look, &seen, "once more: 30 cm above the floor");
                }
                () => self.chart.pass("range ahead", &seen),
            }
        }
        self.visit.please(Act::PutDown);
        Ok(())
    }

    /// The mean of what is picked from a topic's samples while somebody moves the vehicle.
    fn watch(&mut self, act: Act, topic: &str, pick: impl Fn(&Reading) -> Option<[f64; 2]>) -> Result<[f64; 2], Lost> {
        let end = self.visit.elapsed() + act.moving().unwrap_or_default();
        let (mut sum, mut count) = ([0.0; 2], 0.0f64);
        while self.visit.elapsed() < end {
            self.visit.wait(LOOK);
            if let Some(values) = pick(&newest(self.visit, topic)?) {
                sum = [sum[0] + values[0], sum[1] + values[1]];
                count += 1.0;
            }
        }
        Ok(sum.map(|sum| sum / count.max(1.0)))
    }
}

/// An angle from −π to π.
fn wrapped(angle: f64) -> f64 {
    angle - (angle / (2.0 * PI)).round() * 2.0 * PI
}
