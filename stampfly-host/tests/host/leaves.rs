//! The commander of a vehicle that flies leaves, and others, who only watch, say on that they are
//! there: the vehicle notices in the time that is documented for one who is alone, and lands.

use crate::connect::page;
use crate::connect_radio::key;
use crate::doorstep::{MavlinkProgram, Observer, Speaker, WebProgram};
use crate::program::{Program, folder};
use crate::real_time::in_real_time;
use std::net::UdpSocket;
use std::path::Path;
use std::time::{Duration, Instant};

/// A commander is lost after three seconds, and a link half a second later. A machine that is busy
/// with the other vehicles is late.
const LOST: Duration = Duration::from_millis(3_500);
const BUSY: Duration = Duration::from_millis(2_000);

struct Crowd {
    name: &'static str,
    /// What has to live as long.
    _programs: Vec<Program>,
    flies: Box<dyn Speaker>,
    watches: Vec<Box<dyn Speaker>>,
    observer: Observer,
}

impl Crowd {
    fn lets_it_down(self) {
        let Self { name, _programs, mut flies, mut watches, observer } = self;
        observer.is_ready();
        let live = |flies: &mut dyn Speaker, watches: &mut [Box<dyn Speaker>], seconds: f32| {
            let until = Instant::now() + Duration::from_secs_f32(seconds);
            while Instant::now() < until {
                flies.lives(Duration::from_millis(500));
                watches.iter_mut().for_each(|one| one.is_there());
            }
        };
        live(&mut *flies, &mut watches, 2.0);
        for (what, is_seen) in [("arm", Observer::is_flown as fn(&Observer) -> bool), ("take_off", Observer::flies)] {
            let done = (0..10).any(|_| {
                flies.asks(what, Duration::ZERO);
                let answer = flies.answer(Duration::from_secs(4)) == Some(true);
                live(&mut *flies, &mut watches, if answer { 2.0 } else { 1.0 });
                answer && is_seen(&observer)
            });
            assert!(done, "{name}: {what} is not done");
        }
        live(&mut *flies, &mut watches, 5.0);
        // Meanwhile the commands of others are refused.
        for one in &mut watches {
            flies.lives(Duration::from_millis(400));
            one.asks("hold", Duration::ZERO);
            assert_eq!(one.answer(Duration::from_millis(800)), Some(false), "{name}: another's command");
        }
        flies.lives(Duration::from_millis(400));
        assert!(!observer.has_no_link(Duration::ZERO), "{name}: lost although it is there");
        drop(flies);
        let left = Instant::now();
        while !observer.has_no_link(Duration::from_millis(300)) {
            watches.iter_mut().for_each(|one| one.is_there());
            assert!(left.elapsed() < LOST + BUSY, "{name}: others keep the link");
        }
        println!("{name}: lost after {:.1} s", left.elapsed().as_secs_f32());
        while !observer.has_landed_within(Duration::from_millis(300)) {
            watches.iter_mut().for_each(|one| one.is_there());
            assert!(left.elapsed() < Duration::from_secs(40), "{name}: it does not land");
        }
    }
}

fn serve(name: &str, ports: &[&str], more: &[&str]) -> (Program, Vec<String>, Observer) {
    let named = ports.iter().flat_map(|port| ["--port", port]);
    let arguments: Vec<&str> = ["serve", "--port", "others=off", "--port", "http=0"]
        .into_iter()
        .chain(named)
        .chain(more.iter().copied())
        .collect();
    let mut serving = Program::start(&folder("leaves", name), &arguments);
    let places = ports.iter().map(|port| port.split_once('=').expect("a port").0);
    let places = places.filter(|name| *name != "mavlink-udp").map(|name| serving.place(name)).collect();
    let address = serving.said("http ", "http://");
    (serving, places, Observer::of(page(&address), address))
}

fn connect(name: &str, place: &str, more: &[&str]) -> Program {
    let ports = ["--port", "mavlink-udp=off", "--port", "http=0"];
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("leaves").join(name);
    Program::start(&folder, &[&["connect", place][..], &ports, more].concat())
}

fn web(address: &str) -> Box<dyn Speaker> {
    Box::new(WebProgram::new(page(address), true))
}

fn tcp(place: &str) -> Box<dyn Speaker> {
    Box::new(MavlinkProgram::tcp(place))
}

fn two_pages() -> Crowd {
    let (serving, _, observer) = serve("pages", &[], &[]);
    let (flies, watches) = (web(observer.address()), vec![web(observer.address())]);
    Crowd { name: "serve, two pages", _programs: vec![serving], flies, watches, observer }
}

fn two_stations_of_one_number() -> Crowd {
    let (serving, places, observer) = serve("stations", &["mavlink-tcp=0"], &[]);
    let (flies, watches) = (tcp(&places[0]), vec![tcp(&places[0])]);
    Crowd { name: "serve, two stations of one number", _programs: vec![serving], flies, watches, observer }
}

fn two_stations_of_datagrams() -> Crowd {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
    let port = format!("mavlink-udp={}", socket.local_addr().expect("an address"));
    let (serving, _, observer) = serve("datagrams", &[&port], &[]);
    let mut flies = MavlinkProgram::udp(socket);
    let watches: Vec<Box<dyn Speaker>> = vec![Box::new(MavlinkProgram::udp_to(flies.vehicle()))];
    let (name, flies) = ("serve, two stations of datagrams", Box::new(flies));
    Crowd { name, _programs: vec![serving], flies, watches, observer }
}

/// A program flies; a page and a station of its own number watch.
fn a_program_and_others() -> Crowd {
    let (serving, places, observer) = serve("others", &["mavlink-tcp=0", "usb-tcp=0"], &[]);
    let watches = vec![web(observer.address()), tcp(&places[0])];
    Crowd { name: "serve, a program at its cable", _programs: vec![serving], flies: tcp(&places[1]), watches, observer }
}

fn two_pages_of_connect() -> Crowd {
    let (serving, places, observer) = serve("connect", &["usb-tcp=0"], &[]);
    let mut connected = connect("connect", &format!("tcp:{}", places[0]), &[]);
    let address = connected.said("http ", "http://");
    let (flies, watches) = (web(&address), vec![web(&address)]);
    Crowd { name: "connect, two pages", _programs: vec![serving, connected], flies, watches, observer }
}

/// A program flies; another of its number and a page watch.
fn two_programs_of_connect() -> Crowd {
    let (serving, places, observer) = serve("programs", &["usb-tcp=0"], &[]);
    let mut connected = connect("programs", &format!("tcp:{}", places[0]), &["--port", "mavlink-tcp=0"]);
    // They are said in this order.
    let (address, place) = (connected.said("http ", "http://"), connected.place("mavlink-tcp"));
    let (flies, watches) = (tcp(&place), vec![tcp(&place), web(&address)]);
    Crowd { name: "connect, two programs", _programs: vec![serving, connected], flies, watches, observer }
}

/// Two computers with a cable each, or two programs that carry one.
fn two_connects() -> Crowd {
    let (serving, places, observer) = serve("connects", &["usb-tcp=0"], &[]);
    let place = format!("tcp:{}", places[0]);
    let mut programs = [connect("connects", &place, &[]), connect("connects", &place, &[])];
    let [one, two] = programs.each_mut().map(|program| web(&program.said("http ", "http://")));
    let programs = programs.into_iter().chain([serving]).collect();
    Crowd { name: "two connects", _programs: programs, flies: one, watches: vec![two], observer }
}

fn two_pages_by_radio() -> Crowd {
    let keys = folder("leaves", "keys");
    let ours = key(&keys, "ours", 1);
    let (serving, places, observer) = serve("radio", &["sealed=0"], &["--key", &ours]);
    let arguments = ["connect", &format!("udp:{}", places[0]), "--port", "http=0", "--key", &ours];
    let mut connected = Program::start(&keys, &arguments);
    let address = connected.said("http ", "http://");
    let (flies, watches) = (web(&address), vec![web(&address)]);
    Crowd { name: "by radio, two pages", _programs: vec![serving, connected], flies, watches, observer }
}

#[test]
fn a_commander_who_leaves_is_missed_in_time_whoever_else_is_there() {
    let _flies = in_real_time();
    let crowds: [fn() -> Crowd; 8] = [
        two_pages,
        two_stations_of_one_number,
        two_stations_of_datagrams,
        a_program_and_others,
        two_pages_of_connect,
        two_programs_of_connect,
        two_connects,
        two_pages_by_radio,
    ];
    // They mostly wait, so they wait together.
    std::thread::scope(|scope| {
        for crowd in crowds {
            scope.spawn(move || crowd().lets_it_down());
        }
    });
}
