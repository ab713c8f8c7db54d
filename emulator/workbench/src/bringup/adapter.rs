//! A CAN adapter on the bus of the emulated boards, in virtual time.

use std::cell::RefCell;
use std::rc::Rc;

use canbus::{Frame as Wire, Id, StandardId, Time};
use canopen::{Frame, Instant};
use nodectl::bus::{Bus, BusError, Received};
use sim::port;
use sim::world::{PortId, World};

/// Period at which the adapter polls for a frame.
const STEP: Time = Time::from_micros(100);

/// The world that several adapters and their user share.
pub type Shared = Rc<RefCell<World>>;

/// The adapter. It leaves the bus when it is dropped.
pub struct Adapter {
    world: Shared,
    port: PortId,
    each: Box<dyn FnMut(&mut World)>,
}

impl Adapter {
    /// Joins the bus at its bit rate. `each` is called between two polls.
    pub fn join(world: &Shared, each: impl FnMut(&mut World) + 'static) -> Adapter {
        let mut inner = world.borrow_mut();
        let bit_rate = inner.bit_rate();
        let port = inner.open_port();
        inner.port(port).attach(Some(port::Adapter { bit_rate, silent: false }));
        Adapter { world: Rc::clone(world), port, each: Box::new(each) }
    }

    fn next(&self) -> Option<Received> {
        let mut world = self.world.borrow_mut();
        let stamped = world.port(self.port).receive()?;
        Some(Received { frame: from_wire(&stamped.frame)?, at: instant(stamped.at) })
    }
}

impl Drop for Adapter {
    fn drop(&mut self) {
        // A world that is in use has no more need of the port.
        if let Ok(mut world) = self.world.try_borrow_mut() {
            world.close_port(self.port);
        }
    }
}

impl Bus for Adapter {
    fn now(&self) -> Instant {
        instant(self.world.borrow().now())
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        let mut world = self.world.borrow_mut();
        let now = world.now();
        if let Some(wire) = to_wire(frame) {
            world.port(self.port).send(wire, now);
        }
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

fn to_wire(frame: &Frame) -> Option<Wire> {
    let id = StandardId::new(frame.id())?;
    if frame.is_remote() {
        Wire::remote(id, u8::try_from(frame.len()).ok()?)
    } else {
        Wire::data(id, frame.data())
    }
}

fn from_wire(frame: &Wire) -> Option<Frame> {
    let Id::Standard(id) = frame.id() else { return None };
    if frame.is_remote() {
        Frame::remote(id.as_raw(), frame.dlc())
    } else {
        Frame::new(id.as_raw(), frame.bytes())
    }
}
