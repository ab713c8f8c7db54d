//! The same lift with both nodes as emulated boards. The nodes' sensors are the plants of the boards, and the virtual
//! devices are clients of the simulated bus.

use std::cell::RefCell;
use std::rc::Rc;

use canbus::{Stamped, Time};
use canopen::sdo::Multiplexer;
use canopen::{Action, Duration, Frame, Instant};
use chip::plant::{Motion, Signal};
use host_tests::bench::Queue;
use host_tests::network::{Unit, from_bus, to_bus};
use host_tests::sdo::{Channel, Client};
use sim::stimuli::Stimulus;

use crate::car::WIDTH;
use crate::device::VirtualDevice;
use crate::installer::Site;
use crate::log::last;
use crate::small_lift::virtual_devices;
use crate::support::{self, Master, SECOND};
use crate::table::{LOAD, POSITION};
use crate::world::World;

/// Length of the tape for one revolution of the plant's shaft, in mm: 4096 marks of 0.1 mm.
const TAPE: f64 = 409.6;
const TICK: Time = Time::from_millis(1);
/// Numbers of the boards.
const POSITION_BOARD: usize = 0;
const LOAD_BOARD: usize = 1;

/// A virtual device with its client on the bus.
struct Seat {
    client: Master,
    device: VirtualDevice,
    filters: [Vec<u16>; 2],
}

impl Seat {
    fn new(device: VirtualDevice, world: &mut sim::world::World) -> Seat {
        Seat { client: Master::join(world), device, filters: [vec![], vec![]] }
    }

    fn start(&mut self, world: &mut sim::world::World) {
        let mut out = Queue::default();
        self.device.start(instant(world.now()), &mut out);
        self.fulfil();
        self.send(out, world);
    }

    /// Processes the received frames and the work that is due.
    fn run(&mut self, world: &mut sim::world::World) {
        let (now, mut out) = (instant(world.now()), Queue::default());
        while let Some(received) = world.port(self.client.port).receive() {
            let Some(frame) = from_bus(&received.frame) else { continue };
            if self.filters[0].contains(&frame.id()) {
                self.device.on_process_frame(&frame, now, &mut out);
            }
            if self.filters[1].contains(&frame.id()) {
                self.device.on_service_frame(&frame, now, &mut out);
            }
            self.fulfil();
        }
        self.device.poll(now, &mut out);
        self.send(out, world);
    }

    fn fulfil(&mut self) {
        while let Some(action) = self.device.take_action() {
            assert_eq!(action, Action::Identifiers, "nobody resets a virtual device");
            self.filters = [self.device.process_ids(), self.device.service_ids()];
        }
    }

    fn send(&self, out: Queue, world: &mut sim::world::World) {
        let now = world.now();
        out.0.iter().for_each(|frame| world.port(self.client.port).send(to_bus(frame), now));
    }
}

/// The lift.
pub(crate) struct Boards {
    boards: sim::world::World,
    master: Master,
    seats: Vec<Seat>,
    pub(crate) world: Rc<RefCell<World>>,
    pub(crate) log: Vec<Stamped>,
}

impl Boards {
    /// A lift with the car at the lowest landing and open doors; all devices are Pre-operational.
    pub(crate) fn new() -> Boards {
        let flags = format!("--bitrate 1000 --node {POSITION}:lift --node {LOAD}:lift");
        let mut boards = support::world(&flags);
        let world = World { car: 3_000.0, doors: [WIDTH; 2], ..World::default() };
        let world = Rc::new(RefCell::new(world));
        let master = Master::join(&mut boards);
        let mut seats: Vec<Seat> =
            virtual_devices(&world).into_iter().map(|device| Seat::new(device, &mut boards)).collect();
        seats.iter_mut().for_each(|seat| seat.start(&mut boards));
        let mut lift = Boards { boards, master, seats, world, log: vec![] };
        lift.boards.apply(&parse("shaft", &format!("{POSITION}=const:{}", 3_000.0 / TAPE))).unwrap();
        lift.load(0.0);
        lift.run(1000);
        lift
    }

    /// Runs for `millis` milliseconds and keeps the frames on the bus.
    pub(crate) fn run(&mut self, millis: u64) {
        for _ in 0..millis {
            self.tick();
        }
    }

    /// Advances by a millisecond: the devices act, and the car moves evenly to the position that the drive has reached.
    fn tick(&mut self) {
        let from = self.world.borrow().car;
        self.seats.iter_mut().for_each(|seat| seat.run(&mut self.boards));
        let (now, to) = (self.boards.now(), self.world.borrow().car);
        let seconds = TICK.as_secs_f64();
        let signal = Signal::Ramp { from: from / TAPE, to: to / TAPE, seconds };
        let machine = self.boards.machine(POSITION_BOARD);
        let at = now.max(machine.now());
        machine.peripherals_mut().plant_mut(at).set_shaft(Motion::Angle(signal), now);
        self.world.borrow_mut().measured.push((instant(now), from));
        self.boards.run_until(now + TICK);
        self.log.extend(self.boards.take_frames());
    }

    /// Runs until the condition `is_so` holds.
    pub(crate) fn run_until(&mut self, limit: u64, mut is_so: impl FnMut(&mut Boards) -> bool) {
        for _ in 0..limit / 10 {
            if is_so(self) {
                return;
            }
            self.run(10);
        }
        panic!("it did not happen in {limit} ms: {:?}", self.world.borrow().car);
    }

    pub(crate) fn load(&mut self, kilograms: f64) {
        let pascal = 2.0e5 + kilograms * 500.0;
        self.boards.apply(&parse("pressure", &format!("{LOAD}=const:{pascal}"))).unwrap();
    }

    /// Presses button 1 for a moment.
    pub(crate) fn press_button(&mut self) {
        for what in ["down", "up"] {
            self.boards.apply(&parse("button", &format!("{LOAD}=1:{what}"))).unwrap();
            self.run(50);
        }
    }

    /// Whether lamp 1 is lit, at the pin of the board.
    pub(crate) fn is_lit(&mut self) -> bool {
        self.boards.machine(LOAD_BOARD).peripherals().output('C', 0) == Some(true)
    }

    pub(crate) fn read(&mut self, node: u8, index: u16, sub: u8) -> u64 {
        let bytes = Client::new(&mut Link { lift: self, node }).read(Multiplexer { index, sub }).unwrap();
        bytes.iter().rev().fold(0, |value, byte| value << 8 | u64::from(*byte))
    }

    pub(crate) fn last(&self, id: u32, object: usize) -> u64 {
        last(&self.log, id, object)
    }

    pub(crate) fn doors_are(&self, width: f64) -> bool {
        self.world.borrow().doors == [width; 2]
    }

    /// The position of the car at an instant, in mm.
    pub(crate) fn car(&self, at: Instant) -> f64 {
        let world = self.world.borrow();
        let next = world.measured.partition_point(|(time, _)| *time <= at);
        let (before, from) = world.measured[next - 1];
        let to = world.measured.get(next).map_or(world.car, |(_, car)| *car);
        from + (to - from) * (at.0 - before.0) as f64 / TICK.as_micros() as f64
    }
}

impl Site for Boards {
    fn write(&mut self, node: u8, index: u16, sub: u8, bytes: &[u8]) {
        let result = Client::new(&mut Link { lift: self, node }).write(Multiplexer { index, sub }, bytes);
        assert_eq!(result, Ok(()), "{node}: {index:X}h:{sub}");
    }

    /// Waits half a second after a reset, because the board may have to erase a page of its parameters.
    fn nmt(&mut self, command: u8, node: u8) {
        self.master.send(&mut self.boards, 0, &[command, node]);
        self.run(if command == 1 { 5 } else { SECOND.as_micros() / 1000 });
    }
}

/// The SDO channel from the master to one server.
struct Link<'a> {
    lift: &'a mut Boards,
    node: u8,
}

impl Channel for Link<'_> {
    fn send(&mut self, request: [u8; 8]) {
        self.lift.master.send(&mut self.lift.boards, 0x600 + u16::from(self.node), &request);
    }

    fn received(&mut self) -> Option<[u8; 8]> {
        let Boards { master, boards, .. } = self.lift;
        let frames = master.heard(boards, 0x580 + u16::from(self.node));
        frames.first()?.bytes().try_into().ok()
    }

    fn wait(&mut self) -> Option<[u8; 8]> {
        (0..500).find_map(|_| {
            self.lift.run(1);
            self.received()
        })
    }
}

fn parse(kind: &str, spec: &str) -> sim::stimuli::Targeted<Stimulus> {
    Stimulus::parse(kind, spec).unwrap()
}

fn instant(time: Time) -> Instant {
    Instant(time.as_micros())
}

/// The position PDOs: the instant of each frame and its position.
pub(crate) fn positions(log: &[Stamped]) -> impl Iterator<Item = (Instant, f64)> {
    log.iter().filter_map(|stamped| {
        let frame: Frame = from_bus(&stamped.frame).filter(|frame| frame.id() == 0x18C)?;
        let position = u32::from_le_bytes(frame.data().try_into().ok()?);
        Some((instant(stamped.at), f64::from(position)))
    })
}

/// The greatest age of a position at the end of its frame: the time from the sample to the dictionary, and the wait for
/// the bus.
pub(crate) const OLDEST: Duration = Duration(800);
