//! The mapping procedure and its interlocks, 1800h and 1A00h.

use crate::bench::{Bench, repeatable};
use proptest::prelude::*;

const INVALID: u32 = 0x8000_0185;
const VALID: u32 = 0x0000_0185;
const NOT_NOW: Result<(), u32> = Err(0x0601_0000);
const BAD_VALUE: Result<(), u32> = Err(0x0609_0030);

fn disabled() -> Bench {
    let mut bench = Bench::booted();
    bench.write32(0x1800, 1, INVALID).unwrap();
    bench.write(0x1A00, 0, &[0]).unwrap();
    bench
}

#[test]
fn five_steps_make_a_new_mapping() {
    let mut bench = Bench::operational();
    bench.write32(0x1800, 1, INVALID).unwrap();
    bench.write(0x1A00, 0, &[0]).unwrap();
    bench.write32(0x1A00, 1, 0x6000_0210).unwrap();
    bench.write32(0x1A00, 2, 0x6000_0120).unwrap();
    bench.write(0x1A00, 0, &[2]).unwrap();
    bench.set_value(1, &[1, 2, 3, 4]);
    bench.set_value(2, &[5, 6]);
    bench.take();
    bench.write32(0x1800, 1, VALID).unwrap();
    assert_eq!(bench.sent(), [(0x185, vec![5, 6, 1, 2, 3, 4])]);
}

#[test]
fn a_valid_pdo_keeps_its_mapping_identifier_and_inhibit_time() {
    let mut bench = Bench::booted();
    assert_eq!(bench.write(0x1A00, 0, &[0]), NOT_NOW);
    assert_eq!(bench.write32(0x1A00, 1, 0), NOT_NOW);
    assert_eq!(bench.write32(0x1800, 1, 0x186), BAD_VALUE);
    assert_eq!(bench.write(0x1800, 3, &[1, 0]), BAD_VALUE);
    assert_eq!(bench.write32(0x1800, 1, VALID), Ok(()));
    assert_eq!(bench.write32(0x1800, 1, 0x4000_0185), Ok(()));
}

#[test]
fn entries_change_only_while_the_count_is_0() {
    let mut bench = Bench::booted();
    bench.write32(0x1800, 1, INVALID).unwrap();
    assert_eq!(bench.write32(0x1A00, 2, 0x6000_0120), NOT_NOW);
    bench.write(0x1A00, 0, &[0]).unwrap();
    assert_eq!(bench.write32(0x1A00, 2, 0x6000_0120), Ok(()));
    assert_eq!(bench.write32(0x1A00, 2, 0), Ok(()));
}

#[test]
fn only_existing_mappable_objects_of_the_right_length_can_be_mapped() {
    let mut bench = disabled();
    assert_eq!(bench.write32(0x1A00, 1, 0x2000_0020), Err(0x0602_0000));
    assert_eq!(bench.write32(0x1A00, 1, 0x6000_0920), Err(0x0602_0000));
    assert_eq!(bench.write32(0x1A00, 1, 0x1017_0010), Err(0x0604_0041));
    assert_eq!(bench.write32(0x1A00, 1, 0x6000_0110), Err(0x0604_0041));
    assert_eq!(bench.write32(0x1A00, 1, 0x6000_0100), Err(0x0604_0041));
    // Dummy entries are allowed in RPDOs only.
    assert_eq!(bench.write32(0x1A00, 1, 0x0005_0008), Err(0x0602_0000));
}

#[test]
fn a_mapping_is_switched_on_as_a_whole() {
    let mut bench = disabled();
    for (sub, entry) in [(1, 0x6000_0120), (2, 0x6000_0320), (3, 0x6000_0210)] {
        bench.write32(0x1A00, sub, entry).unwrap();
    }
    bench.write32(0x1A00, 4, 0).unwrap();
    assert_eq!(bench.write(0x1A00, 0, &[3]), Err(0x0604_0042));
    assert_eq!(bench.write(0x1A00, 0, &[4]), Err(0x0604_0042));
    assert_eq!(bench.write(0x1A00, 0, &[200]), Err(0x0609_0031));
    assert_eq!(bench.write(0x1A00, 0, &[2]), Ok(()));
    bench.write(0x1A00, 0, &[0]).unwrap();
    bench.write32(0x1A00, 2, 0).unwrap();
    assert_eq!(bench.write(0x1A00, 0, &[2]), Err(0x0602_0000));
}

#[test]
fn an_empty_pdo_or_one_with_a_restricted_identifier_cannot_exist() {
    let mut bench = disabled();
    assert_eq!(bench.write32(0x1800, 1, VALID), BAD_VALUE);
    bench.write(0x1A00, 0, &[1]).unwrap();
    for refused in [0x000, 0x180, 0x601, 0x705, 0x2000_0185, 0x800 | 0x185] {
        assert_eq!(bench.write32(0x1800, 1, refused), BAD_VALUE);
    }
    assert_eq!(bench.write32(0x1800, 1, 0x1A5), Ok(()));
}

#[test]
fn transmission_types_and_remote_frames_must_agree() {
    let mut bench = Bench::booted();
    for reserved in 241..=251 {
        assert_eq!(bench.write(0x1800, 2, &[reserved]), BAD_VALUE);
    }
    for allowed in [0, 1, 240, 252, 253, 254, 255] {
        assert_eq!(bench.write(0x1800, 2, &[allowed]), Ok(()));
    }
    bench.write32(0x1800, 1, 0x4000_0185).unwrap();
    assert_eq!(bench.write(0x1800, 2, &[252]), BAD_VALUE);
    bench.write32(0x1800, 1, 0xC000_0185).unwrap();
    assert_eq!(bench.write(0x1800, 2, &[253]), Ok(()));
    assert_eq!(bench.write32(0x1800, 1, 0x4000_0185), BAD_VALUE);
}

/// A write to an object of the TPDO, with values that are often valid.
fn writes() -> impl Strategy<Value = (u16, u8, Vec<u8>)> {
    let word = |values: Vec<u32>| prop::sample::select(values).prop_map(|v| v.to_le_bytes().to_vec());
    let cob_ids = vec![INVALID, VALID, 0x186, 0x8000_0186, 0x4000_0185, 0x601, u32::MAX];
    let entries = vec![0, 0x6000_0120, 0x6000_0210, 0x6000_0320, 0x1000_0020, 0x6000_0108];
    prop_oneof![
        word(cob_ids).prop_map(|v| (0x1800, 1, v)),
        any::<u8>().prop_map(|v| (0x1800, 2, vec![v])),
        (0..6_u8).prop_map(|v| (0x1A00, 0, vec![v])),
        (1..=4_u8, word(entries)).prop_map(|(sub, v)| (0x1A00, sub, v)),
    ]
}

proptest! {
    #![proptest_config(repeatable())]

    /// After any writes in any order, a TPDO that exists has a mapping of one to eight bytes that agrees with the
    /// entries read back, and an identifier that is allowed for PDOs.
    #[test]
    fn no_sequence_of_writes_makes_an_invalid_pdo(sequence in prop::collection::vec(writes(), 1..40)) {
        let mut bench = Bench::operational();
        for (index, sub, bytes) in sequence {
            let before = bench.read(index, sub).unwrap();
            match bench.write(index, sub, &bytes) {
                Ok(()) => prop_assert_eq!(bench.read(index, sub).unwrap(), bytes),
                Err(_) => prop_assert_eq!(bench.read(index, sub).unwrap(), before),
            }
            check(&mut bench)?;
        }
    }
}

fn number(bench: &mut Bench, index: u16, sub: u8) -> u32 {
    bench.read(index, sub).unwrap().iter().rev().fold(0, |n, &byte| n << 8 | u32::from(byte))
}

fn check(bench: &mut Bench) -> Result<(), TestCaseError> {
    let cob_id = number(bench, 0x1800, 1);
    let count = u8::try_from(number(bench, 0x1A00, 0)).unwrap();
    let bits: u32 = (1..=count).map(|sub| number(bench, 0x1A00, sub) & 0xFF).sum();
    prop_assert!(bits <= 64);
    bench.take();
    bench.nmt(0x80);
    bench.nmt(1);
    bench.run(canopen::Duration::from_millis(200));
    for frame in bench.take() {
        if frame.id() < 0x700 {
            prop_assert_eq!((u32::from(frame.id()), frame.len() as u32 * 8), (cob_id & 0xBFFF_FFFF, bits));
        }
    }
    if cob_id & 1 << 31 == 0 {
        prop_assert!(bits > 0 && [0x185, 0x186].contains(&(cob_id & 0x7FF)));
    }
    Ok(())
}
