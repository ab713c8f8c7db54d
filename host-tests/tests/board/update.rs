//! The field update with the images as they are: the application, the bootloader, and a master that follows CiA 302-3.

use canbus::{StandardId, Time};
use canopen::sdo::Multiplexer;
use chip::Stm32f4;
use ed25519_dalek::SigningKey;
use emulator::Machine;
use host_tests::sdo::{Channel, Client, Failure};
use sign::image::Image;
use sign::product;
use sim::world::World;
use update::{Description, HEADER_LEN, Status, Version};

use crate::support::{Master, SECOND, firmware, world};

const DATA: Multiplexer = Multiplexer { index: 0x1F50, sub: 1 };
const CONTROL: Multiplexer = Multiplexer { index: 0x1F51, sub: 1 };
const IDENTIFICATION: Multiplexer = Multiplexer { index: 0x1F56, sub: 1 };
const STATUS: Multiplexer = Multiplexer { index: 0x1F57, sub: 1 };
const DEVICE_TYPE: Multiplexer = Multiplexer { index: 0x1000, sub: 0 };
/// 'BOOT'.
const BOOT: [u8; 4] = 0x424F_4F54_u32.to_le_bytes();
const STOP: u8 = 0;
const START: u8 = 1;
const CLEAR: u8 = 3;
/// First address of the application's header, and what the bootloader may erase besides.
const HEADER: u32 = 0x0801_0000;
/// How long a client waits for a response, the shortest that is known (python-canopen).
const TIME_OUT: Time = Time::from_millis(300);
/// What the bootloader owes while a sector erases.
const PROMPT: Time = Time::from_millis(20);
const STEP: Time = Time::from_micros(100);

/// A master, the node it talks to, and the slowest answer it got.
struct Bench {
    world: World,
    master: Master,
    node: u8,
    slowest: Time,
    sent: Time,
}

impl Bench {
    fn new(flags: &str, bit_rate: u32, node: u8) -> Bench {
        let mut world = world(flags);
        let master = Master::join_at(&mut world, bit_rate);
        Bench { world, master, node, slowest: Time::ZERO, sent: Time::ZERO }
    }

    /// A node of version A that has run for a second at 1 Mbit/s.
    fn running() -> Bench {
        let mut bench = Bench::new("--bitrate 1000", 1_000_000, 1);
        bench.run(SECOND);
        bench
    }

    fn run(&mut self, span: Time) {
        self.world.run_until(self.world.now() + span);
    }

    fn machine(&mut self) -> &mut Machine<Stm32f4> {
        self.world.machine(0)
    }

    fn power_cycle(&mut self) {
        let now = self.world.now();
        self.machine().power_off();
        self.machine().power_on(now);
    }

    fn read(&mut self, at: Multiplexer) -> Result<Vec<u8>, Failure> {
        Client::new(self).read(at)
    }

    fn word(&mut self, at: Multiplexer) -> u32 {
        u32::from_le_bytes(self.read(at).unwrap().try_into().unwrap())
    }

    fn status(&mut self) -> Status {
        Status::from_word(self.word(STATUS))
    }

    fn command(&mut self, command: u8) -> Result<(), Failure> {
        Client::new(self).write(CONTROL, &[command])
    }

    /// Into the bootloader, which answers next.
    fn stop(&mut self) {
        assert_eq!(self.command(STOP), Err(Failure::Silence), "not acknowledged");
        assert_eq!(self.read(DEVICE_TYPE).unwrap(), BOOT);
        assert_eq!(self.read(CONTROL).unwrap(), [0]);
        assert_eq!(self.word(IDENTIFICATION), 0);
    }

    /// Polls until the flash is no longer busy; every answer must be prompt.
    fn wait_for_flash(&mut self) -> Status {
        loop {
            let status = self.status();
            if !status.busy {
                return status;
            }
            self.run(Time::from_millis(3));
        }
    }

    fn clear(&mut self) {
        self.command(CLEAR).unwrap();
        assert_eq!(self.wait_for_flash(), Status::GOOD);
    }

    fn download(&mut self, image: &[u8]) -> Result<(), Failure> {
        Client::new(self).write_blocks(DATA, image)
    }

    /// Starts the program and waits until it says that it runs.
    fn start(&mut self) -> u32 {
        self.command(START).unwrap();
        self.identification_of_running()
    }

    /// The identification of the program once it runs, within ten seconds.
    fn identification_of_running(&mut self) -> u32 {
        for _ in 0..100 {
            self.run(Time::from_millis(100));
            if self.read(CONTROL) == Ok(vec![1]) {
                return self.word(IDENTIFICATION);
            }
        }
        panic!("the program does not run: 1F51h reads {:?}", self.read(CONTROL));
    }

    /// The whole sequence of a master.
    fn update(&mut self, image: &Image) {
        self.stop();
        self.clear();
        self.download(&image.to_bytes()).unwrap();
        assert_eq!(self.wait_for_flash(), Status::GOOD);
        assert_eq!(self.word(IDENTIFICATION), image.header.code_crc());
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
        // What the client has queued must be on the wire before its patience counts.
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

/// The application as it was built.
fn version_a() -> Image {
    product::development_image(&firmware()).unwrap()
}

/// The same with another version and identification: a word more, as many bytes as are wanted.
fn version_b(length: usize) -> Image {
    signed(length, |_| ())
}

/// Version B with something else about it.
fn signed(length: usize, change: impl FnOnce(&mut Description)) -> Image {
    let mut code = version_a().code;
    code.resize(length.max(code.len() + 4), 0xB0);
    let version = Version { major: 9, minor: 8, patch: 7 };
    let mut about =
        Description { product: product::PRODUCT, hardware: product::HARDWARE, version, counter: 0 };
    change(&mut about);
    Image::sign(about, code, &sign::key::development()).unwrap()
}

#[test]
fn the_application_reads_its_identification_from_its_header() {
    let mut bench = Bench::running();
    assert_eq!(bench.word(IDENTIFICATION), version_a().header.code_crc());
}

#[test]
fn a_node_is_updated_to_b_and_back() {
    let mut bench = Bench::running();
    bench.update(&version_b(0));
    bench.update(&version_a());
    assert_eq!(bench.world.summary(1.0, 0).bus.errors, 0);
}

/// All of it is on the wire, and the flash is erased and programmed: what does the node add?
#[test]
fn an_update_takes_what_the_wire_takes() {
    /// Of 128 KiB in blocks of 127 at 116 bits a frame, nothing but the frames.
    const WIRE: [(u32, f64); 3] = [(1000, 2.19), (500, 4.38), (250, 8.76)];
    for (kbit, wire) in WIRE {
        let mut bench = Bench::new(&format!("--bitrate {kbit}"), kbit * 1000, 1);
        bench.run(SECOND);
        bench.stop();
        bench.slowest = Time::ZERO;
        let times: Vec<f64> = [
            Bench::clear as fn(&mut Bench),
            |bench| bench.download(&version_b(128 * 1024 - HEADER_LEN).to_bytes()).unwrap(),
            |bench| assert_eq!(bench.wait_for_flash(), Status::GOOD),
            |bench| assert_ne!(bench.start(), version_a().header.code_crc()),
        ]
        .into_iter()
        .map(|part| {
            let before = bench.world.now();
            part(&mut bench);
            bench.world.now().since(before).as_secs_f64()
        })
        .collect();
        println!(
            "{kbit} kbit/s: clear {:.2} s, download {:.2} s (wire {wire} s), check and copy {:.2} s, start {:.2} s; \
             slowest answer {:.1} ms",
            times[0],
            times[1],
            times[2],
            times[3],
            bench.slowest.as_secs_f64() * 1e3
        );
        assert!(times[1] < 1.15 * wire, "{kbit} kbit/s");
    }
}

/// Both areas, while every sector erases.
#[test]
fn the_bus_is_answered_while_the_flash_erases() {
    let mut bench = Bench::running();
    bench.stop();
    bench.slowest = Time::ZERO;
    bench.clear();
    println!("slowest answer while staging is cleared: {:.2} ms", bench.slowest.as_secs_f64() * 1e3);
    assert!(bench.slowest <= PROMPT);
    bench.download(&version_b(0).to_bytes()).unwrap();
    let mut slow = 0;
    let mut worst = Time::ZERO;
    while {
        bench.slowest = Time::ZERO;
        let busy = bench.status().busy;
        worst = worst.max(bench.slowest);
        slow += u32::from(bench.slowest > PROMPT);
        busy
    } {
        bench.run(Time::from_millis(1));
    }
    println!("slowest answer in check and copy: {:.2} ms", worst.as_secs_f64() * 1e3);
    assert!(slow <= 2, "only the two checks of the signature may take longer: {slow} answers did");
    assert!(worst < Time::from_millis(100));
}

#[test]
fn a_bad_image_is_refused_with_its_code_and_the_old_application_starts() {
    let good = version_b(0);
    let mut flipped = good.to_bytes();
    flipped[HEADER_LEN + 1000] ^= 1;
    let stranger =
        Image::sign(*good.header.description(), good.code.clone(), &SigningKey::from_bytes(&[7; 32]));
    let foreign = signed(0, |about| about.product += 1);
    let elsewhere = signed(0, |about| about.hardware = 2);
    let bad = [
        ("another product", foreign.to_bytes(), 64),
        ("other hardware", elsewhere.to_bytes(), 65),
        ("a bit of the code", flipped, 3),
        ("another key", stranger.unwrap().to_bytes(), 67),
        ("cut short", good.to_bytes()[..40_000].to_vec(), 68),
        ("too much", [good.to_bytes(), vec![0; 16]].concat(), 69),
        ("no image", vec![0x55; 4096], 2),
    ];
    let mut bench = Bench::running();
    bench.stop();
    for (what, image, code) in bad {
        bench.clear();
        let _ = bench.download(&image);
        // What was still to be sent of a block that is refused is answered too.
        bench.run(Time::from_millis(50));
        let status = bench.wait_for_flash();
        println!("{what}: {status}");
        assert_eq!(status.code, code, "{what}");
    }
    assert_eq!(bench.start(), version_a().header.code_crc());
}

#[test]
fn without_an_application_the_node_is_126_at_250_kbit() {
    let mut bench = Bench::new("--bitrate 250", 250_000, 126);
    bench.machine().write(HEADER, &[0xFF; 1024]).unwrap();
    bench.power_cycle();
    bench.run(SECOND);
    assert_eq!(bench.read(DEVICE_TYPE).unwrap(), BOOT);
    assert_eq!(bench.status().code, 1);
    bench.clear();
    bench.download(&version_a().to_bytes()).unwrap();
    assert_eq!(bench.wait_for_flash(), Status::GOOD);
    bench.command(START).unwrap();
    bench.node = 1;
    assert_eq!(bench.identification_of_running(), version_a().header.code_crc());
}

#[test]
fn an_application_that_crashes_again_and_again_stays_reachable() {
    const PC: u8 = 15;
    let mut bench = Bench::running();
    for _ in 0..3 {
        bench.machine().set_register(PC, 0x3000_0000);
        bench.run(SECOND);
    }
    assert_eq!(bench.read(DEVICE_TYPE).unwrap(), BOOT);
    let status = bench.status();
    assert_eq!((status.code, status.detail), (70, 3), "{status}");
    assert_eq!(bench.start(), version_a().header.code_crc(), "it gets another try");
    bench.run(SECOND * 12);
    bench.machine().set_register(PC, 0x3000_0000);
    bench.run(SECOND);
    assert_eq!(bench.read(CONTROL).unwrap(), [1], "a crash after it was well counts for itself");
}

/// Crate `update` cuts at every operation; here the real bootloader shows with some that it is the same machine.
#[test]
fn whenever_the_power_goes_the_node_comes_back_with_one_of_the_two() {
    const CUTS: u64 = 12;
    let (a, b) = (version_a(), version_b(0));
    let words = (b.to_bytes().len() / 4) as u64;
    // Clear, download, the copy with its erases; the commit record in between.
    let all = 6 + words + 4 + 2 + words;
    let (mut old, mut new) = (0, 0);
    for cut in 0..CUTS {
        let mut bench = Bench::running();
        bench.stop();
        bench.machine().peripherals_mut().flash_mut().cut_power_at_operation(1 + cut * all / CUTS + cut);
        let _ = bench.command(CLEAR);
        let _ = (0..3000).find(|_| {
            bench.run(Time::from_millis(1));
            !matches!(bench.read(STATUS).as_deref(), Ok([1, ..]))
        });
        let _ = bench.download(&b.to_bytes());
        bench.run(SECOND * 6);
        bench.power_cycle();
        bench.run(SECOND * 6);
        let found = bench.identification_of_running();
        assert!([a.header.code_crc(), b.header.code_crc()].contains(&found), "cut {cut}");
        if found == a.header.code_crc() { old += 1 } else { new += 1 }
    }
    println!("{CUTS} cuts: {old} times the old application, {new} times the new one");
    assert!(old > 0 && new > 0);
}
