//! `nodectl serve`: the bus in a browser. The messages are those of `tools/nodectl/PROTOCOL.md`.
//!
//! One thread, the [`pump`], owns the bus and the state of all nodes; pages and jobs send it orders. Work that takes
//! several frames (a transfer, a search, an update) is a [`jobs`] job on a thread of its own, with a [`port`] to the
//! bus. So a slow node delays only the page that has asked the node.

mod bus_time;
mod jobs;
mod live;
mod nodes;
mod order;
mod pages;
mod port;
mod pump;
mod request;
mod schedule;
mod status;
mod stimuli;
mod tracer;
mod turn;

use std::io::{self, Read as _};
use std::net::SocketAddr;
use std::sync::mpsc;
use std::thread;

use clap::Args;
use serde::Serialize;

use self::order::Order;
use self::pump::{Pump, Setup};
use super::{Failure, Options, Output};
use crate::bus::Address;

/// Shows the bus in a browser: the nodes, live values, dictionary, trace, commissioning, update.
///
/// The page is for this machine only, unless --page gives an address that other machines reach. Other machines need the
/// token in the printed address. Nothing is sent while no page is open. While one is open, unknown nodes without another
/// client are asked for their identity, unless --silent is given.
#[derive(Debug, Args)]
pub(super) struct Serve {
    /// The bus; that of --bus if it is left out.
    #[arg(value_name = "BUS")]
    address: Option<Address>,

    /// The address of the page. If the port is in use, the next free one is taken; port 0 takes any.
    #[arg(long, value_name = "ADDR:PORT", default_value = "127.0.0.1:8301")]
    page: SocketAddr,

    /// The control connection of a simulator, for the stimuli (`cargo sim --control`).
    #[arg(long, value_name = "ADDR:PORT")]
    stimuli: Option<SocketAddr>,

    /// Send nothing unless a page asks for something.
    #[arg(long)]
    silent: bool,

    /// End with the standard input: for a program that has started this one.
    #[arg(long, hide = true)]
    until_end_of_input: bool,
}

#[derive(Serialize)]
struct Served {
    page: String,
}

impl std::fmt::Display for Served {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "the page is at {}", self.page)
    }
}

impl Serve {
    pub(super) fn run(&self, options: &Options, mut output: Output) -> Result<(), Failure> {
        let address = self.address.clone().unwrap_or_else(|| options.bus.clone());
        let options = Options { bus: address, ..options.clone() };
        // Open the bus first, so that a missing bus is reported before a page opens. A simulator opens its bus only
        // when it knows the address of the page, so the pump opens the bus then.
        let bus = match self.until_end_of_input {
            true => None,
            false => Some(options.bus.open(options.bit_rate())?),
        };
        let (orders, inbox) = mpsc::channel();
        let from_pages = orders.clone();
        let listener = move |said| drop(from_pages.send(Order::Page(said)));
        let server =
            crate::page::start(&crate::page::Options { address: self.page }, listener).map_err(|error| {
                Failure::Usage(format!("the page cannot be served at {}: {error}", self.page))
            })?;
        output.print(&Served { page: server.url.clone() })?;
        if self.until_end_of_input {
            thread::spawn(end_with_input);
        }
        if let Some(control) = self.stimuli {
            stimuli::watch(control, orders.clone());
        }
        let setup = Setup { options, silent: self.silent, control: self.stimuli, hub: server.hub };
        Pump::new(setup, bus, orders, inbox).run();
        Ok(())
    }
}

/// Ends the process when the standard input is closed.
fn end_with_input() {
    let mut input = io::stdin().lock();
    let mut buffer = [0; 256];
    while input.read(&mut buffer).is_ok_and(|count| count > 0) {}
    std::process::exit(0);
}
