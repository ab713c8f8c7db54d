//! A master that follows CiA 302-3, and its images.

use bsp::flash::update_layout::LAYOUT;
use canbus::{StandardId, Time};
use canopen::sdo::Multiplexer;
use chip::Stm32f4;
use emulator::Machine;
use host_tests::sdo::{Channel, Client, Failure};
use programmer::sign::image::Image;
use programmer::sign::product;
use sim::port::Adapter;
use sim::world::World;
use update::{Description, Status, Version};

use crate::support::{Master, SECOND, firmware, world};

pub(super) const DATA: Multiplexer = Multiplexer { index: 0x1F50, sub: 1 };
pub(super) const CONTROL: Multiplexer = Multiplexer { index: 0x1F51, sub: 1 };
pub(super) const IDENTIFICATION: Multiplexer = Multiplexer { index: 0x1F56, sub: 1 };
pub(super) const STATUS: Multiplexer = Multiplexer { index: 0x1F57, sub: 1 };
pub(super) const TRIAL_COMMAND: Multiplexer = Multiplexer { index: 0x2002, sub: 2 };
pub(super) const DEVICE_TYPE: Multiplexer = Multiplexer { index: 0x1000, sub: 0 };
/// 'BOOT'.
pub(super) const BOOT: [u8; 4] = 0x424F_4F54_u32.to_le_bytes();
pub(super) const STOP: u8 = 0;
pub(super) const START: u8 = 1;
pub(super) const CLEAR: u8 = 3;
/// First address of the application's header, and the other addresses that the bootloader may erase.
pub(crate) const HEADER: u32 = 0x0802_0000;
/// The version of image B.
pub(super) const VERSION_B: Version = Version { major: 9, minor: 8, patch: 7 };
/// The time-out of a client for a response, the shortest known (python-canopen).
const TIME_OUT: Time = Time::from_millis(300);
/// The longest allowed response time of the bootloader, also while the flash is busy.
pub(super) const PROMPT: Time = Time::from_millis(20);
const STEP: Time = Time::from_micros(100);

/// A master, its node, and the slowest answer so far.
pub(crate) struct Bench {
    pub(super) world: World,
    master: Master,
    bit_rate: u32,
    pub(super) node: u8,
    pub(super) slowest: Time,
    sent: Time,
}

impl Bench {
    pub(super) fn new(flags: &str, bit_rate: u32, node: u8) -> Bench {
        Bench::with(world(flags), bit_rate, node)
    }

    /// A master on the bus of an existing world.
    pub(crate) fn with(mut world: World, bit_rate: u32, node: u8) -> Bench {
        let master = Master::join_at(&mut world, bit_rate);
        Bench { world, master, bit_rate, node, slowest: Time::ZERO, sent: Time::ZERO }
    }

    /// A node of version A that has run for a second at 1 Mbit/s.
    pub(super) fn running() -> Bench {
        let mut bench = Bench::new("--bitrate 1000", 1_000_000, 1);
        bench.run(SECOND);
        bench
    }

    pub(crate) fn run(&mut self, span: Time) {
        self.world.run_until(self.world.now() + span);
    }

    pub(super) fn machine(&mut self) -> &mut Machine<Stm32f4> {
        self.world.machine(0)
    }

    /// The duration of a call in virtual seconds.
    pub(super) fn time(&mut self, what: impl FnOnce(&mut Bench)) -> f64 {
        let before = self.world.now();
        what(self);
        self.world.now().since(before).as_secs_f64()
    }

    /// The bit rate of the master in bit/s.
    pub(super) fn bit_rate(&self) -> u32 {
        self.bit_rate
    }

    /// The master leaves the bus, or joins it again.
    pub(super) fn attach(&mut self, is_there: bool) {
        let adapter = Adapter { bit_rate: self.bit_rate, silent: false };
        self.world.port(self.master.port).attach(is_there.then_some(adapter));
    }

    pub(super) fn power_cycle(&mut self) {
        let now = self.world.now();
        self.machine().power_off();
        self.machine().power_on(now);
    }

    pub(super) fn read(&mut self, at: Multiplexer) -> Result<Vec<u8>, Failure> {
        Client::new(self).read(at)
    }

    pub(super) fn word(&mut self, at: Multiplexer) -> u32 {
        u32::from_le_bytes(self.read(at).unwrap().try_into().unwrap())
    }

    pub(super) fn status(&mut self) -> Status {
        Status::from_word(self.word(STATUS))
    }

    pub(super) fn command(&mut self, command: u8) -> Result<(), Failure> {
        Client::new(self).write(CONTROL, &[command])
    }

    /// Sends a frame without an answer, and waits until its effect is complete.
    pub(super) fn tell(&mut self, id: u16, bytes: &[u8]) {
        self.master.send(&mut self.world, id, bytes);
        self.run(Time::from_millis(50));
    }

    /// Switches to the bootloader, which gives the next answers.
    pub(super) fn stop(&mut self) {
        assert_eq!(self.command(STOP), Err(Failure::Silence), "not acknowledged");
        assert_eq!(self.read(DEVICE_TYPE).unwrap(), BOOT);
        assert_eq!(self.read(CONTROL).unwrap(), [0]);
        assert_eq!(self.word(IDENTIFICATION), 0);
    }

    /// The status after a refused download; the remaining segments of a block are also answered.
    pub(super) fn settled(&mut self) -> Status {
        self.run(Time::from_millis(50));
        self.wait_for_flash()
    }

    /// The content of the application area, with the header.
    pub(super) fn application(&self) -> Vec<u8> {
        let area = LAYOUT.application();
        self.world.boards()[0].flash()[area.start() as usize..area.end() as usize].to_vec()
    }

    /// Polls until the flash is no longer busy; every answer must be prompt.
    pub(super) fn wait_for_flash(&mut self) -> Status {
        loop {
            let status = self.status();
            if !status.busy {
                return status;
            }
            self.run(Time::from_millis(3));
        }
    }

    pub(super) fn clear(&mut self) {
        self.command(CLEAR).unwrap();
        assert_eq!(self.wait_for_flash(), Status::GOOD);
    }

    pub(super) fn download(&mut self, image: &[u8]) -> Result<(), Failure> {
        Client::new(self).write_blocks(DATA, image)
    }

    /// Starts the program and waits until it is running.
    pub(super) fn start(&mut self) -> u32 {
        self.command(START).unwrap();
        self.identification_of_running()
    }

    /// Whether a program runs and reports this.
    pub(super) fn is_running(&mut self) -> bool {
        self.read(CONTROL) == Ok(vec![1])
    }

    /// Waits until the program runs, for ten seconds at most; returns its identification.
    pub(super) fn identification_of_running(&mut self) -> u32 {
        for _ in 0..100 {
            self.run(Time::from_millis(100));
            if self.is_running() {
                return self.word(IDENTIFICATION);
            }
        }
        panic!("the program does not run: 1F51h reads {:?}", self.read(CONTROL));
    }

    /// Confirms the program on trial.
    pub(crate) fn confirm(&mut self) {
        Client::new(self).write(TRIAL_COMMAND, b"conf").unwrap();
        self.run(Time::from_millis(100));
    }

    /// The complete update sequence of a master.
    pub(crate) fn update(&mut self, image: &Image) {
        self.stop();
        self.clear();
        self.download(&image.to_bytes()).unwrap();
        assert_eq!(self.wait_for_flash(), Status::GOOD);
        assert_eq!(self.word(IDENTIFICATION), 0, "it does not run yet");
        assert_eq!(self.start(), image.header.code_crc());
    }
}

impl Channel for Bench {
    fn send(&mut self, request: [u8; 8]) {
        self.sent = self.world.now();
        self.master.send(&mut self.world, 0x600 + u16::from(self.node), &request);
    }

    fn received(&mut self) -> Option<[u8; 8]> {
        let port = self.world.port(self.master.port);
        let response = StandardId::new(0x580 + u16::from(self.node))?.into();
        std::iter::from_fn(|| port.receive())
            .find(|stamped| stamped.frame.id() == response)
            .and_then(|stamped| stamped.frame.bytes().try_into().ok())
    }

    fn wait(&mut self) -> Option<[u8; 8]> {
        // The client's time-out begins when its queued frames are on the wire.
        while self.world.port(self.master.port).backlog() > 0 {
            self.run(STEP);
            self.sent = self.world.now();
        }
        while self.world.now().since(self.sent) < TIME_OUT {
            if let Some(response) = self.received() {
                self.slowest = self.slowest.max(self.world.now().since(self.sent));
                return Some(response);
            }
            self.run(STEP);
        }
        None
    }
}

/// The application as built.
pub(super) fn version_a() -> Image {
    product::development_image(&firmware()).unwrap()
}

/// The application with another version and identification: the version for 100Ah is changed in the code, and a word is
/// added, or as many as requested.
pub(super) fn version_b(length: usize) -> Image {
    let mut code = version_a().code;
    code.resize(length.max(code.len() + 4), 0xB0);
    let (old, new) = (env!("CARGO_PKG_VERSION").as_bytes(), VERSION_B.to_string());
    let places: Vec<usize> = (0..code.len()).filter(|&at| code[at..].starts_with(old)).collect();
    assert!(old.len() == new.len() && !places.is_empty(), "the application says its version");
    places.into_iter().for_each(|at| code[at..][..old.len()].copy_from_slice(new.as_bytes()));
    signed(code, |_| ())
}

/// Code that is not meant to run, in a valid image except for the change.
pub(super) fn signed(code: Vec<u8>, change: impl FnOnce(&mut Description)) -> Image {
    let mut about = Description {
        board: product::BOARD,
        hardware: product::HARDWARE,
        version: VERSION_B,
        ..Description::default()
    };
    change(&mut about);
    Image::sign(about, code, &programmer::sign::key::development()).unwrap()
}
