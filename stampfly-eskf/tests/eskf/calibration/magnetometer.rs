//! The ellipsoid fit.

use super::{CASES, Errors, MAG_NOISE, Random};
use stampfly_eskf::calibration::{EllipsoidFailure, EllipsoidFit, MagRefusal};
use stampfly_types::{Vec3, math};

/// A magnetometer with its iron: field → shape · field + offset.
fn magnetometer(random: &mut Random, offset: f32) -> (nalgebra::Matrix3<f32>, Vec3) {
    let mut shape = nalgebra::Matrix3::identity();
    for (row, column) in [(0, 1), (0, 2), (1, 2)] {
        let skew = random.within(0.06);
        (shape[(row, column)], shape[(column, row)]) = (skew, skew);
    }
    for axis in 0..3 {
        shape[(axis, axis)] = 1.0 + random.within(0.15);
    }
    (shape, random.vector(offset))
}

#[test]
fn hard_and_soft_iron_are_found_from_all_directions() {
    let (mut offsets, mut angles, mut residuals) = (Errors::default(), Errors::default(), Errors::default());
    for seed in 0..CASES {
        let random = &mut Random::new(seed);
        let strength = 45.0 + random.within(18.0);
        let (shape, offset) = magnetometer(random, 500.0);
        let mut fit = EllipsoidFit::default();
        for _ in 0..1_000 {
            let _ = fit.add(&(shape * random.direction() * strength + offset + random.noise(MAG_NOISE)));
        }
        let (correction, quality) = fit.solve().unwrap();
        offsets.0.push((correction.offset - offset).norm());
        let direction = random.direction();
        let corrected = correction.correct(shape * direction * strength + offset);
        angles.0.push(nalgebra::Vector3::from(corrected).angle(&direction.into()).to_degrees());
        residuals.0.push(quality.residual);
        assert!(quality.coverage == 1.0 && quality.samples > 900, "{quality:?}");
        assert!((correction.matrix - correction.matrix.transpose()).amax() < 1e-5);
        assert!((correction.matrix.determinant() - 1.0).abs() < 1e-4);
    }
    assert!(offsets.report("ellipsoid: offset, up to 500 each axis", "µT").1 < 0.3);
    assert!(angles.report("ellipsoid: any corrected direction", "°").1 < 0.5);
    let (median, worst) = residuals.report("ellipsoid: residual", "µT");
    assert!((0.8..1.2).contains(&(median / MAG_NOISE)) && worst < 2.0 * MAG_NOISE, "it measures the noise");
}

#[test]
fn a_vehicle_that_is_not_turned_every_way_gets_no_ellipsoid() {
    type Path = fn(f32) -> Vec3;
    let around = |angle: f32, up: f32| Vec3::new(math::cos(angle), math::sin(angle), up).normalize();
    let paths: [(&str, Path); 3] = [
        ("level", |angle| Vec3::new(math::cos(angle), math::sin(angle), 0.0)),
        ("a line", |angle| Vec3::new(math::cos(angle), 0.0, 0.0)),
        ("one spot", |_| Vec3::x()),
    ];
    for seed in 0..CASES {
        let random = &mut Random::new(seed);
        let mut refused = |name: &str, path: &dyn Fn(f32) -> Vec3| {
            let mut fit = EllipsoidFit::default();
            for step in 0..2_000u16 {
                let _ = fit.add(&(path(f32::from(step) * 0.05) * 48.0 + random.noise(MAG_NOISE)));
            }
            let result = fit.solve();
            assert!(result.is_err(), "{name}, seed {seed}: {result:?}");
        };
        for (name, path) in paths {
            refused(name, &path);
        }
        refused("a cone", &|angle| around(angle, 0.6));
        refused("a cap", &|angle| around(angle, 1.2 + 0.5 * math::sin(3.1 * angle)));
        refused("a hemisphere", &|angle| around(angle, 1.0 + 1.0 * math::sin(3.1 * angle)));
    }
}

#[test]
fn what_is_accepted_of_a_part_of_the_sphere_is_good() {
    let mut offsets = Errors::default();
    for seed in 0..5 * CASES {
        let random = &mut Random::new(seed);
        let (shape, offset) = magnetometer(random, 100.0);
        let (pole, lowest) = (random.direction(), random.within(1.0));
        let mut fit = EllipsoidFit::default();
        for _ in 0..2_000 {
            let direction = random.direction();
            if direction.dot(&pole) > lowest {
                let _ = fit.add(&(shape * direction * 45.0 + offset + random.noise(MAG_NOISE)));
            }
        }
        if let Ok((correction, _)) = fit.solve() {
            offsets.0.push((correction.offset - offset).norm());
        }
    }
    assert!(offsets.0.len() > CASES as usize);
    assert!(offsets.report("ellipsoid: offset, part of the sphere", "µT").1 < 2.0);
}

#[test]
fn a_strange_field_is_named() {
    let fit = |strength: f32, drift: f32| {
        let random = &mut Random::new(1);
        let mut fit = EllipsoidFit::default();
        for step in 0..600u16 {
            // The strength changes, as near a steel door.
            let strength = strength * (1.0 + drift * math::sin(f32::from(step) * 0.02));
            let _ = fit.add(&(random.direction() * strength));
        }
        fit.solve().map(|(_, quality)| quality)
    };
    assert!(fit(48.0, 0.0).is_ok());
    assert!(matches!(fit(8.0, 0.0), Err(EllipsoidFailure::Strength { strength }) if (strength - 8.0).abs() < 0.1));
    assert!(matches!(fit(48.0, 0.3), Err(EllipsoidFailure::Residual { residual }) if residual > 0.1));
    let mut one = EllipsoidFit::default();
    assert_eq!(one.add(&Vec3::repeat(f32::NAN)), Err(MagRefusal::NotFinite));
    assert_eq!(one.add(&Vec3::repeat(1e20)), Ok(()), "the first sample may be a spike");
    assert_eq!(one.add(&Vec3::x()), Err(MagRefusal::TooFar));
    assert_eq!(one.add(&Vec3::x()), Ok(()), "then the next one begins");
    assert_eq!(one.add(&Vec3::x()), Err(MagRefusal::TooNear));
    assert_eq!(one.solve().unwrap_err(), EllipsoidFailure::TooFew { samples: 1 });
}
