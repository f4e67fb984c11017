//! Sampling of the BMI270: from the physics at 1600 Hz to counts in registers, FIFO and interrupts.

use super::{
    ACCEL, ACCEL_RANGE, ACCEL_SELF_TEST, ACCEL_SETTINGS, ACCEL_START, AT_WATERMARK, Bmi270, EVENT, FASTEST,
    FIFO_CONTENT, FIFO_MODE, GYRO, GYRO_RANGE, GYRO_SETTINGS, GYRO_START, INTERNAL_STATUS, INTERRUPTS, POWER,
    READY_ACCEL, READY_GYRO, STATUS, TEMPERATURE,
};
use crate::chips::Flaw;
use crate::sensors::imu::to_counts;
use stampfly_types::{GRAVITY, Instant};

impl Bmi270 {
    /// Samples at 1600 Hz per output of sensor 0 or 1; `None` for a rate that is not allowed (DS
    /// 5.2.45, 5.2.47).
    fn divider(&self, sensor: usize) -> Option<u64> {
        let (register, slowest) = [(ACCEL_SETTINGS, 1), (GYRO_SETTINGS, 6)][sensor];
        let code = self.register(register) & 0x0F;
        (slowest..=FASTEST).contains(&code).then(|| 1 << (FASTEST - code))
    }

    /// Counts per m/s² or rad/s (DS 5.2.46, 5.2.48).
    fn scale(&self, sensor: usize) -> f64 {
        if sensor == 0 {
            f64::from(16_384u32 >> (self.register(ACCEL_RANGE) & 3)) / f64::from(GRAVITY)
        } else {
            let doublings = (self.register(GYRO_RANGE) & 7).min(4);
            16.4 * f64::from(1u8 << doublings) * 180.0 / core::f64::consts::PI
        }
    }

    /// One sample of both sensors.
    pub(super) fn sample(&mut self, at: Instant) {
        let [ax, ay, az, gx, gy, gz] = self.physics.sample(at);
        let [[ax, ay, az], [gx, gy, gz]] = [[ax, ay, az], [gx, gy, gz]].map(|body| Flaw::turn(self.flaw, body));
        let force = self.self_test.deflect(self.register(ACCEL_SELF_TEST));
        // The chip is mounted such that body is (y, x, −z) of the chip.
        let axes = [[ay + force[0], ax + force[1], -az + force[2]], [gy, gx, -gz]];
        let axes = if self.broken { [[0.0; 3]; 2] } else { axes };
        let mut outputs = [None; 2];
        for (sensor, values) in axes.into_iter().enumerate() {
            let started = [ACCEL_START, GYRO_START][sensor];
            let running = self.on[sensor].is_some_and(|since| at.since(since) >= started && at >= since);
            let Some(divider) = self.divider(sensor).filter(|_| running) else { continue };
            let (sum, count) = &mut self.sums[sensor];
            sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
            *count += 1;
            // Lower rates output the mean of the samples in between.
            if !self.tick.is_multiple_of(divider) {
                continue;
            }
            let (sum, count) = core::mem::take(&mut self.sums[sensor]);
            let scale = self.scale(sensor);
            let mut bytes = [0; 6];
            for (pair, sum) in bytes.chunks_exact_mut(2).zip(sum) {
                pair.copy_from_slice(&to_counts(sum / count as f64, scale).to_le_bytes());
            }
            let place = usize::from([ACCEL, GYRO][sensor]);
            self.registers[place..place + 6].copy_from_slice(&bytes);
            let flag = [READY_ACCEL, READY_GYRO][sensor];
            self.set(STATUS, self.register(STATUS) | flag);
            self.set(INTERRUPTS, self.register(INTERRUPTS) | flag);
            outputs[sensor] = Some(bytes);
        }
        if self.register(POWER) & 8 != 0 {
            let counts = ((self.physics.temperature(at) - 23.0) * 512.0) as i16;
            let [low, high] = counts.to_le_bytes();
            self.set(TEMPERATURE, low);
            self.set(TEMPERATURE + 1, high);
        }
        let content = self.register(FIFO_CONTENT);
        let [accel, gyro] = [outputs[0].filter(|_| content & 0x40 != 0), outputs[1].filter(|_| content & 0x80 != 0)];
        if accel.is_some() || gyro.is_some() {
            self.fifo.push(gyro, accel, content & 0x10 != 0, self.register(FIFO_MODE) & 1 != 0);
        }
        if outputs != [None; 2] {
            self.interrupt.begin_pulse(at);
        }
        if self.at_watermark() {
            self.set(INTERRUPTS, self.register(INTERRUPTS) | AT_WATERMARK);
        }
    }

    /// Switches the sensors on or off according to the power register.
    pub(super) fn switch(&mut self, now: Instant) {
        let power = self.register(POWER);
        for (sensor, bit) in [(0, 4), (1, 2)] {
            let on = power & bit != 0 && self.register(INTERNAL_STATUS) & 0x0F == 1;
            self.on[sensor] = on.then(|| self.on[sensor].unwrap_or(now));
            if !on {
                self.sums[sensor] = Default::default();
            }
        }
    }

    /// Checks the rates and reports invalid ones in the event register.
    pub(super) fn check_settings(&mut self) {
        let refused = u8::from(self.divider(0).is_none()) | u8::from(self.divider(1).is_none()) << 1;
        self.set(EVENT, self.register(EVENT) & !0x1C | refused << 2);
    }
}
