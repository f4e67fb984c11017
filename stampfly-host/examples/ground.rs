//! The ground station over flights that nobody asked for: three vehicles fly their missions in real time, again and again.
//!
//! ```sh
//! cargo run --release -p stampfly-host --example ground -- 8080
//! ```

use stampfly_board::simulation::StampFly;
use stampfly_bus::Schedule;
use stampfly_flight::Observer;
use stampfly_host::flown::fly;
use stampfly_host::ground::ask::{Ask, NAMES};
use stampfly_host::ground::{Calibration, CalibrationKind, Event, Hub, Limits, Reply, Server, VehicleCard, Watch};
use stampfly_host::recorder::Recorder;
use stampfly_sim::vehicle::{Options, Vehicle, Witness};
use stampfly_types::Instant;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant as Wall};

/// Holds virtual time back until the wall's has come.
struct Pace(Wall);

impl Observer for Pace {}

impl<R: Schedule> Witness<R> for Pace {
    fn turn(&mut self, clock: Instant) {
        let due = self.0 + Duration::from_micros(clock.as_micros());
        let early = due.saturating_duration_since(Wall::now());
        if early > Duration::from_millis(2) {
            thread::sleep(early);
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let port: u16 = std::env::args().nth(1).as_deref().unwrap_or("8080").parse()?;
    let missions = ["square", "hover", "random"];
    let card = |(number, _): (usize, &&str)| {
        let name = format!("StampFly {}", number + 1);
        let mut card = VehicleCard::of::<StampFly>(&name, &StampFly::default_config()).offering(NAMES);
        card.place = [0.0, 1.5 * number as f32];
        if number == 0 {
            let line = "calibrate accel {side}".to_owned();
            card.calibrations = vec![Calibration { kind: CalibrationKind::SixPositions, line }];
        }
        card
    };
    let hub = Hub::new(missions.iter().enumerate().map(card).collect());
    let server = Server::start(hub.clone(), ([127, 0, 0, 1], port).into(), Limits::default())?;
    println!("http://{}", server.address());
    let flights: Vec<_> = missions
        .into_iter()
        .enumerate()
        .map(|(number, mission)| {
            let hub = hub.clone();
            thread::spawn(move || again_and_again(&hub, number, mission))
        })
        .collect();
    let hub_of_answers = hub.clone();
    thread::spawn(move || answer(&hub_of_answers));
    flights.into_iter().for_each(|flight| drop(flight.join()));
    Ok(())
}

fn again_and_again(hub: &Arc<Hub>, number: usize, mission: &str) {
    let log = Arc::new(Mutex::new(Vec::new()));
    let provided = log.clone();
    hub.provide_log(number, move || provided.lock().map(|log| log.clone()).unwrap_or_default());
    for seed in 1.. {
        let options = Options { mission: Some(mission.to_owned()), ..Options::default() };
        let (Ok(setup), Some(watch)) = (StampFly::setup(&options, seed), hub.witness(number)) else { return };
        let recorder = Recorder::<StampFly>::with_log(&setup, &[]);
        let mut witness: ((Watch, Pace), Recorder<StampFly>) = ((watch, Pace(Wall::now())), recorder);
        fly::<StampFly>(&setup, &mut witness, &mut |_, _| {});
        if let Ok(mut log) = log.lock() {
            *log = witness.1.log().to_vec();
        }
        hub.tell_all(number, &Event::Text { text: format!("flight {seed} is over") });
    }
}

/// Nobody carries anything out here; parameters are only remembered.
fn answer(hub: &Hub) {
    loop {
        for vehicle in 0..hub.vehicles() {
            for (client, asked) in hub.asks(vehicle) {
                match &asked.ask {
                    Ask::Sticks(_) => continue,
                    Ask::ParamSet { name, value } => {
                        let value = f64::from(*value);
                        hub.tell_all(vehicle, &Event::Parameter { name: name.clone(), value });
                        hub.answer(client, &asked, Ok(Reply::value(value)));
                    }
                    Ask::Guided(_) => hub.answer(client, &asked, Err("this vehicle flies its own mission".into())),
                    ask => hub.answer(client, &asked, Ok(Reply::text(format!("{} heard", ask.name())))),
                }
            }
        }
        thread::sleep(Duration::from_millis(10));
    }
}
