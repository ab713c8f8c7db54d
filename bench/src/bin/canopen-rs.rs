//! canopen-rs, called as in its documentation: a frame is given to the node, and the node returns the answer. SYNC, and
//! writes that change a PDO, must be detected by the application. The library has no time: heartbeat, inhibit time and
//! event timer are left to the application.
#![no_std]
#![no_main]

use core::mem::MaybeUninit;

use bench_images::{Bits, Node, transmit};
use canopen_rs::emcy::ErrorRegister;
use canopen_rs::lss::LssAddress;
use canopen_rs::node::{self, TxFrame};
use canopen_rs::pdo::MappingEntry;
use canopen_rs::{Address, ByteString, Entry, NodeId, ObjectDictionary, StandardObjects, Value};
use cortex_m_rt::entry;

/// Node-ID for the host's requests.
const ID: u8 = 1;
const SYNC: u16 = 0x80;
/// Number of entries that `dictionary` makes: the library finds an entry by a linear search.
const ENTRIES: usize = 139;
/// Number of mapped objects: two numbers of 32 bits.
const MAPPED: u8 = 2;

struct CanopenRs(node::Node<ENTRIES>);

/// A received frame, from which the library takes its parts.
struct Received(Bits);

impl From<Bits> for Received {
    fn from(bits: Bits) -> Received {
        Received(bits)
    }
}

impl Received {
    fn data(&self) -> &[u8] {
        self.0.data.get(..self.0.len).unwrap_or(&[])
    }
}

/// The node described by zencan.toml and bin/ours/dictionary.rs.
struct Dictionary(ObjectDictionary<ENTRIES>);

impl Dictionary {
    fn insert(&mut self, index: u16, sub: u8, entry: Entry) {
        self.0.insert(Address::new(index, sub), entry).expect("there is room for every entry");
    }

    /// Communication and mapping parameters of a PDO with two of the numbers at `index`.
    fn pdo(&mut self, number: u16, base: u16, cob_id: u32, transmission: u8, index: u16) {
        let (parameters, mapping) = (base + number, base + 0x200 + number);
        self.insert(parameters, 0, Entry::constant(Value::Unsigned8(2)));
        self.insert(parameters, 1, Entry::rw(Value::Unsigned32(cob_id)));
        self.insert(parameters, 2, Entry::rw(Value::Unsigned8(transmission)));
        self.insert(mapping, 0, Entry::rw(Value::Unsigned8(MAPPED)));
        for place in 0..8 {
            let sub = number as u8 * MAPPED + place + 1;
            let mapped = if place < MAPPED { MappingEntry::new(index, sub, 32).to_u32() } else { 0 };
            self.insert(mapping, place + 1, Entry::rw(Value::Unsigned32(mapped)));
        }
    }

    /// Eight numbers in an object.
    fn numbers(&mut self, index: u16, entry: fn(Value) -> Entry) {
        self.insert(index, 0, Entry::constant(Value::Unsigned8(8)));
        (1..=8).for_each(|sub| self.insert(index, sub, entry(Value::Integer32(sub.into()))));
    }

    fn text(&mut self, index: u16, text: &str) {
        let text = ByteString::from_str(text).expect("the library takes 32 bytes");
        self.insert(index, 0, Entry::constant(Value::VisibleString(text)));
    }
}

fn dictionary() -> ObjectDictionary<ENTRIES> {
    let mut all = Dictionary(ObjectDictionary::new());
    let standard = StandardObjects::new(0, IDENTITY)
        .with_heartbeat(1000)
        .with_error_history(8)
        .with_device_name("bench");
    standard.insert_into(&mut all.0).expect("there is room for the standard objects");
    all.text(0x1009, "1");
    all.text(0x100A, "1");
    for (number, id) in (0..4).zip([0x200, 0x300, 0x400, 0x500]) {
        all.pdo(number, 0x1400, id + u32::from(ID), 254, 0x2001);
    }
    for (number, id) in (0..4).zip([0x180, 0x280, 0x380, 0x480]) {
        all.pdo(number, 0x1800, id + u32::from(ID), if number == 0 { 1 } else { 254 }, 0x2000);
    }
    all.numbers(0x2000, Entry::ro);
    all.numbers(0x2001, Entry::rw);
    all.insert(0x2002, 0, Entry::rw(Value::Integer32(0)));
    all.text(0x2003, "thirty-two characters, no more..");
    all.insert(0x2004, 0, Entry::constant(Value::Unsigned8(1)));
    all.insert(0x2004, 1, Entry::rw(Value::Domain(ByteString::default())));
    all.0
}

const IDENTITY: LssAddress =
    LssAddress { vendor_id: 0x1A, product_code: 0x2B, revision_number: 1, serial_number: 0 };

impl CanopenRs {
    fn new() -> CanopenRs {
        let id = NodeId::new(ID).expect("1 is a node-ID");
        let mut node = node::Node::new(id, dictionary());
        node.enable_lss(IDENTITY);
        node.configure_pdos_from_od();
        send(&node.boot());
        CanopenRs(node)
    }
}

fn send(frame: &TxFrame) {
    transmit(frame, |frame| {
        let mut data = [0; 8];
        data.iter_mut().zip(frame.data()).for_each(|(to, from)| *to = *from);
        Bits { id: frame.cob_id, len: frame.data().len(), data }
    });
}

impl Node for CanopenRs {
    type Frame = Received;

    fn pass(&mut self, _: u64) {}

    fn sort(&mut self, frame: &Received, now: u64) {
        self.serve(frame, now);
    }

    fn process(&mut self, frame: &Received, _: u64) {
        if frame.0.id == SYNC {
            self.0.sync_tpdos().iter().for_each(send);
        } else {
            let _ = self.0.on_frame(frame.0.id, frame.data());
        }
    }

    fn serve(&mut self, frame: &Received, _: u64) {
        if let Some(answer) = self.0.on_frame(frame.0.id, frame.data()) {
            send(&answer);
        }
        if self.0.take_written_object().is_some_and(|at| (0x1400..=0x1BFF).contains(&at.index)) {
            self.0.configure_pdos_from_od();
        }
    }

    fn disturb(&mut self, _: u64) {
        send(&self.0.raise_emergency(0x1000, ErrorRegister(0), [0; 5]));
        let _ = self.0.od_mut().set(Address::new(0x2000, 1), Value::Integer32(0));
        let _ = self.0.tpdo(1).as_ref().map(send);
        send(&self.0.clear_errors());
        send(&self.0.heartbeat());
    }
}

#[entry]
fn main() -> ! {
    static mut NODE: MaybeUninit<CanopenRs> = MaybeUninit::uninit();
    bench_images::run(NODE.write(CanopenRs::new()))
}
