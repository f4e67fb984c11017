//! Connections that spoke another language than their port, as `serve` and `connect` report them.

use crate::ground::{Event, Hub};
use crate::serve::OpenPorts;
use std::sync::Arc;

/// From now on the terminal and the pages of this vehicle are told of the first, second, fourth,
/// eighth… connection that these ports end: a program that tries for hours fills no terminal.
pub(super) fn watch(ports: &OpenPorts, hub: &Arc<Hub>, vehicle: usize) {
    let pages = hub.clone();
    ports.tell(move |ended| {
        if ended.count.is_power_of_two() {
            eprintln!("stampfly: {ended}");
            pages.tell_all(vehicle, &Event::Text { text: ended.to_string() });
        }
    });
}

/// Prints how many connections these ports ended, when they ended any.
pub(super) fn print_sum<'p>(ports: impl IntoIterator<Item = &'p Arc<OpenPorts>>) {
    let count: u64 = ports.into_iter().map(|ports| ports.ended()).sum();
    if count > 0 {
        eprintln!("{count} connections ended that did not speak their port's language");
    }
}
