//! Commands that a network holds up, on every path from a page or a program to a vehicle: they are
//! refused, and the vehicle does nothing when they come. Motors off is done.

use crate::connect::page;
use crate::connect_radio::key;
use crate::doorstep::{MavlinkProgram, Observer, Speaker, WebProgram};
use crate::program::{Program, folder};
use crate::real_time::in_real_time;
use crate::relay::{Datagrams, Held, Stream};
use crate::thorough::thorough;
use stampfly_host::campaign::parallel;
use std::path::Path;
use std::time::Duration;

/// Paths that are tried at the same time: each has two or three programs.
const AT_ONCE: usize = 4;

/// One path: the vehicle is simulated, and something on the way holds bytes up.
struct Route {
    name: &'static str,
    /// What has to live as long.
    _programs: Vec<Program>,
    held: Box<dyn Held>,
    speaker: Box<dyn Speaker>,
    observer: Observer,
    /// Shortest time that is noticed, s.
    shortest: f32,
}

impl Route {
    /// Holds a command up, and looks what comes of it.
    fn refuses(&mut self, seconds: f32) {
        let Self { name, held, speaker, observer, .. } = self;
        speaker.lives(Duration::from_secs(2));
        held.hold(true);
        speaker.asks("arm", Duration::from_secs_f32(seconds));
        held.hold(false);
        // What was held up comes first, and a machine that is busy with other tests is slow with it.
        let answer = speaker.answer(Duration::from_secs(20));
        assert_eq!(answer, Some(false), "{name}: held for {seconds} s");
        speaker.lives(Duration::from_secs(2));
        assert!(!observer.was_armed(), "{name}: done {seconds} s later");
    }

    /// What is not held up is done, and what stops motors is done whenever it comes.
    fn obeys(&mut self) {
        let Self { name, held, speaker, observer, .. } = self;
        // A machine that is busy with other tests may hold it up by itself.
        let armed = (0..10).any(|_| {
            speaker.lives(Duration::from_secs(2));
            speaker.asks("arm", Duration::ZERO);
            speaker.answer(Duration::from_secs(4)) == Some(true)
        });
        assert!(armed && observer.is_armed(true), "{name}: what is fresh is refused");
        speaker.lives(Duration::from_secs(1));
        held.hold(true);
        speaker.asks("kill", Duration::from_millis(1_500));
        held.hold(false);
        assert!(observer.is_armed(false), "{name}: a kill that came late is not done");
    }
}

fn serve(folder: &Path, port: &str, more: &[&str]) -> (Program, String, Observer) {
    let arguments = ["serve", "--port", "others=off", "--port", "http=0", "--port", port];
    let mut serving = Program::start(folder, &[&arguments, more].concat());
    let (name, _) = port.split_once('=').expect("a port");
    let listens = !matches!(name, "http" | "mavlink-udp");
    let place = if listens { serving.place(name) } else { String::new() };
    let address = serving.said("http ", "http://");
    (serving, place, Observer::of(page(&address), address))
}

fn connect(folder: &Path, place: &str, more: &[&str]) -> Program {
    let ports = ["--port", "mavlink-udp=off", "--port", "http=0"];
    Program::start(folder, &[&["connect", place][..], &ports, more].concat())
}

/// A page, or a program that says no time, at the page of `serve`.
fn served_page(name: &'static str, says_time: bool) -> Route {
    let (serving, _, observer) = serve(&folder("late", name), "http=0", &[]);
    let held = Stream::to(observer.address());
    let speaker = Box::new(WebProgram::new(page(held.place()), says_time));
    Route { name, _programs: vec![serving], held: Box::new(held), speaker, observer, shortest: 1.5 }
}

/// MAVLink at a TCP port of `serve`. Heartbeats alone show that a network has held something up, so
/// that takes three of them.
fn served_tcp() -> Route {
    let name = "serve mavlink-tcp";
    let (serving, place, observer) = serve(&folder("late", "tcp"), "mavlink-tcp=0", &[]);
    let held = Stream::to(&place);
    let speaker = Box::new(MavlinkProgram::tcp(held.place()));
    Route { name, _programs: vec![serving], held: Box::new(held), speaker, observer, shortest: 4.0 }
}

fn served_udp() -> Route {
    let name = "serve mavlink-udp";
    let (held, near) = Datagrams::before_a_program();
    let port = format!("mavlink-udp={}", held.place());
    let (serving, _, observer) = serve(&folder("late", "udp"), &port, &[]);
    let speaker = Box::new(MavlinkProgram::udp(near));
    Route { name, _programs: vec![serving], held: Box::new(held), speaker, observer, shortest: 4.0 }
}

/// A page of `connect`, whose line to the vehicle is held up, or whose own connection is.
fn connected_page(name: &'static str, at_line: bool) -> Route {
    let folder = folder("late", name);
    let (serving, place, observer) = serve(&folder, "usb-tcp=0", &[]);
    let line = Stream::to(&place);
    let mut connected = connect(&folder, &format!("tcp:{}", line.place()), &[]);
    let address = connected.said("http ", "http://");
    let near = Stream::to(&address);
    let socket = page(near.place());
    let held = if at_line { Box::new(line.beside(near)) } else { Box::new(near.beside(line)) };
    let speaker = Box::new(WebProgram::new(socket, true));
    Route { name, _programs: vec![serving, connected], held, speaker, observer, shortest: 1.5 }
}

/// The same over a serial port.
#[cfg(unix)]
fn connected_cable() -> Route {
    let folder = folder("late", "cable");
    let (serving, place, observer) = serve(&folder, "usb-tcp=0", &[]);
    let (held, terminal) = Stream::at_a_terminal(&place);
    let mut connected = connect(&folder, &terminal, &[]);
    let address = connected.said("http ", "http://");
    let speaker = Box::new(WebProgram::new(page(&address), true));
    let (name, held) = ("connect, serial port", Box::new(held));
    Route { name, _programs: vec![serving, connected], held, speaker, observer, shortest: 1.5 }
}

/// A program at MAVLink's port of `connect`. What it says is held up before, while the line is live.
fn connected_program() -> Route {
    let folder = folder("late", "program");
    let (serving, place, observer) = serve(&folder, "usb-tcp=0", &[]);
    let mut connected = connect(&folder, &format!("tcp:{place}"), &["--port", "mavlink-tcp=0"]);
    let held = Stream::to(&connected.place("mavlink-tcp"));
    let speaker = Box::new(MavlinkProgram::tcp(held.place()));
    let (name, held) = ("connect mavlink-tcp", Box::new(held));
    Route { name, _programs: vec![serving, connected], held, speaker, observer, shortest: 4.0 }
}

/// A program at the same port, whose line to the vehicle is held up: that end knows the time.
fn connected_program_at_the_line() -> Route {
    let folder = folder("late", "program_line");
    let (serving, place, observer) = serve(&folder, "usb-tcp=0", &[]);
    let held = Stream::to(&place);
    let more = ["--port", "mavlink-tcp=0"];
    let mut connected = connect(&folder, &format!("tcp:{}", held.place()), &more);
    let speaker = Box::new(MavlinkProgram::tcp(&connected.place("mavlink-tcp")).timed());
    let (name, held) = ("connect mavlink-tcp, line", Box::new(held));
    Route { name, _programs: vec![serving, connected], held, speaker, observer, shortest: 1.5 }
}

fn radio() -> Route {
    let folder = folder("late", "radio");
    let ours = key(&folder, "ours", 1);
    let (serving, place, observer) = serve(&folder, "sealed=0", &["--key", &ours]);
    let held = Datagrams::to(&place);
    let arguments = ["connect", &format!("udp:{}", held.place()), "--port", "http=0", "--key", &ours];
    let mut connected = Program::start(&folder, &arguments);
    let address = connected.said("http ", "http://");
    let speaker = Box::new(WebProgram::new(page(&address), true));
    let (name, held) = ("radio", Box::new(held));
    Route { name, _programs: vec![serving, connected], held, speaker, observer, shortest: 1.5 }
}

#[test]
fn what_a_network_holds_up_is_refused_on_every_path_and_what_stops_motors_is_done() {
    let _flies = in_real_time();
    let routes: [fn() -> Route; _] = [
        || served_page("serve page", true),
        || served_page("serve page, no time", false),
        served_tcp,
        served_udp,
        || connected_page("connect tcp, line", true),
        || connected_page("connect tcp, page", false),
        #[cfg(unix)]
        connected_cable,
        connected_program,
        connected_program_at_the_line,
        radio,
    ];
    // They mostly wait, so some wait together; more of them would hold up one another.
    parallel::each(routes.len(), AT_ONCE, &|place| {
        let mut route = routes[place]();
        route.observer.is_ready();
        let shortest = route.shortest;
        for seconds in thorough(vec![1.5], vec![1.5, 5.0, 20.0]) {
            route.refuses(f32::max(seconds, shortest));
        }
        route.obeys();
    });
}
