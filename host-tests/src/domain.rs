//! A small device with an object of several KiB, which the pressure node lacks, for long transfers.

use canopen::dictionary::{Access, Dictionary, Object, Type};
use canopen::sdo::{Abort, Multiplexer};
use canopen::{Action, Application, CanId, Device, Frame, Instant, NodeId, Part, Transmit};

use crate::asked::Asked;
use crate::network::Unit;

/// Node-ID of the device.
pub const ID: u8 = 9;
/// The object of up to [`CAPACITY`] bytes.
pub const DOMAIN: Multiplexer = Multiplexer { index: 0x2000, sub: 0 };
/// A text of up to [`TEXT_CAPACITY`] bytes, stored in the process image.
pub const TEXT: Multiplexer = Multiplexer { index: 0x2001, sub: 0 };
/// An UNSIGNED32.
pub const WORD: Multiplexer = Multiplexer { index: 0x2002, sub: 0 };
/// Maximum size of the domain in bytes.
pub const CAPACITY: usize = 8192;
/// Maximum size of the text in bytes.
pub const TEXT_CAPACITY: u8 = 60;

const fn parameter(at: Multiplexer, kind: Type) -> Object {
    Object::new(at.index, at.sub, "", kind, Access::ReadWrite)
}

const ROWS: &[Object] = &[
    Object::new(0x1001, 0, "", Type::Unsigned8, Access::ReadOnly),
    parameter(DOMAIN, Type::Domain),
    parameter(TEXT, Type::VisibleString(TEXT_CAPACITY)),
    parameter(WORD, Type::Unsigned32),
];
const DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

/// The content of the domain. A complete download replaces it.
#[derive(Debug, Default)]
pub struct Store {
    /// The content that a client can read.
    pub content: Vec<u8>,
    incoming: Vec<u8>,
}

impl Application for Store {
    fn read_domain(&self, _: Multiplexer) -> Result<&[u8], Abort> {
        Ok(&self.content)
    }

    fn write_domain(&mut self, _: Multiplexer, part: Part<'_>) -> Result<(), Abort> {
        match part {
            Part::Begin(size) if size.is_some_and(|size| size > CAPACITY) => return Err(Abort::TooLong),
            Part::Begin(_) => self.incoming.clear(),
            Part::Data(offset, bytes) if offset == self.incoming.len() => {
                self.incoming.extend_from_slice(bytes);
            }
            Part::End(len) if len == self.incoming.len() => self.content = std::mem::take(&mut self.incoming),
            Part::Data(..) | Part::End(_) => return Err(Abort::General),
        }
        if self.incoming.len() > CAPACITY { Err(Abort::TooLong) } else { Ok(()) }
    }
}

/// The device.
#[derive(Debug)]
pub struct DomainDevice {
    device: canopen::device!(Store, ROWS),
    asked: Asked,
}

impl DomainDevice {
    /// A device with an empty domain.
    ///
    /// # Panics
    /// Never.
    #[must_use]
    pub fn new() -> DomainDevice {
        let node_id = NodeId::new(ID).expect("a node-ID");
        DomainDevice { device: Device::new(&DICTIONARY, node_id, Store::default()), asked: Asked::default() }
    }

    /// The stored content.
    #[must_use]
    pub fn content(&self) -> &[u8] {
        &self.device.application().content
    }

    /// Replaces the stored content.
    pub fn set_content(&mut self, content: &[u8]) {
        self.device.application_mut().content = content.to_vec();
    }
}

impl Default for DomainDevice {
    fn default() -> DomainDevice {
        DomainDevice::new()
    }
}

impl Unit for DomainDevice {
    fn start(&mut self, now: Instant, out: &mut impl Transmit) {
        self.asked.keep(self.device.start(now, out));
    }

    fn on_process_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        self.asked.keep(self.device.on_process_frame(frame, now, out));
    }

    fn on_service_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        self.asked.keep(self.device.on_service_frame(frame, now, out));
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        let next = self.device.poll(now, out);
        self.asked.keep(next);
        next.due()
    }

    fn take_action(&mut self) -> Option<Action> {
        self.asked.take_action()
    }

    fn process_ids(&self) -> Vec<u16> {
        self.device.process_ids().map(CanId::get).collect()
    }

    fn service_ids(&self) -> Vec<u16> {
        self.device.service_ids().map(CanId::get).collect()
    }
}
