//! `stampfly doors`: the ports of a vehicle, what programs may do there, and what stops others.

use crate::command_line::arguments::TopicsOptions;
use crate::command_line::failure::Failure;
use crate::connect;
use crate::vehicles::{self, ForVehicle};
use serde_json::json;
use stampfly_sim::vehicle::{Guard, PortSpec, Speech, Transport, Vehicle};
use std::process::ExitCode;

pub fn run(options: &TopicsOptions) -> Result<ExitCode, Failure> {
    vehicles::with(&options.vehicle.name, Doors(options))?
}

struct Doors<'o>(&'o TopicsOptions);

impl ForVehicle for Doors<'_> {
    type Output = Result<ExitCode, Failure>;

    fn run<V: Vehicle>(self) -> Self::Output {
        let Self(options) = self;
        let rows: Vec<_> = [("serve", V::PORTS), ("connect", connect::PORTS)]
            .into_iter()
            .flat_map(|(command, ports)| ports.iter().map(move |port| (command, port)))
            .collect();
        if options.json {
            let rows: Vec<_> = rows
                .iter()
                .map(|(command, port)| {
                    json!({
                        "command": command, "name": port.name, "place": place(port), "may": port.may,
                        "here": here(port), "others": others(command, port),
                    })
                })
                .collect();
            outln!("{}", json!({ "doors": rows }));
            return Ok(ExitCode::SUCCESS);
        }
        if options.markdown {
            outln!(
                "| of | door | place | who comes in may | what stops a page in a browser | what stops other machines |"
            );
            outln!("|---|---|---|---|---|---|");
        }
        for (command, port) in rows {
            let [place, here, others] = [place(port), here(port).to_owned(), others(command, port).to_owned()];
            if options.markdown {
                outln!("| `{command}` | `{}` | {place} | {} | {here} | {others} |", port.name, port.may);
            } else {
                outln!(
                    "{command:<8} {:<12} {place:<20} may {}\n{:<21} pages: {here}\n{0:<21} others: {others}",
                    port.name,
                    port.may,
                    ""
                );
            }
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn place(port: &PortSpec) -> String {
    let number = port.number;
    let place = match port.transport {
        Transport::Udp => format!("UDP {number}"),
        Transport::UdpTo => format!("sends to UDP {number}"),
        Transport::Tcp | Transport::Page => format!("TCP {number}"),
        Transport::Terminal => "a pseudo-terminal".to_owned(),
    };
    if port.when_named { format!("{place}, when it is asked for") } else { place }
}

/// What stops a page of another site in a browser of this machine.
const fn here(port: &PortSpec) -> &'static str {
    match (port.transport, port.speech) {
        (Transport::Page, _) => "its own page alone: `Host`, `Origin`, `Sec-Fetch-Site`",
        (Transport::Terminal, _) => "a file of the account",
        (Transport::Udp | Transport::UdpTo, _) => "browsers send no such datagrams",
        (_, Speech::Mavlink) => "the first bytes have to be a frame of MAVLink",
        (_, Speech::Msp) => "the first bytes have to be a frame of MSP",
        (_, Speech::Text) => "the first line must not be HTTP, nor begin with other bytes than keys",
        (_, Speech::Cable) => "the first bytes have to be a frame of MAVLink, or a line that is not HTTP",
        (_, Speech::Http | Speech::Datagrams) => "nothing",
    }
}

/// What stops programs on other machines.
fn others(command: &str, port: &PortSpec) -> &'static str {
    match port.guard {
        Guard::SendsOnly => "nothing comes in; what goes out is readable",
        _ if port.transport == Transport::Terminal => "the port is on this machine alone, of this account",
        _ if command == "connect" => "the port is on this machine alone",
        Guard::Loopback => "the port is on this machine alone; closed with `--sign-all`",
        Guard::Key if *port == PortSpec::SEALED => "every frame is sealed with the key; without one the port is closed",
        Guard::Key => "signatures with the key's pass-phrase; without `--key` the port is on this machine alone",
        Guard::Secret => "a secret in the page's address; without `--key` the port is on this machine alone",
    }
}
