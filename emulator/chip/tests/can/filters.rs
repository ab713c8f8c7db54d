//! Acceptance filters against a model that tries every filter of every bank.

use canbus::{Controller, ExtendedId, Frame, Id, StandardId, Time};
use chip::can::DualCan;
use proptest::prelude::*;

use crate::rig::*;

#[derive(Clone, Copy, Debug)]
struct Bank {
    list: bool,
    wide: bool,
    fifo: u32,
    active: bool,
    registers: [u32; 2],
}

/// One filter, written out: a mask and a value for one of the forms of the identifier.
struct Filter {
    rank: (bool, bool),
    fifo: u32,
    number: u32,
    active: bool,
    wide: bool,
    value: u32,
    mask: u32,
}

fn filters(banks: &[Bank]) -> Vec<Filter> {
    let mut next = [0, 0];
    let mut filters = Vec::new();
    for bank in banks {
        let [one, two] = bank.registers;
        let halves = [one & 0xFFFF, one >> 16, two & 0xFFFF, two >> 16];
        let pairs: Vec<(u32, u32)> = match (bank.wide, bank.list) {
            (true, false) => vec![(one, two & !1)],
            (true, true) => vec![(one, !1), (two, !1)],
            (false, false) => vec![(halves[0], halves[1]), (halves[2], halves[3])],
            (false, true) => halves.iter().map(|half| (*half, 0xFFFF)).collect(),
        };
        for (value, mask) in pairs {
            let number = next[bank.fifo as usize];
            next[bank.fifo as usize] += 1;
            let rank = (!bank.wide, !bank.list);
            let Bank { fifo, active, wide, .. } = *bank;
            filters.push(Filter { rank, fifo, number, active, wide, value, mask });
        }
    }
    filters
}

/// STID[10:0], EXID[17:0], IDE, RTR, 0 and STID[10:0], RTR, IDE, EXID[17:15] (RM0390, filter bank organisation).
fn forms(frame: &Frame) -> (u32, u32) {
    let (stid, exid, ide) = match frame.id() {
        Id::Standard(id) => (u32::from(id.as_raw()), 0, 0),
        Id::Extended(id) => (id.as_raw() >> 18, id.as_raw() & 0x3_FFFF, 1),
    };
    let rtr = u32::from(frame.is_remote());
    (stid << 21 | exid << 3 | ide << 2 | rtr << 1, stid << 5 | rtr << 4 | ide << 3 | exid >> 15)
}

fn expect(banks: &[Bank], frame: &Frame) -> Option<(u32, u32)> {
    let (long, short) = forms(frame);
    let hit = |filter: &&Filter| {
        let form = if filter.wide { long } else { short };
        filter.active && form & filter.mask == filter.value & filter.mask
    };
    filters(banks).iter().filter(hit).min_by_key(|filter| filter.rank).map(|f| (f.fifo, f.number))
}

/// FIFO and filter match index of a frame that a chip receives.
fn observe(can: &mut DualCan, unit: u32, frame: &Frame) -> Option<(u32, u32)> {
    let now = Time::from_millis(1);
    let controller = if unit == 0 { &mut can.can1 } else { &mut can.can2 };
    controller.received(frame, now);
    (0..2).find_map(|fifo| {
        let base = unit * 0x400;
        let status = base + [RF0R, RF1R][fifo];
        (can.read(status, now)? & 3 > 0).then_some(())?;
        let index = can.read(base + RX[fifo] + 4, now)? >> 8 & 0xFF;
        assert_eq!(can.read(base + RX[fifo], now), Some(forms(frame).0));
        can.write(status, RFOM, now)?;
        can.advance(now + Time::from_micros(1));
        Some((fifo as u32, index))
    })
}

/// Both units on the bus; the banks from `split` on belong to CAN2.
fn set_up(banks: &[Bank], split: u32) -> DualCan {
    let mut can = DualCan::new(APB1);
    let bits = |test: fn(&Bank) -> bool| banks.iter().enumerate().map(|(n, b)| u32::from(test(b)) << n).sum();
    let mut write = |offset, value| can.write(offset, value, Time::ZERO).unwrap();
    write(FMR, split << 8 | 1);
    write(FM1R, bits(|bank| bank.list));
    write(FS1R, bits(|bank| bank.wide));
    write(FFA1R, bits(|bank| bank.fifo == 1));
    for (n, b) in banks.iter().enumerate() {
        write(bank(n as u32, 0), b.registers[0]);
        write(bank(n as u32, 1), b.registers[1]);
    }
    write(FA1R, bits(|bank| bank.active));
    write(FMR, split << 8);
    for unit in [0, 0x400] {
        write(unit + MCR, INRQ);
        write(unit + BTR, ONE_MEGABIT);
        write(unit + MCR, 0);
    }
    can.advance(Time::from_millis(1));
    can
}

/// Frames with few different identifiers, so that filters overlap.
fn frame() -> impl Strategy<Value = Frame> {
    let base = prop::sample::select(vec![0_u16, 1, 0x80, 0x181, 0x601, 0x7FF]);
    let extended = prop::sample::select(vec![0_u32, 0x0601_8000, 0x0604_0001, 0x1FFF_FFFF]);
    let id = prop_oneof![
        base.prop_map(|raw| Id::from(StandardId::new(raw).unwrap())),
        extended.prop_map(|raw| Id::from(ExtendedId::new(raw).unwrap())),
    ];
    (id, any::<bool>())
        .prop_map(|(id, remote)| if remote { Frame::remote(id, 0) } else { Frame::data(id, &[]) }.unwrap())
}

fn any_bank() -> impl Strategy<Value = Bank> {
    let wide = || {
        prop_oneof![frame().prop_map(|f| forms(&f).0), prop::sample::select(vec![0, u32::MAX, 0xFF00_0006])]
    };
    let half =
        || prop_oneof![frame().prop_map(|f| forms(&f).1), prop::sample::select(vec![0, 0xFFFF, 0xFF08])];
    let narrow = || (half(), half()).prop_map(|(low, high)| high << 16 | low);
    (
        any::<bool>(),
        any::<bool>(),
        0..2_u32,
        prop::bool::weighted(0.7),
        [wide(), wide()],
        [narrow(), narrow()],
    )
        .prop_map(|(list, wide, fifo, active, long, short)| Bank {
            list,
            wide,
            fifo,
            active,
            registers: if wide { long } else { short },
        })
}

proptest! {
    #![proptest_config(fixed())]

    #[test]
    fn filters_agree_with_the_model(
        banks in prop::collection::vec(any_bank(), 28),
        split in 0_u32..=28,
        used in 0_usize..=28,
        frames in prop::collection::vec(frame(), 20),
    ) {
        let mut banks = banks;
        banks.iter_mut().skip(used).for_each(|bank| bank.active = false);
        let mut can = set_up(&banks, split);
        let (master, slave) = banks.split_at(split as usize);
        for frame in frames {
            prop_assert_eq!(observe(&mut can, 0, &frame), expect(master, &frame));
            prop_assert_eq!(observe(&mut can, 1, &frame), expect(slave, &frame));
        }
    }
}

#[test]
fn numbers_count_inactive_banks_for_each_fifo() {
    let bank = |list, wide, fifo, active, registers| Bank { list, wide, fifo, active, registers };
    let id = 0x123 << 21;
    let banks = [
        bank(true, true, 0, false, [0, 0]),
        bank(false, false, 1, true, [0xFFFF_0000, 0xFFFF_0000]),
        bank(true, false, 0, true, [0, 0x123 << 5]),
        bank(false, true, 1, true, [id, !1]),
    ];
    let frame = standard(0x123, &[]);
    // Expected by hand: FIFO 0 has filters 0, 1 (inactive list of two) and 2..5; FIFO 1 has 0, 1 and then the 32-bit
    // mask.
    assert_eq!(observe(&mut set_up(&banks, 28), 0, &frame), Some((1, 2)));
    assert_eq!(observe(&mut set_up(&banks[..3], 28), 0, &frame), Some((0, 4)));
}

#[test]
fn filters_are_written_only_where_their_lock_allows() {
    let mut rig = Rig::new(1, 0);
    rig.write(0, FMR, 0x0E00);
    rig.write(0, FM1R, 1);
    assert_eq!(rig.read(0, FM1R), 0, "mode needs FINIT");
    rig.write(0, bank(3, 1), 7);
    rig.write(0, FA1R, 1 << 3);
    rig.write(0, bank(3, 1), 8);
    assert_eq!(rig.read(0, bank(3, 1)), 7, "an active bank is write protected");
    rig.write(0, FMR, 1);
    rig.write(0, bank(3, 1), 8);
    assert_eq!(rig.read(0, bank(3, 1)), 8);
    rig.write(0, FMR, u32::MAX);
    assert_eq!(rig.read(0, FMR), 0x2A1C_3F01);
}

#[test]
fn nothing_is_received_while_filters_are_initialised() {
    let mut rig = Rig::started(1, 1, 0);
    rig.write(0, FMR, 0x0E01);
    rig.hosts[0].send(standard(1, &[]), rig.now);
    rig.run(Time::from_millis(1));
    assert_eq!(rig.read(0, RF0R), 0);
}
