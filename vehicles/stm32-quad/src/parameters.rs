//! The parameters: one line each with default, range and unit. Defaults are the original's of November 2021.

#![expect(clippy::approx_constant, reason = "the table takes literals")]

use crate::messages::SensorOffsets;
use stampfly_param::parameters;

parameters! {
    /// Every parameter of the quadcopter.
    pub struct Parameters {
        /// Gains about roll, in shares of a motor's range.
        roll: RollGains {
            /// For a rate error of 1 rad/s.
            p = 0.2 in [0.0, 2.55] "s/rad";
            /// For a rate error of 1 rad/s that lasts a second.
            i = 0.02 in [0.0, 2.55] "1/rad";
            /// For a rate error that grows by 1 rad/s².
            d = 0.002 in [0.0, 0.1] "s^2/rad";
        }
        /// Gains about pitch.
        pitch: PitchGains {
            /// For a rate error of 1 rad/s.
            p = 0.2 in [0.0, 2.55] "s/rad";
            /// For a rate error of 1 rad/s that lasts a second.
            i = 0.02 in [0.0, 2.55] "1/rad";
            /// For a rate error that grows by 1 rad/s².
            d = 0.002 in [0.0, 0.1] "s^2/rad";
        }
        /// Gains about yaw.
        yaw: YawGains {
            /// For a rate error of 1 rad/s.
            p = 0.2 in [0.0, 2.55] "s/rad";
            /// For a rate error of 1 rad/s that lasts a second.
            i = 0.02 in [0.0, 2.55] "1/rad";
            /// For a rate error that grows by 1 rad/s².
            d = 0.0 in [0.0, 0.1] "s^2/rad";
        }
        /// Sticks.
        stick: StickParameters {
            /// Lean at full stick in ANGLE mode, 50°.
            angle_max = 0.872_664_6 in [0.1, 1.4] "rad";
            /// Rate at full stick in ACRO mode and about yaw, 180°/s.
            rotation_max = 3.141_592_7 in [0.1, 30.0] "rad/s";
            /// A stick is at its end within this share of its travel.
            threshold = 0.05 in [0.01, 0.3] "1";
        }
        /// What the loops' and the throttle's shares are multiplied by before they meet in the mixer.
        gain: MixGains {
            /// Of all three axes.
            rotation = 1.0 in [0.1, 25.5] "1";
            /// Of the throttle.
            throttle = 1.0 in [0.1, 25.5] "1";
        }
        /// Battery.
        battery: BatteryParameters {
            /// Cells in series, 1 or 2.
            cells = 1.0 in [1.0, 2.0] "1";
            /// Supply of the converter: 2.85 V with one cell, 3.3 V with two.
            reference = 2.85 in [1.8, 3.6] "V";
            /// Ratio of the voltage divider: 39 kΩ above 22 kΩ.
            scale = 2.772_727_3 in [0.1, 3.642_857_2] "1";
            /// Warning level of one cell.
            warning = 3.3 in [0.0, 25.5] "V";
            /// Critical level of one cell.
            critical = 3.1 in [0.0, 25.5] "V";
        }
        /// Corner frequencies.
        filter: FilterParameters {
            /// Of the accelerometer; −6 dB there.
            accel = 75.0 in [5.0, 255.0] "Hz";
            /// Of the gyro; −6 dB there.
            gyro = 75.0 in [5.0, 255.0] "Hz";
            /// Of the loops' derivative; −3 dB there.
            derivative = 100.0 in [1.0, 255.0] "Hz";
        }
        /// Offsets of the sensors, which a calibration finds.
        offset: OffsetParameters {
            /// Accelerometer, x.
            accel_x = 0.0 in [-10.0, 10.0] "m/s^2";
            /// Accelerometer, y.
            accel_y = 0.0 in [-10.0, 10.0] "m/s^2";
            /// Accelerometer, z.
            accel_z = 0.0 in [-10.0, 10.0] "m/s^2";
            /// Gyro, x.
            gyro_x = 0.0 in [-1.0, 1.0] "rad/s";
            /// Gyro, y.
            gyro_y = 0.0 in [-1.0, 1.0] "rad/s";
            /// Gyro, z.
            gyro_z = 0.0 in [-1.0, 1.0] "rad/s";
        }
        /// How it is built.
        frame: FrameParameters {
            /// 0 quadrotor X, 1 quadrotor H, 2 hexarotor X, 3 octorotor X.
            layout = 0.0 in [0.0, 3.0] "1";
            /// How far the board is turned about z, clockwise seen from above, on the frame.
            board_yaw = 0.0 in [-3.141_592_7, 3.141_592_7] "rad";
        }
    }
    where p:
    "battery.critical" "battery.warning" p.battery.critical < p.battery.warning => "the warning would come after the end";
}

impl From<&SensorOffsets> for OffsetParameters {
    fn from(SensorOffsets { accel, gyro }: &SensorOffsets) -> Self {
        let ([accel_x, accel_y, accel_z], [gyro_x, gyro_y, gyro_z]) = (accel.to_array(), gyro.to_array());
        Self { accel_x, accel_y, accel_z, gyro_x, gyro_y, gyro_z }
    }
}
