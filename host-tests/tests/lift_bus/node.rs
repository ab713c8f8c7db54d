//! The node in personality lift: the CANopen device with the lift's table, and the lift's measurement.

use std::cell::RefCell;
use std::rc::Rc;

use canopen::dictionary::{Entry, Group};
use canopen::sdo::Abort;
use canopen::{Application, CanId, Device, Frame, Instant, NodeId, Stored, Transmit};
use host_tests::network::Unit;
use node::Request;
use node::lift::Fields;
use profiles::lift::Lift;
use profiles::lift::panel::Lamp;

use crate::device::{TICK, request};
use crate::table::{NODE, NODE_SIZE, POSITION};
use crate::world::World;

static FIELDS: Fields = Fields::new(&NODE);

/// More than a group takes when packed.
const PACKED: usize = 2048;

/// The rules of the lift, and what 1010h has stored.
#[derive(Debug, Default)]
struct Rules {
    stored: [Vec<u8>; 2],
}

impl Application for Rules {
    fn initialise(&mut self, image: &mut [u8]) {
        let device_type = FIELDS.device_type(image);
        NODE.field(0x1000, 0).store(image, device_type.to_le_bytes());
    }

    fn write(&mut self, number: u8, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        FIELDS.write(number, entry, bytes, image)
    }

    fn stored(&self, group: Group) -> Stored<'_> {
        let [communication, application] = &self.stored;
        let packed: &[u8] = match group {
            Group::Communication => communication,
            Group::Application => application,
            Group::Calibration | Group::Volatile => &[],
        };
        Stored { packed, is_sound: true }
    }
}

/// The node.
pub(crate) struct LiftNode {
    device: Device<Rules, NODE_SIZE>,
    node_id: u8,
    lift: Lift,
    lamp: Lamp,
    world: Rc<RefCell<World>>,
    next_sample: Instant,
}

impl LiftNode {
    pub(crate) fn new(node_id: u8, world: &Rc<RefCell<World>>) -> LiftNode {
        LiftNode {
            device: Device::new(&NODE, NodeId::new(node_id), Rules::default()),
            node_id,
            lift: Lift::default(),
            lamp: Lamp::default(),
            world: Rc::clone(world),
            next_sample: Instant::NEVER,
        }
    }

    pub(crate) fn is_lit(&self) -> bool {
        FIELDS.is_lit(self.device.image())
    }

    fn sample(&mut self, now: Instant, out: &mut impl Transmit) {
        self.next_sample = self.next_sample + TICK;
        if self.device.take_parameters_changed() {
            self.lift.apply(&FIELDS.parameters(self.device.image()));
        }
        let mut world = self.world.borrow_mut();
        if self.node_id == POSITION {
            let car = world.car;
            world.measured.push((now, car));
        }
        FIELDS.publish(&self.lift.sample(&world.read()), self.device.image_mut());
        self.device.changed(now, out);
    }

    fn pack(&self, group: Group) -> Vec<u8> {
        let mut packed = heapless::Vec::<u8, PACKED>::new();
        NODE.pack(group, self.device.node_id(), self.device.image(), &mut packed).expect("room");
        packed.to_vec()
    }
}

impl Unit for LiftNode {
    fn start(&mut self, now: Instant, out: &mut impl Transmit) {
        self.device.start(now, out);
        self.next_sample = now;
    }

    fn on_process_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        self.device.on_process_frame(frame, now, out);
        FIELDS.follow_output(&mut self.lamp, self.device.image_mut());
    }

    fn on_service_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        self.device.on_service_frame(frame, now, out);
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        if now >= self.next_sample {
            self.sample(now, out);
        }
        let process = self.device.poll_process(now, out);
        process.min(self.device.poll_services(now, out)).min(self.next_sample)
    }

    fn take_request(&mut self) -> Option<Request> {
        self.device.take_action().map(request)
    }

    fn store(&mut self, now: Instant, out: &mut impl Transmit) {
        let stored = [self.pack(Group::Communication), self.pack(Group::Application)];
        self.device.application_mut().stored = stored;
        self.device.finish(Ok(()), now, out);
    }

    fn process_ids(&self) -> Vec<u16> {
        self.device.process_ids().map(CanId::get).collect()
    }

    fn service_ids(&self) -> Vec<u16> {
        self.device.service_ids().map(CanId::get).collect()
    }
}
