//! The program `nodectl` on the bus of the emulated boards, in virtual time.

use nodectl::Network;
use nodectl::bus::Bus;
use nodectl::cli::{Cli, Failure, Output, Paper, Session};
use sim::world::World;
use workbench::bringup::Adapter;
pub(crate) use workbench::bringup::Shared;

/// Runs a command with its own adapter; returns its output and its result. `each` is called between two polls of the
/// adapter.
pub(crate) fn run(
    world: &Shared,
    cli: &Cli,
    each: impl FnMut(&mut World) + 'static,
) -> (String, Result<(), Failure>) {
    let mut adapter = Some(Adapter::join(world, each));
    let open = move || Ok(Box::new(adapter.take().expect("the bus is opened once")) as Box<dyn Bus>);
    let paper = Paper::default();
    let output = Output::new(paper.clone(), cli.options.json);
    let result = cli.run_in(&mut Session::with(Network::open(open).unwrap(), &cli.options, output));
    (paper.take(), result)
}
