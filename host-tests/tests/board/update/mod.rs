//! The field update with the real images: the application, the bootloader, and a master that follows CiA 302-3.

mod authorisation;
mod bench;
mod broken_line;
mod corrupted;
mod cuts;
mod device;
mod fleet;
mod guest;
mod owner;
mod protected;
mod records;
mod trial;

use bsp::flash::sectors::FLASH;
use bsp::flash::update_layout::LAYOUT;
use callgraph::budget::{Budget, Compiler};
use canbus::Time;
use host_tests::thorough::either;
use update::{HEADER_LEN, Status};

use crate::stack::assert_bound;
use crate::support::{SECOND, images, world_of};
use bench::{BOOT, CONTROL, DEVICE_TYPE, IDENTIFICATION, PROMPT, START, signed, version_a, version_b};
pub(crate) use bench::{Bench, HEADER};

/// Code in 1F57h for an invalid signature.
const SIGNATURE: u8 = 67;

#[test]
fn the_application_reads_its_identification_from_its_header() {
    let mut bench = Bench::running();
    assert_eq!(bench.word(IDENTIFICATION), version_a().header.code_crc());
}

#[test]
fn a_node_is_updated_to_b_and_back() {
    let mut bench = Bench::running();
    bench.update(&version_b(0));
    bench.confirm();
    bench.update(&version_a());
    assert_eq!(bench.world.summary(1.0, 0).bus.errors, 0);
}

/// The update time compared with the time of the frames on the wire, including erase and programming. At one bit rate
/// without `--thorough`.
#[test]
fn an_update_takes_the_time_of_its_frames() {
    /// The times of the frames alone, for 127.5 KiB in blocks of 127 segments at 116 bits a frame.
    const WIRE: [(u32, f64); 3] = [(1000, 2.18), (500, 4.36), (250, 8.73)];
    let image = signed(noise(LAYOUT.longest_image() as usize - HEADER_LEN), |_| ()).to_bytes();
    for &(kbit, wire) in either(&WIRE[1..2], &WIRE[..]) {
        let mut bench = Bench::new(&format!("--bitrate {kbit}"), kbit * 1000, 1);
        bench.run(SECOND);
        bench.stop();
        let [clear, download, copy] = [
            bench.time(Bench::clear),
            bench.time(|bench| bench.download(&image).unwrap()),
            bench.time(|bench| assert_eq!(bench.wait_for_flash(), Status::GOOD)),
        ];
        let share = download / wire;
        println!(
            "{kbit} kbit/s: clear {clear:.2} s, download {download:.2} s ({share:.3} of the wire limit of {wire} s), \
             check and copy {copy:.2} s"
        );
        assert!(share < 1.05, "{kbit} kbit/s");
    }
}

/// Random bytes, which need at least as many stuff bits as code.
fn noise(length: usize) -> Vec<u8> {
    let mut random = fastrand::Rng::with_seed(1);
    (0..length).map(|_| random.u8(..)).collect()
}

/// Answers stay prompt while every sector of both areas is erased, and during download, check, signature and copy.
#[test]
fn every_answer_of_an_update_is_prompt() {
    let mut bench = Bench::running();
    bench.stop();
    let image = version_b(0).to_bytes();
    let mut slowest = |what: &str, phase: &mut dyn FnMut(&mut Bench)| {
        bench.slowest = Time::ZERO;
        phase(&mut bench);
        println!("slowest answer while the node {what}: {:.2} ms", bench.slowest.as_secs_f64() * 1e3);
        assert!(bench.slowest > Time::ZERO && bench.slowest <= PROMPT, "{what}");
    };
    slowest("erases staging", &mut |bench| bench.clear());
    slowest("programs what comes", &mut |bench| bench.download(&image).unwrap());
    slowest("checks the image and copies it", &mut |bench| {
        while bench.status().busy {
            bench.run(Time::from_micros(500));
        }
    });
    assert_eq!(bench.status(), Status::GOOD);
}

#[test]
fn without_an_application_the_node_is_where_its_record_says() {
    let mut bench = Bench::new("--bitrate 500", 500_000, 1);
    bench.machine().write(HEADER, &[0xFF; 1024]).unwrap();
    bench.power_cycle();
    bench.run(SECOND);
    assert_eq!(bench.read(DEVICE_TYPE).unwrap(), BOOT);
    assert_eq!(bench.status().code, 1);
    bench.clear();
    bench.download(&version_a().to_bytes()).unwrap();
    assert_eq!(bench.wait_for_flash(), Status::GOOD);
    bench.command(START).unwrap();
    assert_eq!(bench.identification_of_running(), version_a().header.code_crc());
}

/// An application written with a debugger: its checksums are right, but the signature is missing. Neither a power cycle
/// nor a master starts it.
#[test]
fn an_unsigned_application_does_not_start_on_the_board() {
    let mut bench = Bench::running();
    let image = version_b(0);
    let unsigned = [&image.header.with_signature([0; 64]).encode()[..], &image.code].concat();
    bench.machine().write(HEADER, &unsigned).unwrap();
    bench.power_cycle();
    bench.run(SECOND);
    assert_eq!(bench.read(DEVICE_TYPE).unwrap(), BOOT);
    assert_eq!(bench.status().code, SIGNATURE);
    bench.command(START).unwrap();
    bench.run(SECOND);
    assert_eq!((bench.read(DEVICE_TYPE).unwrap(), bench.status().code), (BOOT.to_vec(), SIGNATURE));
    bench.machine().write(HEADER, &version_a().to_bytes()).unwrap();
    assert_eq!(bench.start(), version_a().header.code_crc());
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

/// On a silent bus the application listens for the bit rate for any time: this does not confirm the application.
#[test]
fn an_application_that_is_not_on_the_bus_does_not_confirm_itself() {
    const PC: u8 = 15;
    let mut bench = Bench::new("--bitrate 1000 --node 1:pressure@auto", 1_000_000, 1);
    for _ in 0..3 {
        bench.run(SECOND * 12);
        bench.machine().set_register(PC, 0x3000_0000);
    }
    bench.run(SECOND);
    assert!((0..20).any(|_| bench.read(DEVICE_TYPE) == Ok(BOOT.to_vec())), "it stays in the bootloader");
    assert_eq!((bench.status().code, bench.status().detail), (70, 3));
}

/// The counter is outside of the application area. Neither damage there, nor an update, nor a debugger that programs
/// that area resets the counter.
#[test]
fn the_security_counter_outlives_the_application() {
    const COUNTER: u8 = 66;
    let code = version_b(0).code;
    let [older, newer] = [1, 2].map(|counter| signed(code.clone(), |about| about.counter = counter));
    let mut bench = Bench::running();
    bench.update(&newer);
    // The counter of an image is in force from the first start after its confirmation on.
    bench.run(SECOND * 10);
    bench.power_cycle();
    assert_eq!(bench.identification_of_running(), newer.header.code_crc());
    // Neither the application nor the image to copy again is valid.
    for place in [HEADER, FLASH + LAYOUT.staging().start()] {
        bench.machine().write(place, &[0; 64]).unwrap();
    }
    bench.power_cycle();
    bench.run(SECOND);
    bench.clear();
    let _ = bench.download(&older.to_bytes());
    let status = bench.settled();
    assert_eq!((status.code, status.detail), (COUNTER, 2), "{status}");
    bench.machine().write(HEADER, &older.to_bytes()).unwrap();
    bench.power_cycle();
    bench.run(SECOND);
    let status = bench.settled();
    assert_eq!((bench.read(DEVICE_TYPE).unwrap(), status.code), (BOOT.to_vec(), 1), "{status}");
    bench.clear();
    bench.download(&newer.to_bytes()).unwrap();
    assert_eq!(bench.wait_for_flash(), Status::GOOD);
    bench.command(START).unwrap();
    assert_eq!(bench.identification_of_running(), newer.header.code_crc());
}

/// The check of the signature needs the most stack.
#[test]
fn the_bootloader_stays_within_the_bound_of_its_stack() {
    let mut bench = Bench::new("--bitrate 250", 250_000, 1);
    bench.machine().write(HEADER, &[0xFF; 1024]).unwrap();
    bench.power_cycle();
    bench.run(SECOND);
    bench.clear();
    bench.download(&version_a().to_bytes()).unwrap();
    assert_eq!(bench.wait_for_flash(), Status::GOOD);
    assert_bound(&bench.world, &["bootloader"]);
}

/// The linker limits the bootloader to its two sectors. Another compiler must not break that limit.
#[test]
fn the_bootloader_fits_into_its_two_sectors() {
    const KIB: u64 = 1024;
    const SECTORS: Budget = Budget { what: "bootloader, bytes of flash", limit: 32 * KIB, width: 0 };
    // The seal of a start, the second check of the signature and the start of the clock with its tries use a part of the
    // KiB that was reserved before.
    const WITH_RESERVE: Budget = Budget { limit: 32 * KIB - 608, width: 2, ..SECTORS };
    /// With the key that authorises changes of the program. The rest of a block after a time-out takes 136 bytes.
    const GUARDED: Budget =
        Budget { what: "bootloader with 2003h, bytes of flash", limit: 32 * KIB - 256, width: 2 };
    let size = |bootloader: &str| {
        let size = world_of(bootloader, "").summary(1.0, 0).nodes[0].memory.bootloader_flash;
        (u64::from(size), Compiler::of(&images().join(bootloader)).unwrap())
    };
    let (development, compiler) = size("bootloader");
    println!("{}", WITH_RESERVE.check(development, &compiler).unwrap());
    println!("{}, free {}", SECTORS.check(development, &compiler).unwrap(), SECTORS.limit - development);
    let (guarded, compiler) = size("bootloader-guarded");
    println!("{}", GUARDED.check(guarded, &compiler).unwrap());
}
