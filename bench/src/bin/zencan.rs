//! zencan-node, called as in its documentation: frames go into the mailbox at once, `process` runs when the mailbox
//! requests it, and the driver fetches frames when it is notified.
#![no_std]
#![no_main]

use core::cell::RefCell;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicBool, Ordering};

use bench_images::{Bits, Domain, Node, transmit};
// The critical sections needed by the mailbox and every object.
use cortex_m as _;
use cortex_m_rt::entry;
use critical_section::Mutex;
use zencan_node::Callbacks;
use zencan_node::common::messages::{CanId, CanMessage};
use zencan_node::common::sdo::AbortCode;
use zencan_node::object_dict::{ObjectAccess, SubObjectAccess};

#[allow(missing_docs, unreachable_pub, clippy::all, clippy::pedantic)]
mod generated {
    zencan_node::include_modules!(NODE);
}

/// Node-ID for the host's requests.
const ID: u8 = 1;

/// The mailbox requests a run of `process`.
static PROCESS: AtomicBool = AtomicBool::new(false);
/// Frames are ready to be fetched.
static TRANSMIT: AtomicBool = AtomicBool::new(false);
static CONTENT: Content = Content(Mutex::new(RefCell::new(Domain::new())));

/// The domain in the form that zencan accesses.
struct Content(Mutex<RefCell<Domain>>);

impl SubObjectAccess for Content {
    fn read(&self, offset: usize, buf: &mut [u8]) -> Result<usize, AbortCode> {
        critical_section::with(|cs| {
            let domain = self.0.borrow_ref(cs);
            let rest = domain.content().get(offset..).unwrap_or(&[]);
            let len = rest.len().min(buf.len());
            buf[..len].copy_from_slice(&rest[..len]);
            Ok(len)
        })
    }

    fn read_size(&self) -> usize {
        critical_section::with(|cs| self.0.borrow_ref(cs).content().len())
    }

    fn write(&self, data: &[u8]) -> Result<(), AbortCode> {
        let has_room = critical_section::with(|cs| self.0.borrow_ref_mut(cs).write(0, data));
        if has_room { Ok(()) } else { Err(AbortCode::OutOfMemory) }
    }
}

struct Zencan(zencan_node::Node<'static>);

/// A message in zencan's type.
struct Message(CanMessage);

impl From<Bits> for Message {
    fn from(bits: Bits) -> Message {
        Message(CanMessage::new(CanId::Std(bits.id), bits.data.get(..bits.len).unwrap_or(&[])))
    }
}

impl Zencan {
    fn new() -> Zencan {
        generated::OBJECT2004.content.register_handler(&CONTENT);
        generated::NODE_MBOX.set_process_notify_callback(&|| PROCESS.store(true, Ordering::Relaxed));
        generated::NODE_MBOX.set_transmit_notify_callback(&|| TRANSMIT.store(true, Ordering::Relaxed));
        let id = zencan_node::common::NodeId::new(ID).expect("1 is a node-ID");
        Zencan(zencan_node::Node::new(
            id,
            Callbacks::new(),
            &generated::NODE_MBOX,
            &generated::NODE_STATE,
            &generated::OD_TABLE,
        ))
    }

    fn run(&mut self, now: u64) {
        self.0.process(now);
        if TRANSMIT.load(Ordering::Relaxed) {
            TRANSMIT.store(false, Ordering::Relaxed);
            while let Some(message) = generated::NODE_MBOX.next_transmit_message() {
                transmit(&message, bits);
            }
        }
    }
}

fn bits(message: &CanMessage) -> Bits {
    Bits { id: message.id().raw() as u16, len: message.data().len(), data: message.data }
}

impl Node for Zencan {
    type Frame = Message;

    fn pass(&mut self, now: u64) {
        self.run(now);
    }

    fn sort(&mut self, Message(message): &Message, _: u64) {
        let _ = generated::NODE_MBOX.store_message(*message);
    }

    /// The mailbox does not request processing for an RPDO: the RPDO waits for the next pass, which is therefore
    /// counted too.
    fn process(&mut self, Message(message): &Message, now: u64) {
        let _ = generated::NODE_MBOX.store_message(*message);
        self.run(now);
    }

    fn serve(&mut self, Message(message): &Message, now: u64) {
        let _ = generated::NODE_MBOX.store_message(*message);
        if PROCESS.load(Ordering::Relaxed) {
            PROCESS.store(false, Ordering::Relaxed);
            self.run(now);
        }
    }

    /// The node reports no faults.
    fn disturb(&mut self, _: u64) {
        let _ = generated::OBJECT2000.set(0, 0);
        let _ = generated::OBJECT2000.set_event_flag(1);
    }
}

#[entry]
fn main() -> ! {
    static mut NODE: MaybeUninit<Zencan> = MaybeUninit::uninit();
    bench_images::run(NODE.write(Zencan::new()))
}
