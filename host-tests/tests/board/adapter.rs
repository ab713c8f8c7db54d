//! The program `nodectl` on the bus of the emulated boards, in virtual time.

use std::cell::RefCell;
use std::rc::Rc;

use canbus::Time;
use canopen::{Frame, Instant};
use host_tests::network::{from_bus, to_bus};
use nodectl::Network;
use nodectl::bus::{Bus, BusError, Received};
use nodectl::cli::{Cli, Failure, Output, Paper, Session};
use sim::world::World;

use crate::support::Master;

/// Period at which the adapter polls for a frame.
const STEP: Time = Time::from_micros(100);

/// The world that the adapter and the test share.
pub(crate) type Shared = Rc<RefCell<World>>;

/// Runs a command with its own adapter; returns its output and its result. `each` is called between two polls of the
/// adapter.
pub(crate) fn run(
    world: &Shared,
    cli: &Cli,
    each: impl FnMut(&mut World) + 'static,
) -> (String, Result<(), Failure>) {
    let bit_rate = world.borrow().bit_rate();
    let master = Master::join_at(&mut world.borrow_mut(), bit_rate);
    let port = master.port;
    let mut adapter = Some(Adapter { world: Rc::clone(world), master, each: Box::new(each) });
    let open = move || Ok(Box::new(adapter.take().expect("the bus is opened once")) as Box<dyn Bus>);
    let paper = Paper::default();
    let output = Output::new(paper.clone(), cli.options.json);
    let result = cli.run_in(&mut Session::with(Network::open(open).unwrap(), &cli.options, output));
    world.borrow_mut().close_port(port);
    (paper.take(), result)
}

/// The adapter of `nodectl`.
struct Adapter {
    world: Shared,
    master: Master,
    each: Box<dyn FnMut(&mut World)>,
}

impl Adapter {
    fn next(&self) -> Option<Received> {
        let mut world = self.world.borrow_mut();
        let stamped = world.port(self.master.port).receive()?;
        Some(Received { frame: from_bus(&stamped.frame)?, at: instant(stamped.at) })
    }
}

impl Bus for Adapter {
    fn now(&self) -> Instant {
        instant(self.world.borrow().now())
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        let mut world = self.world.borrow_mut();
        let now = world.now();
        world.port(self.master.port).send(to_bus(frame), now);
        Ok(())
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Received>, BusError> {
        loop {
            let received = self.next();
            if received.is_some() || self.now() >= until {
                return Ok(received);
            }
            let mut world = self.world.borrow_mut();
            let next = world.now() + STEP;
            world.run_until(next);
            (self.each)(&mut world);
        }
    }
}

fn instant(time: Time) -> Instant {
    Instant(time.as_micros())
}
