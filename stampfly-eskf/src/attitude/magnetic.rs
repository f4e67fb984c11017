//! Classifies a magnetic field: clean, disturbed, or that of another place.
//!
//! Strength and dip of a field are known without the heading. A sample that differs from the
//! reference in either is disturbed. A different field that stays constant while the body turns
//! belongs to another place and becomes the reference; the first reference is kept and used again
//! as soon as it returns.
//!
//! [`Heading`](super::heading::Heading) decides the effect of a disturbed field and the direction
//! of a new one. A field that is only rotated about the vertical cannot be detected here.
//!
//! After Laidig, Seel, "VQF", Information Fusion 91, 2023, section 3.5; the return to the first
//! reference is new.

use super::config::AttitudeConfig;
use super::low_pass::LowPass;
use nalgebra::Vector2;
use stampfly_types::{Vec3, math};

/// Time constant of strength and dip, s.
const SMOOTHING: f32 = 0.05;
/// Sum of slow rotation with a constant field that suffices for a first reference, rad: one circle,
/// there and back. A boat at 10°/s takes about a minute.
const SLOW_TURNS: f32 = core::f32::consts::TAU;

/// A field without its heading.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Field {
    strength: f32,
    dip: f32,
}

impl Field {
    /// Strength and dip of a field in the level frame; `None` if its horizontal part is at most 1
    /// µT.
    fn of(field: &Vec3) -> Option<Self> {
        let level = math::sqrt(field.x * field.x + field.y * field.y);
        (level > 1.0).then(|| Self { strength: field.norm(), dip: math::atan2(field.z, level) })
    }

    /// Distance of another field, where one is the largest tolerated difference.
    fn distance(&self, config: &AttitudeConfig, other: &Self) -> f32 {
        let strength = (other.strength - self.strength).abs() / (config.mag_strength_tolerance * self.strength);
        strength.max((other.dip - self.dip).abs() / config.mag_dip_tolerance)
    }

    fn follow(&mut self, other: &Self, share: f32) {
        self.strength += (other.strength - self.strength) * share;
        self.dip += (other.dip - self.dip) * share;
    }
}

/// Classification of a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum FieldStatus {
    /// Consistent with the reference.
    Clean {
        /// Distance from the reference, one at the limit.
        ratio: f32,
    },
    /// Inconsistent with the reference.
    Disturbed {
        /// Distance from the reference, above one unless it has only just become consistent.
        ratio: f32,
    },
    /// No reference yet.
    NoReference,
    /// With this sample it became the first reference.
    FirstReference,
    /// With this sample it replaced the reference.
    NewReference,
    /// With this sample the first reference became valid again.
    ReferenceReturned,
    /// No horizontal part.
    Vertical,
}

/// Comparison with the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Magnetic {
    current: LowPass<2>,
    reference: Option<Field>,
    /// The first reference, while another one is in use.
    home: Option<Field>,
    candidate: Option<Field>,
    agrees_for: f32,
    home_agrees_for: f32,
    candidate_for: f32,
    /// Slow rotation since the candidate was first seen, rad.
    slowly_turned: f32,
}

impl Magnetic {
    /// Expects fields like `reference`, level frame, µT. Without one, waits for a constant field.
    pub fn new(reference: Option<&Vec3>) -> Self {
        Self {
            current: LowPass::new(SMOOTHING),
            reference: reference.and_then(Field::of),
            home: None,
            candidate: None,
            // The initial reference is valid at once.
            agrees_for: f32::MAX,
            home_agrees_for: 0.0,
            candidate_for: 0.0,
            slowly_turned: 0.0,
        }
    }

    /// Takes a field in the level frame, µT, `dt` seconds after the last one, and the angular rate,
    /// rad/s.
    pub fn step(&mut self, config: &AttitudeConfig, field: &Vec3, rate: f32, dt: f32) -> FieldStatus {
        let Some(measured) = Field::of(field) else { return FieldStatus::Vertical };
        self.current.step(&Vector2::new(measured.strength, measured.dip), dt);
        let &[strength, dip] = self.current.value().as_ref();
        let now = Field { strength, dip };
        let follow = (dt / config.mag_reference_time).min(1.0);

        // Compare with the reference, which follows the field slowly while both agree.
        let mut ratio = f32::MAX;
        let mut clean = false;
        if let Some(reference) = &mut self.reference {
            ratio = reference.distance(config, &now);
            self.agrees_for = if ratio < 1.0 { self.agrees_for + dt } else { 0.0 };
            if self.agrees_for >= config.mag_agree_time {
                clean = true;
                reference.follow(&now, follow);
            }
        }
        // The first reference takes over if it fits better than the present one.
        if let Some(home) = self.home {
            let distance = home.distance(config, &now);
            self.home_agrees_for = if distance < ratio.min(1.0) { self.home_agrees_for + dt } else { 0.0 };
            if self.home_agrees_for >= config.mag_agree_time {
                (self.reference, self.home) = (Some(home), None);
                self.agrees_for = self.home_agrees_for;
                return FieldStatus::ReferenceReturned;
            }
        }
        // A candidate must stay constant while the body turns.
        match &mut self.candidate {
            Some(candidate) if candidate.distance(config, &now) < 1.0 => {
                candidate.follow(&now, follow);
                if rate >= config.mag_renew_rate {
                    self.candidate_for += dt;
                } else if rate >= config.rest_rate {
                    self.slowly_turned += rate * dt;
                }
            }
            candidate => {
                *candidate = Some(now);
                self.candidate_for = 0.0;
                self.slowly_turned = 0.0;
            }
        }
        let found = match self.reference {
            None => self.candidate_for >= config.mag_first_time || self.slowly_turned >= SLOW_TURNS,
            Some(_) => self.candidate_for >= config.mag_renew_time,
        };
        if !clean && found {
            let before = core::mem::replace(&mut self.reference, self.candidate);
            self.home = self.home.or(before);
            (self.agrees_for, self.home_agrees_for) = (config.mag_agree_time, 0.0);
            return if before.is_some() { FieldStatus::NewReference } else { FieldStatus::FirstReference };
        }
        match (clean, self.reference) {
            (true, _) => FieldStatus::Clean { ratio },
            (false, Some(_)) => FieldStatus::Disturbed { ratio },
            (false, None) => FieldStatus::NoReference,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EARTH: Vec3 = Vec3::new(16.0, 0.0, 42.0);
    const DT: f32 = 0.01;

    /// Classifications over `time` seconds of one field at `rate`: number of clean ones, and of the
    /// other kinds.
    fn seconds(magnetic: &mut Magnetic, time: f32, field: Vec3, rate: f32) -> (u32, [u32; 4]) {
        let config = AttitudeConfig::default();
        let (mut clean, mut others) = (0, [0; 4]);
        for _ in 0..(time / DT) as u32 {
            match magnetic.step(&config, &field, rate, DT) {
                FieldStatus::Clean { .. } => clean += 1,
                FieldStatus::Disturbed { .. } => others[0] += 1,
                FieldStatus::NewReference | FieldStatus::FirstReference => others[1] += 1,
                FieldStatus::ReferenceReturned => others[2] += 1,
                FieldStatus::NoReference | FieldStatus::Vertical => others[3] += 1,
            }
        }
        (clean, others)
    }

    #[test]
    fn a_turning_body_finds_its_first_reference_and_a_still_one_waits() {
        let mut magnetic = Magnetic::new(None);
        assert_eq!(seconds(&mut magnetic, 30.0, EARTH, 0.0), (0, [0, 0, 0, 3_000]));
        let (clean, others) = seconds(&mut magnetic, 10.0, EARTH, 1.0);
        assert!(clean > 400 && others[1] == 1, "{clean} {others:?}");
    }

    #[test]
    fn slow_turns_make_a_first_reference_and_no_other() {
        let mut magnetic = Magnetic::new(None);
        let (clean, others) = seconds(&mut magnetic, 60.0, EARTH, 0.15);
        assert!(clean > 1_500 && others[1] == 1, "{clean} {others:?}");
        let (_, others) = seconds(&mut magnetic, 120.0, EARTH * 1.3, 0.15);
        assert_eq!(others[1], 0, "another place takes a body that turns");
        let (_, others) = seconds(&mut Magnetic::new(None), 600.0, EARTH, 0.02);
        assert_eq!(others[1], 0, "that is the gyro's bias");
    }

    #[test]
    fn stronger_and_steeper_fields_are_disturbed_and_turned_ones_are_not() {
        let mut magnetic = Magnetic::new(Some(&EARTH));
        assert_eq!(seconds(&mut magnetic, 2.0, EARTH, 1.0), (200, [0; 4]));
        let (clean, others) = seconds(&mut magnetic, 5.0, EARTH * 1.2, 1.0);
        assert!(clean < 20 && others[0] > 480, "{clean} {others:?}");
        let (clean, _) = seconds(&mut magnetic, 5.0, Vec3::new(0.0, 16.0, 42.0), 1.0);
        assert!(clean > 430, "{clean}: no one can tell");
        let (clean, _) = seconds(&mut magnetic, 5.0, Vec3::new(4.0, 0.0, 44.8), 1.0);
        assert!(clean < 20, "{clean}");
    }

    #[test]
    fn another_place_is_learned_in_motion_only_and_left_again() {
        let config = AttitudeConfig::default();
        let mut magnetic = Magnetic::new(Some(&EARTH));
        let elsewhere = EARTH * 1.3;
        let (_, others) = seconds(&mut magnetic, 60.0, elsewhere, 0.0);
        assert_eq!(others[1], 0, "beside a magnet on the table");
        let (clean, others) = seconds(&mut magnetic, 2.0 * config.mag_renew_time, elsewhere, 1.0);
        assert!(clean > 1_000 && others[1] == 1, "{clean} {others:?}");
        let (clean, others) = seconds(&mut magnetic, 2.0, EARTH, 1.0);
        assert!(clean > 100 && others[2] == 1, "{clean} {others:?}");
    }

    #[test]
    fn a_field_without_a_level_part_has_no_heading() {
        let mut magnetic = Magnetic::new(Some(&EARTH));
        let verdict = magnetic.step(&AttitudeConfig::default(), &Vec3::new(0.0, 0.5, 50.0), 0.0, DT);
        assert_eq!(verdict, FieldStatus::Vertical);
    }
}
