//! Errors of the running firmware: the EMCY is on the bus before the state that 1029h demands, in every personality and
//! with several node-IDs; whether the error comes while the node runs, or the start finds it.

use canbus::{Id, Time};
use sim::stimuli::Stimulus;
use sim::world::World;

use crate::support::{Master, SECOND, world};

const NODES: [(&str, u8); 4] = [("pressure", 1), ("encoder", 16), ("combined", 127), ("lift", 16)];
const STOPPED: u8 = 4;
/// The parameter pages (memory.x).
const PAGES: u32 = 0x0800_8000;
const SIZE: usize = 0x8000;
/// Number of the program counter.
const PC: u8 = 15;
/// A value whose bytes occur nowhere else in the pages.
const MARK: [u8; 2] = [0x17, 0x5A];

struct Setup {
    world: World,
    master: Master,
    id: u8,
}

impl Setup {
    /// A node with 1029h:1 and 1029h:2 at 2, stored. A lift node measures the load and a position.
    fn new(personality: &str, id: u8) -> Setup {
        let mut world = world(&format!("--bitrate 1000 --node {id}:{personality} --pressure const:250000"));
        let master = Master::join(&mut world);
        world.run_until(SECOND);
        let mut setup = Setup { world, master, id };
        if personality == "lift" {
            setup.write(0x2305, 0, &[3]);
        }
        setup.write(0x1029, 1, &[2]);
        setup.write(0x1029, 2, &[2]);
        setup.write(0x1017, 0, &[50, 0]);
        setup.write(0x1010, 1, b"save");
        setup
    }

    fn write(&mut self, index: u16, sub: u8, value: &[u8]) {
        let [low, high] = index.to_le_bytes();
        let mut request = [0x23 | (4 - value.len() as u8) << 2, low, high, sub, 0, 0, 0, 0];
        request[4..4 + value.len()].copy_from_slice(value);
        let answer = self.master.ask(&mut self.world, self.id, &request);
        assert_eq!(answer[0], 0x60, "{index:x}h:{sub}: {answer:x?}");
    }

    fn start(&mut self) {
        self.master.send(&mut self.world, 0, &[1, self.id]);
        self.world.run_until(self.world.now() + Time::from_millis(100));
        self.world.take_frames();
    }

    fn fault(&mut self, name: &str) {
        let spec = format!("{name}:on");
        self.world.apply(&Stimulus::parse("fault", &spec).unwrap()).unwrap();
    }

    fn power_cycle(&mut self) {
        let now = self.world.now();
        self.world.machine(0).power_off();
        self.world.machine(0).power_on(now);
        self.world.take_frames();
    }

    /// The EMCY codes of the next second that precede the first heartbeat with state Stopped, and those that follow it.
    fn codes(&mut self) -> (Vec<u16>, Vec<u16>) {
        self.world.run_until(self.world.now() + SECOND + Time::from_millis(300));
        let (mut before, mut after, mut is_stopped) = (vec![], vec![], false);
        for sent in self.world.take_frames() {
            let Id::Standard(id) = sent.frame.id() else { panic!("an identifier of 29 bits") };
            let bytes = sent.frame.bytes();
            if id.as_raw() == 0x080 + u16::from(self.id) {
                let codes = if is_stopped { &mut after } else { &mut before };
                codes.push(u16::from_le_bytes([bytes[0], bytes[1]]));
            }
            is_stopped |= id.as_raw() == 0x700 + u16::from(self.id) && bytes == [STOPPED];
        }
        assert!(is_stopped, "node {} is not stopped: {before:x?}", self.id);
        (before, after)
    }
}

#[test]
fn the_emcy_of_an_error_is_on_the_bus_before_the_node_stops() {
    for (personality, id) in NODES {
        if personality != "encoder" {
            let mut setup = Setup::new(personality, id);
            setup.start();
            setup.fault("rail-high");
            let (before, after) = setup.codes();
            assert!(!before.is_empty() && after.is_empty(), "{personality}: {before:x?}, then {after:x?}");
        }

        let mut setup = Setup::new(personality, id);
        setup.write(0x1016, 1, &0x0009_0064_u32.to_le_bytes());
        setup.start();
        setup.master.send(&mut setup.world, 0x709, &[5]);
        assert_eq!(setup.codes(), (vec![0x8130], vec![]), "{personality}: a heartbeat is missing");
    }
}

#[test]
fn errors_found_at_a_start_are_on_the_bus_before_the_node_stops() {
    for (personality, id) in NODES {
        // A crash, and a sensor that is at a rail from the beginning.
        let mut setup = Setup::new(personality, id);
        setup.start();
        setup.world.machine(0).set_register(PC, 0x3000_0000);
        assert_eq!(setup.codes(), (vec![0x6101], vec![]), "{personality}: a crash");

        if personality != "encoder" {
            let mut setup = Setup::new(personality, id);
            setup.fault("rail-high");
            setup.power_cycle();
            let (before, after) = setup.codes();
            assert!(!before.is_empty() && after.is_empty(), "{personality}: {before:x?}, then {after:x?}");
        }

        // A damaged set of application parameters.
        let mut setup = Setup::new(personality, id);
        setup.write(0x2002, 3, &MARK);
        setup.write(0x1010, 3, b"save");
        let mut pages = vec![0; SIZE];
        setup.world.machine(0).read(PAGES, &mut pages).unwrap();
        let at = pages.windows(2).rposition(|bytes| bytes == MARK).expect("it is stored");
        let address = PAGES + u32::try_from(at).unwrap();
        setup.world.machine(0).write(address, &[MARK[0] ^ 0x80]).unwrap();
        setup.power_cycle();
        assert_eq!(setup.codes(), (vec![0x6303], vec![]), "{personality}: a damaged set");
    }
}

/// LSS, bit timing table 0, index 9: the node leaves the bus and listens. It keeps what was written before.
#[test]
fn an_automatic_detection_that_lss_activates_keeps_state_and_parameters() {
    for (personality, id) in NODES {
        let mut setup = Setup::new(personality, id);
        setup.write(0x1029, 1, &[1]);
        setup.write(0x1017, 0, &[100, 0]);
        if personality == "lift" {
            // Its calls and multiplexed PDOs would fill the queue while nothing can be sent.
            setup.write(0x1881, 1, &(0xC000_0480 | u32::from(id)).to_le_bytes());
            setup.write(0x1801, 1, &(0x8000_0500 | u32::from(id)).to_le_bytes());
        }
        setup.start();
        let Setup { world, master, .. } = &mut setup;
        master.lss(world, &[0x04, 1, 0, 0, 0, 0, 0, 0]);
        assert_eq!(master.lss(world, &[0x13, 0, 9, 0, 0, 0, 0, 0])[0][..2], [0x13, 0]);
        master.lss(world, &[0x15, 10, 0, 0, 0, 0, 0, 0]);
        world.take_frames();
        for _ in 0..60 {
            master.send(world, 0x77F, &[5]);
            world.run_until(world.now() + Time::from_millis(50));
        }
        let node = world.traffic().node(id);
        assert_eq!((node.boot_ups, node.state), (1, sim::traffic::NmtState::Operational), "{personality}");
        let answer = master.ask(world, id, &[0x40, 0x17, 0x10, 0, 0, 0, 0, 0]);
        assert_eq!(answer[4..6], [100, 0], "{personality}: 1017h");
    }
}
