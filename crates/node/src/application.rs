//! The application of the CANopen device: the additions of the node to CiA 301, and its profile.

use canopen::dictionary::{Entry, Group, Groups, is_packed};
use canopen::emcy::Fault;
use canopen::nmt::State;
use canopen::sdo::{Abort, Multiplexer};
use canopen::{Application, Condition, ErrorClass, Part, Reset, Soundness};
use profiles::communication::{
    LOST_EVENT_KINDS, PARAMETER_MEMORY, PERSONALITY, PROGRAM_AUTHORISATION, PROGRAM_TRIAL, UPDATE_LOG,
};
use profiles::fault::Flags;
use profiles::lift::objects::{SWITCHED_OFF, UNKNOWN_CHOICES};
use profiles::{AnyProfile, Snapshot};
use update::{Authorisation, Log, Programs};

use crate::Setup;
use crate::configured::Configured;
use crate::fault::{CONDITIONS, flag_of};
use crate::memory::MemoryState;
use crate::stored::Stored;
use crate::transfer_buffer::TransferBuffer;
use crate::trial::ProgramTrial;

/// Number of kinds of lost events: sub-indexes 1 to this one of 2001h.
pub const LOST_EVENTS: usize = LOST_EVENT_KINDS as usize;

/// The application with its state.
#[derive(Debug)]
pub(crate) struct NodeApplication {
    pub(crate) setup: Setup,
    pub(crate) configured: Configured,
    pub(crate) profile: AnyProfile,
    /// The last published snapshot: a reset of the dictionary does not reset the measured values.
    pub(crate) snapshot: Snapshot,
    /// The flags of active faults. A reset of the dictionary does not end a fault.
    pub(crate) flags: Flags,
    pub(crate) stored: Stored,
    /// Room and wear of the parameter memory (2010h).
    pub(crate) memory: MemoryState,
    /// Counters of lost events, as counted by the firmware (2001h).
    pub(crate) lost_events: [u32; LOST_EVENTS],
    pub(crate) trial: ProgramTrial,
    /// The programs in the flash (2004h).
    pub(crate) programs: Programs,
    /// The log of updates (2006h).
    pub(crate) update_log: Log,
    /// Permission to change the program (2003h).
    pub(crate) authorisation: Authorisation,
    buffer: TransferBuffer,
}

impl NodeApplication {
    pub(crate) fn new(setup: &Setup) -> NodeApplication {
        NodeApplication {
            setup: *setup,
            configured: Configured::of(setup),
            profile: AnyProfile::new(setup.personality),
            snapshot: Snapshot::default(),
            flags: Flags::default(),
            stored: Stored::NOTHING,
            memory: MemoryState::UNKNOWN,
            lost_events: [0; LOST_EVENTS],
            trial: ProgramTrial::default(),
            programs: Programs::default(),
            update_log: Log::EMPTY,
            authorisation: Authorisation::default(),
            buffer: TransferBuffer::EMPTY,
        }
    }

    /// Shows the measured values.
    pub(crate) fn show_values(&mut self, image: &mut [u8]) {
        self.profile.publish(&self.snapshot, image);
    }

    /// Shows the flags, in a profile that has objects for them.
    pub(crate) fn show_flags(&self, image: &mut [u8]) {
        self.profile.show_flags(self.flags, image);
    }

    /// Shows the personality of the next start.
    pub(crate) fn show_personality(&self, image: &mut [u8]) {
        self.show(PERSONALITY, 0, &[self.configured.personality.number()], image);
    }

    /// Shows room and wear of the parameter memory.
    pub(crate) fn show_memory(&self, image: &mut [u8]) {
        let MemoryState { erases, erases_allowed, .. } = self.memory;
        self.show(PARAMETER_MEMORY, 1, &self.memory.accepted().to_le_bytes(), image);
        self.show(PARAMETER_MEMORY, 2, &erases.to_le_bytes(), image);
        self.show(PARAMETER_MEMORY, 3, &[erases_allowed], image);
    }

    /// Communication parameters that a firmware without 2307h has stored: TPDOs that were off stay off.
    fn adopt_older_choice(&self, image: &mut [u8]) {
        let packed = self.stored.get(Group::Communication).packed;
        if !packed.is_empty() && !is_packed(packed, SWITCHED_OFF, 0) {
            self.show(SWITCHED_OFF, 0, &[UNKNOWN_CHOICES], image);
        }
    }

    /// The four bytes of an object.
    pub(crate) fn value_at(&self, at: Multiplexer, image: &[u8]) -> [u8; 4] {
        let entry = self.setup.personality.dictionary().find(at.index, at.sub);
        entry.map_or([0; 4], |entry| entry.field().load(image))
    }

    pub(crate) fn show(&self, index: u16, sub: u8, bytes: &[u8], image: &mut [u8]) {
        if let Ok(entry) = self.setup.personality.dictionary().find(index, sub) {
            entry.field().set(image, bytes);
        }
    }
}

impl Application for NodeApplication {
    const CONDITIONS: &'static [Condition] = &CONDITIONS;
    const SENDS_EVENTS: bool = true;
    const THRESHOLDS: bool = true;

    fn register_bits(&self) -> u8 {
        self.profile.register_bits()
    }

    #[inline(never)]
    fn initialise(&mut self, reset: Reset, image: &mut [u8]) {
        let setup = &self.setup;
        let mut show = |index, sub, bytes: &[u8]| self.show(index, sub, bytes, image);
        show(0x1009, 0, setup.hardware_version.as_bytes());
        show(0x100A, 0, setup.software_version.as_bytes());
        show(0x1018, 1, &profiles::product::VENDOR_ID.to_le_bytes());
        show(0x1018, 2, &setup.personality.product_code().to_le_bytes());
        show(0x1018, 3, &profiles::product::REVISION.to_le_bytes());
        show(0x1018, 4, &setup.serial_number.to_le_bytes());
        show(0x1F56, 1, &setup.program_id.to_le_bytes());
        let status = self.trial.flash_status().unwrap_or(self.stored.flash_status());
        show(0x1F57, 1, &status.to_le_bytes());
        self.adopt_older_choice(image);
        let mut defaults = Groups::NONE;
        for group in Group::COMMON {
            let is_loaded = reset == Reset::Node || group == Group::Communication;
            defaults.set(group, is_loaded && self.stored.get(group).packed.is_empty());
        }
        self.profile.initialise(image, defaults);
        self.show_personality(image);
        self.show_flags(image);
        self.show_lost_events(image);
        self.show_memory(image);
        self.show_trial(image);
        self.show_programs(image);
        self.show_authorisation(image);
        self.show_values(image);
    }

    fn write(&mut self, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        match entry.index() {
            PROGRAM_TRIAL => {
                let is_at_work = self.has_measured();
                self.trial.command(bytes, is_at_work, self.commander())
            }
            PROGRAM_AUTHORISATION => self.answer(bytes, image),
            _ => self.profile.write(entry, bytes, image),
        }
    }

    fn switches_pdos(&self, entry: &Entry) -> bool {
        self.profile.switches_pdos(entry.index())
    }

    fn written(&mut self, entry: &Entry, image: &mut [u8]) {
        self.profile.written(entry, image);
    }

    fn received(&mut self, rpdo: u16, image: &mut [u8]) {
        self.profile.received(rpdo, image);
    }

    fn state(&mut self, state: State, image: &mut [u8]) {
        self.profile.state(state, image);
    }

    fn synchronised(&mut self, counter: Option<u8>, image: &mut [u8]) {
        self.profile.synchronised(counter, image);
    }

    fn error(&mut self, class: ErrorClass, image: &mut [u8]) {
        self.profile.error(class, image);
    }

    fn fault(&mut self, _: Fault, _: bool, image: &mut [u8]) {
        self.show_flags(image);
    }

    fn sends_events(&self, tpdo: u16) -> bool {
        self.profile.sends_events(tpdo)
    }

    fn is_quiet(&self, tpdo: usize, place: usize, image: &[u8]) -> bool {
        self.profile.is_quiet(tpdo, place, image)
    }

    fn sent(&mut self, tpdo: usize, image: &[u8]) {
        self.profile.sent(tpdo, image);
    }

    fn stores(&self, entry: &Entry) -> Option<Groups> {
        let stores = self.profile.stores(entry.index(), entry.sub());
        stores.then_some(Groups::one(Group::Application))
    }

    /// A program on trial stores nothing, because the previous program has to find its settings.
    fn can_store(&self) -> Result<(), Abort> {
        if self.trial.is_open() { Err(Abort::DeviceState) } else { self.memory.check() }
    }

    fn begin_events(&mut self, tpdo: u16, image: &mut [u8]) {
        self.profile.begin_events(tpdo, image);
    }

    fn next_event(&mut self, tpdo: u16, image: &mut [u8]) -> bool {
        self.profile.next_event(tpdo, image)
    }

    fn takes_all_nodes(&self, rpdo: u16) -> bool {
        self.profile.takes_all_nodes(rpdo)
    }

    fn broadcasts(&self, at: Multiplexer, image: &[u8]) -> bool {
        self.profile.broadcasts(at, image)
    }

    fn stored(&self, group: Group) -> canopen::Stored<'_> {
        // The calibration belongs to the device: a dictionary without calibration objects leaves the stored one alone.
        if self.setup.personality.has_group(group) {
            self.stored.get(group)
        } else {
            canopen::Stored { packed: &[], soundness: Soundness::Whole }
        }
    }

    fn loaded(&mut self, group: Group, good: bool) {
        self.flags.set(flag_of(group), !good);
    }

    fn admits(&self, entry: &Entry) -> Result<(), Abort> {
        self.admit(entry.index(), entry.sub())
    }

    fn read_domain(&self, at: Multiplexer) -> Result<&[u8], Abort> {
        if at.index == UPDATE_LOG { Ok(self.update_log.bytes()) } else { self.buffer.read() }
    }

    fn write_domain(&mut self, _: Multiplexer, part: Part<'_>) -> Result<(), Abort> {
        self.buffer.write(part)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::BitRate;
    use canopen::NodeId;
    use profiles::Personality;
    use std::vec;
    use std::vec::Vec;

    fn application(personality: Personality) -> (NodeApplication, Vec<u8>) {
        let mut application = NodeApplication::new(&Setup {
            personality,
            node_id: NodeId::new(5),
            bit_rate: BitRate::FASTEST,
            serial_number: 1,
            program_id: 0,
            hardware_version: "",
            software_version: "",
        });
        let mut image = vec![0; personality.dictionary().image_size()];
        personality.dictionary().load_defaults(&mut image);
        application.initialise(Reset::Node, &mut image);
        (application, image)
    }

    /// The inputs of the PDOs: bit 31 of all COB-IDs, and what is broadcast.
    fn pdos(application: &NodeApplication, image: &[u8]) -> Vec<bool> {
        let entries = application.setup.personality.dictionary().entries();
        let state = |entry: Entry| {
            let is_cob_id = matches!(entry.index(), 0x1400..=0x15FF | 0x1800..=0x19FF) && entry.sub() == 1;
            let at = Multiplexer { index: entry.index(), sub: entry.sub() };
            let is_off = is_cob_id && entry.field().u32(image) >> 31 != 0;
            [is_off, application.broadcasts(at, image)]
        };
        entries.flat_map(state).collect()
    }

    #[test]
    fn a_write_that_switches_pdos_is_one_of_an_entry_that_says_so() {
        for personality in Personality::ALL {
            let own = |entry: &Entry| entry.index() >= 0x2000;
            let mut switching = 0;
            for entry in personality.dictionary().entries().filter(own) {
                let says_so = application(personality).0.switches_pdos(&entry);
                switching += usize::from(says_so);
                for value in [0, 1, 2, 3, 7, 0x0F, 0xFF] {
                    let (mut application, mut image) = application(personality);
                    let before = pdos(&application, &image);
                    let bytes = [value, 0, 0, 0, 0, 0, 0, 0];
                    let bytes = &bytes[..entry.field().get(&image).len().min(8)];
                    if application.write(&entry, bytes, &mut image).is_ok() {
                        entry.field().set(&mut image, bytes);
                    }
                    let has_switched = pdos(&application, &image) != before;
                    assert!(says_so || !has_switched, "{:X}h:{}", entry.index(), entry.sub());
                }
            }
            let expected = if personality == Personality::Lift { 6 } else { 0 };
            assert!(switching <= expected, "{personality:?}: {switching}");
        }
    }
}
