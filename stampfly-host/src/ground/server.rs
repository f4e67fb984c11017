//! The server of the page: a thread that accepts, and one for each connection.
//!
//! For one person at a desk and a few programs. Use a loopback address unless others on the network are to fly the vehicles:
//! there is no password.

use super::client;
use super::limits::Limits;
use super::page;
use crate::waited::has_only_waited;
use stampfly_ground::Hub;
use stampfly_ground::http::{self, Hosts, Refusal, Request, Wanted};
use std::io::{self, ErrorKind, Read, Write};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use tungstenite::handshake::derive_accept_key;

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
    is_over: Arc<AtomicBool>,
    open: AtomicUsize,
}

impl Server {
    /// Listens there. Port 0 takes a free one.
    ///
    /// # Errors
    /// When the system refuses the address.
    pub fn start(hub: Arc<Hub>, listen: SocketAddr, limits: Limits) -> io::Result<Self> {
        let listener = TcpListener::bind(listen)?;
        let address = listener.local_addr()?;
        let hosts = if address.ip().is_loopback() { Hosts::Loopback } else { Hosts::Addresses };
        let is_over = Arc::new(AtomicBool::new(false));
        let common = Common { hub, hosts, limits, is_over: is_over.clone(), open: AtomicUsize::new(0) };
        let common = Arc::new(common);
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

/// One of the open connections.
struct Place(Arc<Common>);

impl Drop for Place {
    fn drop(&mut self) {
        self.0.open.fetch_sub(1, Ordering::Relaxed);
    }
}

fn accept(listener: &TcpListener, common: &Arc<Common>) {
    for stream in listener.incoming() {
        if common.is_over.load(Ordering::Relaxed) {
            return;
        }
        let Ok(stream) = stream else {
            // Out of file handles, say: again, but not at once.
            thread::sleep(Duration::from_millis(10));
            continue;
        };
        let before = common.open.fetch_add(1, Ordering::Relaxed);
        let place = Place(common.clone());
        if before >= common.limits.connections {
            // Nobody waits for this client: what the system takes at once has to do.
            let _ = stream.set_nonblocking(true);
            let _ = (&stream).write(http::refuse(Refusal::Busy).as_bytes());
            let _ = stream.shutdown(Shutdown::Write);
            continue;
        }
        // Without a thread the client is left alone: its connection closes.
        let _ = thread::Builder::new().name("ground client".into()).spawn(move || {
            let _ = attend(&place.0, stream);
        });
    }
}

fn attend(common: &Common, mut stream: TcpStream) -> io::Result<()> {
    stream.set_write_timeout(Some(common.limits.stall))?;
    let mut bytes = Vec::new();
    let Request { wanted, length } = match read_request(common, &mut stream, &mut bytes)? {
        Ok(request) => request,
        Err(refusal) => return answer(&mut stream, http::refuse(refusal).as_bytes(), &[]),
    };
    match wanted {
        Wanted::Page => {
            let (html, policy) = page::html();
            let head = http::head("200 OK", "text/html; charset=utf-8", html.len(), &policy);
            answer(&mut stream, head.as_bytes(), html.as_bytes())
        }
        Wanted::Log(vehicle) => match common.hub.log(vehicle) {
            Some(log) => {
                let name = format!("Content-Disposition: attachment; filename=\"vehicle-{vehicle}.ulg\"\r\n");
                let head = http::head("200 OK", "application/octet-stream", log.len(), &name);
                answer(&mut stream, head.as_bytes(), &log)
            }
            None => answer(&mut stream, http::refuse(Refusal::NotFound).as_bytes(), &[]),
        },
        Wanted::Socket(key) => {
            stream.write_all(http::upgrade(&derive_accept_key(key.as_bytes())).as_bytes())?;
            let is_over = || common.is_over.load(Ordering::Relaxed);
            client::serve(common.hub.clone(), stream, bytes.split_off(length), &common.limits, &is_over);
            Ok(())
        }
    }
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
    stream.shutdown(Shutdown::Write)?;
    // A connection that is closed with bytes unread is reset, and the answer may be lost. A little of what the client still
    // sends is read, for a little time.
    stream.set_read_timeout(Some(Duration::from_millis(200)))?;
    let mut rest = [0; 2048];
    for _ in 0..32 {
        if stream.read(&mut rest)? == 0 {
            break;
        }
    }
    Ok(())
}
