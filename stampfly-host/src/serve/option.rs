//! Where a port of a vehicle is to be: `NAME=ADDRESS:NUMBER`, `NAME=NUMBER` or `NAME=off`;
//! `others=off` closes those that are not named.

use stampfly_sim::vehicle::{PortSpec, Transport};
use std::fmt;
use std::net::{Ipv4Addr, SocketAddr};
use std::str::FromStr;

/// Between the ports of one vehicle and those of the next in the same world: as PX4's and
/// ArduPilot's simulators do it for MAVLink.
const NEXT_VEHICLE: u16 = 10;
/// All ports that are not named.
const OTHERS: &str = "others";

/// Where one port is to be.
///
/// ```
/// use stampfly_host::serve::PortOption;
/// let option: PortOption = "tello=0.0.0.0:8889".parse().unwrap();
/// assert_eq!((option.name.as_str(), option.address.unwrap().port()), ("tello", 8889));
/// assert_eq!("console=off".parse::<PortOption>().unwrap().address, None);
/// assert_eq!("console=0".parse::<PortOption>().unwrap().address.unwrap().to_string(), "127.0.0.1:0");
/// assert!("console".parse::<PortOption>().is_err() && "others=0".parse::<PortOption>().is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PortOption {
    /// Which port; `others` are all that are not named.
    pub name: String,
    /// Where; `None` for nowhere.
    pub address: Option<SocketAddr>,
}

/// The text is no port option.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PortOptionError(String);

impl fmt::Display for PortOptionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "'{}' is none of NAME=ADDRESS:NUMBER, NAME=NUMBER, NAME=off, others=off", self.0)
    }
}

impl std::error::Error for PortOptionError {}

impl FromStr for PortOption {
    type Err = PortOptionError;

    fn from_str(text: &str) -> Result<Self, PortOptionError> {
        let wrong = || PortOptionError(text.to_owned());
        let (name, place) = text.split_once('=').ok_or_else(wrong)?;
        let address = match (place, place.parse::<u16>()) {
            ("off", _) => None,
            (_, Ok(number)) => Some(SocketAddr::from((Ipv4Addr::LOCALHOST, number))),
            (address, Err(_)) => Some(address.parse().map_err(|_| wrong())?),
        };
        // They have no number in common.
        if name == OTHERS && address.is_some() {
            return Err(wrong());
        }
        Ok(Self { name: name.to_owned(), address })
    }
}

impl PortOption {
    /// Refuses options for ports that are not among these, which `whose` has.
    ///
    /// # Errors
    /// What there is instead, in words.
    pub fn check(options: &[Self], ports: &[PortSpec], whose: &str) -> Result<(), String> {
        let is_known = |option: &&Self| option.name == OTHERS || ports.iter().any(|port| port.name == option.name);
        let Some(unknown) = options.iter().find(|option| !is_known(option)) else { return Ok(()) };
        let names: Vec<_> = ports.iter().map(|port| port.name).collect();
        Err(format!("{whose} has no port '{}'; it has {}", unknown.name, names.join(", ")))
    }

    /// Where this port of the `number`-th vehicle is, from zero: as the options say, else on this
    /// machine at its own number. `None` for nowhere.
    #[must_use]
    pub fn place(options: &[Self], port: &PortSpec, number: usize) -> Option<SocketAddr> {
        let named = |name: &str| options.iter().rev().find(|option| option.name == name);
        let option = named(port.name).or_else(|| named(OTHERS));
        let own = SocketAddr::from((Ipv4Addr::LOCALHOST, port.number));
        let mut address = option.map_or(Some(own), |option| option.address)?;
        let moves = matches!(port.transport, Transport::Udp | Transport::Tcp) && address.port() != 0;
        if moves {
            let step = u16::try_from(number).unwrap_or(u16::MAX).saturating_mul(NEXT_VEHICLE);
            address.set_port(address.port().saturating_add(step));
        }
        Some(address)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_vehicle_is_ten_ports_further_and_sends_to_the_same_place() {
        let spoken = PortSpec::udp("tello", 8889, "");
        let sent = PortSpec { transport: Transport::UdpTo, ..PortSpec::udp("telemetry", 5005, "") };
        let place = |port, number| PortOption::place(&[], port, number).map(|address| address.port());
        assert_eq!([place(&spoken, 0), place(&spoken, 1), place(&sent, 1)], [Some(8889), Some(8899), Some(5005)]);
    }

    #[test]
    fn the_last_option_for_a_port_counts_and_a_free_port_stays_free() {
        let options = ["tello=7000", "tello=0", "other=off"].map(|text| text.parse().unwrap());
        let port = PortSpec::udp("tello", 8889, "");
        assert_eq!(PortOption::place(&options, &port, 3).map(|address| address.port()), Some(0));
        let port = PortSpec::udp("other", 1, "");
        assert_eq!(PortOption::place(&options, &port, 0), None);
    }

    #[test]
    fn others_are_those_that_are_not_named_before_or_behind() {
        let options = ["tello=7000", "others=off"].map(|text| text.parse().unwrap());
        let place = |name| PortOption::place(&options, &PortSpec::udp(name, 8889, ""), 0).map(|address| address.port());
        assert_eq!([place("tello"), place("console")], [Some(7000), None]);
        let ports = [PortSpec::udp("tello", 8889, "")];
        assert_eq!(PortOption::check(&options, &ports, "it"), Ok(()));
        let unknown = ["msp=1".parse().unwrap()];
        assert_eq!(PortOption::check(&unknown, &ports, "it"), Err("it has no port 'msp'; it has tello".to_owned()));
    }
}
