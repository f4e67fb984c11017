//! Light budget of a range finder: maximum range, cone, and crosstalk of a cover glass.
//!
//! **Maximum range.** ST's data sheet of the VL53L1X (DocID031281, tables 6 and 7), which has the
//! same sensor and laser, gives the maximum range by reflectance and ambient light for measurements
//! of 100 ms:
//!
//! | cm | dark | 50·10³/s per detector | 200·10³/s |
//! |---|---:|---:|---:|
//! | white, 88 % | 360 | 166 | 73 |
//! | grey, 54 % | 340 | 154 | 69 |
//! | grey, 17 % | 170 | 114 | 68 |
//!
//! In the dark it is proportional to the square root of the reflectance, because the signal falls
//! with the inverse square of the distance. Ambient light sets a limit that hardly depends on the
//! floor: detectors are blind after each photon. The two limits combine as their inverse squares,
//! within 12 % of the table. The VL53L3CX at 33 ms reaches 300 cm where the VL53L1X reaches 381
//! ("up to 300 cm+", DS13204); all ranges are scaled by this ratio.
//!
//! **Cone.** The sensor sees everything within 12.5° of its axis (DS13204), weighted with the
//! inverse square of the distance. Targets within the length of the pulse form one echo at their
//! mean; targets farther apart form several, of which the strongest is reported.
//!
//! **Cover.** A window over the sensor returns some light immediately (ST AN5231). This is a
//! separate echo near zero: it biases near targets towards itself, and it is the only echo when the
//! floor is out of range. The part compensates crosstalk only after a calibration by the host,
//! which the StampFly's firmware does not perform.

use crate::conditions::Conditions;
use nalgebra::Vector3;

/// Largest distance that the chip reports, m.
pub(crate) const MAXIMUM: f64 = 4.0;
/// Reflectance of the white chart.
const WHITE: f64 = 0.88;
/// Maximum range at an ambient light of 50·10³/s, relative to that over a white floor in the dark,
/// and the exponent of its fall with the light.
const AMBIENT_CEILING: f64 = 0.446;
const AMBIENT_EXPONENT: f64 = 0.61;
/// Signal from a floor of 40 % at one metre, 10⁶ photons/s over all detectors.
const FLOOR: f64 = 8.0;
const FLOOR_REFLECTANCE: f64 = 0.4;
/// Ambient light of a dim room in the same unit, and number of exposed detectors.
const DIM_ROOM: f64 = 0.5;
const DETECTORS: f64 = 200.0;
/// Least distance in the inverse square law, m.
const NEAR: f64 = 0.05;
/// Distance between targets above which their echoes are separate, m: length of the pulse, 2.5 bins
/// of 0.2 m.
const PULSE: f64 = 0.5;
/// Apparent distance of the cover's echo, m.
const COVER: f64 = 0.02;
/// Rings of beams that sample the cone with equal solid angles: angle in units of the half angle,
/// and number of beams.
const RINGS: [(f64, usize); 3] = [(0.0, 1), (0.48, 4), (0.83, 8)];

/// One echo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Echo {
    /// Mean distance of the target, m.
    pub distance: f64,
    /// Signal that the target would return from one metre, 10⁶ photons/s over all detectors.
    pub brightness: f64,
}

impl Echo {
    /// No echo.
    pub const NONE: Self = Self { distance: 0.0, brightness: 0.0 };

    /// Signal of the echo, 10⁶ photons/s over all detectors.
    pub fn rate(&self) -> f64 {
        self.brightness / self.distance.max(NEAR).powi(2)
    }
}

/// One or two echoes of the floor, and that of the cover. Missing echoes have a brightness of 0.
pub(crate) type Echoes = [Echo; 3];

/// Optics of one specimen over one floor in one light.
#[derive(Clone, Debug)]
pub(crate) struct Light {
    /// Directions of the beams, body; the first is the axis.
    beams: Vec<Vector3<f64>>,
    /// Factor by which the cone overestimates the distance of a level floor; divided out.
    level: f64,
    /// Signal from one metre, 10⁶/s.
    floor: f64,
    /// Signal of the cover, 10⁶/s.
    cover: f64,
    /// Ambient light, 10⁶/s.
    pub ambient: f64,
    /// Maximum range, m.
    pub ceiling: f64,
}

impl Light {
    /// Optics of a range finder that looks along `axis`, body.
    pub fn new(conditions: &Conditions, axis: Vector3<f64>) -> Self {
        let beams = beams(&axis, conditions.range_cone);
        let down: Vec<_> = beams.iter().map(|beam| 1.0 / beam.dot(&axis)).collect();
        Self {
            level: mean(&down, 1.0).distance,
            beams,
            floor: FLOOR * (conditions.floor_reflectance / FLOOR_REFLECTANCE),
            cover: conditions.range_cover,
            ambient: DIM_ROOM + DETECTORS * 1e-3 * conditions.ambient_light,
            ceiling: ceiling(conditions),
        }
    }

    /// The optical axis, body.
    pub fn axis(&self) -> Vector3<f64> {
        self.beams[0]
    }

    /// The echoes. `meets` returns the distance of the target along a direction, body, or `None`
    /// without a target.
    pub fn echoes(&self, meets: impl Fn(&Vector3<f64>) -> Option<f64>) -> Echoes {
        let cover = Echo { distance: COVER, brightness: self.cover * NEAR.powi(2) };
        let each = self.floor / self.beams.len() as f64;
        let mut met: Vec<_> = self.beams.iter().filter_map(meets).map(|distance| distance / self.level).collect();
        // Sorted by distance, the first gap longer than the pulse separates near and far targets.
        met.sort_by(f64::total_cmp);
        let is_apart = |pair: &[f64]| matches!(pair, [near, far] if far - near > PULSE);
        let split = met.windows(2).position(is_apart).map_or(met.len(), |place| place + 1);
        [mean(&met[..split], each), mean(&met[split..], each), cover]
    }

    /// The distance that the part reports: that of the strongest echo, biased towards others within
    /// its pulse. `None` without an echo.
    ///
    /// If the floor is beyond the maximum range, the cover's echo is reported instead, provided
    /// that it is as bright as a floor at the maximum range; a weaker one is not a target.
    pub fn reported(&self, echoes: &Echoes) -> Option<f64> {
        let [near, far, cover] = echoes;
        let floor = if far.rate() > near.rate() { far } else { near };
        let (of_floor, of_cover) = (floor.rate(), cover.rate());
        // Signal of a floor at the maximum range.
        let least = self.floor / self.ceiling.powi(2);
        let is_out_of_reach = of_floor == 0.0 || floor.distance > self.ceiling;
        if is_out_of_reach && of_cover >= least {
            Some(cover.distance)
        } else if of_floor == 0.0 {
            None
        } else if of_cover == 0.0 || floor.distance - cover.distance > PULSE {
            Some(floor.distance)
        } else {
            Some((floor.distance * of_floor + cover.distance * of_cover) / (of_floor + of_cover))
        }
    }
}

/// The maximum range under these conditions, m.
fn ceiling(conditions: &Conditions) -> f64 {
    let Conditions { range_reach: reach, floor_reflectance, ambient_light, .. } = conditions;
    let in_the_dark = reach * (floor_reflectance / WHITE).sqrt();
    let by_ambient = AMBIENT_CEILING * reach * libm::pow(50.0 / ambient_light, AMBIENT_EXPONENT);
    (in_the_dark.powi(-2) + by_ambient.powi(-2)).sqrt().recip().min(MAXIMUM)
}

/// Combines targets of equal brightness at these distances into one echo, at the signal-weighted
/// mean.
fn mean(distances: &[f64], each: f64) -> Echo {
    match distances {
        [] => Echo::NONE,
        [distance] => Echo { distance: *distance, brightness: each },
        distances => {
            let rates = distances.iter().map(|distance| Echo { distance: *distance, brightness: each }.rate());
            let sum =
                |(weighted, all): (f64, f64), (distance, rate): (&f64, f64)| (weighted + distance * rate, all + rate);
            let (weighted, all) = distances.iter().zip(rates).fold((0.0, 0.0), sum);
            Echo { distance: weighted / all, brightness: each * distances.len() as f64 }
        }
    }
}

/// Directions of the beams of a cone around an axis; only the axis for a cone without width.
fn beams(axis: &Vector3<f64>, half_angle: f64) -> Vec<Vector3<f64>> {
    if half_angle == 0.0 {
        return vec![*axis];
    }
    let side = if axis.x.abs() < 0.5 { Vector3::x() } else { Vector3::y() };
    let (across, along) = (axis.cross(&side).normalize(), axis.cross(&axis.cross(&side)).normalize());
    let ring = |(out, count): (f64, usize)| {
        (0..count).map(move |place| {
            let (turn, tilt) = (core::f64::consts::TAU * place as f64 / count as f64, out * half_angle);
            let ((sin, cos), (up, forward)) = (libm::sincos(turn), libm::sincos(tilt));
            axis * forward + (across * cos + along * sin) * up
        })
    };
    RINGS.into_iter().flat_map(ring).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(conditions: &Conditions) -> Light {
        Light::new(conditions, Vector3::z())
    }

    #[test]
    fn in_the_gentle_world_it_is_a_thin_beam_that_sees_four_metres() {
        let light = light(&Conditions::GENTLE);
        assert_eq!((light.ceiling, light.ambient, light.beams.len()), (4.0, 0.5, 1));
        let echoes = light.echoes(|_| Some(1.25));
        assert_eq!(
            echoes,
            [Echo { distance: 1.25, brightness: 8.0 }, Echo::NONE, Echo { distance: 0.02, brightness: 0.0 }]
        );
        assert_eq!(echoes[0].rate(), 8.0 / 1.5625);
        assert_eq!(light.reported(&echoes), Some(1.25));
        assert_eq!(light.reported(&light.echoes(|_| None)), None);
    }

    /// VL53L1X, tables 6 and 7, with the maximum range of its white chart.
    #[test]
    fn the_ceiling_is_the_data_sheets() {
        let rows = [(0.88, [3.6, 1.66, 0.73]), (0.54, [3.4, 1.54, 0.69]), (0.17, [1.7, 1.14, 0.68])];
        for (floor_reflectance, published) in rows {
            for (ambient_light, published) in [0.0, 50.0, 200.0].into_iter().zip(published) {
                let conditions =
                    Conditions { floor_reflectance, ambient_light, range_reach: 3.81, ..Conditions::GENTLE };
                let ratio = ceiling(&conditions) / published;
                assert!((ratio - 1.0).abs() < 0.13, "{floor_reflectance} in {ambient_light}: {ratio} of {published} m");
            }
        }
        let part = Conditions { range_reach: 3.0, floor_reflectance: 0.88, ..Conditions::GENTLE };
        assert!((ceiling(&part) - 3.0).abs() < 1e-9, "the VL53L3CX's title");
    }

    #[test]
    fn a_cone_over_a_level_floor_measures_its_distance_and_over_a_slope_less_than_its_axis() {
        let light = light(&Conditions { range_cone: 0.218, ..Conditions::GENTLE });
        assert_eq!(light.beams.len(), 13);
        let level = light.echoes(|beam| Some(1.0 / beam.z));
        assert!((light.reported(&level).expect("floor") - 1.0).abs() < 1e-12);
        assert!((level[0].rate() / 8.0 - 1.0).abs() < 0.05, "as much light as of a beam");
        // Tilted by 25°, the axis meets the floor at 1.1034 m; the nearer half of the cone returns
        // more light.
        let (sin, cos) = 25f64.to_radians().sin_cos();
        let tilted = light.echoes(|beam| Some(1.0 / (cos * beam.z + sin * beam.x)));
        let reported = light.reported(&tilted).expect("floor");
        assert!((1.07..1.1034).contains(&reported), "{reported}");
    }

    #[test]
    fn an_edge_in_the_cone_is_between_and_a_deep_one_is_the_stronger_of_two() {
        let light = light(&Conditions { range_cone: 0.218, ..Conditions::GENTLE });
        let over = |table: f64, share: f64| {
            // The table covers one side of the axis.
            light.echoes(move |beam| Some(if beam.x > 0.2 * share { table } else { 1.0 } / beam.z))
        };
        let half = light.reported(&over(0.7, 0.0)).expect("both");
        assert!((0.75..0.95).contains(&half), "a table 0.3 m high, half in the cone: {half}");
        let most = light.reported(&over(0.7, -0.5)).expect("mostly table");
        assert!(most < half && most > 0.7, "{most}");
        let deep = light.reported(&over(0.4, 0.0)).expect("two");
        assert!((0.39..0.41).contains(&deep), "0.6 m apart: the near one is the stronger: {deep}");
    }

    #[test]
    fn a_cover_pulls_what_is_near_and_stands_for_what_is_out_of_reach() {
        let reported = |range_cover: f64, distance: Option<f64>| {
            let light = light(&Conditions { range_cover, range_reach: 3.0, ..Conditions::GENTLE });
            assert!((2.0..2.1).contains(&light.ceiling), "{} m", light.ceiling);
            light.reported(&light.echoes(|_| distance))
        };
        assert!(reported(0.5, Some(0.4)).is_some_and(|near| (0.38..0.4).contains(&near)));
        assert_eq!(
            [reported(0.5, Some(1.5)), reported(5.0, Some(1.5))],
            [Some(1.5); 2],
            "it does not hide what is far"
        );
        // A clean window is not a target; a smeared one is, if there is no other.
        assert_eq!([reported(0.5, Some(2.5)), reported(0.5, None)], [Some(2.5), None]);
        assert_eq!([reported(5.0, Some(2.5)), reported(5.0, None)], [Some(0.02); 2], "a false target near by");
    }
}
