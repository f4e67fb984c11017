//! The parameters: one line each with default, range and unit.

use stampfly_param::parameters;

parameters! {
    /// Every parameter of the aircraft.
    pub struct Parameters {
        /// True airspeeds.
        speed: SpeedParameters {
            /// Slowest flight, wings level.
            stall = 9.7 in [3.0, 30.0] "m/s";
            /// It leaves the ground.
            rotation = 12.0 in [3.0, 40.0] "m/s";
            /// Of a climb.
            climb = 16.5 in [5.0, 50.0] "m/s";
            /// Between way-points.
            cruise = 17.0 in [5.0, 50.0] "m/s";
            /// On the slope, over the stall; half of the wind is added.
            approach_share = 1.3 in [1.1, 2.0] "1";
            /// On the ground, over ground.
            taxi = 2.5 in [0.5, 6.0] "m/s";
        }
        /// Heights, above the strip.
        height: HeightParameters {
            /// A take-off is over.
            climbed = 40.0 in [5.0, 120.0] "m";
            /// A landing begins.
            approach = 40.0 in [10.0, 120.0] "m";
            /// The slope is this high above the aiming point: what comes short must not land before it.
            crossing = 2.2 in [0.0, 10.0] "m";
            /// The throttle closes.
            flare = 4.0 in [0.5, 20.0] "m";
            /// The nose turns to the strip.
            decrab = 1.5 in [0.3, 10.0] "m";
            /// It is as good as on the ground.
            touchdown = 0.4 in [0.1, 5.0] "m";
        }
        /// Climbs and descents.
        climb: ClimbParameters {
            /// Pitch of the first climb.
            pitch = 0.3 in [0.05, 0.6] "rad";
            /// Largest rate of climb.
            rate_max = 3.5 in [0.5, 10.0] "m/s";
            /// Largest rate of sink.
            sink_max = 2.5 in [0.5, 10.0] "m/s";
        }
        /// The last metres.
        flare: FlareParameters {
            /// Rate of sink at touchdown.
            sink = 0.4 in [0.1, 1.5] "m/s";
            /// Time in which the height fades.
            time = 3.0 in [0.5, 10.0] "s";
        }
        /// Lines and orbits.
        path: PathParameters {
            /// Radius of a turn.
            radius = 70.0 in [20.0, 200.0] "m";
            /// How hard a line is approached.
            line_gain = 0.05 in [0.001, 0.5] "1/m";
            /// How hard an orbit is approached, for a radius.
            orbit_gain = 2.5 in [0.1, 10.0] "1";
            /// Rate of turn for an error of the course.
            course_gain = 0.9 in [0.1, 5.0] "1/s";
            /// Largest bank.
            bank_max = 0.7 in [0.1, 1.0] "rad";
            /// Largest bank near the ground.
            bank_low = 0.35 in [0.05, 0.7] "rad";
            /// Bank of the circle in which it waits to know where it is.
            bank_lost = 0.3 in [0.05, 0.6] "rad";
            /// When it has waited for this long it comes down where it is.
            blind = 120.0 in [10.0, 3600.0] "s";
        }
        /// Height and speed.
        energy: EnergyParameters {
            /// Throttle of a level cruise.
            throttle_trim = 0.45 in [0.0, 1.0] "1";
            /// Throttle for a thrust of the weight.
            throttle_feed = 1.5 in [0.1, 5.0] "1";
            /// Pitch of a level cruise.
            pitch_trim = 0.03 in [-0.2, 0.3] "rad";
            /// Rate of climb for an error of the height.
            height_gain = 0.4 in [0.05, 2.0] "1/s";
            /// Acceleration for an error of the speed.
            speed_gain = 0.4 in [0.05, 2.0] "1/s";
        }
        /// The roll loops, at cruising speed.
        roll: RollGains {
            /// Rate for an error of the bank.
            attitude = 4.0 in [0.5, 15.0] "1/s";
            /// Deflection that holds a rate.
            feed = 0.1 in [0.0, 1.0] "s/rad";
            /// Deflection for an error of the rate.
            rate = 0.1 in [0.0, 2.0] "s/rad";
            /// The same for one that lasts a second.
            integral = 0.15 in [0.0, 5.0] "1/rad";
        }
        /// The pitch loops, at cruising speed.
        pitch: PitchGains {
            /// Rate for an error of the pitch.
            attitude = 3.0 in [0.5, 15.0] "1/s";
            /// Deflection for an error of the rate.
            rate = 0.3 in [0.0, 2.0] "s/rad";
            /// The same for one that lasts a second.
            integral = 0.6 in [0.0, 5.0] "1/rad";
        }
        /// The yaw loop, at cruising speed.
        yaw: YawGains {
            /// Deflection for an error of the rate.
            rate = 0.2 in [0.0, 2.0] "s/rad";
            /// Rudder for a side force that lasts a second, for each m/s².
            side_force = 0.05 in [0.0, 1.0] "s^2/m";
            /// Rate for an error of a heading that is held.
            heading = 1.5 in [0.1, 10.0] "1/s";
        }
        /// The link.
        link: LinkParameters {
            /// It is lost when nobody was heard for this long: it comes home and circles. Never, if it was never heard.
            lost = 5.0 in [1.0, 600.0] "s";
            /// When the watch has let it circle at home for so long, and nobody wants anything else, it lands.
            land = 60.0 in [2.0, 3600.0] "s";
        }
        /// The fence: outside of it, it comes home and circles.
        fence: FenceParameters {
            /// From home, over ground.
            radius = 1500.0 in [50.0, 20000.0] "m";
            /// Above home.
            height = 150.0 in [20.0, 2000.0] "m";
        }
        /// The battery.
        battery: BatteryParameters {
            /// It lands at this voltage, under load.
            warning = 9.9 in [0.0, 60.0] "V";
        }
        /// The compass: what a calibration has found.
        compass: CompassParameters {
            /// Hard iron, x.
            x = 0.0 in [-200.0, 200.0] "uT";
            /// Hard iron, y.
            y = 0.0 in [-200.0, 200.0] "uT";
            /// Hard iron, z.
            z = 0.0 in [-200.0, 200.0] "uT";
            /// Declination, east of north.
            declination = -0.14 in [-3.2, 3.2] "rad";
            /// Inclination, downwards.
            inclination = 0.87 in [-1.6, 1.6] "rad";
        }
    }
    where p:
    "speed.rotation" "speed.stall" p.speed.rotation > p.speed.stall => "it would leave the ground in a stall";
    "speed.cruise" "speed.stall" p.speed.cruise > 1.2 * p.speed.stall => "it would cruise near its stall";
    "height.decrab" "height.flare" p.height.decrab < p.height.flare => "the nose would turn before the throttle is closed";
    "height.touchdown" "height.decrab" p.height.touchdown < p.height.decrab => "it would touch down before the nose has turned";
    "link.lost" "link.land" p.link.lost < p.link.land => "it would land before it comes home";
}
