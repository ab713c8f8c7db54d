//! The choice of virtual devices (2305h) and the TPDOs that follow from it, through every kind of reset and store.

use canopen::Frame;
use host_tests::bench::{Bench, raw};
use host_tests::tables::table;
use node::Personality;
use profiles::lift::devices::Devices;
use storage::{Change, GroupNumber};

const START: u8 = 0x01;
const RESET_NODE: u8 = 0x81;
const RESET_COMMUNICATION: u8 = 0x82;
const NODE_IDS: [u8; 3] = [1, 16, 127];
const OFF: u32 = 1 << 31;
/// The load, and the positions 1 to 4.
const TPDOS: [u16; 5] = [0x1901, 0x1906, 0x1907, 0x1980, 0x1981];

fn lift(id: u8) -> Bench {
    let mut bench = Bench::booted_at(Personality::Lift, id);
    bench.sample(&raw(0.0, 298.15));
    bench
}

fn number(bench: &mut Bench, index: u16, sub: u8) -> u32 {
    let bytes = bench.read(index, sub).unwrap();
    bytes.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte))
}

/// Which of the TPDOs are valid.
fn valid(bench: &mut Bench) -> [bool; 5] {
    TPDOS.map(|index| number(bench, index, 1) & OFF == 0)
}

fn switch(bench: &mut Bench, index: u16, is_on: bool) {
    let cob_id = number(bench, index, 1) & !OFF;
    bench.write(index, 1, &(if is_on { cob_id } else { cob_id | OFF }).to_le_bytes()).unwrap();
}

fn save(bench: &mut Bench, sub: u8) {
    bench.write(0x1010, sub, b"save").unwrap();
}

fn reset(bench: &mut Bench, command: u8) {
    bench.nmt(command);
    while bench.take_action().is_some() {}
    bench.restart();
    bench.sample(&raw(0.0, 298.15));
}

/// The CAN-IDs of the frames that follow on NMT start.
fn sends(bench: &mut Bench) -> Vec<u16> {
    bench.sample(&raw(0.0, 298.15));
    bench.take();
    bench.nmt(START);
    bench.take().into_iter().map(|(id, _)| id).filter(|id| matches!(id, 0x188..=0x18F)).collect()
}

/// Each way in which the two groups can part.
#[test]
fn a_tpdo_is_valid_while_its_virtual_device_is_chosen() {
    type Way = fn(Bench) -> Bench;
    let ways: [(&str, Way); 5] = [
        ("reset communication before a save", |mut bench| {
            reset(&mut bench, RESET_COMMUNICATION);
            bench
        }),
        ("1010h:3 alone", |mut bench| {
            save(&mut bench, 3);
            bench.power_cycled()
        }),
        ("1010h:1, then 1011h:2", |mut bench| {
            save(&mut bench, 1);
            bench.write(0x1011, 2, b"load").unwrap();
            bench.power_cycled()
        }),
        ("1010h:2 before the choice, 1010h:3 after it", |mut bench| {
            bench.write(0x2305, 0, &[0]).unwrap();
            save(&mut bench, 2);
            bench.write(0x2305, 0, &[Devices::POSITION.0]).unwrap();
            save(&mut bench, 3);
            bench.power_cycled()
        }),
        ("1010h:1", |mut bench| {
            save(&mut bench, 1);
            bench.power_cycled()
        }),
    ];
    for id in NODE_IDS {
        for (name, way) in ways {
            let mut bench = lift(id);
            bench.write(0x2305, 0, &[Devices::POSITION.0]).unwrap();
            let mut bench = way(bench);
            assert_eq!(number(&mut bench, 0x1000, 0), 0x0600_01A1, "{name}");
            assert_eq!(valid(&mut bench), [false, true, false, false, false], "{name}");
            assert_eq!(sends(&mut bench), [0x18C], "{name}");
        }
    }
}

#[test]
fn a_tpdo_that_a_client_has_switched_off_stays_off() {
    for id in NODE_IDS {
        let mut bench = lift(id);
        bench.write(0x2305, 0, &[3]).unwrap();
        switch(&mut bench, 0x1901, false);
        let expected = [false, true, false, false, false];
        bench.write(0x2305, 0, &[3]).unwrap();
        assert_eq!(valid(&mut bench), expected, "2305h is written again");
        save(&mut bench, 1);
        reset(&mut bench, RESET_COMMUNICATION);
        assert_eq!(valid(&mut bench), expected, "reset communication");
        reset(&mut bench, RESET_NODE);
        assert_eq!(valid(&mut bench), expected, "reset node");
        let mut bench = bench.power_cycled();
        assert_eq!((valid(&mut bench), sends(&mut bench)), (expected, vec![0x18C]), "power cycle");
        assert_eq!(number(&mut bench, 0x2307, 0), 1);
        switch(&mut bench, 0x1901, true);
        assert_eq!(number(&mut bench, 0x2307, 0), 0);
        save(&mut bench, 1);
        assert_eq!(valid(&mut bench.power_cycled()), [true, true, false, false, false], "on again");
    }
}

/// 1010h:2 stores what a client has switched off, whatever is chosen later.
#[test]
fn a_tpdo_switched_off_is_stored_with_the_communication_parameters() {
    let mut bench = lift(16);
    bench.write(0x2305, 0, &[3]).unwrap();
    save(&mut bench, 3);
    switch(&mut bench, 0x1906, false);
    save(&mut bench, 2);
    assert_eq!(valid(&mut bench.power_cycled()), [true, false, false, false, false]);
}

#[test]
fn a_new_choice_switches_its_tpdos_on() {
    let mut bench = lift(16);
    bench.write(0x2305, 0, &[3]).unwrap();
    switch(&mut bench, 0x1901, false);
    bench.write(0x2305, 0, &[1]).unwrap();
    bench.write(0x2305, 0, &[3]).unwrap();
    assert_eq!(valid(&mut bench), [true, true, false, false, false], "a new choice");
    bench.write(0x2301, 2, &[2]).unwrap();
    assert_eq!(valid(&mut bench), [true, true, true, false, false], "a unit with a sensor");
    switch(&mut bench, 0x1907, false);
    bench.write(0x2301, 2, &[1]).unwrap();
    assert_eq!(valid(&mut bench), [true, true, false, false, false], "switched off by hand");
    bench.write(0x2301, 2, &[0]).unwrap();
    bench.write(0x2301, 2, &[1]).unwrap();
    assert_eq!(valid(&mut bench), [true, true, true, false, false], "a new unit");
}

/// Communication parameters of a firmware that had the COB-IDs only: what was off stays off, and follows the next choice.
#[test]
fn parameters_of_an_older_firmware_keep_switched_off_tpdos_off() {
    const LOAD_OFF: [u8; 9] = [0x01, 0x19, 1, 1, 4, 0x88, 0x01, 0x00, 0xC0];
    const POSITION_ON: [u8; 9] = [0x06, 0x19, 1, 1, 4, 0x8C, 0x01, 0x00, 0x40];
    for (chosen, expected) in [(3, [false, true]), (0, [false, false])] {
        let mut bench = lift(16);
        let communication = [LOAD_OFF, POSITION_ON].concat();
        let application = [0x05, 0x23, 0, 1, 1, chosen];
        let set = |group, value| Change::Set { group, version: 0x0301, value };
        let sets = [set(GroupNumber::Two, &communication[..]), set(GroupNumber::Three, &application)];
        bench.store.store().save(&sets).unwrap();
        bench.forget_saved();
        let mut bench = bench.power_cycled();
        assert_eq!(bench.read(0x1001, 0), Ok(vec![0]));
        assert_eq!(valid(&mut bench)[..2], expected, "2305h = {chosen}");
        save(&mut bench, 1);
        let mut bench = bench.power_cycled();
        assert_eq!(valid(&mut bench)[..2], expected, "stored again, 2305h = {chosen}");
        bench.write(0x2305, 0, &[3]).unwrap();
        assert_eq!(valid(&mut bench)[..2], [chosen == 0, true]);
    }
}

/// Writes all parameters of one node to another in ascending order, as a generic tool downloads a DCF; without the
/// commands, which CiA 306 marks in the data sheet.
fn download(from: &mut Bench, to: &mut Bench) {
    const COMMANDS: [u16; 2] = [0x6382, 0x6486];
    let rows = table(Personality::Lift).into_iter().filter(|row| row.access == "rw");
    for row in rows.filter(|row| row.index != 0x2000 && !COMMANDS.contains(&row.index)) {
        if matches!(row.index, 0x1003 | 0x1010 | 0x1011 | 0x1F51 | 0x2003 | 0x2204 | 0x2203 | 0x2F00 | 0x6011)
        {
            continue;
        }
        let value = from.read(row.index, row.sub).unwrap();
        let is_new = to.read(row.index, row.sub).unwrap() != value;
        // A few values cannot be written in every state, not even with the value that they have.
        if let Err(abort) = to.write(row.index, row.sub, &value) {
            assert!(!is_new, "{row:X?}: {abort:X}h");
        }
    }
}

fn parameters(bench: &mut Bench) -> Vec<(u16, u8, Vec<u8>)> {
    let rows = table(Personality::Lift).into_iter().filter(|row| row.access == "rw");
    let rows = rows.filter(|row| !matches!(row.index, 0x1003 | 0x2000 | 0x2203 | 0x2F00 | 0x6382 | 0x6486));
    rows.filter_map(|row| Some((row.index, row.sub, bench.read(row.index, row.sub).ok()?))).collect()
}

#[test]
fn a_download_in_ascending_order_gives_the_same_node() {
    const WORD: [u8; 6] = [5, 4, 1, 0, 1, 0];
    let setups: [fn(&mut Bench); 4] = [
        |bench| bench.write(0x2305, 0, &[3]).unwrap(),
        |bench| {
            bench.write(0x2301, 2, &[2]).unwrap();
            bench.write(0x2305, 0, &[3]).unwrap();
            switch(bench, 0x1901, false);
            switch(bench, 0x1907, false);
        },
        |bench| {
            bench.write(0x2305, 0, &[15]).unwrap();
            bench.write(0x6100, 1, &WORD).unwrap();
            (3..=4).for_each(|sub| bench.write(0x2320, sub, &[sub, 1, 1, 1, 1, 1]).unwrap());
        },
        |bench| {
            bench.write(0x2305, 0, &[4]).unwrap();
            bench.write(0x6100, 1, &WORD).unwrap();
            (1..=2).for_each(|sub| bench.write(0x2320, sub, &[sub, 9, 9, 9, 9, 9]).unwrap());
        },
    ];
    for id in NODE_IDS {
        for (number, setup) in setups.iter().enumerate() {
            let (mut from, mut to) = (lift(id), lift(id));
            setup(&mut from);
            download(&mut from, &mut to);
            assert!(parameters(&mut to) == parameters(&mut from), "setup {number}");
            for bench in [&mut from, &mut to] {
                save(bench, 1);
            }
            let (mut from, mut to) = (from.power_cycled(), to.power_cycled());
            assert!(parameters(&mut to) == parameters(&mut from), "setup {number}, after a power cycle");
        }
    }
}

/// 6100h:1 = 0 after 2320h, in any order: no call has an empty word.
#[test]
fn an_input_of_zero_makes_no_empty_words() {
    for id in NODE_IDS {
        let mut bench = lift(id);
        bench.write(0x2305, 0, &[Devices::INPUT_PANEL.0]).unwrap();
        let words = [[1, 1, 1, 1, 1, 0], [1, 1, 1, 1, 1, 1]];
        (1..).zip(words).for_each(|(sub, word)| bench.write(0x2320, sub, &word).unwrap());
        bench.write(0x6100, 1, &[0; 6]).unwrap();
        assert_eq!([1, 2].map(|sub| bench.read(0x2320, sub).unwrap()), words.map(|word| word.to_vec()));
        bench.write(0x6100, 2, &[2, 1, 1, 4, 1, 0]).unwrap();
        bench.write(0x6100, 2, &[0; 6]).unwrap();
        bench.nmt(START);
        for pressed in [true, false] {
            bench.buttons = [pressed; 2];
            (0..50).for_each(|_| bench.sample(&raw(0.0, 298.15)));
        }
        let calls: Vec<_> =
            bench.take().into_iter().filter(|(frame, _)| *frame == 0x480 + u16::from(id)).collect();
        assert!(calls.iter().all(|(_, data)| words.iter().any(|word| word[..] == data[..])), "{calls:X?}");
        assert_eq!(calls.len(), 3);
    }
}

/// A node of CiA 301 whose RPDO 4 has a CAN-ID at which lift devices expect multiplexed PDOs.
#[test]
fn a_pdo_that_cannot_be_multiplexed_is_ignored() {
    for id in NODE_IDS {
        let mut bench = lift(id);
        bench.write(0x2305, 0, &[3]).unwrap();
        bench.nmt(START);
        bench.take();
        let frames: [&[u8]; 5] = [
            &[1, 2, 3, 4],
            &[],
            &[0x80 | id, 0x12, 0x34, 0x56, 0, 0, 0, 0],
            &[0x80, 0x12, 0x34, 0x56, 0, 0, 0, 0],
            &[0; 8],
        ];
        for data in frames {
            bench.receive(&Frame::new(0x514, data).unwrap());
            let emcys = bench.take().into_iter().filter(|(frame, _)| *frame == 0x80 + u16::from(id));
            assert_eq!(emcys.collect::<Vec<_>>(), [], "{data:X?}");
            assert_eq!(bench.read(0x1001, 0), Ok(vec![0]));
        }
    }
}

#[test]
fn a_multiplexed_pdo_that_this_node_rejects_is_reported() {
    for id in NODE_IDS {
        for (producer, address, data, is_reported) in [
            (20, 0x80 | id, [0x82, 0x63, 2, 0, 0, 0, 0], true),
            (20, 0x80, [0x82, 0x63, 2, 0, 0, 0, 0], false),
            (3, 0x80 | id, [0x82, 0x63, 2, 0, 0, 0, 0], true),
            (3, 0x80 | id, [0x12, 0x34, 2, 0, 0, 0, 0], true),
            (20, 0x80 | id, [0x12, 0x34, 2, 0, 0, 0, 0], false),
        ] {
            let mut bench = lift(id);
            bench.write(0x2305, 0, &[3]).unwrap();
            bench.nmt(START);
            bench.take();
            let frame = [&[address][..], &data].concat();
            bench.receive(&Frame::new(0x500 + producer, &frame).unwrap());
            let emcys = bench.take().into_iter().filter(|(frame, _)| *frame == 0x80 + u16::from(id));
            let codes: Vec<_> = emcys.map(|(_, data)| u16::from_le_bytes([data[0], data[1]])).collect();
            let expected = if is_reported { vec![0x8230] } else { vec![] };
            assert_eq!(codes, expected, "unit 2 has no sensor: {frame:X?}");
        }
    }
}

/// The number, not the rank among the RPDOs of the dictionary.
#[test]
fn an_emcy_has_the_number_of_the_rpdo() {
    for id in NODE_IDS {
        let mut bench = lift(id);
        bench.nmt(START);
        bench.take();
        for (can_id, number) in [(0x400, 257_u16), (0x501, 2), (0x507, 8)] {
            bench.receive(&Frame::new(can_id, &[1]).unwrap());
            let emcys = bench.take().into_iter().filter(|(frame, _)| *frame == 0x80 + u16::from(id));
            let details: Vec<_> = emcys.map(|(_, data)| (data[0], data[1], [data[3], data[4]])).collect();
            assert_eq!(details, [(0x10, 0x82, number.to_le_bytes())], "{can_id:X}h");
        }
    }
}
