//! The complete lift: its devices on one bus, and its shaft.

use std::cell::RefCell;
use std::rc::Rc;

use canbus::Stamped;
use canopen::sdo::Multiplexer;
use canopen::{Action, Duration, Frame, Instant, Transmit};
use host_tests::network::{Network, Unit};
use host_tests::sdo::Client;

use crate::car::{Barrier, Display, Door, Drive, WIDTH};
use crate::controller::Controller;
use crate::device::VirtualDevice;
use crate::installer::Site;
use crate::log::last;
use crate::node::{LiftNode, lift_node};
use crate::table::{self, BARRIERS, CONTROLLER, DISPLAY, DOORS, DRIVE, LOAD, POSITION};
use crate::world::World;

/// A device of the lift.
pub(crate) enum Any {
    Node(Box<LiftNode>),
    Virtual(Box<VirtualDevice>),
}

/// Calls the same method of any kind of device.
macro_rules! either {
    ($self:ident, $unit:ident => $call:expr) => {
        match $self {
            Any::Node($unit) => $call,
            Any::Virtual($unit) => $call,
        }
    };
}

impl Unit for Any {
    fn start(&mut self, now: Instant, out: &mut impl Transmit) {
        either!(self, unit => unit.start(now, out));
    }

    fn on_process_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        either!(self, unit => unit.on_process_frame(frame, now, out));
    }

    fn on_service_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        either!(self, unit => unit.on_service_frame(frame, now, out));
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        either!(self, unit => unit.poll(now, out))
    }

    fn take_action(&mut self) -> Option<Action> {
        either!(self, unit => unit.take_action())
    }

    fn store(&mut self, now: Instant, out: &mut impl Transmit) {
        either!(self, unit => unit.store(now, out));
    }

    fn process_ids(&self) -> Vec<u16> {
        either!(self, unit => unit.process_ids())
    }

    fn service_ids(&self) -> Vec<u16> {
        either!(self, unit => unit.service_ids())
    }
}

/// The lift: its bus, its world, and all frames.
pub(crate) struct SmallLift {
    pub(crate) network: Network<Any>,
    pub(crate) world: Rc<RefCell<World>>,
    pub(crate) log: Vec<Stamped>,
}

/// Numbers of the devices in the network.
const LOAD_NODE: usize = 1;
const DISPLAY_DEVICE: usize = 8;

impl SmallLift {
    /// A lift with the car at the lowest landing and open doors; all devices are Pre-operational.
    pub(crate) fn new() -> SmallLift {
        let world = World { car: 3_000.0, doors: [WIDTH; 2], ..World::default() };
        let world = Rc::new(RefCell::new(world));
        let node = |id| Any::Node(Box::new(lift_node(id, &world)));
        let virtual_devices = virtual_devices(&world).map(|device| Any::Virtual(Box::new(device)));
        let mut network = Network::new([node(POSITION), node(LOAD)].into_iter().chain(virtual_devices));
        network.start();
        SmallLift { network, world, log: vec![] }
    }

    /// Runs for `millis` milliseconds and keeps the frames on the bus.
    pub(crate) fn run(&mut self, millis: u64) {
        self.network.run(Duration::from_millis(millis));
        self.log.extend(std::iter::from_fn(|| self.network.hear()));
    }

    /// Runs until the condition `is_so` holds.
    pub(crate) fn run_until(&mut self, limit: u64, mut is_so: impl FnMut(&mut SmallLift) -> bool) {
        for _ in 0..limit / 10 {
            if is_so(self) {
                return;
            }
            self.run(10);
        }
        panic!("it did not happen in {limit} ms: {:?}", self.world.borrow().car);
    }

    pub(crate) fn read(&mut self, node: u8, index: u16, sub: u8) -> u64 {
        let bytes = Client::new(&mut self.network.server(node)).read(Multiplexer { index, sub }).unwrap();
        bytes.iter().rev().fold(0, |value, byte| value << 8 | u64::from(*byte))
    }

    pub(crate) fn press_button(&mut self) {
        self.world.borrow_mut().is_pressed = true;
        self.run(50);
        self.world.borrow_mut().is_pressed = false;
        self.run(50);
    }

    pub(crate) fn load(&mut self, kilograms: f64) {
        self.world.borrow_mut().load = kilograms;
        self.run(250);
    }

    /// The last value of an object in a PDO with this identifier.
    pub(crate) fn last(&self, id: u32, object: usize) -> u64 {
        last(&self.log, id, object)
    }

    pub(crate) fn position(&self) -> u64 {
        self.last(0x18C, 0)
    }

    pub(crate) fn is_lit(&self) -> bool {
        matches!(&self.network.stations[LOAD_NODE].unit, Any::Node(node) if node.protocol.outputs().digital[0])
    }

    /// A value in the display.
    pub(crate) fn shown(&mut self, index: u16, sub: u8) -> u64 {
        match &mut self.network.stations[DISPLAY_DEVICE].unit {
            Any::Virtual(display) => display.value(index, sub),
            Any::Node(_) => panic!("the display is another device"),
        }
    }

    pub(crate) fn doors_are(&self, width: f64) -> bool {
        self.world.borrow().doors == [width; 2]
    }
}

impl Site for SmallLift {
    fn write(&mut self, node: u8, index: u16, sub: u8, bytes: &[u8]) {
        let result = Client::new(&mut self.network.server(node)).write(Multiplexer { index, sub }, bytes);
        assert_eq!(result, Ok(()), "{node}: {index:X}h:{sub}");
    }

    fn nmt(&mut self, command: u8, node: u8) {
        self.network.transmit(&Frame::new(0, &[command, node]).unwrap());
        self.run(5);
    }
}

/// The virtual devices of the test.
pub(crate) fn virtual_devices(world: &Rc<RefCell<World>>) -> [VirtualDevice; 7] {
    let [door_1, door_2] = DOORS;
    let [barrier_1, barrier_2] = BARRIERS;
    [
        VirtualDevice::new(CONTROLLER, &table::CALL_CONTROLLER, Controller::default(), world),
        VirtualDevice::new(DRIVE, &table::CAR_DRIVE, Drive::default(), world),
        VirtualDevice::new(door_1, &table::DOOR_1, Door(1), world),
        VirtualDevice::new(door_2, &table::DOOR_2, Door(2), world),
        VirtualDevice::new(barrier_1, &table::BARRIER_1, Barrier(1), world),
        VirtualDevice::new(barrier_2, &table::BARRIER_2, Barrier(2), world),
        VirtualDevice::new(DISPLAY, &table::DISPLAY_UNIT, Display::default(), world),
    ]
}
