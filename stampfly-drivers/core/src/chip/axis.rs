//! Orientation of a chip on its board, in steps of 90°.
//!
//! Every driver delivers its samples in the body frame (FRD). The board's code passes the mounting
//! of each chip as an [`AxisMap`]. Not for mounting errors of a few degrees: correct those by
//! calibration.

use stampfly_types::Vec3;

/// An axis of the chip, in its positive or negative direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum Axis {
    PlusX,
    MinusX,
    PlusY,
    MinusY,
    PlusZ,
    MinusZ,
}

impl Axis {
    const fn number(self) -> u8 {
        match self {
            Self::PlusX | Self::MinusX => 0,
            Self::PlusY | Self::MinusY => 1,
            Self::PlusZ | Self::MinusZ => 2,
        }
    }

    const fn is_negative(self) -> bool {
        matches!(self, Self::MinusX | Self::MinusY | Self::MinusZ)
    }

    fn of(self, chip: &Vec3) -> f32 {
        match self {
            Self::PlusX => chip.x,
            Self::MinusX => -chip.x,
            Self::PlusY => chip.y,
            Self::MinusY => -chip.y,
            Self::PlusZ => chip.z,
            Self::MinusZ => -chip.z,
        }
    }
}

/// Maps each body axis (FRD) to the chip axis that points along it.
///
/// ```
/// use stampfly_driver_core::chip::{Axis, AxisMap};
/// use stampfly_types::Vec3;
/// // A chip mounted upside down, with its x axis to the right.
/// let map = AxisMap::new(Axis::PlusY, Axis::PlusX, Axis::MinusZ).expect("a rotation");
/// assert_eq!(map.to_body(Vec3::new(1.0, 2.0, 3.0)), Vec3::new(2.0, 1.0, -3.0));
/// assert_eq!(AxisMap::new(Axis::PlusX, Axis::PlusX, Axis::PlusZ), None, "an axis is used twice");
/// assert_eq!(AxisMap::new(Axis::PlusY, Axis::PlusX, Axis::PlusZ), None, "a mirror");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AxisMap {
    forward: Axis,
    right: Axis,
    down: Axis,
}

impl AxisMap {
    /// The chip's axes coincide with the body's.
    pub const IDENTITY: Self = Self { forward: Axis::PlusX, right: Axis::PlusY, down: Axis::PlusZ };

    /// A map from the chip axes that point forward, right and down. `None` when an axis is used
    /// twice or when the axes are a mirror image instead of a rotation.
    #[must_use]
    pub const fn new(forward: Axis, right: Axis, down: Axis) -> Option<Self> {
        let (first, second, third) = (forward.number(), right.number(), down.number());
        if first == second || second == third || third == first {
            return None;
        }
        // The determinant is the sign of the permutation, plus when it is cyclic, times the product
        // of the three directions. A rotation has plus one.
        let cyclic = (first + 1) % 3 == second;
        let negative = forward.is_negative() ^ right.is_negative() ^ down.is_negative();
        if cyclic == negative { None } else { Some(Self { forward, right, down }) }
    }

    /// Turns a vector from chip axes into body axes.
    #[must_use]
    pub fn to_body(self, chip: Vec3) -> Vec3 {
        Vec3::new(self.forward.of(&chip), self.right.of(&chip), self.down.of(&chip))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_all_signed_triples_exactly_the_24_rotations_are_maps() {
        use Axis::{MinusX, MinusY, MinusZ, PlusX, PlusY, PlusZ};
        let all = [PlusX, MinusX, PlusY, MinusY, PlusZ, MinusZ];
        let mut rotations = 0;
        for forward in all {
            for right in all {
                for down in all {
                    let rows =
                        [forward, right, down].map(|axis| [Vec3::x(), Vec3::y(), Vec3::z()].map(|unit| axis.of(&unit)));
                    let columns = rows.map(Vec3::from);
                    let determinant = columns[0].cross(&columns[1]).dot(&columns[2]);
                    assert_eq!(AxisMap::new(forward, right, down).is_some(), determinant == 1.0);
                    rotations += i32::from(determinant == 1.0);
                }
            }
        }
        assert_eq!(rotations, 24);
    }

    #[test]
    fn the_identity_is_a_rotation_and_changes_nothing() {
        let AxisMap { forward, right, down } = AxisMap::IDENTITY;
        assert_eq!(AxisMap::new(forward, right, down), Some(AxisMap::IDENTITY));
        assert_eq!(AxisMap::IDENTITY.to_body(Vec3::new(1.0, -2.0, 3.0)), Vec3::new(1.0, -2.0, 3.0));
    }
}
