//! Inertial and flow sensor on one bus in time slots: the first on time, the second in between.

use crate::mounting;
use core::cell::{Cell, RefCell};
use stampfly_drivers::chip::bmi270::{self, Bmi270};
use stampfly_drivers::chip::pmw3901::{self, Pmw3901};
use stampfly_drivers::slot::{Rhythm, Slots};
use stampfly_drivers::{Imu, OpticalFlow, Sample};
use stampfly_sim::chips::{Board, stand_in_image};
use stampfly_sim::time::Tasks;
use stampfly_sim::{Simulation, SimulationConfig};
use stampfly_types::messages::ImuData;
use stampfly_types::{Duration, Instant};

/// Longest transfer of the flow sensor.
const LONGEST: Duration = Duration::from_micros(200);
const END: Instant = Instant::from_secs(30);
/// Both have started.
const BEGIN: Instant = Instant::from_secs(1);

/// Requests samples from an inertial sensor endlessly.
async fn deliver(mut imu: impl Imu, note: impl Fn(Sample<ImuData>)) {
    loop {
        note(imu.next().await.expect("no error"));
    }
}

/// Worst case of one vehicle with or without interrupt pin: age of an inertial sample at its
/// delivery, and time between two flow samples.
fn worst(seed: u64, wired: bool) -> [Duration; 2] {
    let config = SimulationConfig { seed, ..SimulationConfig::example() };
    let Simulation { clock, world, .. } = Simulation::new(&config);
    let image = stand_in_image();
    let Board { imu, flow, .. } = Board::new(&world, &clock, &config, &image);
    let pin = imu.interrupt_pin();
    let mut slots = Slots::new(clock.clone(), Rhythm::HZ_400);
    let (lead, guest, bus) = slots.split(imu, flow, LONGEST);
    let imu = Bmi270::spi(lead, clock.clone(), &image, mounting::IMU, bmi270::Config::default());
    let mut flow = Pmw3901::new(guest, clock.clone(), mounting::FLOW, pmw3901::Config::default());
    let [age, interval] = [const { Cell::new(Duration::ZERO) }; 2];
    let counts = RefCell::new([0; 2]);
    let mut tasks = Tasks::new(clock.clone());
    let note = |sample: Sample<ImuData>| {
        if clock.now() > BEGIN {
            age.set(age.get().max(clock.now().since(sample.at)));
            counts.borrow_mut()[0] += 1;
        }
    };
    if wired {
        tasks.spawn(deliver(imu.with_interrupt(pin), note));
    } else {
        tasks.spawn(deliver(imu, note));
    }
    tasks.spawn(async {
        let mut before = None;
        loop {
            let sample = flow.next().await.expect("no error");
            if clock.now() > BEGIN {
                let gap = before.map_or(Duration::ZERO, |before| sample.at.since(before));
                interval.set(interval.get().max(gap));
                counts.borrow_mut()[1] += 1;
            }
            before = Some(sample.at);
        }
    });
    tasks.run_until(BEGIN);
    // The long transfers of the inertial sensor's start are over.
    let before = bus.delays();
    tasks.run_until(END);
    drop(tasks);
    assert_eq!(bus.delays(), before, "seed {seed}: the lead never waits");
    let [samples, flows] = counts.into_inner();
    assert!(samples > 29 * 390 && flows > 29 * 93, "seed {seed}: {samples} and {flows}");
    [age.get(), interval.get()]
}

#[test]
fn the_lead_never_waits_and_the_guest_hardly() {
    for wired in [false, true] {
        let figures: Vec<_> = (1..=8).map(|seed| worst(seed, wired)).collect();
        let most = |index: usize| figures.iter().map(|figure| figure[index]).max().expect("eight");
        let name = if wired { "with its interrupt" } else { "without its interrupt" };
        println!("inertial sample {name} {} old, {} between flow samples, at worst", most(0), most(1));
        // Three chip samples of a slow clock (1.91 ms) plus the read-out; 10 ms plus the wait for a
        // slot.
        assert!(most(0) <= Duration::from_micros(2_150), "{name}: {figures:?}");
        assert!(most(1) <= Duration::from_micros(10_750), "{name}: {figures:?}");
    }
}
