//! `stampfly serve`: simulated vehicles in real time, flown by other programs.
//!
//! Each vehicle has a thread, its ports and its log. Ctrl-C ends them, a report of each is written, and the exit code says whether
//! a vehicle did what it must not.

use crate::command_line::arguments::ServeOptions;
use crate::command_line::ended;
use crate::command_line::failure::Failure;
use crate::command_line::fly::{figures, write_report};
use crate::flown::{Flown, fly};
use crate::ground::{self, Client, Event, Hub, Limits, Server, VehicleCard, Watch};
use crate::log_file::LogFile;
use crate::recorder::Recorder;
use crate::serve::{Armed, ArmedWitness, FlightLog, Key, OpenPorts, Page, PortOption, RecordOut};
use crate::vehicles::{self, ForVehicle};
use serde_json::Value;
use stampfly_bus::{Schedule, TopicTable};
use stampfly_sim::vehicle::{Live, Options, Speed, Transport, Vehicle, Verdict};
use stampfly_types::Duration;
use std::net::{Ipv6Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

/// A log of more bytes has no report: a browser would not open it. Some ten minutes of one vehicle.
const LARGEST_REPORT: u64 = 300_000_000;
/// A log of one vehicle has so many bytes at most: an hour in the air.
const LARGEST_LOG: u64 = 2_000_000_000;
/// As good as for ever, s: a year.
const FOR_EVER: u64 = 365 * 86_400;
/// Vehicles stand side by side in rows of so many, so far apart, m.
const COLUMNS: u8 = 8;
const APART: f32 = 2.0;
/// After Ctrl-C, a vehicle that does not end in this time is left where it is.
const PATIENCE: std::time::Duration = std::time::Duration::from_secs(3);

pub fn run(options: &ServeOptions) -> Result<ExitCode, Failure> {
    vehicles::with(&options.scene.vehicle.name, Serve(options))?
}

struct Serve<'o>(&'o ServeOptions);

impl ForVehicle for Serve<'_> {
    type Output = Result<ExitCode, Failure>;

    fn run<V: Vehicle>(self) -> Self::Output {
        let Self(options) = self;
        if options.scene.list {
            options.scene.print_list::<V>(options.seed)?;
            return Ok(ExitCode::SUCCESS);
        }
        let hub = hub::<V>(options)?;
        let ports = open::<V>(options, &hub)?;
        let _server = ground(options, &ports, &hub)?;
        let (closing, over) = (ports.clone(), Arc::new(AtomicBool::new(false)));
        let are_over = over.clone();
        ctrlc::set_handler(move || {
            closing.iter().for_each(|ports| ports.close());
            thread::sleep(PATIENCE);
            // A report of a long flight takes longer than that to write.
            if !are_over.load(Ordering::Relaxed) {
                std::process::exit(130);
            }
        })?;
        std::fs::create_dir_all(&options.out).map_err(|error| format!("{}: {error}", options.out.display()))?;
        let flights: Vec<_> = ports
            .iter()
            .enumerate()
            .map(|(number, ports)| Flight::<V>::first(options, number, ports, &hub))
            .collect::<Result<_, _>>()?;
        let ended: Vec<_> = thread::scope(|scope| {
            let threads: Vec<_> = flights.into_iter().map(|flight| scope.spawn(move || flight.fly_all())).collect();
            threads.into_iter().map(thread::ScopedJoinHandle::join).collect()
        });
        over.store(true, Ordering::Relaxed);
        ended::print_sum(&ports);
        let mut all_well = true;
        for ended in ended {
            for (flown, hash, log) in ended.map_err(|_| "a vehicle's thread has failed")?? {
                all_well &= flown.outcome.succeeded();
                report::<V>(options, &flown, hash, &log)?;
            }
        }
        Ok(if all_well { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}

/// What a page is told of every vehicle, and what it shares with their flights.
fn hub<V: Vehicle>(options: &ServeOptions) -> Result<Arc<Hub>, Failure> {
    let mut cards = Vec::new();
    for number in 0..options.count {
        let setup = options.scene.setup::<V>(options.seed + u64::from(number), None, None)?;
        let name = format!("{} {}", V::NAME, number + 1);
        let mut card = VehicleCard::of::<V>(&name, V::config(&setup)).offering(V::ASKS);
        let [column, row] = [number % COLUMNS, number / COLUMNS].map(|place| f32::from(place) * APART);
        card.place = [-row, column];
        cards.push(card);
    }
    Ok(Hub::new(cards))
}

/// Starts the ground station where the first vehicle has its port for one, if it has and it is not off.
fn ground(options: &ServeOptions, ports: &[Arc<OpenPorts>], hub: &Arc<Hub>) -> Result<Option<Server>, Failure> {
    let first = ports.first();
    let place = first.and_then(|ports| ports.places().iter().find(|(port, _)| port.transport == Transport::Page));
    let Some((port, address)) = place else { return Ok(None) };
    let secret = first.and_then(|ports| ports.page_secret());
    match Server::with_secret(hub.clone(), *address, Limits::default(), secret.clone()) {
        Ok(server) => {
            outln!("{:<12} {:<42} open {} in a browser", port.name, port.meaning, page_address(&server, secret));
            Ok(Some(server))
        }
        Err(error) if options.port.iter().any(|option| option.name == port.name) => {
            let name = port.name;
            Err(format!("port '{name}' at {address}: {error}; '--port {name}=NUMBER' chooses another").into())
        }
        Err(error) => {
            let name = port.name;
            eprintln!(
                "stampfly: port '{name}' at {address}: {error}; '--port {name}=NUMBER' chooses another, the vehicle flies without it"
            );
            Ok(None)
        }
    }
}

/// What a browser is to open.
pub(super) fn page_address(server: &Server, secret: Option<String>) -> String {
    let end = secret.map_or_else(String::new, |secret| format!("/#{secret}"));
    format!("http://{}{end}", server.address())
}

/// The page's end of one vehicle's port.
struct PageOf {
    hub: Arc<Hub>,
    vehicle: usize,
}

impl Page for PageOf {
    fn take(&self) -> Vec<(SocketAddr, Vec<u8>)> {
        let asks = self.hub.asks(self.vehicle, ground::now()).into_iter();
        asks.filter_map(|(client, asked)| Some((address(client), serde_json::to_vec(&asked).ok()?))).collect()
    }

    fn deliver(&self, to: SocketAddr, bytes: &[u8]) {
        if let (SocketAddr::V6(to), Ok(text)) = (to, std::str::from_utf8(bytes)) {
            self.hub.send(Client::of(to.ip().to_bits() as u64), text);
        }
    }

    fn gone(&self) -> Vec<SocketAddr> {
        self.hub.gone(self.vehicle).into_iter().map(address).collect()
    }

    fn tell(&self, text: &str) {
        self.hub.tell_all(self.vehicle, &Event::Text { text: text.to_owned() });
    }

    fn tell_commander(&self, who: &str, page: Option<u32>) {
        let event = Event::Commander { who: who.to_owned(), page: page.map(u64::from) };
        self.hub.tell_all(self.vehicle, &event);
    }
}

/// A page has no address of its own: its number, written as one.
fn address(client: Client) -> SocketAddr {
    (Ipv6Addr::from_bits(client.number().into()), 0).into()
}

/// Opens the ports of every vehicle, and says where they are.
fn open<V: Vehicle>(options: &ServeOptions, hub: &Arc<Hub>) -> Result<Vec<Arc<OpenPorts>>, Failure> {
    if V::PORTS.is_empty() {
        return Err(format!("the vehicle '{}' has no ports", V::NAME).into());
    }
    let listen = options.listen.map(|address| PortOption { name: "listen".into(), address: Some(address) });
    let wanted: Vec<_> = options.port.iter().cloned().chain(listen).collect();
    PortOption::check(&wanted, V::PORTS, V::NAME)?;
    let which = |number: usize| if options.count == 1 { String::new() } else { format!("vehicle {}  ", number + 1) };
    let key = options.key.as_deref().map(Key::read).transpose()?.map(|key| key.everywhere(options.sign_all));
    let mut all = Vec::new();
    for number in 0..usize::from(options.count) {
        let opened = OpenPorts::open(V::PORTS, &wanted, number, key.clone())?;
        for (port, place) in opened.places().iter().filter(|(port, _)| port.transport != Transport::Page) {
            let does = if port.transport == Transport::UdpTo { "sending to" } else { "listening on" };
            outln!("{}{:<12} {:<42} {does} {place}", which(number), port.name, port.meaning);
        }
        for (port, place) in opened.terminals() {
            outln!("{}{:<12} {:<42} is {place}", which(number), port.name, port.meaning);
        }
        for error in opened.missed() {
            eprintln!("stampfly: {}{error}; the vehicle flies without it", which(number));
        }
        ended::watch(&opened, hub, number);
        all.push(Arc::new(opened.with_page(PageOf { hub: hub.clone(), vehicle: number })));
    }
    Ok(all)
}

/// A flight that is over: how it went, its hash, its log.
type Over<V> = (Flown<<V as Vehicle>::Outcome>, u64, PathBuf);

/// One vehicle, ready to be switched on.
struct Flight<'s, V: Vehicle> {
    options: &'s ServeOptions,
    number: usize,
    ports: &'s Arc<OpenPorts>,
    hub: &'s Hub,
    setup: V::Setup,
    recorder: Recorder<V, FlightLog>,
    log: PathBuf,
    watch: Watch,
    record: RecordOut,
    armed: ArmedWitness,
}

impl<'s, V: Vehicle> Flight<'s, V> {
    /// The first of a vehicle.
    fn first(
        options: &'s ServeOptions,
        number: usize,
        ports: &'s Arc<OpenPorts>,
        hub: &'s Hub,
    ) -> Result<Self, Failure> {
        let ServeOptions { scene, seed, speed, seconds, .. } = options;
        let limit = seconds.map_or(Duration::from_secs(FOR_EVER), Duration::from_seconds);
        let live = Live { ports: ports.clone(), number, limit, speed: Some(Speed::new(*speed)) };
        let typed = Options { live: Some(live), ..scene.options(scene.jitter) };
        let setup = V::setup(&typed, seed + number as u64)?;
        Ok(Self::prepare(options, number, ports, hub, setup, 0)?)
    }

    /// The one after so many restarts. Each has a log of its own, because each begins at power-on.
    fn prepare(
        options: &'s ServeOptions,
        number: usize,
        ports: &'s Arc<OpenPorts>,
        hub: &'s Hub,
        setup: V::Setup,
        restarts: usize,
    ) -> Result<Self, String> {
        let which = if options.count == 1 { String::new() } else { format!("-{}", number + 1) };
        let again = if restarts == 0 { String::new() } else { format!("-restart-{restarts}") };
        let log = options.out.join(format!("flight{which}{again}.ulg"));
        let failed = |error| format!("{}: {error}", log.display());
        let file = LogFile::create(log.clone()).map_err(failed)?;
        let facts = [
            ("ver_sw".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
            ("seed".to_owned(), (options.seed + number as u64).to_string()),
            ("mission".to_owned(), "other programs".to_owned()),
        ];
        let armed = Armed::default();
        let so_far = file.clone();
        hub.provide_log(number, move || so_far.so_far());
        let watch = hub.witness(number).ok_or("the ground station does not know this vehicle")?;
        let recorder = Recorder::with_sink(FlightLog::new(file, armed.clone(), LARGEST_LOG), &setup, &facts)
            .map_err(|error| format!("{}: {error:?}", log.display()))?;
        let record = options.record.map_or_else(
            || Ok(RecordOut::nowhere()),
            |to| {
                let port = to.port().saturating_add(10 * number as u16);
                RecordOut::datagrams(V::NAME, (to.ip(), port).into()).map_err(|error| format!("{to}: {error}"))
            },
        )?;
        let armed = armed.witness(<<V::Runnables as Schedule>::Topics as TopicTable>::TOPICS);
        Ok(Self { options, number, ports, hub, setup, recorder, log, watch, record, armed })
    }

    /// Flies, again after each restart that somebody asks the vehicle for.
    fn fly_all(self) -> Result<Vec<Over<V>>, String> {
        let (mut over, mut next) = (Vec::new(), Some(self));
        while let Some(flight) = next.take() {
            let Self { options, number, ports, hub, setup, recorder, log, watch, record, armed } = flight;
            let mut witnesses = (recorder, (armed, (watch, record)));
            let flown = fly::<V>(&setup, &mut witnesses, &mut |_, _| {});
            let (recorder, _) = witnesses;
            let hash = recorder.hash();
            if let Some(Err(error)) = recorder.into_written().map(FlightLog::finish) {
                eprintln!("stampfly: {}: {error}", log.display());
            }
            if let Some(setup) = V::again(&setup, &flown.outcome) {
                next = Some(Self::prepare(options, number, ports, hub, setup, over.len() + 1)?);
                ports.reopen();
            }
            over.push((flown, hash, log));
        }
        Ok(over)
    }
}

/// Says how it went, and writes the report.
fn report<V: Vehicle>(options: &ServeOptions, flown: &Flown<V::Outcome>, hash: u64, log: &Path) -> Result<(), Failure> {
    let page = log.with_extension("html");
    let size = std::fs::metadata(log).map_or(0, |file| file.len());
    let shown = size <= LARGEST_REPORT;
    if shown {
        let bytes = std::fs::read(log).map_err(|error| format!("{}: {error}", log.display()))?;
        write_report::<V>(flown, (&bytes, hash), None, options.seed, &page)?;
    }
    for (name, contents) in flown.outcome.files() {
        let path = options.out.join(name);
        std::fs::write(&path, contents).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    if options.scene.json {
        outln!("{}", Value::Object(figures(flown, hash)));
        return Ok(());
    }
    outln!("{:.1} s, {}", flown.duration.seconds_f64(), flown.outcome.sentence());
    outln!("log     {}", log.display());
    match shown {
        true => outln!("report  {}", page.display()),
        false => outln!("report  none: the log has {} MB", size / 1_000_000),
    }
    Ok(())
}
