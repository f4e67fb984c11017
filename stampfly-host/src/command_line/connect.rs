//! `stampfly connect`: the ground station's page for a real vehicle, and at a cable MAVLink's ports.

use crate::command_line::arguments::{ConnectOptions, VehiclePlace};
use crate::command_line::doctor::port_of;
use crate::command_line::ended;
use crate::command_line::failure::Failure;
use crate::command_line::serve::page_address;
use crate::connect::{Bridge, PORTS, Place, RadioPlace};
use crate::ground::{Hub, Limits, Server, VehicleCard};
use crate::serve::{Key, OpenPorts, PortOption};
use crate::vehicles::{self, ForVehicle};
use stampfly_link::secure;
use stampfly_sim::vehicle::{Transport, Vehicle};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// What a real vehicle can be asked: everything but what a world does. The last two at a cable alone, where a motor can be stopped whatever happens to the radio.
const OFFERS: &[&str] =
    &["guided", "sticks", "alive", "param_set", "param_get", "param_save", "console", "motor_test", "motor_stop"];
const BY_RADIO: usize = OFFERS.len() - 2;

pub fn run(options: &ConnectOptions) -> Result<ExitCode, Failure> {
    let way = match (&options.place, &options.key) {
        (Some(VehiclePlace::Line(place)), None) => Way::Line(place.clone()),
        (Some(VehiclePlace::Radio(place)), Some(file)) => Way::Radio(place.clone(), Key::read(file)?.sealing()?),
        (None, None) => Way::Line(Place::Serial(port_of(None)?)),
        _ => return Err("a vehicle in a network, udp:HOST, wants its '--key FILE', and no other does".into()),
    };
    vehicles::with(&options.vehicle.name, Connect(options, way))?
}

/// A way to the vehicle, with what it takes.
enum Way {
    Line(Place),
    Radio(RadioPlace, secure::Key),
}

struct Connect<'o>(&'o ConnectOptions, Way);

impl ForVehicle for Connect<'_> {
    type Output = Result<ExitCode, Failure>;

    fn run<V: Vehicle>(self) -> Self::Output {
        let Self(options, way) = self;
        // Nobody speaks MAVLink in sealed frames: in a network the vehicle has ports of its own for that.
        let (specs, offers, place) = match &way {
            Way::Line(place) => (PORTS, OFFERS, place.to_string()),
            Way::Radio(place, _) => {
                (PORTS.get(..1).unwrap_or_default(), OFFERS.get(..BY_RADIO).unwrap_or_default(), place.to_string())
            }
        };
        PortOption::check(&options.port, specs, "a connected vehicle")?;
        std::fs::create_dir_all(&options.out).map_err(|error| format!("{}: {error}", options.out.display()))?;
        let hub = Hub::new(vec![VehicleCard {
            faults: &[],
            missions: Vec::new(),
            ..VehicleCard::of::<V>(V::NAME, &V::default_config()).offering(offers)
        }]);
        let is_public = |wanted: &&PortOption| wanted.address.is_some_and(|address| !address.ip().is_loopback());
        if let Some(public) = options.port.iter().find(is_public) {
            let why = "the vehicle on a cable asks for no key, so programs on this machine alone may command it";
            return Err(format!("port '{}': {why}; '--port {0}=NUMBER' leaves it here", public.name).into());
        }
        let ports = Arc::new(OpenPorts::open(specs, &options.port, 0, None)?);
        for error in ports.missed() {
            eprintln!("stampfly: {error}; the vehicle is connected without it");
        }
        ended::watch(&ports, &hub, 0);
        let mut server = None;
        for (port, address) in ports.places() {
            let does = match port.transport {
                Transport::Page => {
                    let started = Server::start(hub.clone(), *address, Limits::default()).map_err(|error| {
                        format!("port '{}' at {address}: {error}; '--port {0}=NUMBER' chooses another", port.name)
                    })?;
                    let does = format!("open {} in a browser", page_address(&started, None));
                    server = Some(started);
                    does
                }
                Transport::UdpTo => format!("sending to {address}"),
                _ => format!("listening on {address}"),
            };
            outln!("{:<12} {:<42} {does}", port.name, port.meaning);
        }
        outln!("{:<12} {:<42} at {place}", "vehicle", V::NAME);
        let (closing, counting) = (ports.clone(), ports.clone());
        ctrlc::set_handler(move || closing.close())?;
        let until = options.seconds.map(|seconds| Instant::now() + Duration::from_secs_f32(seconds));
        let folder = options.out.clone();
        let bridge = match way {
            Way::Line(place) => Bridge::<V>::new(place, options.baud, hub, ports, folder),
            Way::Radio(place, key) => Bridge::by_radio(place, key, hub, ports, folder),
        };
        let mut bridge = bridge.ok_or("the ground station does not know this vehicle")?;
        if let Some(file) = &options.record {
            let failed = |error| format!("{}: {error}", file.display());
            bridge = bridge.recording(file.clone()).map_err(failed)?;
        }
        let carried = bridge.run(until);
        ended::print_sum([&counting]);
        drop(server);
        if let Some((file, counts)) = options.record.as_ref().zip(carried.record) {
            let [chunks, missing] = counts.map_err(|error| format!("{}: {error}", file.display()))?;
            outln!("{}: {chunks} chunks, {missing} missing", file.display());
        }
        Ok(if carried.was_heard { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}
