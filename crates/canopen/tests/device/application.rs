//! The application of the device under test: it records calls, and provides the values that a test sets.

use std::collections::VecDeque;

use canopen::dictionary::{Entry, Group, Groups};
use canopen::nmt::State;
use canopen::sdo::{Abort, Multiplexer};
use canopen::{Application, Condition, ErrorClass, Fault, Part, Reset, Soundness, Stored};

use crate::rows::DICTIONARY;

/// The object of type DOMAIN.
const DOMAIN: Multiplexer = Multiplexer { index: 0x6104, sub: 0 };

/// The conditions of the application.
pub(crate) const SENSOR_BREAK: u8 = 0;
pub(crate) const PRESSURE_RAIL: u8 = 1;
pub(crate) const TEMPERATURE_RAIL: u8 = 2;
pub(crate) const UNEXPECTED_RESET: u8 = 3;
/// The only condition to which 1029h:2 applies.
pub(crate) const DEVICE_FAULT: u8 = 4;

/// Calls of the application by the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Told {
    Written(u16, u8),
    Received(u16),
    Sync(Option<u8>),
    State(State),
    Fault(Fault, bool),
    Error(ErrorClass),
}

/// Accepts only 4711 at 6102h, and keeps a domain of up to 5000 bytes.
#[derive(Default)]
pub(crate) struct Numbers {
    /// 1F80h, as if from a store.
    pub(crate) start_up: u8,
    pub(crate) domain: Vec<u8>,
    pub(crate) downloads: usize,
    /// The stored values: communication, application, calibration.
    pub(crate) stored: [Vec<u8>; 3],
    pub(crate) is_damaged: bool,
    /// The groups that a write to 6201h, or to another object, stores.
    pub(crate) stores: Option<Groups>,
    /// The other object; 0 for none.
    pub(crate) stored_at_once: u16,
    /// Why the memory accepts no job.
    pub(crate) is_full: Option<Abort>,
    /// The reports of the device about the groups that it loaded.
    pub(crate) loaded: Vec<(Group, bool)>,
    pub(crate) told: Vec<Told>,
    /// The TPDO whose frames are events; 0 for none.
    pub(crate) event_tpdo: u16,
    /// The value of the last sent event: each change of 6000h:1 is an event.
    pub(crate) last_event: Option<[u8; 4]>,
    /// Waiting events, used instead: the values of 6000h:1 to send.
    pub(crate) events: VecDeque<[u8; 4]>,
    /// An object that multiplexed TPDOs do not send to all nodes.
    pub(crate) not_told: Option<Multiplexer>,
    /// The multiplexed RPDO that takes the frames of all nodes; 0 for none.
    pub(crate) all_nodes_rpdo: u16,
}

impl Application for Numbers {
    const SENDS_EVENTS: bool = true;

    const CONDITIONS: &'static [Condition] = &[
        Condition::new(0x5006),
        Condition::new(0x8002),
        Condition::new(0x8001),
        Condition::new(0x6101),
        Condition::new(0x5003).of_class(ErrorClass::DEVICE),
    ];

    fn initialise(&mut self, _: Reset, image: &mut [u8]) {
        DICTIONARY.field(0x1F80, 0).set(image, &[self.start_up]);
    }

    fn takes_all_nodes(&self, rpdo: u16) -> bool {
        rpdo == self.all_nodes_rpdo
    }

    fn write(&mut self, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        if entry.index() == 0x6201 {
            // Switches TPDO 1 and RPDO 1 off and on.
            if let [14 | 15] = bytes {
                let valid = if bytes == [14] { 0x80 } else { 0 };
                DICTIONARY.field(0x1800, 1).store(image, [0x85, 0x01, 0, valid]);
                DICTIONARY.field(0x1400, 1).store(image, [0x05, 0x02, 0, valid]);
            }
            return if bytes == [13] { Err(Abort::InvalidValue) } else { Ok(()) };
        }
        assert_eq!((entry.index(), entry.sub()), (0x6102, 0));
        if bytes == 4711_u32.to_le_bytes() { Ok(()) } else { Err(Abort::NotStored) }
    }

    fn stores(&self, entry: &Entry) -> Option<Groups> {
        self.stores.filter(|_| entry.index() == 0x6201 || entry.index() == self.stored_at_once)
    }

    fn can_store(&self) -> Result<(), Abort> {
        self.is_full.map_or(Ok(()), Err)
    }

    fn switches_pdos(&self, entry: &Entry) -> bool {
        entry.index() == 0x6201
    }

    fn sends_events(&self, tpdo: u16) -> bool {
        tpdo == self.event_tpdo
    }

    fn begin_events(&mut self, tpdo: u16, _: &mut [u8]) {
        assert_eq!(tpdo, self.event_tpdo);
        self.last_event = None;
    }

    fn next_event(&mut self, tpdo: u16, image: &mut [u8]) -> bool {
        assert_eq!(tpdo, self.event_tpdo);
        let field = DICTIONARY.field(0x6000, 1);
        if let Some(event) = self.events.pop_front() {
            field.set(image, &event);
            self.last_event = Some(event);
            return true;
        }
        let now = field.load(image);
        self.last_event.replace(now) != Some(now)
    }

    fn broadcasts(&self, at: Multiplexer, _: &[u8]) -> bool {
        self.not_told != Some(at)
    }

    fn stored(&self, group: Group) -> Stored<'_> {
        let [communication, application, calibration] = &self.stored;
        let packed: &[u8] = match group {
            Group::Communication => communication,
            Group::Application => application,
            _ => calibration,
        };
        let soundness = if self.is_damaged { Soundness::Older } else { Soundness::Whole };
        Stored { packed, soundness }
    }

    fn loaded(&mut self, group: Group, good: bool) {
        self.loaded.push((group, good));
    }

    fn written(&mut self, entry: &Entry, _: &mut [u8]) {
        self.told.push(Told::Written(entry.index(), entry.sub()));
    }

    fn received(&mut self, rpdo: u16, _: &mut [u8]) {
        self.told.push(Told::Received(rpdo));
    }

    fn synchronised(&mut self, counter: Option<u8>, _: &mut [u8]) {
        self.told.push(Told::Sync(counter));
    }

    fn state(&mut self, state: State, _: &mut [u8]) {
        self.told.push(Told::State(state));
    }

    fn fault(&mut self, fault: Fault, active: bool, _: &mut [u8]) {
        self.told.push(Told::Fault(fault, active));
    }

    fn error(&mut self, class: ErrorClass, _: &mut [u8]) {
        self.told.push(Told::Error(class));
    }

    fn read_domain(&self, at: Multiplexer) -> Result<&[u8], Abort> {
        assert_eq!(at, DOMAIN);
        Ok(&self.domain)
    }

    fn write_domain(&mut self, at: Multiplexer, part: Part<'_>) -> Result<(), Abort> {
        assert_eq!(at, DOMAIN);
        match part {
            Part::Begin(_) => self.domain.clear(),
            Part::Data(offset, bytes) => {
                assert_eq!(offset, self.domain.len());
                self.domain.extend_from_slice(bytes);
            }
            Part::End(len) => {
                assert_eq!(len, self.domain.len());
                self.downloads += 1;
            }
        }
        if self.domain.len() > 5000 { Err(Abort::NotStored) } else { Ok(()) }
    }
}
