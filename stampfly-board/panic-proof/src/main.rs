//! Links only if no panic can be reached from the flight code: `cargo xtask panic-proof`.
//!
//! The panic handler calls a function that does not exist. When the compiler can show that nothing ever panics, it
//! drops the handler and the program links; one index that it cannot bound, anywhere in what is called here, and the
//! linker misses the function. What is called: every runnable with everything behind it, the bus with its taps, the
//! choice between all estimators and controllers, and the self test, with data the compiler knows nothing about.
//!
//! The program is never run. With the feature `control` it has one unchecked index and must not link.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;
use stampfly_board::vehicle::assemble;
use stampfly_board::{FlightLoop, VehicleConfig, golden, wiring};
use stampfly_bus::Band;
use stampfly_types::Micros;

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
    let config: VehicleConfig = black_box(VehicleConfig::default());
    let mut bus = wiring::Bus::new();
    let wiring::Split { ports, mut taps, heads } = bus.split(None);
    let (vehicle, mut outside) = assemble(ports, &config);
    let mut flight_loop = FlightLoop::new(vehicle, heads, black_box(Micros::ZERO));
    while black_box(true) {
        let at: Micros = black_box(Micros::ZERO);
        outside.imu.publish(at, &black_box(Default::default()));
        outside.tof.publish(at, &black_box(Default::default()));
        outside.flow.publish(at, &black_box(Default::default()));
        outside.mag.publish(at, &black_box(Default::default()));
        outside.baro.publish(at, &black_box(Default::default()));
        outside.cameras.publish(at, &black_box(Default::default()));
        outside.power.publish(at, &black_box(Default::default()));
        outside.pilot.publish(at, &black_box(Default::default()));
        outside.button.publish(at, &black_box(Default::default()));
        let _ = outside.guided.publish(at, black_box(Default::default()));
        flight_loop.run_band(Band::Flight, black_box(at), &mut ());
        flight_loop.run_band(Band::Background, black_box(at), &mut ());
        black_box((outside.motors.latest(), outside.indicator.latest(), outside.telemetry.latest()));
        taps.drain(&mut |id, at, generation, words| {
            black_box((id, at, generation, words));
        });
    }
    let _ = black_box(golden::play(black_box(golden::FLIGHT), &mut ()));
    #[cfg(feature = "control")]
    black_box(black_box([1u32, 2, 3])[black_box(1usize)]);
}
