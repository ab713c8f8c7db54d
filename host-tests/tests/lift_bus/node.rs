//! A node in personality lift: both halves, its parameter store, and what its sensors read of the world.

use std::cell::RefCell;
use std::rc::Rc;

use canopen::{Frame, Instant, NodeId, Transmit};
use host_tests::bench::{Flash, deliver, empty_store, setup};
use host_tests::network::Unit;
use node::{Measurement, Personality, Protocol, Request, Setup, Start};

use crate::device::TICK;
use crate::table::POSITION;
use crate::world::World;

/// The node.
pub(crate) struct LiftNode {
    protocol: Protocol,
    measurement: Measurement,
    store: Flash,
    node_id: u8,
    world: Rc<RefCell<World>>,
    next_sample: Instant,
}

impl LiftNode {
    pub(crate) fn new(node_id: u8, world: &Rc<RefCell<World>>) -> LiftNode {
        let setup = Setup { personality: Personality::Lift, node_id: NodeId::new(node_id), ..setup() };
        LiftNode {
            protocol: Protocol::new(&setup),
            measurement: Measurement::new(setup.personality, Start::First),
            store: empty_store(),
            node_id,
            world: Rc::clone(world),
            next_sample: Instant::NEVER,
        }
    }

    pub(crate) fn is_lit(&self) -> bool {
        let [first, _] = self.protocol.lamps();
        first
    }

    fn sample(&mut self, now: Instant, out: &mut impl Transmit) {
        self.next_sample = self.next_sample + TICK;
        if let Some(parameters) = self.protocol.take_parameters() {
            self.measurement.apply(&parameters);
        }
        let mut world = self.world.borrow_mut();
        if self.node_id == POSITION {
            let car = world.car;
            world.measured.push((now, car));
        }
        let snapshot = self.measurement.sample(&world.pressure(), &world.tape(), [world.is_pressed, false]);
        self.protocol.publish(&snapshot, now, out);
    }
}

impl Unit for LiftNode {
    fn start(&mut self, now: Instant, out: &mut impl Transmit) {
        self.protocol.start(now, out);
        self.next_sample = now;
    }

    fn on_process_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        self.protocol.on_process_frame(frame, now, out);
    }

    fn on_service_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        self.protocol.on_service_frame(frame, now, out);
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        if now >= self.next_sample {
            self.sample(now, out);
        }
        let process = self.protocol.poll_process(now, out);
        process.min(self.protocol.poll_services(now, out)).min(self.next_sample)
    }

    fn take_request(&mut self) -> Option<Request> {
        self.protocol.take_request()
    }

    fn store(&mut self, now: Instant, out: &mut impl Transmit) {
        deliver(&mut self.protocol, &mut self.store, now, out);
    }

    fn process_ids(&self) -> Vec<u16> {
        self.protocol.process_ids().collect()
    }

    fn service_ids(&self) -> Vec<u16> {
        self.protocol.service_ids().collect()
    }
}
