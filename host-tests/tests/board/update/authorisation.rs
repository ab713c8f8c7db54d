//! The bootloader of an owner who requires an authorisation for changes of the program (2003h), with the real images.

use canopen::sdo::{Abort, Multiplexer};
use host_tests::sdo::{Client, Failure};
use nodectl::update::AuthorisationKey;

use super::bench::{BOOT, Bench, CLEAR, DEVICE_TYPE, HEADER, START, STOP, version_a, version_b};
use super::fleet;
use super::owner::signed_by_owner;
use crate::support::{SECOND, world_of};

/// The key that `cargo xtask` builds this bootloader with.
const KEY: &str = include_str!("authorisation-key.hex");

const fn authorisation(sub: u8) -> Multiplexer {
    Multiplexer { index: 0x2003, sub }
}

const STATE: Multiplexer = authorisation(1);
const CHALLENGE: Multiplexer = authorisation(2);
const RESPONSE: Multiplexer = authorisation(3);
const SERIAL_NUMBER: Multiplexer = Multiplexer { index: 0x1018, sub: 4 };
const TRIAL_COMMAND: Multiplexer = Multiplexer { index: 0x2002, sub: 2 };
/// NMT reset node.
const RESET: u8 = 0x81;

/// Values of 2003h:1.
const NO_KEY: u8 = 0;
const CLOSED: u8 = 1;
const OPEN: u8 = 2;

fn refused(abort: Abort) -> Failure {
    Failure::Refused(abort.code())
}

/// A node in its bootloader, without a program that may be started.
fn empty() -> Bench {
    let mut bench = Bench::with(world_of("bootloader-guarded", "--bitrate 1000"), 1_000_000, 1);
    bench.run(SECOND);
    assert_eq!(bench.read(DEVICE_TYPE).unwrap(), BOOT);
    bench
}

/// A node that runs a program signed by its owner.
fn running() -> Bench {
    let mut bench = empty();
    let image = signed_by_owner(&version_a());
    bench.machine().write(HEADER, &image.to_bytes()).unwrap();
    bench.power_cycle();
    assert_eq!(bench.identification_of_running(), image.header.code_crc());
    bench
}

fn state(bench: &mut Bench) -> u8 {
    bench.read(STATE).unwrap()[0]
}

fn challenge(bench: &mut Bench) -> [u8; 8] {
    bench.read(CHALLENGE).unwrap().try_into().unwrap()
}

/// The response of the holder of the key to the node's current challenge.
fn response(bench: &mut Bench) -> [u8; 8] {
    let key: AuthorisationKey = KEY.parse().unwrap();
    key.response(challenge(bench), bench.word(SERIAL_NUMBER))
}

fn answer(bench: &mut Bench, response: [u8; 8]) -> Result<(), Failure> {
    Client::new(bench).write(RESPONSE, &response)
}

#[test]
fn a_node_without_a_program_takes_one_from_the_holder_of_its_key_alone() {
    let mut bench = empty();
    let image = signed_by_owner(&version_a());
    assert_eq!(state(&mut bench), CLOSED);
    for command in [STOP, START, CLEAR] {
        assert_eq!(bench.command(command), Err(refused(Abort::DeviceState)));
    }
    assert_eq!(bench.download(&image.to_bytes()), Err(refused(Abort::DeviceState)));
    let right = response(&mut bench);
    let mut wrong = right;
    wrong[7] ^= 0x80;
    assert_eq!(answer(&mut bench, wrong), Err(refused(Abort::InvalidValue)));
    assert_eq!(bench.command(CLEAR), Err(refused(Abort::DeviceState)));
    answer(&mut bench, right).unwrap();
    assert_eq!(state(&mut bench), OPEN);
    bench.clear();
    bench.download(&image.to_bytes()).unwrap();
    bench.wait_for_flash();
    assert_eq!(bench.start(), image.header.code_crc());
    assert_eq!(state(&mut bench), CLOSED, "the program has a challenge of its own");
}

/// A write of every length to every entry of the bootloader: what has an effect on the program is refused, and nothing
/// else can be written but the heartbeat time.
#[test]
fn a_closed_bootloader_accepts_no_write_with_an_effect_on_the_program() {
    const ABSENT: u32 = 0x0602_0000;
    let mut bench = empty();
    let mut outcomes = Vec::new();
    for index in 0x1000..0x3000 {
        let object = Multiplexer { index, sub: 0 };
        if bench.read(object) == Err(Failure::Refused(ABSENT)) {
            continue;
        }
        for at in (0..9).map(|sub| Multiplexer { index, sub }) {
            let results = [1, 2, 4, 8].map(|len| Client::new(&mut bench).write(at, &vec![3; len]));
            if results.contains(&Ok(())) {
                outcomes.push((at.index, at.sub, "accepted"));
            } else if results.contains(&Err(refused(Abort::DeviceState))) {
                outcomes.push((at.index, at.sub, "refused"));
            }
        }
    }
    let expected = [(0x1017, 0, "accepted"), (0x1F50, 1, "refused"), (0x1F51, 1, "refused")];
    assert_eq!(outcomes, expected);
    assert_eq!(state(&mut bench), CLOSED);
}

#[test]
fn a_machine_is_stopped_by_the_holder_of_the_key_alone_and_its_bootloader_is_open_then() {
    let mut bench = running();
    assert_eq!(state(&mut bench), CLOSED);
    for command in [STOP, 2] {
        assert_eq!(bench.command(command), Err(refused(Abort::DeviceState)));
    }
    assert_eq!(Client::new(&mut bench).write(TRIAL_COMMAND, b"back"), Err(refused(Abort::DeviceState)));
    for sub in [3, 4] {
        let time = Multiplexer { index: 0x2002, sub };
        assert_eq!(Client::new(&mut bench).write(time, &[1, 0]), Err(refused(Abort::DeviceState)));
    }
    assert!(bench.is_running());
    let right = response(&mut bench);
    answer(&mut bench, right).unwrap();
    bench.stop();
    assert_eq!(state(&mut bench), OPEN);
    bench.clear();
    // A reset closes the node again: the program is unchanged, and starts.
    bench.tell(0, &[RESET, 1]);
    bench.identification_of_running();
    assert_eq!(state(&mut bench), CLOSED);
}

/// A recorded response does not open the node again: not at once, not after a reset, not after a power cycle.
#[test]
fn a_replayed_response_opens_nothing() {
    let mut bench = running();
    let mut heard = Vec::new();
    for round in 0..6 {
        assert!(!heard.contains(&challenge(&mut bench)), "the challenge of start {round} was there before");
        heard.push(challenge(&mut bench));
        let right = response(&mut bench);
        answer(&mut bench, right).unwrap();
        if round % 2 == 0 {
            bench.tell(0, &[RESET, 1]);
        } else {
            bench.power_cycle();
        }
        bench.identification_of_running();
        assert_eq!(answer(&mut bench, right), Err(refused(Abort::InvalidValue)));
        assert_eq!(bench.command(STOP), Err(refused(Abort::DeviceState)));
        assert_old_answers_open_no_bootloader(&mut bench, right);
    }
}

/// The holder of the key stops the node; old responses are refused in the bootloader. The node is then reset.
fn assert_old_answers_open_no_bootloader(bench: &mut Bench, old: [u8; 8]) {
    let right = response(bench);
    answer(bench, right).unwrap();
    bench.stop();
    for stale in [old, right] {
        assert_eq!(answer(bench, stale), Err(refused(Abort::InvalidValue)));
    }
    bench.tell(0, &[RESET, 1]);
    bench.identification_of_running();
}

#[test]
fn two_nodes_with_one_key_have_challenges_of_their_own() {
    let flags = "--bitrate 1000 --node 1:pressure --node 2:pressure";
    let mut bench = Bench::with(world_of("bootloader-guarded", flags), 1_000_000, 1);
    bench.run(SECOND);
    let (first, of_first) = (challenge(&mut bench), response(&mut bench));
    bench.node = 2;
    assert_ne!(challenge(&mut bench), first);
    assert_eq!(answer(&mut bench, of_first), Err(refused(Abort::InvalidValue)));
}

#[test]
fn nodectl_updates_with_the_key_and_not_without() {
    let world = fleet::share(world_of("bootloader-guarded", "--bitrate 1000"));
    let image = signed_by_owner(&version_a());
    let key = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/board/update/authorisation-key.hex");
    let refusal = fleet::try_update(&world, "1", &image, None, &[]).unwrap_err();
    assert!(refusal.contains("--authorisation-key"), "{refusal}");
    for image in [image, signed_by_owner(&version_b(0))] {
        let reports = fleet::try_update(&world, "1", &image, None, &["--authorisation-key", key]).unwrap();
        assert_eq!(reports[0]["new_identification"], image.header.code_crc());
        assert_eq!(reports[0]["on_trial"], false);
    }
}

#[test]
fn a_bootloader_without_a_key_needs_no_response() {
    let mut bench = Bench::running();
    assert_eq!((state(&mut bench), challenge(&mut bench)), (NO_KEY, [0; 8]));
    assert_eq!(answer(&mut bench, [0; 8]), Err(refused(Abort::DeviceState)));
    bench.stop();
    let absent = bench.read(STATE).unwrap_err();
    assert_eq!(absent, refused(Abort::NoObject));
}
