//! Links only if no panic can be reached from the flight code: `cargo xtask panic-proof`.
//!
//! The panic handler calls a function that does not exist. When the compiler can show that nothing ever panics, it
//! drops the handler and the program links; one index that it cannot bound, anywhere in what is called here, and the
//! linker misses the function. What is called, with data the compiler knows nothing about: every runnable with everything
//! behind it, whichever estimator and controller the parameters choose; the bus with its taps; the black box; the self
//! test; every runnable of the fixed-wing aircraft and of the STM32 quadcopter; the radio's packets and session; the secure session at both ends; the decoders of every chip and the motors.
//!
//! Not here: the drivers' waiting. An `async` function may be polled once too often only by an executor that is broken.
//!
//! The program is never run. With the feature `control` it is one unchecked index and must not link.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use stampfly_board::black_box::{BlackBox, RETENTION};
use stampfly_board::link::{Link, Outgoing};
use stampfly_board::schedule::Runnables;
use stampfly_board::{VehicleConfig, golden, topics};
use stampfly_bus::{Band, Taps};
use stampfly_drivers::Decimator;
use stampfly_drivers::chip::{bmi270, bmm150, bmp280, ina3221, mpu6000, nrf24l01, pmw3901, vl53l3cx};
use stampfly_flight::Assembled;
use stampfly_link::secure::{Guarded, Key, MAX_FRAME, Payload, Policy, Station, Vehicle};
use stampfly_link::{Address, PairingPacket, Session, TelemetryPacket};
use stampfly_services::CommandArbiter;
use stampfly_types::Instant;

unsafe extern "C" {
    fn a_panic_can_be_reached() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    // SAFETY: never called: it does not exist, and a program that refers to it does not link.
    unsafe { a_panic_can_be_reached() }
}

/// The entry point.
#[unsafe(no_mangle)]
extern "C" fn flight() {
    if cfg!(feature = "control") {
        black_box(black_box([1u32, 2, 3])[black_box(1usize)]);
        return;
    }
    vehicle();
    aeroplane();
    stm32_quad();
    sealed();
    chips();
    let _ = black_box(golden::self_test(&mut MaybeUninit::uninit(), &mut topics::Bus::new()));
}

/// Everything between the sensors' topics and the motors', and the radio's end of the bus.
fn vehicle() {
    let config: VehicleConfig = black_box(VehicleConfig::default());
    let mut bus = topics::Bus::new();
    let vehicle = Assembled::<Runnables>::new(&mut bus, None, &config, black_box(Instant::ZERO));
    let Assembled { mut flight_loop, mut outside, mut taps } = vehicle;
    let session = Session::new(black_box(Address([0; 6])), black_box(1), black_box(None));
    let vehicle = Key::generate(black_box(1), black_box([0; 32])).ok().map(Vehicle::new);
    let mut link = Link::new(Guarded::new(vehicle, session, black_box(Policy::default())), outside.link);
    let mut arbiter = CommandArbiter::new();
    let mut room = [0; MAX_FRAME];
    let mut memory = BlackBox::<1024>::new(RETENTION);
    while black_box(true) {
        let at: Instant = black_box(Instant::ZERO);
        outside.imu.sensor_imu.publish(at, &black_box(Default::default()));
        outside.tof.sensor_tof.publish(at, &black_box(Default::default()));
        outside.flow.sensor_flow.publish(at, &black_box(Default::default()));
        outside.mag.sensor_mag.publish(at, &black_box(Default::default()));
        outside.baro.sensor_baro.publish(at, &black_box(Default::default()));
        outside.cameras.external_pose.publish(at, &black_box(Default::default()));
        outside.power.sensor_power.publish(at, &black_box(Default::default()));
        outside.button_pin.button_contact.publish(at, &black_box(Default::default()));
        outside.console.motor_test.publish(at, &black_box(Default::default()));
        outside.console.pairing_request.publish(at, &black_box(Default::default()));
        outside.storage.storage_busy.publish(at, &black_box(Default::default()));
        outside.cutoff.cutoff_state.publish(at, &black_box(Default::default()));
        // Every byte that strangers can send.
        let mut bytes = black_box([0; MAX_FRAME]);
        let Some(bytes) = bytes.get_mut(..black_box(0)) else { continue };
        let _ = black_box((PairingPacket::decode(bytes), TelemetryPacket::decode(bytes)));
        let _ = black_box(link.receive(&mut arbiter, at, black_box(Address([0; 6])), bytes));
        for what in Outgoing::ALL {
            black_box(link.transmit(at, what, black_box([0; 8]), &mut room));
        }
        link.keep(&mut arbiter, at);
        black_box(link.notice(&arbiter, at, &mut room));
        black_box(link.guarded.session().age(at));
        flight_loop.run_band(Band::Flight, black_box(at), &mut ());
        flight_loop.run_band(Band::Background, black_box(at), &mut ());
        black_box(outside.motors.actuator_motor.latest());
        black_box((outside.indicator.signal.latest(), outside.supervisor.restart_request.latest()));
        black_box(outside.storage.link_peer.latest());
        taps.drain(&mut |topic, at, generation, words| memory.note(topic, at, generation, words));
        black_box(memory.records().count());
    }
}

/// The fixed-wing aircraft, from its sensors to its servos.
fn aeroplane() {
    use stampfly_plane::{Parameters, Runnables, topics};
    let mut bus = topics::Bus::new();
    let parameters: Parameters = black_box(Parameters::default());
    let vehicle = Assembled::<Runnables>::new(&mut bus, None, &parameters, black_box(Instant::ZERO));
    let Assembled { mut flight_loop, mut outside, .. } = vehicle;
    while black_box(true) {
        let at: Instant = black_box(Instant::ZERO);
        outside.imu.sensor_imu.publish(at, &black_box(Default::default()));
        outside.mag.sensor_mag.publish(at, &black_box(Default::default()));
        outside.baro.sensor_baro.publish(at, &black_box(Default::default()));
        outside.gnss.sensor_gnss.publish(at, &black_box(Default::default()));
        outside.pitot.sensor_airspeed.publish(at, &black_box(Default::default()));
        outside.battery.sensor_power.publish(at, &black_box(Default::default()));
        let _ = outside.link.command_guided.publish(at, black_box(Default::default()));
        let _ = outside.link.way_point_edit.publish(at, black_box(Default::default()));
        let _ = outside.link.parameter_request.publish(at, black_box(Default::default()));
        flight_loop.run_band(Band::Flight, black_box(at), &mut ());
        flight_loop.run_band(Band::Background, black_box(at), &mut ());
        black_box((outside.motor.actuator_motor.latest(), outside.servos.actuator_servo.latest()));
    }
}

/// The STM32 quadcopter, from its sensors to its motors.
fn stm32_quad() {
    use stampfly_stm32_quad::{Parameters, Runnables, topics};
    let mut bus = topics::Bus::new();
    let parameters: Parameters = black_box(Parameters::default());
    let vehicle = Assembled::<Runnables>::new(&mut bus, None, &parameters, black_box(Instant::ZERO));
    let Assembled { mut flight_loop, mut outside, .. } = vehicle;
    while black_box(true) {
        let at: Instant = black_box(Instant::ZERO);
        outside.imu.sensor_imu.publish(at, &black_box(Default::default()));
        outside.battery.battery_sample.publish(at, &black_box(Default::default()));
        outside.receiver.receiver_input.publish(at, &black_box(Default::default()));
        let _ = outside.link.parameter_request.publish(at, black_box(Default::default()));
        flight_loop.run_band(Band::Flight, black_box(at), &mut ());
        flight_loop.run_band(Band::Background, black_box(at), &mut ());
        black_box((outside.motors.actuator_motor.latest(), outside.lights.lights.latest()));
    }
}

/// The secure session, at both ends: every byte that strangers can send, and everything that an end can say.
fn sealed() {
    let Ok(key) = Key::generate(black_box(1), black_box([0; 32])) else { return };
    let Ok(other) = Key::from_uri(black_box("")) else { return };
    let open = Session::new(black_box(Address([0; 6])), black_box(1), black_box(None));
    let mut guarded = Guarded::new(Vehicle::new(key), open, black_box(Policy::default()));
    let mut station = Station::new(other);
    let mut room = [0; MAX_FRAME];
    while black_box(true) {
        let (at, random): (Instant, [u8; 8]) = (black_box(Instant::ZERO), black_box([0; 8]));
        let mut frame = black_box([0; MAX_FRAME]);
        let Some(frame) = frame.get_mut(..black_box(0)) else { continue };
        let _ = black_box(guarded.receive(at, black_box(Address([0; 6])), frame));
        let _ = black_box(station.receive(at, frame));
        guarded.set_armed(black_box(false));
        black_box(guarded.transmit(at, random, &mut room));
        black_box(station.transmit(at, random, &mut room));
        let payload: Payload<'_> = black_box(Payload::Kill);
        let _ = black_box(guarded.seal(at, &payload, &mut room));
        let _ = black_box(station.seal(at, &payload, &mut room));
        black_box((guarded.age(at), guarded.vehicle().map(|vehicle| vehicle.tally().refused()), station.tally()));
    }
}

/// Every byte that chips can send.
fn chips() {
    if let Some(group) = bmi270::codec::decode_frames(&black_box([0; 52]), black_box(true)) {
        black_box(black_box(Decimator::default()).push(&group));
    }
    black_box(bmi270::codec::Status::decode(&black_box([0; 14])).celsius());
    if let Some(trim) = bmm150::codec::Trim::decode(&black_box([0; 21])) {
        let reading = bmm150::codec::Reading::decode(&black_box([0; 11]));
        black_box((trim.compensate(&reading), trim.compensate_integer(&reading)));
    }
    if let Some(calibration) = bmp280::codec::Calibration::decode(&black_box([0; 24])) {
        black_box((
            calibration.compensate(black_box(0), black_box(0)),
            bmp280::codec::pressure_altitude(black_box(0.0)),
        ));
    }
    black_box(bmp280::codec::Reading::decode(&black_box([0; 10])));
    black_box((ina3221::codec::shunt_volts(black_box(0)), ina3221::codec::bus_volts(black_box(0))));
    black_box(mpu6000::codec::Sample::decode(&black_box([0; 14])).map(|sample| sample.celsius()));
    let factory = mpu6000::codec::factory_answers(black_box([0; 4]));
    black_box(mpu6000::codec::passes_self_test(&black_box([0.0; 6]), &factory));
    black_box(nrf24l01::codec::Status::decode(black_box(0)));
    black_box(pmw3901::codec::Motion::decode(&black_box([0; 12])).map(|motion| motion.is_valid()));
    black_box(vl53l3cx::codec::Reading::decode(&black_box([0; 17])).map(|reading| reading.status()));
    let exposure = vl53l3cx::bins::Exposure { oscillator: 48_333, macro_periods: [85, 71], laser_start: 9 };
    let histogram = vl53l3cx::bins::Histogram::decode(&black_box([0; vl53l3cx::bins::BLOCK_BYTES]));
    black_box(histogram.map(|histogram| histogram.reading(&black_box(exposure), 0.0, black_box(None))));
}
