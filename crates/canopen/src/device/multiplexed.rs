//! Multiplexed PDOs in the device: the objects that the producer monitors, and the destination of a received object.

use super::Application;
use super::Definition;
use super::inner::Inner;
use crate::dictionary::Entry;
use crate::emcy::Fault;
use crate::pdo::{Address, Addressing, Mpdo, ScannerSettings, Watched};
use crate::sdo::Multiplexer;
use crate::{Frame, NodeId, Tick};

/// Object scanner list (CiA 301, 7.5.2.44): which objects are sent in source address mode.
const SCANNER_LIST: u16 = 0x1FA0;
/// Object dispatching list (CiA 301, 7.5.2.45): destinations of other nodes' objects in source address mode.
const DISPATCHING_LIST: u16 = 0x1FD0;
/// The longest value in a multiplexed PDO, in bytes.
const LONGEST: u8 = 4;

impl<D: Definition> Inner<D> {
    /// Gives the producer its settings and its objects, after any change that may affect them. Unchanged settings keep
    /// the record of the values that have been sent, so nothing is sent again.
    pub(super) fn configure_scanner(&mut self, settings: Option<ScannerSettings>) {
        let addressing = settings.map(|settings| settings.addressing);
        let is_new = !self.scanner.has(settings);
        if is_new {
            self.scanner.configure(settings);
            match addressing {
                Some(Addressing::Source) => self.watch_listed(),
                Some(Addressing::Destination) => self.watch_all(),
                None => return,
            }
        }
        if addressing == Some(Addressing::Destination) {
            self.select_watched();
        }
        if !self.state.has_pdos() {
            return;
        }
        if is_new {
            self.scanner.start();
        } else {
            self.scanner.send_new();
        }
    }

    /// Monitors all objects that can be sent.
    fn watch_all(&mut self) {
        for entry in self.dictionary.entries() {
            self.watch_entry(&entry);
        }
    }

    /// Selects the objects to send: the application broadcasts them, and no TPDO maps them. A TPDO that is switched off
    /// counts too: switching it off must not send its objects in another frame.
    fn select_watched(&mut self) {
        let (application, image) = (&self.application, self.image.as_ref());
        self.scanner.select(|at| application.broadcasts(at, image));
        self.deselect_mapped();
        self.scanner.forget_deselected();
    }

    /// Monitors the objects of the scanner list. Each line is a block of sub-indexes of one object.
    fn watch_listed(&mut self) {
        let [count, ..] = self.number(SCANNER_LIST, 0).to_le_bytes();
        for line in 0..count {
            let [first, low, high, size] = self.number(SCANNER_LIST, line + 1).to_le_bytes();
            for sub in first..first.saturating_add(size) {
                if let Ok(entry) = self.dictionary.find(u16::from_le_bytes([low, high]), sub) {
                    self.watch_entry(&entry);
                }
            }
        }
    }

    fn watch_entry(&mut self, entry: &Entry) {
        if entry.attributes.mapping.allows_tpdo() && entry.field.size <= LONGEST {
            let at = Multiplexer { index: entry.index(), sub: entry.sub() };
            self.scanner.watch(Watched::new(at, entry.field));
        }
    }

    /// Takes a received multiplexed PDO. `addressing` is the mode of the RPDO; a frame of the other mode is ignored.
    /// Returns whether a value is in the image.
    pub(super) fn on_mpdo(&mut self, frame: [u8; 8], addressing: Addressing, now: Tick) -> bool {
        let Some(mpdo) = Mpdo::parse(frame) else { return false };
        match (mpdo.address, addressing) {
            (Address::Destination(node), Addressing::Destination)
                if node.is_none() || node == self.node_id =>
            {
                self.take_addressed(&mpdo, node, now)
            }
            (Address::Source(node), Addressing::Source) => self.dispatch(&mpdo, node),
            _ => false,
        }
    }

    /// Takes an object for this node or for all nodes. An object that is missing or rejects the value is an error only
    /// if this node alone is addressed.
    fn take_addressed(&mut self, mpdo: &Mpdo, node: Option<NodeId>, now: Tick) -> bool {
        let is_taken = self.store_mpdo(mpdo.at, mpdo.data);
        if !is_taken && node.is_some() {
            self.report(Fault::MpdoNotTaken, now);
        }
        is_taken
    }

    /// Whether a frame of any node can be a multiplexed PDO for this node: eight bytes that name an object which
    /// accepts process data. Any other frame is a PDO of a node that uses the CAN-ID otherwise.
    pub(super) fn is_mpdo(&self, frame: &Frame) -> bool {
        let mpdo = if frame.len() == 8 { Mpdo::parse(frame.bytes()) } else { None };
        mpdo.is_some_and(|mpdo| {
            matches!(mpdo.address, Address::Source(_)) || self.consumed(mpdo.at).is_some()
        })
    }

    /// The entry at this place, if a multiplexed PDO can write it.
    fn consumed(&self, at: Multiplexer) -> Option<Entry> {
        let entry = self.dictionary.find(at.index, at.sub).ok()?;
        (entry.attributes.mapping.allows_rpdo() && entry.field.size <= LONGEST).then_some(entry)
    }

    /// Stores the value, if the object exists and accepts the value. Returns whether it does.
    fn store_mpdo(&mut self, at: Multiplexer, data: [u8; 4]) -> bool {
        let Some(entry) = self.consumed(at) else { return false };
        let bytes = data.get(..usize::from(entry.field.size)).unwrap_or(&data);
        self.store_process_value(&entry, bytes)
    }

    fn dispatch(&mut self, mpdo: &Mpdo, sender: NodeId) -> bool {
        let count = self.number(DISPATCHING_LIST, 0).to_le_bytes()[0];
        for line in 0..count {
            let target = self.dispatching_line(line + 1).and_then(|line| line.target(mpdo.at, sender));
            if let Some(at) = target {
                return self.store_mpdo(at, mpdo.data);
            }
        }
        false
    }

    fn dispatching_line(&self, sub: u8) -> Option<DispatchingLine> {
        let entry = self.dictionary.find(DISPATCHING_LIST, sub).ok()?;
        let [node, remote_sub, a, b, sub, c, d, size] = entry.field.load(self.image.as_ref());
        let remote = Multiplexer { index: u16::from_le_bytes([a, b]), sub: remote_sub };
        let local = Multiplexer { index: u16::from_le_bytes([c, d]), sub };
        Some(DispatchingLine { sender: NodeId::new(node)?, remote, local, size })
    }
}

/// A line of the dispatching list: a block of sub-indexes of the sender, and their destination.
struct DispatchingLine {
    sender: NodeId,
    remote: Multiplexer,
    local: Multiplexer,
    size: u8,
}

impl DispatchingLine {
    /// The destination of an object, if the block contains it.
    fn target(&self, at: Multiplexer, sender: NodeId) -> Option<Multiplexer> {
        let offset = at.sub.checked_sub(self.remote.sub)?;
        let is_meant = sender == self.sender && at.index == self.remote.index && offset < self.size;
        let sub = self.local.sub.checked_add(offset)?;
        is_meant.then_some(Multiplexer { index: self.local.index, sub })
    }
}
