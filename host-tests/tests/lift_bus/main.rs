//! A small lift on one bus: two nodes in personality lift as car position unit and load measuring unit with a panel, and
//! call controller, drive, doors, light barriers and a display as virtual devices of the host. All of them run the same
//! CANopen device with dictionaries from the same catalogue.

mod car;
mod controller;
mod device;
mod node;
mod table;
mod world;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use canbus::Stamped;
use canopen::pdo::Mpdo;
use canopen::sdo::Multiplexer;
use canopen::{Duration, Frame, Instant, Transmit};
use host_tests::network::{Network, Unit, from_bus};
use host_tests::sdo::Client;
use profiles::encoder::UNDERFLOW;
use profiles::lift::catalogue::{Content, by_cob_id};
use profiles::lift::load::{FULL_LOAD, HALF_LOAD, OVERLOAD, ZERO_LOAD};

use car::{Barrier, Display, Door, Drive};
use controller::{Controller, FAST, LAMP_OFF, LAMP_ON, LANDINGS, call};
use device::VirtualDevice;
use node::LiftNode;
use table::{BARRIERS, CONTROLLER, DISPLAY, DOORS, DRIVE, LOAD, POSITION};
use world::World;

/// A device of the lift.
enum Any {
    Node(Box<LiftNode>),
    Virtual(Box<VirtualDevice>),
}

/// The same call for whichever it is.
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

    fn take_request(&mut self) -> Option<::node::Request> {
        either!(self, unit => unit.take_request())
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

/// The lift: its bus, its shaft, and all frames.
struct SmallLift {
    network: Network<Any>,
    world: Rc<RefCell<World>>,
    log: Vec<Stamped>,
}

/// Places of the devices in the network.
const LOAD_NODE: usize = 1;
const DISPLAY_DEVICE: usize = 8;

impl SmallLift {
    /// A car at the lowest landing with open doors, all devices in Pre-operational.
    fn new() -> SmallLift {
        let world = World { car: 3_000.0, doors: [car::WIDTH; 2], ..World::default() };
        let world = Rc::new(RefCell::new(world));
        let node = |id| Any::Node(Box::new(LiftNode::new(id, &world)));
        let [door_1, door_2] = DOORS;
        let [barrier_1, barrier_2] = BARRIERS;
        let virtual_devices = [
            VirtualDevice::new(CONTROLLER, &table::CALL_CONTROLLER, Controller::default(), &world),
            VirtualDevice::new(DRIVE, &table::CAR_DRIVE, Drive::default(), &world),
            VirtualDevice::new(door_1, &table::DOOR_1, Door(1), &world),
            VirtualDevice::new(door_2, &table::DOOR_2, Door(2), &world),
            VirtualDevice::new(barrier_1, &table::BARRIER_1, Barrier(1), &world),
            VirtualDevice::new(barrier_2, &table::BARRIER_2, Barrier(2), &world),
            VirtualDevice::new(DISPLAY, &table::DISPLAY_UNIT, Display::default(), &world),
        ];
        let virtual_devices = virtual_devices.map(|device| Any::Virtual(Box::new(device)));
        let mut network = Network::new([node(POSITION), node(LOAD)].into_iter().chain(virtual_devices));
        network.start();
        SmallLift { network, world, log: vec![] }
    }

    /// Lets time pass and keeps what is on the bus.
    fn run(&mut self, millis: u64) {
        self.network.run(Duration::from_millis(millis));
        self.log.extend(std::iter::from_fn(|| self.network.hear()));
    }

    /// Lets time pass until something is the case.
    fn run_until(&mut self, limit: u64, mut is_so: impl FnMut(&mut SmallLift) -> bool) {
        for _ in 0..limit / 10 {
            if is_so(self) {
                return;
            }
            self.run(10);
        }
        panic!("it did not happen in {limit} ms: {:?}", self.world.borrow().car);
    }

    fn write(&mut self, node: u8, index: u16, sub: u8, bytes: &[u8]) {
        let result = Client::new(&mut self.network.server(node)).write(Multiplexer { index, sub }, bytes);
        assert_eq!(result, Ok(()), "{node}: {index:X}h:{sub}");
    }

    fn read(&mut self, node: u8, index: u16, sub: u8) -> u64 {
        let bytes = Client::new(&mut self.network.server(node)).read(Multiplexer { index, sub }).unwrap();
        bytes.iter().rev().fold(0, |value, byte| value << 8 | u64::from(*byte))
    }

    fn nmt(&mut self, command: u8, node: u8) {
        self.network.transmit(&Frame::new(0, &[command, node]).unwrap());
        self.run(5);
    }

    /// What the installer does: each node is one of the two units, a PDO of the other is off; then saved and reset.
    fn install(&mut self) {
        self.write(POSITION, 0x2211, 3, &0_f32.to_le_bytes());
        self.write(POSITION, 0x2100, 1, &[6]);
        self.write(POSITION, 0x2101, 1, &100_000_u32.to_le_bytes());
        self.write(POSITION, 0x2105, 0, &[0]);
        self.write(POSITION, 0x63B8, 1, &22_100_i32.to_le_bytes());
        self.write(POSITION, 0x63B4, 1, &9_900_i32.to_le_bytes());
        self.write(POSITION, 0x1901, 1, &0xC000_0188_u32.to_le_bytes());
        self.run(5);
        self.write(POSITION, 0x6382, 1, &LANDINGS[0].to_le_bytes());

        self.write(LOAD, 0x2201, 1, &[0]);
        for (sub, value) in [(1, 2.0e5_f32), (2, 0.0), (3, 6.0e5), (4, 800.0)] {
            self.write(LOAD, 0x2211, sub, &value.to_le_bytes());
        }
        for (sub, kilograms) in [(1, 30_u16), (2, 300), (3, 600), (4, 660)] {
            self.write(LOAD, 0x6483, sub, &kilograms.to_le_bytes());
        }
        self.write(LOAD, 0x2220, 2, &call(4).to_le_bytes()[..6]);
        self.write(LOAD, 0x2221, 1, &LAMP_OFF.to_le_bytes()[..6]);
        self.write(LOAD, 0x2221, 2, &LAMP_ON.to_le_bytes()[..6]);
        self.write(LOAD, 0x1906, 1, &0xC000_018C_u32.to_le_bytes());
        for node in [POSITION, LOAD] {
            self.write(node, 0x1010, 1, b"save");
            self.nmt(0x81, node);
        }
        self.run(5);
    }

    fn press_button(&mut self) {
        self.world.borrow_mut().is_pressed = true;
        self.run(50);
        self.world.borrow_mut().is_pressed = false;
        self.run(50);
    }

    fn load(&mut self, kilograms: f64) {
        self.world.borrow_mut().load = kilograms;
        self.run(250);
    }

    /// The last value of an object that a PDO with this identifier carried.
    fn last(&self, id: u32, object: usize) -> u64 {
        let field = by_cob_id(id).unwrap().fields().nth(object).unwrap();
        let frames = self.log.iter().rev().filter_map(|stamped| from_bus(&stamped.frame));
        let frame = frames.into_iter().find(|frame| u32::from(frame.id()) == id).unwrap();
        field.value(frame.data()).unwrap()
    }

    fn position(&self) -> u64 {
        self.last(0x18C, 0)
    }

    fn is_lit(&self) -> bool {
        matches!(&self.network.stations[LOAD_NODE].unit, Any::Node(node) if node.is_lit())
    }

    fn doors_are(&self, width: f64) -> bool {
        self.world.borrow().doors == [width; 2]
    }
}

#[test]
fn a_small_lift() {
    let mut lift = SmallLift::new();
    lift.install();
    assert_eq!(lift.read(POSITION, 0x1000, 0), 0x0600_01A1, "a car position unit");
    assert_eq!(lift.read(LOAD, 0x1000, 0), 0x0000_01A1, "load measuring unit, input and output panel unit");
    assert_eq!(lift.read(POSITION, 0x6383, 1), u64::from(LANDINGS[0]), "the preset outlives the reset");

    lift.nmt(1, 0);
    lift.run(300);
    assert_eq!((lift.last(0x188, 0), lift.last(0x188, 1)), (ZERO_LOAD.into(), 0));
    assert!(lift.doors_are(car::WIDTH) && !lift.is_lit());

    too_many_people(&mut lift);
    somebody_in_the_door(&mut lift);
    up_and_down(&mut lift);

    every_frame_is_known(&lift.log);
    every_position_is_that_of_the_car(&lift);
    the_display_knows_what_concerns_it(&mut lift);
    assert_eq!(lift.network.traffic().errors, 0);
}

/// With 700 kg in the car it does not leave, though it is called.
fn too_many_people(lift: &mut SmallLift) {
    lift.load(700.0);
    let signals = u64::from(HALF_LOAD | FULL_LOAD | OVERLOAD);
    assert_eq!((lift.last(0x188, 0), lift.last(0x188, 1)), (signals, 700));
    lift.press_button();
    assert!(lift.is_lit(), "the call is taken");
    lift.run(1000);
    assert!(lift.doors_are(car::WIDTH));
    assert_eq!(lift.position(), LANDINGS[0].into());
}

/// One leaves, which takes time: the doors open again.
fn somebody_in_the_door(lift: &mut SmallLift) {
    lift.load(640.0);
    assert_eq!(lift.last(0x188, 0) & u64::from(OVERLOAD), 0);
    lift.run_until(500, |lift| !lift.doors_are(car::WIDTH));
    lift.world.borrow_mut().is_blocked[1] = true;
    lift.run_until(700, |lift| lift.doors_are(car::WIDTH));
    assert_eq!(lift.position(), LANDINGS[0].into());
    lift.world.borrow_mut().is_blocked[1] = false;
    lift.run_until(1000, |lift| lift.doors_are(0.0));
}

/// Four floors up at full speed, three down.
fn up_and_down(lift: &mut SmallLift) {
    for (landing, position) in [(4, LANDINGS[4]), (1, LANDINGS[1])] {
        lift.run_until(12_000, |lift| !lift.is_lit());
        assert!(lift.position().abs_diff(position.into()) <= 1, "{} for {position}", lift.position());
        lift.run_until(1000, |lift| lift.doors_are(car::WIDTH));
        if landing == 4 {
            lift.write(LOAD, 0x2220, 2, &call(1).to_le_bytes()[..6]);
            lift.press_button();
        }
    }
    let fastest = lift.log.iter().filter_map(|stamped| velocity(&from_bus(&stamped.frame)?));
    let (slowest, fastest) = fastest.fold((0, 0), |(low, high), v| (v.min(low), v.max(high)));
    assert_eq!((slowest, fastest), (-FAST, FAST));
}

/// The actual velocity in a frame that carries it.
fn velocity(frame: &Frame) -> Option<i32> {
    let field = by_cob_id(frame.id().into()).filter(|_| frame.id() == 0x183)?.fields().nth(3)?;
    let word = u32::try_from(field.value(frame.data())?).ok()?;
    Some(word.cast_signed())
}

/// Every frame is one of the catalogue, of its length, or one of CiA 301's services to or from a device that is there.
fn every_frame_is_known(log: &[Stamped]) {
    let mut counts = BTreeMap::<u16, usize>::new();
    for frame in log.iter().filter_map(|stamped| from_bus(&stamped.frame)) {
        *counts.entry(frame.id()).or_default() += 1;
        let Some(definition) = by_cob_id(frame.id().into()) else {
            assert!(is_service(frame.id()), "{:X}h", frame.id());
            continue;
        };
        match definition.pdo.content {
            Content::Objects(_) => {
                let bits: usize = definition.fields().map(|field| usize::from(field.object.bits)).sum();
                assert_eq!(frame.data().len() * 8, bits, "{}", definition.pdo.name);
            }
            Content::Multiplexed => {
                let mpdo = Mpdo::parse(frame.data().try_into().unwrap()).unwrap();
                let known: &[u16] = if definition.producer == Some(DISPLAY) {
                    &[0x5000]
                } else {
                    &[0x2203, 0x2213, 0x63C0, 0x63C5]
                };
                assert!(known.contains(&mpdo.at.index), "{mpdo:?}");
            }
        }
    }
    let pdos: Vec<u16> = counts.keys().copied().filter(|id| by_cob_id((*id).into()).is_some()).collect();
    let expected = [
        0x182, 0x183, 0x188, 0x18C, 0x200, 0x201, 0x202, 0x205, 0x206, 0x400, 0x490, 0x491, 0x507, 0x510,
        0x511,
    ];
    assert_eq!(pdos, expected, "each device sends its own and nobody sends another's");
}

/// Boot-up and heartbeats, and SDO responses that nobody waited for any longer: none of an error.
fn is_service(id: u16) -> bool {
    let devices = [CONTROLLER, DRIVE, DISPLAY, POSITION, LOAD].into_iter().chain(DOORS).chain(BARRIERS);
    devices.map(u16::from).any(|device| [0x580 + device, 0x700 + device].contains(&id))
}

/// A position on the bus is that of the car when it was measured, to one step, and is at most a millisecond old.
fn every_position_is_that_of_the_car(lift: &SmallLift) {
    let world = lift.world.borrow();
    let (mut frames, mut worst) = (0, 0.0_f64);
    for stamped in &lift.log {
        let Some(frame) = from_bus(&stamped.frame).filter(|frame| frame.id() == 0x18C) else { continue };
        let position = f64::from(u32::from_le_bytes(frame.data().try_into().unwrap()));
        let at = stamped.at.as_micros();
        let count = world.measured.partition_point(|(time, _)| time.0 < at);
        let (measured, car) = world.measured[count - 1];
        // The car was at 3 m from the end of the tape when the preset made that 10 m.
        let error = position - (car + 7_000.0);
        assert!(error.abs() <= 1.0, "{position} at {at} us, when the car was at {car}");
        assert!(at - measured.0 <= 1000);
        (frames, worst) = (frames + 1, worst.max(error.abs()));
    }
    println!("{frames} positions, none more than {worst:.2} mm from the car");
    assert!(frames > 8_000, "one a millisecond while it drives: {frames}");
}

/// It has the state of the position unit from that unit's multiplexed PDO, and ignores the rest of them.
fn the_display_knows_what_concerns_it(lift: &mut SmallLift) {
    let Any::Virtual(display) = &mut lift.network.stations[DISPLAY_DEVICE].unit else { panic!() };
    assert_eq!(display.value(0x2203, 1), 0, "within its limits");
    lift.world.borrow_mut().car -= 3_200.0;
    lift.run(10);
    let Any::Virtual(display) = &mut lift.network.stations[DISPLAY_DEVICE].unit else { panic!() };
    assert_eq!(display.value(0x2203, 1), u64::from(UNDERFLOW), "below them");
}
