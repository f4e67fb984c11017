//! Parameters of an aeroplane as a table settable by name, and an example with its sources.

use crate::conditions::Conditions;
use crate::plant::battery::BatterySpec;
use crate::plant::table::parameters;

parameters! {
    /// Airframe, aerodynamics, propulsion, undercarriage and servos of a conventional aeroplane
    /// with a nose wheel.
    ///
    /// Coefficients refer to wing area, mean chord (pitch) and span (roll, yaw). Lift and drag are
    /// in wind axes, side force and moments in body axes. Rates are made dimensionless with half
    /// the chord or half the span divided by the airspeed (Klein and Morelli, Aircraft System
    /// Identification). Deflections are positive with the trailing edge down, for the rudder with
    /// the trailing edge left.
    ///
    /// ```
    /// use stampfly_sim::param::parameters;
    /// use stampfly_sim::plant::AeroplaneParameters;
    ///
    /// let mut plane = AeroplaneParameters::EXAMPLE;
    /// parameters::set(&mut plane, "mass", 0.6)?;
    /// assert_eq!(plane.mass, 0.6);
    /// # Ok::<(), stampfly_sim::param::ParameterError<f64>>(())
    /// ```
    AeroplaneParameters,
    /// The Ultra Stick 25e of the University of Minnesota's UAV laboratory, with the mass of a slow
    /// flyer, a smaller propeller and a nose wheel.
    ///
    /// Geometry and derivatives are published (UASLab/OpenFlightSim,
    /// `Simulation/aircraft/UltraStick25e`, MIT licence: `AeroOpenFlight.xml`,
    /// `MetricsOpenFlight.xml`, identified from flights; `Engines/APC 12x6e.xml` from the
    /// manufacturer's data). The original weighs 1.959 kg and stalls at about 9.7 m/s. Here mass,
    /// moments of inertia, springs and dampers are 0.2706 of the published values
    /// (`MassOpenFlight.xml`, `Gear.xml`), so all speeds are 0.52 of the original and it stalls at
    /// 5 m/s. The propeller is scaled to 8 inches; the thrust line passes through the centre of
    /// mass, 46 mm above the published one; the undercarriage is reversed. Values that are not
    /// published are marked as assumptions in the source of the table.
    EXAMPLE {
        // MassOpenFlight.xml times 0.2706.
        mass = 0.53 ["kg"] in 0.05 ..= 25.0, "Take-off mass, battery included.";
        inertia_x = 0.01935 ["kg*m^2"] in 1e-4 ..= 20.0, "Moment of inertia about body x.";
        inertia_y = 0.02337 ["kg*m^2"] in 1e-4 ..= 20.0, "Moment of inertia about body y.";
        inertia_z = 0.04157 ["kg*m^2"] in 1e-4 ..= 20.0, "Moment of inertia about body z.";
        inertia_xz = 0.00379 ["kg*m^2"] in -1.0 ..= 1.0, "Product of inertia, the integral of x times z over the mass.";
        gravity = 9.80665 ["m/s^2"] in 0.0 ..= 20.0, "Gravity (ISO 80000-3).";
        air_density = 1.225 ["kg/m^3"] in 0.3 ..= 1.5, "Density of the air (ICAO standard atmosphere at sea level).";
        // A wing warped by a few tenths of a degree: an assumption.
        manufacturing_spread = 1.0 ["1"] in 0.0 ..= 5.0, "Scales the per-seed warp of wing and tail; 0 is the perfect aeroplane.";

        // MetricsOpenFlight.xml.
        wing_area = 0.3097 ["m^2"] in 0.01 ..= 10.0, "Wing area.";
        wing_span = 1.27 ["m"] in 0.2 ..= 10.0, "Wing span.";
        wing_chord = 0.25 ["m"] in 0.02 ..= 2.0, "Mean aerodynamic chord.";

        // AeroOpenFlight.xml. Its lift due to the rate of the angle of attack (1.9724) is
        // neglected. Its side force is perpendicular to the wind instead of the body, which is
        // equivalent at small sideslip.
        lift_0 = 0.1068 ["1"] in -1.0 ..= 1.0, "Lift at no angle of attack.";
        lift_alpha = 4.58 ["1/rad"] in 1.0 ..= 7.0, "Lift by angle of attack.";
        lift_q = 6.1639 ["1"] in 0.0 ..= 20.0, "Lift by pitch rate.";
        lift_aileron = 0.23755 ["1/rad"] in 0.0 ..= 2.0, "Lift by one aileron.";
        lift_flap = 0.74 ["1/rad"] in 0.0 ..= 3.0, "Lift by both flaps.";
        lift_elevator = 0.0983 ["1/rad"] in -1.0 ..= 2.0, "Lift by elevator.";
        // Not published. A steep sigmoid (Beard and McLain, Small Unmanned Aircraft, 2012, equation
        // 4.10, M of table E.2), placed so that the largest lift is 1.08 at 13 degrees, as usual
        // for a plain wing at this Reynolds number: an assumption.
        stall_alpha = 0.28 ["rad"] in 0.1 ..= 1.0, "Angle of attack at which half of the wing's flow has separated.";
        stall_sharpness = 50.0 ["1/rad"] in 5.0 ..= 200.0, "How suddenly it separates.";
        // AeroOpenFlight.xml.
        drag_0 = 0.0434 ["1"] in 0.0 ..= 0.5, "Least drag.";
        drag_lift_0 = 0.23 ["1"] in -0.5 ..= 1.0, "Lift at which the drag is least.";
        drag_induced = 0.0814934 ["1"] in 0.0 ..= 0.5, "Drag by the square of lift above that.";
        drag_aileron = 0.0151 ["1/rad"] in 0.0 ..= 0.5, "Drag by one aileron.";
        drag_flap = 0.1467 ["1/rad"] in 0.0 ..= 0.5, "Drag by both flaps.";
        drag_elevator = 0.0135 ["1/rad"] in 0.0 ..= 0.5, "Drag by elevator.";
        drag_rudder = 0.0303 ["1/rad"] in 0.0 ..= 0.5, "Drag by rudder.";
        side_beta = -0.4889 ["1/rad"] in -3.0 ..= 0.0, "Side force by sideslip.";
        side_p = -0.0375 ["1"] in -1.0 ..= 1.0, "Side force by roll rate.";
        side_r = 0.15 ["1"] in -1.0 ..= 1.0, "Side force by yaw rate.";
        side_rudder = 0.1913 ["1/rad"] in -1.0 ..= 1.0, "Side force by rudder.";
        roll_beta = -0.0545 ["1/rad"] in -0.5 ..= 0.5, "Rolling moment by sideslip.";
        roll_p = -0.4496 ["1"] in -2.0 ..= 0.0, "Rolling moment by roll rate.";
        roll_r = 0.1086 ["1"] in -1.0 ..= 1.0, "Rolling moment by yaw rate.";
        roll_aileron = -0.0823 ["1/rad"] in -1.0 ..= 0.0, "Rolling moment by the right aileron.";
        roll_rudder = 0.0115 ["1/rad"] in -0.5 ..= 0.5, "Rolling moment by rudder.";
        pitch_0 = -0.0278 ["1"] in -0.5 ..= 0.5, "Pitching moment at no angle of attack.";
        pitch_alpha = -0.723 ["1/rad"] in -5.0 ..= 1.0, "Pitching moment by angle of attack.";
        pitch_q = -13.5664 ["1"] in -60.0 ..= 0.0, "Pitching moment by pitch rate.";
        pitch_aileron = 0.02335 ["1/rad"] in -1.0 ..= 1.0, "Pitching moment by one aileron.";
        pitch_flap = 0.0467 ["1/rad"] in -1.0 ..= 1.0, "Pitching moment by both flaps.";
        pitch_elevator = -0.8488 ["1/rad"] in -5.0 ..= 0.0, "Pitching moment by elevator.";
        yaw_beta = 0.0723 ["1/rad"] in -0.5 ..= 1.0, "Yawing moment by sideslip.";
        yaw_p = 0.118 ["1"] in -0.5 ..= 0.5, "Yawing moment by roll rate.";
        yaw_r = -0.1833 ["1"] in -1.0 ..= 0.0, "Yawing moment by yaw rate.";
        yaw_aileron = 0.0287 ["1/rad"] in -0.5 ..= 0.5, "Yawing moment by the right aileron.";
        yaw_rudder = -0.1811 ["1/rad"] in -1.0 ..= 0.0, "Yawing moment by rudder.";

        // Effectors.xml: 30 degrees, 33 rad/s, 20 ms. The speed is that of a small digital servo,
        // 60 degrees in 0.12 s over a throw of 45 degrees: an assumption.
        reach_aileron = 0.52 ["rad"] in 0.05 ..= 1.2, "Largest deflection of an aileron.";
        reach_flap = 0.52 ["rad"] in 0.0 ..= 1.2, "Largest deflection of the flaps.";
        reach_elevator = 0.52 ["rad"] in 0.05 ..= 1.2, "Largest deflection of the elevator.";
        reach_rudder = 0.52 ["rad"] in 0.05 ..= 1.2, "Largest deflection of the rudder.";
        servo_time_constant = 0.0303 ["s"] in 0.0 ..= 1.0, "Time constant of the servos.";
        servo_speed = 11.0 ["1/s"] in 0.1 ..= 1000.0, "Shares of the largest deflection that a servo runs through in a second.";
        servo_period = 0.02 ["s"] in 0.0 ..= 0.1, "Time between two pulses that tell the servos where to go.";

        // Engines/APC 12x6e.xml: cubic polynomials through its 30 points, with errors up to 0.0008
        // and 0.0010. Diameter 8 inches.
        propeller_diameter = 0.2032 ["m"] in 0.05 ..= 1.5, "Diameter of the propeller.";
        thrust_0 = 0.10865 ["1"] in 0.0 ..= 0.3, "Thrust coefficient at no advance.";
        thrust_1 = -0.02912 ["1"] in -1.0 ..= 1.0, "Thrust coefficient by advance ratio.";
        thrust_2 = -0.22764 ["1"] in -2.0 ..= 2.0, "Thrust coefficient by its square.";
        thrust_3 = 0.09452 ["1"] in -2.0 ..= 2.0, "Thrust coefficient by its cube.";
        power_0 = 0.05671 ["1"] in 0.0 ..= 0.3, "Power coefficient at no advance.";
        power_1 = -0.07749 ["1"] in -1.0 ..= 1.0, "Power coefficient by advance ratio.";
        power_2 = 0.13741 ["1"] in -2.0 ..= 2.0, "Power coefficient by its square.";
        power_3 = -0.17411 ["1"] in -2.0 ..= 2.0, "Power coefficient by its cube.";
        advance_limit = 0.9 ["1"] in 0.1 ..= 3.0, "Largest advance ratio for which the coefficients are good; beyond, they stay.";
        // The published 1.2991e-4 kg m^2 times (8/12)^5, plus a motor bell of 0.9e-5 kg m^2. From
        // here to the battery: assumptions.
        propeller_inertia = 2.6e-5 ["kg*m^2"] in 1e-8 ..= 0.1, "Moment of inertia of propeller and motor.";
        propeller_spin = 1.0 ["1"] in -1.0 ..= 1.0, "1 turns clockwise seen from behind, -1 the other way; 0 has no torque on the airframe.";
        propeller_ahead = 0.298 ["m"] in -2.0 ..= 2.0, "Propeller ahead of the centre of mass.";
        propeller_below = 0.0 ["m"] in -0.5 ..= 0.5, "Thrust line below the centre of mass.";
        propeller_nominal_speed = 890.0 ["rad/s"] in 10.0 ..= 5000.0, "Speed in cruise; the vibration is referred to it.";
        // 1100 rpm/V.
        motor_constant = 0.00868 ["V*s/rad"] in 1e-4 ..= 1.0, "Voltage by speed without load, and torque by current.";
        motor_resistance = 0.12 ["ohm"] in 0.001 ..= 5.0, "Winding, controller and leads.";
        motor_idle_current = 0.5 ["A"] in 0.0 ..= 5.0, "Current that friction takes.";

        battery_cells = 3.0 ["1"] in 1.0 ..= 12.0, "Lithium cells in series.";
        battery_capacity = 1.3 ["A*h"] in 0.01 ..= 50.0, "Capacity of the battery.";
        battery_charge = 1.0 ["1"] in 0.0 ..= 1.0, "State of charge at the start.";
        battery_resistance = 0.03 ["ohm"] in 0.0 ..= 1.0, "Internal resistance that acts at once, leads included.";
        battery_polarisation = 0.015 ["ohm"] in 0.0 ..= 1.0, "Internal resistance that acts with the time constant.";
        battery_time_constant = 10.0 ["s"] in 0.1 ..= 1000.0, "Time constant of the polarisation.";
        board_current = 0.3 ["A"] in 0.0 ..= 5.0, "What everything but the motor draws, servos at rest.";
        // A magnetometer in the wing, away from the leads.
        field_x = -0.1 ["uT/A"] in -50.0 ..= 50.0, "Field of the battery current at the magnetometer, body x.";
        field_y = 0.15 ["uT/A"] in -50.0 ..= 50.0, "Field of the battery current at the magnetometer, body y.";
        field_z = -0.1 ["uT/A"] in -50.0 ..= 50.0, "Field of the battery current at the magnetometer, body z.";
        static_wash = 0.0 ["Pa"] in -50.0 ..= 50.0, "Pressure of the propeller's wash at the barometer in cruise.";

        // Gear.xml relative to the centre of mass of MassOpenFlight.xml, reversed: the published
        // main wheels are 38 mm ahead of it.
        gear_height = 0.2238 ["m"] in 0.02 ..= 2.0, "Height of the centre of mass, standing.";
        gear_main = 0.038 ["m"] in 0.001 ..= 1.0, "Main wheels behind the centre of mass.";
        gear_nose = 0.22 ["m"] in 0.01 ..= 2.0, "Nose wheel ahead of the centre of mass.";
        gear_track = 0.3302 ["m"] in 0.02 ..= 3.0, "Distance between the main wheels.";
        gear_stiffness = 990.0 ["N/m"] in 10.0 ..= 1e5, "Spring of one wheel.";
        gear_damping = 31.5 ["N*s/m"] in 0.0 ..= 1e4, "Damper of one wheel.";
        // Gear.xml has 0.02 and 0.5. Small wheels on short grass have more rolling friction;
        // brakes, steering and relaxation length are assumptions.
        wheel_rolling = 0.08 ["1"] in 0.0 ..= 1.0, "Rolling friction.";
        wheel_side = 0.5 ["1"] in 0.0 ..= 2.0, "Friction across a wheel.";
        wheel_brake = 0.3 ["1"] in 0.0 ..= 2.0, "Friction along a main wheel that is braked.";
        wheel_relaxation = 0.04 ["m"] in 0.001 ..= 2.0, "Way on which a rolling wheel loses its side deflection.";
        steering_reach = 0.2 ["rad"] in 0.0 ..= 1.2, "Largest angle of the nose wheel, with the rudder.";
        // The tail skid is from Gear.xml, the other contact points from the geometry.
        body_stiffness = 600.0 ["N/m"] in 10.0 ..= 1e5, "Spring of nose, tail, fin and wing tips.";
        body_damping = 5.0 ["N*s/m"] in 0.0 ..= 1e4, "Damper of nose, tail, fin and wing tips.";
        body_friction = 0.5 ["1"] in 0.0 ..= 2.0, "Friction of nose, tail, fin and wing tips.";
        tail_behind = 0.667 ["m"] in 0.05 ..= 5.0, "Tail skid behind the centre of mass.";
        tail_below = 0.084 ["m"] in -0.5 ..= 1.0, "Tail skid below the centre of mass.";
        fin_above = 0.2 ["m"] in 0.0 ..= 2.0, "Tip of the fin above the centre of mass.";
        tips_above = 0.03 ["m"] in -0.5 ..= 1.0, "Wing tips above the centre of mass.";
    }
}

impl AeroplaneParameters {
    /// The Ultra Stick 25e with its published mass and propeller; it stalls at about 9.7 m/s.
    ///
    /// The differences from the [example](Self::EXAMPLE) are published, too (`MassOpenFlight.xml`,
    /// `Gear.xml`, `Engines/APC 12x6e.xml`), except for the springs and dampers of the airframe,
    /// and motor and battery, which are assumptions: 800 rpm/V on three cells.
    pub const ULTRA_STICK_25E: Self = Self {
        mass: 1.959,
        inertia_x: 0.07151,
        inertia_y: 0.08636,
        inertia_z: 0.15364,
        inertia_xz: 0.014,
        gear_stiffness: 3_657.96,
        gear_damping: 116.4,
        body_stiffness: 2_200.0,
        body_damping: 18.0,
        propeller_diameter: 0.3048,
        propeller_inertia: 1.4e-4,
        propeller_nominal_speed: 600.0,
        motor_constant: 0.01194,
        motor_resistance: 0.05,
        battery_capacity: 3.3,
        battery_resistance: 0.015,
        battery_polarisation: 0.008,
        ..Self::EXAMPLE
    };

    /// These parameters with the battery under these conditions.
    #[must_use]
    pub fn under(&self, conditions: &Conditions) -> Self {
        let battery = self.battery().worn(conditions.battery_age).at(conditions.battery_temperature);
        Self {
            battery_charge: battery.charge * (1.0 - conditions.battery_drained),
            battery_capacity: battery.capacity,
            battery_resistance: battery.resistance,
            battery_polarisation: battery.polarisation,
            ..self.clone()
        }
    }

    pub(super) fn battery(&self) -> BatterySpec {
        BatterySpec {
            cells: self.battery_cells,
            charge: self.battery_charge,
            capacity: self.battery_capacity,
            resistance: self.battery_resistance,
            polarisation: self.battery_polarisation,
            time_constant: self.battery_time_constant,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_param::parameters::{iter, set, validate};

    #[test]
    fn the_example_lies_in_every_range_and_every_name_can_be_set() {
        let mut parameters = AeroplaneParameters::EXAMPLE;
        assert_eq!(validate(&parameters), Ok(()));
        for (info, _) in iter(&AeroplaneParameters::EXAMPLE) {
            set(&mut parameters, info.name, info.max).expect("the upper end is allowed");
            assert!(set(&mut parameters, info.name, f64::NAN).is_err());
        }
    }

    /// Mass, moments of inertia and springs are the same share of the published ones.
    #[test]
    fn the_example_is_the_published_aeroplane_made_lighter() {
        let p = AeroplaneParameters::EXAMPLE;
        let heavy = AeroplaneParameters::ULTRA_STICK_25E;
        let pairs = [
            (p.mass, heavy.mass),
            (p.inertia_x, heavy.inertia_x),
            (p.inertia_y, heavy.inertia_y),
            (p.inertia_z, heavy.inertia_z),
            (p.inertia_xz, heavy.inertia_xz),
            (p.gear_stiffness, heavy.gear_stiffness),
        ];
        for (here, there) in pairs {
            assert!((here / there - 0.2706).abs() < 5e-4, "{here} of {there}");
        }
    }
}
