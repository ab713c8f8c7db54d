//! The records of updates on the real images: the log of events, the count of erases, and the budget of clears.

use canbus::Time;
use canopen::sdo::Multiplexer;
use host_tests::sdo::{Client, Failure};
use update::{Cause, Clears, Log, Outcome, Refusal, Status};

use super::bench::{Bench, CLEAR, DATA, version_a, version_b};
use crate::support::SECOND;

const LOG: Multiplexer = Multiplexer { index: 0x2006, sub: 0 };
const ERASES: Multiplexer = Multiplexer { index: 0x2004, sub: 6 };
const CLEARS_ALLOWED: Multiplexer = Multiplexer { index: 0x2004, sub: 7 };
const COMMAND: Multiplexer = Multiplexer { index: 0x2002, sub: 2 };
const DEVICE_STATE: u32 = 0x0800_0022;

/// The outcomes of the log, the oldest first.
fn outcomes(bench: &mut Bench) -> Vec<Outcome> {
    let log = Log::from_bytes(&bench.read(LOG).unwrap());
    let mut outcomes: Vec<_> = log.events().map(|event| event.outcome).collect();
    outcomes.reverse();
    outcomes
}

fn erases(bench: &mut Bench) -> u16 {
    u16::from_le_bytes(bench.read(ERASES).unwrap().try_into().unwrap())
}

#[test]
fn the_log_names_each_update_and_survives_updates_and_losses_of_power() {
    let mut bench = Bench::running();
    assert_eq!((outcomes(&mut bench), erases(&mut bench)), (vec![], 0), "a new board");
    // Refused: an image with another signature.
    let mut image = version_b(0).to_bytes();
    image[600] ^= 1;
    bench.stop();
    bench.clear();
    let _ = bench.download(&image);
    let refused = bench.settled();
    assert_ne!(refused, Status::GOOD);
    bench.start();
    bench.run(SECOND);
    let mut expected = vec![Outcome::Refused(refused)];
    assert_eq!((outcomes(&mut bench), erases(&mut bench)), (expected.clone(), 1));
    // On trial, and confirmed.
    bench.update(&version_b(0));
    bench.run(SECOND);
    expected.push(Outcome::OnTrial);
    assert_eq!((outcomes(&mut bench), erases(&mut bench)), (expected.clone(), 4));
    bench.confirm();
    bench.run(SECOND);
    expected.push(Outcome::Confirmed(Cause::Command));
    assert_eq!(outcomes(&mut bench), expected);
    bench.power_cycle();
    bench.run(SECOND);
    assert_eq!(outcomes(&mut bench), expected);
    // Taken back.
    bench.update(&version_a());
    bench.run(SECOND);
    Client::new(&mut bench).write(COMMAND, b"back").unwrap();
    assert_eq!(bench.identification_of_running(), version_b(0).header.code_crc());
    bench.run(SECOND);
    expected.extend([Outcome::OnTrial, Outcome::Withdrawn(Cause::Command)]);
    assert_eq!((outcomes(&mut bench), erases(&mut bench)), (expected.clone(), 8));
    let log = Log::from_bytes(&bench.read(LOG).unwrap());
    let newest = log.events().next().unwrap();
    assert_eq!(newest.version, version_a().header.description().version);
    bench.power_cycle();
    bench.run(SECOND);
    assert_eq!((outcomes(&mut bench), erases(&mut bench)), (expected, 8));
}

/// A program on the bus that clears and begins downloads, with resets between them.
#[test]
fn a_program_that_clears_in_a_loop_uses_its_budget_up_and_an_update_after_a_loss_of_power_goes_through() {
    let mut bench = Bench::running();
    bench.stop();
    for round in 0..Clears::BURST {
        bench.clear();
        Client::new(&mut bench).write(DATA, &[0; 7]).unwrap_err();
        if round.is_multiple_of(8) {
            bench.tell(0x000, &[129, 1]);
            bench.run(Time::from_millis(500));
            if bench.is_running() {
                bench.stop();
            }
        }
    }
    let refused = bench.command(CLEAR);
    assert_eq!(refused, Err(Failure::Refused(DEVICE_STATE)));
    assert_eq!(bench.status(), Status::refused(Refusal::Worn));
    bench.start();
    bench.run(SECOND);
    assert_eq!(bench.read(CLEARS_ALLOWED), Ok(vec![0]));
    assert_eq!(erases(&mut bench), u16::from(Clears::BURST));
    bench.power_cycle();
    bench.run(SECOND);
    assert_eq!(bench.read(CLEARS_ALLOWED), Ok(vec![Clears::BURST]));
    bench.update(&version_b(0));
}

/// A reset in the middle of a copy would erase a sector once more.
#[test]
fn resets_in_the_middle_of_a_copy_wait_until_it_is_done() {
    let mut bench = Bench::running();
    bench.stop();
    bench.clear();
    bench.download(&version_b(0).to_bytes()).unwrap();
    for _ in 0..30 {
        bench.tell(0x000, &[129, 1]);
    }
    bench.run(SECOND * 8);
    assert_eq!(bench.identification_of_running(), version_b(0).header.code_crc());
    bench.run(SECOND);
    assert_eq!(erases(&mut bench), 3);
}
