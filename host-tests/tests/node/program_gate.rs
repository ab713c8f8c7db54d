//! A node whose owner has set a key: what changes the program, or what is confirmed, needs the answer to the challenge.

use canopen::Frame;
use canopen::dictionary::Entry;
use canopen::sdo::Multiplexer;
use host_tests::bench::{Bench, ID, raw};
use host_tests::sdo::{Client, Failure};
use node::{Instant, Personality, Verdict};
use update::{Authorisation, Cause, Pair, Trial, response};

const KEY: [u8; 32] = [0x5A; 32];
const SERIAL: u32 = 0x1234_5678;
/// Room for the values of any personality.
const IMAGE: &[u8] = &[0; 16 * 1024];
const DEVICE_STATE: Failure = Failure::Refused(0x0800_0022);

/// The entries whose writing has an effect on the program, and the effect. Every other writable entry has none.
const EFFECTS: [(u16, u8, &str); 7] = [
    (0x1011, 1, "the times of 2002h become the defaults"),
    (0x1011, 3, "the times of 2002h become the defaults"),
    (0x1F51, 1, "the program stops, and the bootloader runs"),
    (0x2000, 0, "the stored times of 2002h are those of another personality"),
    (0x2002, 2, "the program is confirmed or rolled back"),
    (0x2002, 3, "the time after which it is rolled back"),
    (0x2002, 4, "the time after which it is confirmed"),
];

/// A measuring node with a key and a program on trial, after ten seconds without a frame for it.
fn guarded(personality: Personality) -> Bench {
    let mut bench = Bench::booted_as(personality);
    let pair = Pair::new(&KEY, &[1], SERIAL);
    bench.protocol.set_authorisation(Authorisation::new(Some(pair), false));
    bench.protocol.set_trial(Trial::Open);
    bench.restart();
    bench.sample(&raw(0.0, 298.15));
    bench
}

fn open(bench: &mut Bench) {
    let challenge = bench.read(0x2003, 2).unwrap().try_into().unwrap();
    bench.write(0x2003, 3, &response(&KEY, challenge, SERIAL)).unwrap();
}

fn at(entry: &Entry) -> Multiplexer {
    Multiplexer { index: entry.index(), sub: entry.sub() }
}

fn has_effect(at: Multiplexer) -> bool {
    EFFECTS.iter().any(|(index, sub, _)| (*index, *sub) == (at.index, at.sub))
}

/// Values that a stranger tries: the commands, zeros, ones, and all bits.
fn values(entry: &Entry) -> Vec<Vec<u8>> {
    let len = entry.field().get(IMAGE).len().clamp(1, 8);
    let words: [&[u8]; 4] = [b"conf", b"back", b"save", b"load"];
    let words = words.iter().filter(|word| word.len() == len).map(|word| word.to_vec());
    let one = [vec![1], vec![0; len - 1]].concat();
    words.chain([vec![0; len], one, vec![0xFF; len]]).collect()
}

fn verdict(bench: &mut Bench, seconds: u64) -> Option<Verdict> {
    bench.protocol.judge(Instant(seconds * 1_000_000), true);
    bench.protocol.verdict()
}

/// Every other entry is written as if there were no key.
#[test]
fn every_entry_with_an_effect_on_the_program_is_refused_until_the_challenge_is_answered() {
    for personality in Personality::ALL {
        let (mut closed, mut free) = (guarded(personality), guarded(personality));
        free.protocol.set_authorisation(Authorisation::default());
        let mut effects = EFFECTS.to_vec();
        for entry in personality.dictionary().entries().filter(|entry| entry.index() != 0x2003) {
            let at = at(&entry);
            let (index, sub) = (at.index, at.sub);
            for value in values(&entry) {
                let result = Client::new(&mut closed).write(at, &value);
                if has_effect(at) {
                    assert_eq!(result, Err(DEVICE_STATE), "{index:04X}h:{sub} = {value:02X?}");
                } else {
                    let without_key = Client::new(&mut free).write(at, &value);
                    assert_eq!(result, without_key, "{index:04X}h:{sub} = {value:02X?}");
                }
            }
            effects.retain(|(index, sub, _)| (*index, *sub) != (at.index, at.sub));
        }
        assert_eq!(effects, [], "{personality:?}: no such entry");
    }
}

#[test]
fn the_holder_of_the_key_may_write_them() {
    for personality in Personality::ALL {
        for (index, sub, effect) in EFFECTS.into_iter().filter(|(index, ..)| *index != 0x1F51) {
            let mut bench = guarded(personality);
            open(&mut bench);
            // A program on trial stores and restores nothing.
            if (index, sub) != (0x2002, 2) {
                bench.protocol.end_trial();
            }
            let value: &[u8] = match (index, sub) {
                (0x1011, _) => b"load",
                (0x2000, _) => &[2],
                (0x2002, 2) => b"conf",
                _ => &[9, 0],
            };
            assert_eq!(bench.write(index, sub, value), Ok(()), "{index:04X}h:{sub}, {effect}");
        }
    }
}

/// A stranger writes every entry, sends NMT commands and heartbeats: the trial ends as without these frames.
#[test]
fn a_stranger_neither_confirms_nor_rolls_back_a_program() {
    for personality in Personality::ALL {
        let mut bench = guarded(personality);
        bench.nmt(1);
        let _ = bench.write(0x1016, 1, &0x0002_03E8_u32.to_le_bytes());
        bench.receive(&Frame::new(0x702, &[5]).unwrap());
        for entry in personality.dictionary().entries() {
            for value in values(&entry) {
                let _ = Client::new(&mut bench).write(at(&entry), &value);
            }
        }
        assert_eq!(bench.read(0x2002, 1), Ok(vec![1]), "node {ID}, {personality:?}: it is on trial");
        assert_eq!(verdict(&mut bench, 599), None, "{personality:?}");
        assert_eq!(verdict(&mut bench, 600), Some(Verdict::TakeBack(Cause::Time)), "{personality:?}");
    }
}

#[test]
fn a_program_is_confirmed_after_ten_seconds_when_the_holder_of_the_key_has_spoken() {
    let mut bench = guarded(Personality::Pressure);
    bench.read(0x1000, 0).unwrap();
    assert_eq!(verdict(&mut bench, 20), None);
    open(&mut bench);
    assert_eq!(verdict(&mut bench, 20), None, "the challenge was not answered before");
    bench.read(0x1000, 0).unwrap();
    assert_eq!(verdict(&mut bench, 20), Some(Verdict::Confirm(Cause::Master)));
}
