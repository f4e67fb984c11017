//! Aerodynamic forces and moments on wing, tail and fuselage.
//!
//! Linear in angles, rates and deflections up to the stall. Beyond it, lift and drag blend smoothly
//! into those of a flat plate (Beard and McLain, Small Unmanned Aircraft, 2012, equations 4.9 and
//! 4.10). Neglected: hysteresis and asymmetry of the stall, so the aeroplane does not enter spins;
//! the propeller's slipstream over the tail; the loss of control effectiveness at large angles.
use super::{AeroplaneParameters, Surface};
use nalgebra::Vector3;

/// Airspeed below which aerodynamic forces are set to zero, m/s.
const STILL: f64 = 0.05;

/// Deflections of the controls, rad, in the order of [`Surface`].
pub(super) type Angles = [f64; super::SURFACES];

/// Airflow relative to the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Flow {
    /// Airspeed, m/s.
    pub airspeed: f64,
    /// Angle of attack, rad.
    pub alpha: f64,
    /// Sideslip, rad, positive with the air from the right.
    pub beta: f64,
}

impl Flow {
    /// The flow for this velocity through the air, body FRD, m/s.
    pub(super) fn of(air: &Vector3<f64>) -> Self {
        let airspeed = air.norm();
        let beta = if airspeed > STILL { libm::asin((air.y / airspeed).clamp(-1.0, 1.0)) } else { 0.0 };
        Self { airspeed, alpha: libm::atan2(air.z, air.x), beta }
    }
}

/// Asymmetry of one specimen: dimensionless moment offsets about roll, pitch and yaw.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Warp(pub [f64; 3]);

/// Share of the induced drag that remains at this height above the ground (McCormick, Aerodynamics,
/// Aeronautics and Flight Mechanics).
fn ground_effect(height: f64, span: f64) -> f64 {
    let ratio = 16.0 * height.max(0.0) / span;
    ratio * ratio / (1.0 + ratio * ratio)
}

/// Separated share of the flow, 0 to 1.
fn separation(p: &AeroplaneParameters, alpha: f64) -> f64 {
    let above = libm::exp(-p.stall_sharpness * (alpha - p.stall_alpha));
    let below = libm::exp(p.stall_sharpness * (alpha + p.stall_alpha));
    (1.0 + above + below) / ((1.0 + above) * (1.0 + below))
}

/// Lift and drag coefficients. `pitching` is the dimensionless pitch rate, `height` that of the
/// wing above the ground, m.
pub(super) fn lift_and_drag(p: &AeroplaneParameters, alpha: f64, pitching: f64, d: &Angles, height: f64) -> [f64; 2] {
    let [right, left, elevator, rudder, flaps, _] = *d;
    let separated = separation(p, alpha);
    let (sin, cos) = libm::sincos(alpha);
    let controls = p.lift_aileron * (right + left) + p.lift_flap * flaps + p.lift_elevator * elevator;
    let attached = p.lift_0 + p.lift_alpha * alpha;
    // Lift of a flat plate, antisymmetric in the angle of attack.
    let plate = 2.0 * sin * sin.abs() * cos;
    let lift = (1.0 - separated) * attached + separated * plate + p.lift_q * pitching + controls;
    // Induced drag is quadratic in the lift above that of least drag, and vanishes as the flow
    // separates.
    let excess = (1.0 - separated) * (attached + controls - p.drag_lift_0);
    let induced = p.drag_induced * excess * excess * ground_effect(height, p.wing_span);
    let trimmed = p.drag_aileron * (right.abs() + left.abs())
        + p.drag_flap * flaps.abs()
        + p.drag_elevator * elevator.abs()
        + p.drag_rudder * rudder.abs();
    [lift, p.drag_0 + induced + trimmed + separated * 2.0 * (sin * sin * sin).abs()]
}

/// Pitching moment coefficient at a dimensionless pitch rate.
pub(super) fn pitching(p: &AeroplaneParameters, alpha: f64, rate: f64, d: &Angles) -> f64 {
    let [right, left, elevator, _, flaps, _] = *d;
    let separated = separation(p, alpha);
    // The sine gives a restoring moment from any angle.
    let alpha = (1.0 - separated) * alpha + separated * libm::sin(alpha);
    p.pitch_0
        + p.pitch_alpha * alpha
        + p.pitch_q * rate
        + p.pitch_aileron * (right + left)
        + p.pitch_flap * flaps
        + p.pitch_elevator * elevator
}

/// Aerodynamic force, N, and torque, N·m, on the body, body FRD.
///
/// `air` is the velocity through the air, `rate` the angular rate, both body FRD; `height` that of
/// the wing above the ground, m.
pub(super) fn loads(
    p: &AeroplaneParameters,
    warp: &Warp,
    air: &Vector3<f64>,
    rate: &Vector3<f64>,
    d: &Angles,
    height: f64,
) -> (Vector3<f64>, Vector3<f64>) {
    let Flow { airspeed, alpha, .. } = Flow::of(air);
    if airspeed < STILL {
        return (Vector3::zeros(), Vector3::zeros());
    }
    let pressure = 0.5 * p.air_density * airspeed * airspeed * p.wing_area;
    // Factors that make angular rates dimensionless.
    let (half_chord, half_span) = (0.5 * p.wing_chord / airspeed, 0.5 * p.wing_span / airspeed);
    let (roll, pitch, yaw) = (rate.x * half_span, rate.y * half_chord, rate.z * half_span);
    let rudder = d[Surface::Rudder as usize];
    // Only the difference of the ailerons rolls; their sum acts as flaps.
    let aileron = d[Surface::RightAileron as usize] - d[Surface::LeftAileron as usize];
    // The sine of the sideslip, which is bounded when the air comes from the side or from behind.
    let slip = air.y / airspeed;
    let across = (air.x * air.x + air.z * air.z).sqrt();
    let (cos_a, sin_a) = if across > STILL { (air.x / across, air.z / across) } else { (1.0, 0.0) };
    // Only the flow across the wing produces lift (simple sweep theory).
    let crossing = 1.0 - slip * slip;

    let [lift, drag] = lift_and_drag(p, alpha, pitch, d, height);
    let lift = lift * crossing;
    let side = p.side_beta * slip + p.side_p * roll + p.side_r * yaw + p.side_rudder * rudder;
    // Drag is opposite to the motion through the air, lift perpendicular to it in the plane of
    // symmetry.
    let force = air * (-drag / airspeed) + Vector3::new(lift * sin_a, side, -lift * cos_a);

    let moment = Vector3::new(
        p.roll_beta * slip + p.roll_p * roll + p.roll_r * yaw + p.roll_aileron * aileron + p.roll_rudder * rudder,
        pitching(p, alpha, pitch, d) * crossing,
        p.yaw_beta * slip + p.yaw_p * roll + p.yaw_r * yaw + p.yaw_aileron * aileron + p.yaw_rudder * rudder,
    ) + Vector3::from(warp.0);
    // Reference lengths of the moment coefficients.
    let lengths = Vector3::new(p.wing_span, p.wing_chord, p.wing_span);
    (force * pressure, moment.component_mul(&lengths) * pressure)
}

#[cfg(test)]
mod tests {
    use super::*;

    const P: AeroplaneParameters = AeroplaneParameters::EXAMPLE;

    fn lift(alpha: f64) -> f64 {
        lift_and_drag(&P, alpha, 0.0, &[0.0; 6], 100.0)[0]
    }

    #[test]
    fn lift_grows_as_published_falls_after_the_stall_and_is_a_plates_at_last() {
        assert!((lift(0.1) - (0.1068 + 0.458)).abs() < 1e-3);
        let (most, at) = (0..600)
            .map(|i| (lift(f64::from(i) * 1e-3), i))
            .fold((0.0, 0), |a, b| if b.0 > a.0 && b.1 < 400 { b } else { a });
        assert!((most - 1.08).abs() < 0.01 && (220..250).contains(&at), "{most} at {at} mrad");
        assert!(lift(0.33) < 0.5 * most, "{}", lift(0.33));
        assert!((lift(0.7) - 2.0 * 0.7f64.sin().powi(2) * 0.7f64.cos()).abs() < 1e-3);
        assert!(lift(-0.7) < -0.6 && lift(2.5) < 0.0, "upside down and backwards");
        // 2·m·g / (ρ·S·CLmax).
        let stall = (2.0 * P.mass * P.gravity / (P.air_density * P.wing_area * most)).sqrt();
        assert!((stall - 5.0).abs() < 0.1, "{stall} m/s");
    }

    #[test]
    fn the_ground_takes_induced_drag_away() {
        let drag = |height| lift_and_drag(&P, 0.15, 0.0, &[0.0; 6], height)[1];
        assert!(drag(0.15) < drag(0.5) && drag(0.5) < drag(10.0));
        assert!(
            (drag(0.25 * P.wing_span) - P.drag_0) / (drag(100.0) - P.drag_0) > 0.9,
            "a quarter of the span is high already"
        );
    }

    #[test]
    fn whatever_comes_from_the_right_turns_the_nose_there() {
        let (force, torque) =
            loads(&P, &Warp::default(), &Vector3::new(10.0, 1.0, 0.0), &Vector3::zeros(), &[0.0; 6], 50.0);
        assert!(force.y < 0.0 && torque.z > 0.0 && torque.x < 0.0, "{force:?} {torque:?}");
    }

    #[test]
    fn controls_turn_where_their_signs_say() {
        let torque = |surface: Surface| {
            let mut d = [0.0; 6];
            d[surface as usize] = 0.1;
            let with = loads(&P, &Warp::default(), &Vector3::new(10.0, 0.0, 0.0), &Vector3::zeros(), &d, 50.0).1;
            with - loads(&P, &Warp::default(), &Vector3::new(10.0, 0.0, 0.0), &Vector3::zeros(), &[0.0; 6], 50.0).1
        };
        assert!(torque(Surface::RightAileron).x < 0.0 && torque(Surface::LeftAileron).x > 0.0);
        assert!(torque(Surface::Elevator).y < 0.0 && torque(Surface::Rudder).z < 0.0);
    }
}
