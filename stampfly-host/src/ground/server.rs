//! The server of the page: a thread that accepts, and one for each connection.
//!
//! For one person at a desk and a few programs. Where others can reach it, give it a
//! [secret](Server::with_secret).

use super::client;
use super::limits::Limits;
use super::page;
use crate::waited::has_only_waited;
use stampfly_ground::http::{self, Hosts, Refusal, Request, Wanted};
use stampfly_ground::{Hub, LogSoFar};
use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use tungstenite::handshake::derive_accept_key;

/// Bytes of a log that are in memory.
const PART: usize = 64 << 10;

/// A server that runs until it is dropped.
///
/// ```
/// use std::io::{Read, Write};
/// use std::net::TcpStream;
/// use stampfly_host::ground::{Hub, Limits, Server};
///
/// let server = Server::start(Hub::new(vec![]), "127.0.0.1:0".parse().unwrap(), Limits::default())?;
/// let mut stream = TcpStream::connect(server.address())?;
/// write!(stream, "GET / HTTP/1.1\r\nHost: {}\r\n\r\n", server.address())?;
/// let mut answer = String::new();
/// stream.read_to_string(&mut answer)?;
/// assert!(answer.starts_with("HTTP/1.1 200 OK\r\n"));
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Debug)]
pub struct Server {
    address: SocketAddr,
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// What all connections share.
struct Common {
    hub: Arc<Hub>,
    hosts: Hosts,
    limits: Limits,
    /// What has to follow the addresses.
    secret: Option<String>,
    is_over: Arc<AtomicBool>,
    /// Requests that are not answered yet, oldest first.
    requests: Mutex<VecDeque<(u64, TcpStream)>>,
    sockets: AtomicUsize,
    logs: AtomicUsize,
}

impl Common {
    fn requests(&self) -> MutexGuard<'_, VecDeque<(u64, TcpStream)>> {
        self.requests.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes another request. Where there are too many, the oldest one is ended.
    fn begin(&self, number: u64, stream: &TcpStream) -> io::Result<()> {
        let stream = stream.try_clone()?;
        let mut requests = self.requests();
        if requests.len() >= self.limits.requests
            && let Some((_, oldest)) = requests.pop_front()
        {
            let _ = oldest.shutdown(Shutdown::Both);
        }
        requests.push_back((number, stream));
        Ok(())
    }

    /// This request is answered, or has become something else.
    fn end(&self, number: u64) {
        self.requests().retain(|(other, _)| *other != number);
    }

    /// Does it know the secret, if there is one? Compared in a time that does not depend on where
    /// they differ.
    fn knows(&self, said: Option<&str>) -> bool {
        let Some(secret) = &self.secret else { return true };
        let said = said.unwrap_or_default();
        let differs = secret.bytes().zip(said.bytes()).fold(0, |differs, (one, other)| differs | (one ^ other));
        secret.len() == said.len() && differs == 0
    }
}

/// One of a number of places, until it is dropped.
struct Place<'c>(&'c AtomicUsize);

impl<'c> Place<'c> {
    fn take(taken: &'c AtomicUsize, most: usize) -> Option<Self> {
        let place = Place(taken);
        (taken.fetch_add(1, Ordering::Relaxed) < most).then_some(place)
    }
}

impl Drop for Place<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Server {
    /// Listens there. Port 0 takes a free one.
    ///
    /// # Errors
    /// When the system refuses the address.
    pub fn start(hub: Arc<Hub>, listen: SocketAddr, limits: Limits) -> io::Result<Self> {
        Self::with_secret(hub, listen, limits, None)
    }

    /// The same. With a secret, only pages whose address ends with it see and ask anything: letters
    /// and digits.
    ///
    /// # Errors
    /// When the system refuses the address.
    pub fn with_secret(hub: Arc<Hub>, listen: SocketAddr, limits: Limits, secret: Option<String>) -> io::Result<Self> {
        let listener = TcpListener::bind(listen)?;
        let address = listener.local_addr()?;
        let hosts = if address.ip().is_loopback() { Hosts::Loopback } else { Hosts::Addresses };
        let is_over = Arc::new(AtomicBool::new(false));
        let common = Arc::new(Common {
            hub,
            hosts,
            limits,
            secret,
            is_over: is_over.clone(),
            requests: Mutex::default(),
            sockets: AtomicUsize::new(0),
            logs: AtomicUsize::new(0),
        });
        let thread = thread::Builder::new().name("ground".into()).spawn(move || accept(&listener, &common))?;
        Ok(Self { address, is_over, thread: Some(thread) })
    }

    /// Where it listens.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        // Accepting ends with the next connection: this one.
        let here = match self.address.ip() {
            IpAddr::V4(address) if address.is_unspecified() => IpAddr::from(Ipv4Addr::LOCALHOST),
            IpAddr::V6(address) if address.is_unspecified() => Ipv6Addr::LOCALHOST.into(),
            address => address,
        };
        if TcpStream::connect_timeout(&(here, self.address.port()).into(), Duration::from_secs(1)).is_ok()
            && let Some(thread) = self.thread.take()
        {
            let _ = thread.join();
        }
    }
}

fn accept(listener: &TcpListener, common: &Arc<Common>) {
    for (number, stream) in (0..).zip(listener.incoming()) {
        if common.is_over.load(Ordering::Relaxed) {
            return;
        }
        let Ok(stream) = stream else {
            // Out of file handles, say: again, but not at once.
            thread::sleep(Duration::from_millis(10));
            continue;
        };
        if common.begin(number, &stream).is_err() {
            continue;
        }
        let of_thread = common.clone();
        // Without a thread the client is left alone: its connection closes.
        let begun = thread::Builder::new().name("ground client".into()).spawn(move || {
            let _ = attend(&of_thread, number, stream);
            of_thread.end(number);
        });
        if begun.is_err() {
            common.end(number);
        }
    }
}

fn attend(common: &Common, number: u64, mut stream: TcpStream) -> io::Result<()> {
    stream.set_write_timeout(Some(common.limits.stall))?;
    let mut bytes = Vec::new();
    let Request { wanted, secret, length } = match read_request(common, &mut stream, &mut bytes)? {
        Ok(request) => request,
        Err(refusal) => return refuse(&mut stream, refusal),
    };
    // The page itself shows nothing and knows nothing: the secret is in its address, behind what a
    // browser sends.
    if wanted != Wanted::Page && !common.knows(secret.as_deref()) {
        return refuse(&mut stream, Refusal::Secret);
    }
    match wanted {
        Wanted::Page => {
            let (html, policy) = page::html();
            let head = http::head("200 OK", "text/html; charset=utf-8", html.len() as u64, &policy);
            answer(&mut stream, head.as_bytes(), html.as_bytes())
        }
        Wanted::Log(vehicle) => {
            common.end(number);
            let Some(_place) = Place::take(&common.logs, common.limits.logs) else {
                return refuse(&mut stream, Refusal::Busy);
            };
            match common.hub.log(vehicle) {
                Some(Ok(log)) => send_log(&common.limits, &mut stream, vehicle, log),
                Some(Err(_)) => refuse(&mut stream, Refusal::Unreadable),
                None => refuse(&mut stream, Refusal::NotFound),
            }
        }
        Wanted::Socket(key) => {
            common.end(number);
            let Some(_place) = Place::take(&common.sockets, common.limits.sockets) else {
                return refuse(&mut stream, Refusal::Busy);
            };
            stream.write_all(http::upgrade(&derive_accept_key(key.as_bytes())).as_bytes())?;
            let is_over = || common.is_over.load(Ordering::Relaxed);
            client::serve(common.hub.clone(), stream, bytes.split_off(length), &common.limits, &is_over);
            Ok(())
        }
    }
}

/// Sends a log part by part, as it is on the disk. A client that is slower than the limit gets a
/// part of it.
fn send_log(limits: &Limits, stream: &mut TcpStream, vehicle: usize, log: LogSoFar) -> io::Result<()> {
    let LogSoFar { length, mut bytes } = log;
    let name = format!("Content-Disposition: attachment; filename=\"vehicle-{vehicle}.ulg\"\r\n");
    stream.write_all(http::head("200 OK", "application/octet-stream", length, &name).as_bytes())?;
    let (begun, mut sent, mut part) = (Instant::now(), 0, vec![0; PART]);
    loop {
        let count = bytes.read(&mut part)?;
        if count == 0 {
            return end(stream);
        }
        stream.write_all(part.get(..count).unwrap_or_default())?;
        sent += count as u64;
        let allowed = limits.stall + Duration::from_secs(sent / u64::from(limits.slowest.max(1)));
        if begun.elapsed() > allowed {
            return Err(ErrorKind::TimedOut.into());
        }
    }
}

fn refuse(stream: &mut TcpStream, refusal: Refusal) -> io::Result<()> {
    answer(stream, http::refuse(refusal).as_bytes(), &[])
}

/// Reads until there is a request or the time is over. What has been read stays in `bytes`.
fn read_request(common: &Common, stream: &mut TcpStream, bytes: &mut Vec<u8>) -> io::Result<Result<Request, Refusal>> {
    let until = Instant::now() + common.limits.head;
    let mut part = [0; 2048];
    loop {
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Ok(Err(Refusal::Slow));
        }
        stream.set_read_timeout(Some(left))?;
        let length = match stream.read(&mut part) {
            Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
            Ok(length) => length,
            Err(error) if has_only_waited(&error) => continue,
            Err(error) => return Err(error),
        };
        bytes.extend_from_slice(part.get(..length).unwrap_or_default());
        match http::request(bytes, common.hosts) {
            Ok(None) => {}
            Ok(Some(request)) => return Ok(Ok(request)),
            Err(refusal) => return Ok(Err(refusal)),
        }
    }
}

fn answer(stream: &mut TcpStream, head: &[u8], body: &[u8]) -> io::Result<()> {
    stream.write_all(head)?;
    stream.write_all(body)?;
    end(stream)
}

fn end(stream: &mut TcpStream) -> io::Result<()> {
    stream.shutdown(Shutdown::Write)?;
    // A connection that is closed with bytes unread is reset, and the answer may be lost. A little
    // of what the client still sends is read, for a little time.
    stream.set_read_timeout(Some(Duration::from_millis(200)))?;
    let mut rest = [0; 2048];
    for _ in 0..32 {
        if stream.read(&mut rest)? == 0 {
            break;
        }
    }
    Ok(())
}
