//! Storage groups of the product: 1010h and 1011h from sub-index 4 on.

use canopen::dictionary::{Access, Dictionary, Group, Groups, Object, Services, Type, check};
use canopen::nmt::Command;
use canopen::sdo::Multiplexer;
use canopen::{Action, Application, Device, Fault, Frame, Instant, Job, NodeId, Soundness, Stored, objects};

use crate::exchange;
use crate::types::Sent;

const ID: u8 = 5;
const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register()],
    objects::emergency(),
    [Object::new(0x1009, 0, "Variant", Type::Unsigned32, Access::ReadWrite).stored(Group::Application)],
    objects::identity(0, 1, 1),
    objects::store_parameters_with::<6>(&["Save recipes", "Save counters"]),
    objects::restore_parameters_with::<6>(&["Restore recipes", "Restore counters"]),
    [
        Object::new(0x2000, 0, "Recipe", Type::Unsigned16, Access::ReadWrite).stored(Group::Own4).value(7),
        Object::new(0x2001, 0, "Counter", Type::Unsigned32, Access::ReadWrite).stored(Group::Own5),
        Object::new(0x2002, 0, "Filter", Type::Unsigned8, Access::ReadWrite).stored(Group::Application),
    ],
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

/// The stored groups, by their number, and what was reported of them.
#[derive(Default)]
struct Memory {
    packed: [Vec<u8>; 8],
    damaged: Option<Group>,
    loaded: Vec<(Group, bool)>,
    faults: Vec<(Fault, bool)>,
}

impl Application for Memory {
    fn stored(&self, group: Group) -> Stored<'_> {
        let soundness = if self.damaged == Some(group) { Soundness::Lost } else { Soundness::Whole };
        Stored { packed: &self.packed[group as usize], soundness }
    }

    fn loaded(&mut self, group: Group, good: bool) {
        self.loaded.push((group, good));
    }

    fn fault(&mut self, fault: Fault, active: bool, _: &mut [u8]) {
        self.faults.push((fault, active));
    }
}

type Node = canopen::device!(Memory, ROWS);

fn start(node: &mut Node) -> Vec<Frame> {
    let mut sent = Sent::default();
    let _ = node.start(Instant(0), &mut sent);
    while node.poll(Instant(0), &mut sent).action.is_some() {}
    sent.0
}

fn node() -> Node {
    let mut node = Device::new(&DICTIONARY, NodeId::new(ID), Memory::default());
    start(&mut node);
    node
}

fn ask(node: &mut Node, request: Frame) -> Vec<Frame> {
    let mut sent = Sent::default();
    let _ = node.on_service_frame(&request, Instant(1), &mut sent);
    sent.0
}

fn write(node: &mut Node, index: u16, bytes: &[u8]) {
    exchange::write(ID, Multiplexer { index, sub: 0 }, bytes, |request| ask(node, request)).unwrap();
}

fn read(node: &mut Node, index: u16, sub: u8) -> Result<Vec<u8>, u32> {
    exchange::read(ID, Multiplexer { index, sub }, |request| ask(node, request))
}

/// The job that a command begins.
fn command(node: &mut Node, (index, sub): (u16, u8), word: &[u8; 4]) -> Result<Job, u32> {
    let [low, high] = index.to_le_bytes();
    let mut request = [0x23, low, high, sub, 0, 0, 0, 0];
    request[4..].copy_from_slice(word);
    let mut sent = Sent::default();
    let next = node.on_service_frame(&Frame::new(0x605, &request).unwrap(), Instant(1), &mut sent);
    if let Some(refusal) = sent.0.first() {
        return Err(u32::from_le_bytes(refusal.data()[4..].try_into().unwrap()));
    }
    let Some(Action::Store(job)) = next.action else { panic!("{next:?}") };
    let _ = node.finish(Ok(()), Instant(2), &mut sent);
    assert_eq!(sent.0[0].data()[0], 0x60);
    Ok(job)
}

fn groups<const N: usize>(all: [Group; N]) -> Groups {
    let mut groups = Groups::NONE;
    all.into_iter().for_each(|group| groups.set(group, true));
    groups
}

#[test]
fn each_sub_index_stores_and_restores_its_group() {
    let mut node = node();
    assert_eq!(read(&mut node, 0x1010, 0), Ok(vec![5]));
    let all = groups([Group::Communication, Group::Application, Group::Own4, Group::Own5]);
    let expected = [
        (1, all),
        (2, Groups::one(Group::Communication)),
        (3, Groups::one(Group::Application)),
        (4, Groups::one(Group::Own4)),
        (5, Groups::one(Group::Own5)),
    ];
    for (sub, groups) in expected {
        assert_eq!(command(&mut node, (0x1010, sub), b"save"), Ok(Job::Store(groups)));
        assert_eq!(command(&mut node, (0x1011, sub), b"load"), Ok(Job::Restore(groups)));
        assert_eq!(command(&mut node, (0x1010, sub), b"load"), Err(0x0800_0020));
        assert_eq!(read(&mut node, 0x1010, sub), Ok(vec![1, 0, 0, 0]));
    }
    assert_eq!(command(&mut node, (0x1010, 6), b"save"), Err(0x0609_0011));
}

#[test]
fn a_group_of_the_product_is_loaded_at_a_reset() {
    let mut node = node();
    write(&mut node, 0x2000, &[0x34, 0x12]);
    write(&mut node, 0x2001, &[9, 0, 0, 0]);
    let mut buffer = [0; 32];
    for group in [Group::Own4, Group::Own5] {
        let len = DICTIONARY.pack(group, NodeId::new(ID), node.image(), &mut buffer).unwrap();
        node.application_mut().packed[group as usize] = buffer[..len].to_vec();
    }
    let packed = &node.application().packed;
    assert_eq!(packed[Group::Own4 as usize], [0x00, 0x20, 0, 1, 2, 0x34, 0x12], "its values and no others");
    write(&mut node, 0x2000, &[0, 0]);
    let _ = node.nmt(canopen::nmt::Command::ResetNode, Instant(3), &mut Sent::default());
    start(&mut node);
    assert_eq!(read(&mut node, 0x2000, 0), Ok(vec![0x34, 0x12]));
    assert_eq!(read(&mut node, 0x2001, 0), Ok(vec![9, 0, 0, 0]));
    assert!(node.application().loaded.contains(&(Group::Own5, true)));
}

#[test]
fn a_damaged_group_keeps_its_defaults_and_is_reported_with_its_code() {
    let mut node = node();
    node.application_mut().damaged = Some(Group::Own4);
    let _ = node.nmt(canopen::nmt::Command::ResetNode, Instant(3), &mut Sent::default());
    let sent = start(&mut node);
    let emcy = sent.iter().find(|frame| frame.id() == 0x085).map(Frame::data);
    assert_eq!(emcy, Some(&[0x04, 0x63, 0x01, 2, 0, 0, 0, 0][..]));
    assert_eq!(read(&mut node, 0x2000, 0), Ok(vec![7, 0]));
    assert_eq!(node.application().faults, [(Fault::StoredData(Group::Own4), true)]);
    node.application_mut().damaged = None;
    let _ = node.nmt(canopen::nmt::Command::ResetNode, Instant(4), &mut Sent::default());
    start(&mut node);
    assert_eq!(node.application().faults[1..], [(Fault::StoredData(Group::Own4), false)]);
}

#[test]
fn a_group_and_its_sub_index_go_together() {
    assert!(Services::of(ROWS).contains(Services::OWN_GROUPS));
    assert!(!Services::of(&objects::store_parameters()).contains(Services::OWN_GROUPS));
    for (at, group) in Group::ALL.into_iter().enumerate() {
        assert_eq!(group as usize, at);
        let sub = group.sub();
        assert!(sub == 0 || Groups::of_sub(sub) == Some(Groups::one(group)), "{group:?}");
    }
    assert_eq!(Groups::of_sub(9), None);
    let row = Object::new(0x2000, 0, "", Type::Unsigned8, Access::ReadWrite).stored(Group::Own6);
    let error = std::panic::catch_unwind(move || check(&[row])).unwrap_err();
    let message = error.downcast_ref::<String>().map(String::as_str);
    assert_eq!(message, Some("2000h:0: 1010h has no sub-index for the storage group"));
}

#[test]
fn a_reset_of_the_communication_leaves_a_low_index_of_another_group_alone() {
    let mut node = node();
    write(&mut node, 0x1009, &[1, 2, 3, 4]);
    let mut sent = Sent::default();
    let _ = node.nmt(Command::ResetCommunication, Instant(1), &mut sent);
    start(&mut node);
    assert_eq!(read(&mut node, 0x1009, 0), Ok(vec![1, 2, 3, 4]));
    let _ = node.nmt(Command::ResetNode, Instant(1), &mut sent);
    start(&mut node);
    assert_eq!(read(&mut node, 0x1009, 0), Ok(vec![0; 4]));
}

#[test]
fn a_group_that_stays_damaged_is_no_new_fault_at_a_reset() {
    let mut node = node();
    node.application_mut().damaged = Some(Group::Own4);
    for _ in 0..3 {
        let _ = node.nmt(Command::ResetNode, Instant(3), &mut Sent::default());
        start(&mut node);
        assert_eq!(node.application().faults, [(Fault::StoredData(Group::Own4), true)]);
    }
}

#[test]
fn a_damaged_group_without_values_is_not_reported_as_good() {
    let mut node = node();
    node.application_mut().damaged = Some(Group::Own4);
    node.application_mut().loaded.clear();
    let _ = node.nmt(Command::ResetNode, Instant(3), &mut Sent::default());
    start(&mut node);
    let loaded = &node.application().loaded;
    assert!(loaded.contains(&(Group::Own4, false)) && loaded.contains(&(Group::Own5, true)), "{loaded:?}");
}
