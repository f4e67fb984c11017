//! The tables under the flight loop, step by step: when motors stop, and that a calibration reaches the sensor.

use stampfly_bus::Band;
use stampfly_flight::{Assembled, FlightLoop};
use stampfly_param::{ParameterAction, ParameterRequest, ParameterTable};
use stampfly_stm32_quad::messages::ReceiverInput;
use stampfly_stm32_quad::schedule::{ACTIVATIONS, PERIOD, RESPONSE_TIMES};
use stampfly_stm32_quad::topics::{Bus, Outside};
use stampfly_stm32_quad::{Parameters, Runnables};
use stampfly_types::messages::{ImuData, MotorOutput};
use stampfly_types::{Duration, GRAVITY, Instant, Vec3};

/// A vehicle on a table, four thousand times a second.
struct Bench<'b> {
    flight_loop: FlightLoop<'b, Runnables>,
    outside: Outside<'b>,
    now: Instant,
}

impl<'b> Bench<'b> {
    fn new(bus: &'b mut Bus) -> Self {
        let Assembled { flight_loop, outside, .. } =
            Assembled::<Runnables>::new(bus, None, &Parameters::default(), Instant::ZERO);
        Self { flight_loop, outside, now: Instant::ZERO }
    }

    /// A step, with a sample or without, and sticks if there is a packet.
    fn step(&mut self, gyro: Option<Vec3>, input: Option<ReceiverInput>) -> MotorOutput {
        self.now += PERIOD;
        if let Some(input) = input {
            self.outside.receiver.receiver_input.publish(self.now, &input);
        }
        if let Some(gyro) = gyro {
            // A sensor that repeats itself does not measure.
            let noise = Vec3::new(1.0, -1.0, 1.0) * ((self.now.as_micros() / 250 * 7_919 % 101) as f32 - 50.0) * 1e-5;
            let accel = Vec3::new(0.0, 0.0, -GRAVITY) + noise;
            self.outside.imu.sensor_imu.publish(self.now, &ImuData { accel, gyro: gyro + noise, ..Default::default() });
        }
        self.flight_loop.run_band(Band::Flight, self.now, &mut ());
        self.flight_loop.run_band(Band::Background, self.now, &mut ());
        self.outside.motors.actuator_motor.latest().map(|output| output.data).unwrap_or_default()
    }

    /// Armed, with this throttle and what a still gyro says.
    fn armed(&mut self, throttle: f32, gyro: Vec3) -> MotorOutput {
        for _ in 0..10 {
            self.step(Some(gyro), Some(sticks(0.0, 1.0)));
        }
        (0..40).map(|_| self.step(Some(gyro), Some(sticks(throttle, 0.5)))).last().expect("steps")
    }
}

fn sticks(throttle: f32, yaw: f32) -> ReceiverInput {
    ReceiverInput { roll: 0.5, pitch: 0.5, yaw, throttle, aux: [0.0; 4] }
}

#[test]
fn the_motors_stop_exactly_a_second_after_the_last_packet() {
    let mut bus = Bus::new();
    let mut bench = Bench::new(&mut bus);
    let output = bench.armed(0.5, Vec3::zeros());
    assert!(output.armed && output.duty[..4].iter().all(|duty| (*duty - 0.5).abs() < 0.01), "{output:?}");
    assert_eq!(output.duty[4..], [0.0; 4]);
    let last = bench.now;
    while bench.step(Some(Vec3::zeros()), None).armed {}
    assert_eq!(bench.now.since(last), Duration::from_secs(1));
    assert_eq!(bench.step(Some(Vec3::zeros()), None).duty, [0.0; 8]);
    // It does not arm by itself.
    assert!(!bench.step(Some(Vec3::zeros()), Some(sticks(0.5, 0.5))).armed);
}

#[test]
fn without_samples_the_motors_stop_after_twenty_five_milliseconds() {
    let mut bus = Bus::new();
    let mut bench = Bench::new(&mut bus);
    assert!(bench.armed(0.5, Vec3::zeros()).armed);
    let last = bench.now;
    while bench.step(None, Some(sticks(0.5, 0.5))).armed {}
    let since = bench.now.since(last);
    // The controller's own deadline is two steps.
    assert!((Duration::from_millis(25)..=Duration::from_micros(25_500)).contains(&since), "{since:?}");
}

#[test]
fn channel_five_chooses_the_mode() {
    let mut bus = Bus::new();
    let mut bench = Bench::new(&mut bus);
    for (channel, angle_mode) in [(0.0, true), (0.24, true), (0.25, false), (1.0, false)] {
        bench.step(Some(Vec3::zeros()), Some(ReceiverInput { aux: [channel, 0.0, 0.0, 0.0], ..sticks(0.5, 0.5) }));
        let state = bench.outside.receiver.control_state.latest().expect("published").data;
        assert_eq!(state.angle_mode, angle_mode, "{channel}");
    }
}

#[test]
fn a_throttle_that_is_down_stops_armed_motors_and_keeps_them_armed() {
    let mut bus = Bus::new();
    let mut bench = Bench::new(&mut bus);
    let output = bench.armed(0.05, Vec3::zeros());
    assert!(output.armed && output.duty == [0.0; 8]);
}

#[test]
fn a_calibration_by_the_sticks_takes_the_gyros_offset_away() {
    let mut bus = Bus::new();
    let mut bench = Bench::new(&mut bus);
    let offset = Vec3::new(0.03, -0.02, 0.01);
    // Longer than it takes: it is done once.
    for _ in 0..8_400 {
        bench.step(Some(offset), Some(sticks(1.0, 0.0)));
    }
    let found = bench.outside.link.sensor_offsets.latest().expect("a calibration has ended").data;
    assert!((found.gyro - offset).norm() < 1e-5 && found.accel.norm() < 1e-4, "{found:?}");
    let output = bench.armed(0.5, offset);
    let duty = &output.duty[..4];
    assert!(duty.iter().all(|duty| (*duty - 0.5).abs() < 1e-3), "nothing to correct: {duty:?}");
}

#[test]
fn what_a_calibration_has_found_outlives_a_change_of_gains() {
    let mut bus = Bus::new();
    let mut bench = Bench::new(&mut bus);
    let offset = Vec3::new(0.03, -0.02, 0.01);
    for _ in 0..8_400 {
        bench.step(Some(offset), Some(sticks(1.0, 0.0)));
    }
    let index = Parameters::TABLE.iter().position(|row| row.info.name == "roll.p").expect("a parameter") as u32;
    for action in [ParameterAction::Set, ParameterAction::Apply] {
        let request = ParameterRequest { action, index, value: 0.25 };
        bench.outside.link.parameter_request.publish(bench.now, request).expect("there is room");
    }
    let output = (0..400).map(|_| bench.armed(0.5, offset)).last().expect("steps");
    assert!(output.duty[..4].iter().all(|duty| (*duty - 0.5).abs() < 1e-3), "nothing to correct: {output:?}");
    let parameters = bench.outside.link.parameters.latest().expect("published").data;
    assert_eq!(parameters.roll.p, 0.25);
    assert!((parameters.offset.gyro_x - 0.03).abs() < 1e-5, "and is kept with the parameters");
}

#[test]
fn the_flight_band_is_done_before_its_next_sample() {
    for (line, response) in ACTIVATIONS.iter().zip(RESPONSE_TIMES) {
        println!("{:<15} {} us", line.name, response.as_micros());
        if line.band == Band::Flight {
            assert!(response < PERIOD, "{}: {response:?}", line.name);
        }
    }
}
