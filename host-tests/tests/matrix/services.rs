//! Services of every node, in every personality.

use canopen::Duration;
use canopen::dictionary::Mapping;
use canopen::lss::Request;
use host_tests::matrix::Case;
use node::Personality;

use crate::bus::{Bus, Node};

const HEARTBEAT: (u16, u8, u8) = (0x1017, 0, 2);
const RESET_NODE: u8 = 129;
const RESET_COMMUNICATION: u8 = 130;

fn word(text: [u8; 4]) -> u32 {
    u32::from_le_bytes(text)
}

/// A saved value outlives both resets; after a restore, the default does.
pub(crate) fn save_and_restore<B: Bus>(node: &mut Node<'_, B>) {
    let (index, sub, size) = HEARTBEAT;
    let default = node.read(index, sub);
    node.write(index, sub, size, 700);
    node.write(0x1010, 1, 4, word(*b"save"));
    node.write(index, sub, size, 600);
    for command in [RESET_NODE, RESET_COMMUNICATION] {
        node.restart(command);
        assert_eq!(node.read(index, sub), 700);
    }
    node.write(0x1011, 1, 4, word(*b"load"));
    assert_eq!(node.read(index, sub), 700, "a restore acts with the next reset");
    node.restart(RESET_NODE);
    assert_eq!(node.read(index, sub), default);
}

/// A node-ID that is set by LSS is that of the next start.
pub(crate) fn a_node_id_by_lss<B: Bus>(node: &mut Node<'_, B>) {
    let other = if node.id == 127 { 2 } else { node.id + 1 };
    node.lss(&Request::SwitchGlobal { configuration: true });
    node.lss(&Request::NodeId(other));
    node.lss(&Request::Store);
    node.lss(&Request::SwitchGlobal { configuration: false });
    node.bus.send(0, &[RESET_COMMUNICATION, node.id]);
    node.id = other;
    let boot_up = 0x700 + u16::from(other);
    while node.await_id(boot_up).data() != [0] {}
    assert_eq!(node.read(0x1018, 0), 4);
}

/// Each command leads to its state.
pub(crate) fn states<B: Bus>(node: &mut Node<'_, B>) {
    node.write(0x1017, 0, 2, 100);
    for (command, state) in [(1, 5), (128, 127), (2, 4), (1, 5), (2, 4), (128, 127)] {
        node.nmt(command);
        assert_eq!(node.state(), state);
    }
}

/// Heartbeats have the time of 1017h, and none come with 0.
pub(crate) fn heartbeats<B: Bus>(node: &mut Node<'_, B>) {
    let id = 0x700 + u16::from(node.id);
    for period in [100, 250] {
        node.write(0x1017, 0, 2, period);
        node.await_id(id);
        node.forget(id);
        node.bus.run(Duration::from_millis(u64::from(period) * 4 + 30));
        let count = std::iter::from_fn(|| node.bus.hear(id)).count();
        assert!((4..=5).contains(&count), "{count} in 4 periods of {period} ms");
    }
    node.write(0x1017, 0, 2, 0);
    node.forget(id);
    node.bus.run(Duration::from_millis(1500));
    assert_eq!(node.bus.hear(id), None);
}

/// A heartbeat that a node misses is reported once, is in 1003h and 1001h, and ends.
pub(crate) fn an_error<B: Bus>(node: &mut Node<'_, B>) {
    const OTHER: u8 = 0x55;
    let emcy = 0x80 + u16::from(node.id);
    node.write(0x1016, 1, 4, u32::from(OTHER) << 16 | 200);
    let before = node.read(0x1003, 0);
    let register = node.read(0x1001, 0);
    node.forget(emcy);
    node.bus.send(0x700 + u16::from(OTHER), &[127]);
    node.bus.run(Duration::from_millis(500));
    let message = node.await_id(emcy);
    assert_eq!(message.data()[..2], [0x30, 0x81]);
    assert_eq!(node.read(0x1003, 0), before + 1);
    assert_eq!(node.read(0x1003, 1) & 0xFFFF, 0x8130);
    // Not every personality has the bit of communication errors.
    assert_eq!(node.read(0x1001, 0) & !0x10, register | 1);
    node.bus.send(0x700 + u16::from(OTHER), &[127]);
    node.bus.run(Duration::from_millis(50));
    assert_eq!(node.read(0x1001, 0), register);
}

/// A TPDO carries what it maps, in the five steps of CiA 301. The PDOs of a lift are pre-defined.
pub(crate) fn a_remapped_tpdo<B: Bus>(node: &mut Node<'_, B>, case: Case) {
    if case.personality == Personality::Lift {
        return;
    }
    let rows = case.personality.rows().iter();
    let is_short = |bits: u8| (8..=32).contains(&bits);
    let mut mappable =
        rows.filter(|row| matches!(row.mapping, Mapping::Tpdo) && is_short(8 * row.kind.size()));
    let row = mappable.next().expect("an object for a TPDO");
    let entry = u32::from(row.index) << 16 | u32::from(row.sub) << 8 | u32::from(8 * row.kind.size());
    let cob_id = 0x180 + u32::from(node.id);
    node.write(0x1800, 1, 4, 0xC000_0000 | cob_id);
    node.write(0x1A00, 0, 1, 0);
    node.write(0x1800, 2, 1, 1);
    node.write(0x1A00, 1, 4, entry);
    node.write(0x1A00, 0, 1, 1);
    node.write(0x1800, 1, 4, 0x4000_0000 | cob_id);
    node.nmt(1);
    for _ in 0..3 {
        let id = 0x180 + u16::from(node.id);
        node.forget(id);
        node.bus.send(0x80, &[]);
        let frame = node.await_id(id);
        assert_eq!(frame.len(), usize::from(row.kind.size()));
        node.bus.run(Duration::from_millis(if node.bus.kbit() < 50 { 60 } else { 10 }));
    }
}
