//! A virtual device on the host: the same CANopen device that the nodes run, and a function that is called once a
//! millisecond.

use std::cell::RefCell;
use std::rc::Rc;

use canopen::dictionary::{Dictionary, Services, Sizes};
use canopen::{Action, CanId, Device, Duration, Frame, Instant, NodeId, Transmit};
use host_tests::asked::Asked;
use host_tests::network::Unit;

use crate::world::World;

/// Sizes that suffice for any of the dictionaries.
const ROOM: Sizes =
    Sizes { image: 512, tpdos: 8, rpdos: 8, watches: 4, scanned: 48, servers: 0, services: Services::ALL };
pub(crate) const TICK: Duration = Duration::from_millis(1);

/// The behaviour of a device apart from CANopen.
pub(crate) trait Behaviour {
    /// Called every millisecond.
    fn tick(&mut self, values: &mut Values, world: &mut World);
}

/// The values of a device's objects.
pub(crate) struct Values<'a> {
    dictionary: &'static Dictionary,
    image: &'a mut [u8],
}

impl Values<'_> {
    pub(crate) fn get(&self, index: u16, sub: u8) -> u64 {
        number(self.dictionary.field(index, sub).get(self.image))
    }

    /// The value of an INTEGER32.
    pub(crate) fn signed(&self, index: u16, sub: u8) -> i32 {
        self.dictionary.field(index, sub).u32(self.image).cast_signed()
    }

    pub(crate) fn set(&mut self, index: u16, sub: u8, value: u64) {
        let field = self.dictionary.field(index, sub);
        let len = field.get(self.image).len();
        field.set(self.image, &value.to_le_bytes()[..len]);
    }

    pub(crate) fn set_signed(&mut self, index: u16, sub: u8, value: i32) {
        self.dictionary.field(index, sub).set(self.image, &value.to_le_bytes());
    }
}

/// The device.
pub(crate) struct VirtualDevice {
    device: canopen::device!((), room: ROOM),
    dictionary: &'static Dictionary,
    behaviour: Box<dyn Behaviour>,
    world: Rc<RefCell<World>>,
    next_tick: Instant,
    asked: Asked,
}

impl VirtualDevice {
    pub(crate) fn new(
        node_id: u8,
        dictionary: &'static Dictionary,
        behaviour: impl Behaviour + 'static,
        world: &Rc<RefCell<World>>,
    ) -> VirtualDevice {
        assert!(dictionary.image_size() <= ROOM.image);
        VirtualDevice {
            device: Device::new(dictionary, NodeId::new(node_id), ()),
            dictionary,
            behaviour: Box::new(behaviour),
            world: Rc::clone(world),
            next_tick: Instant::NEVER,
            asked: Asked::default(),
        }
    }

    /// The value of an object of the device.
    pub(crate) fn value(&self, index: u16, sub: u8) -> u64 {
        number(self.dictionary.field(index, sub).get(self.device.image()))
    }

    fn tick(&mut self, now: Instant, out: &mut impl Transmit) {
        self.next_tick = self.next_tick + TICK;
        let VirtualDevice { dictionary, behaviour, world, .. } = self;
        let next = self.device.publish(now, out, |(), image| {
            behaviour.tick(&mut Values { dictionary, image }, &mut world.borrow_mut());
        });
        self.asked.keep(next);
    }
}

impl Unit for VirtualDevice {
    fn start(&mut self, now: Instant, out: &mut impl Transmit) {
        self.asked.keep(self.device.start(now, out));
        self.next_tick = now;
    }

    fn on_process_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        self.asked.keep(self.device.on_process_frame(frame, now, out));
    }

    fn on_service_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        self.asked.keep(self.device.on_service_frame(frame, now, out));
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        if now >= self.next_tick {
            self.tick(now, out);
        }
        let next = self.device.poll(now, out);
        self.asked.keep(next);
        next.due().min(self.next_tick)
    }

    fn take_action(&mut self) -> Option<Action> {
        self.asked.take_action()
    }

    fn process_ids(&self) -> Vec<u16> {
        self.device.process_ids().map(CanId::get).collect()
    }

    fn service_ids(&self) -> Vec<u16> {
        self.device.service_ids().map(CanId::get).collect()
    }
}

/// A value as a number.
fn number(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |value, byte| value << 8 | u64::from(*byte))
}
