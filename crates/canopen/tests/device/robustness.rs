//! Random frames at any time.

use crate::bench::{Bench, DICTIONARY, ID, repeatable};
use canopen::nmt::State;
use canopen::{Duration, Frame};
use proptest::prelude::*;

/// Identifiers, mostly those that mean something to the node.
fn identifier() -> impl Strategy<Value = u16> {
    prop_oneof![
        4 => Just(0x600 + u16::from(ID)),
        1 => Just(0x000),
        1 => Just(0x080),
        1 => Just(0x180 + u16::from(ID)),
        1 => 0..=0x7FF_u16,
    ]
}

/// SDO requests, mostly for an object of the dictionary.
fn payload() -> impl Strategy<Value = Vec<u8>> {
    let entry =
        prop::sample::select(crate::bench::rows().map(|(row, _)| (row.index, row.sub)).collect::<Vec<_>>());
    let request = (any::<u8>(), entry, any::<[u8; 4]>()).prop_map(|(command, (index, sub), data)| {
        let [low, high] = index.to_le_bytes();
        vec![command, low, high, sub, data[0], data[1], data[2], data[3]]
    });
    let nmt = (prop::sample::select(vec![1, 2, 0x80, 0x81, 0x82, 7]), 0..8_u8).prop_map(|(c, n)| vec![c, n]);
    prop_oneof![4 => request, 1 => nmt, 1 => prop::collection::vec(any::<u8>(), 0..=8)]
}

fn frame() -> impl Strategy<Value = Frame> {
    (identifier(), payload(), prop::bool::weighted(0.1)).prop_map(|(id, data, remote)| {
        let frame = if remote { Frame::remote(id, data.len() as u8) } else { Frame::new(id, &data) };
        frame.unwrap()
    })
}

/// Whether CiA 301 lets a node send the frame in a state. EMCY and PDOs have the CAN-IDs of the dictionary.
fn is_allowed(state: State, frame: &Frame, bench: &Bench) -> bool {
    let emcy = DICTIONARY.field(0x1014, 0).u32(bench.device.image());
    match frame.id() {
        0x705 => true,
        0x585 => state.has_services(),
        id if u32::from(id) == emcy => state.has_services(),
        _ => state.has_pdos(),
    }
}

proptest! {
    #![proptest_config(repeatable())]

    #[test]
    fn no_frame_in_any_state_is_answered_with_a_forbidden_one(
        frames in prop::collection::vec((frame(), 0..3_000_u64), 1..60),
        room in prop_oneof![Just(usize::MAX), 0..20_usize],
    ) {
        let mut bench = Bench::booted();
        bench.out.room = room;
        for (frame, pause) in frames {
            let before = bench.device.state();
            bench.receive(frame);
            let after = bench.device.state();
            if after == State::Initialising && pause % 2 == 0 {
                bench.start();
            }
            bench.run(Duration(pause * 1_000));
            for sent in bench.take() {
                let states = [before, after, bench.device.state()];
                prop_assert!(
                    states.into_iter().any(|state| is_allowed(state, &sent, &bench)),
                    "{sent:?} in {before:?} to {after:?}"
                );
            }
        }
    }

    /// The two polls together never ask to be called again at once, because the processor would spin.
    #[test]
    fn the_next_deadline_is_later_than_now(frames in prop::collection::vec(frame(), 1..60), room in 0..10_usize) {
        let mut bench = Bench::booted();
        bench.out.room = room;
        for frame in frames {
            bench.receive(frame);
            let due = bench.poll();
            prop_assert!(due > bench.now, "{due:?} at {:?}", bench.now);
            bench.now = bench.now + Duration(7);
        }
    }
}
