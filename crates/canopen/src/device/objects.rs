//! SDO access to the dictionary: the rules of the communication objects.

use super::pdos::low_half;
use super::{Application, Core, Job, Part, STALE};
use crate::dictionary::{Entry, Field, Rule, Type, little_endian};
use crate::nmt::State;
use crate::sdo::{Abort, Multiplexer, Objects, Writable};
use crate::{Instant, emcy, sync};

impl<A: Application, const N: usize, const T: usize, const R: usize, const W: usize, const M: usize> Objects
    for Core<A, N, T, R, W, M>
{
    const IS_SMALL: bool = A::SERVICES_ONLY;

    fn read(&self, at: Multiplexer) -> Result<&[u8], Abort> {
        let entry = self.dictionary.find(at.index, at.sub)?;
        if !entry.attributes.access.is_readable() {
            return Err(Abort::WriteOnly);
        }
        match (entry.attributes.kind, entry.rule()) {
            (Type::Domain, _) => self.application.read_domain(at),
            (Type::VisibleString(_), _) => Ok(text(entry.field.get(&self.image))),
            _ if A::SERVICES_ONLY => Ok(entry.field.get(&self.image)),
            (_, Rule::ErrorCount) => Ok(core::slice::from_ref(self.emcy.history().count())),
            (_, Rule::ErrorEntry) => {
                let error = self.emcy.history().error(at.sub).ok_or(Abort::NoData)?;
                Ok(error)
            }
            _ => Ok(entry.field.get(&self.image)),
        }
    }

    fn writable(&self, at: Multiplexer) -> Result<Writable, Abort> {
        let entry = self.dictionary.find(at.index, at.sub)?;
        if !entry.is_writable() {
            return Err(Abort::ReadOnly);
        }
        Ok(if entry.is_domain() { Writable::Stream } else { Writable::Value(entry.field.size.into()) })
    }

    fn write(&mut self, at: Multiplexer, bytes: &[u8], now: Instant) -> Result<(), Abort> {
        let found = self.dictionary.find(at.index, at.sub);
        // By reference: to move it out of the result takes a dozen instructions.
        let entry = found.as_ref().map_err(|abort| *abort)?;
        if !entry.is_writable() {
            return Err(Abort::ReadOnly);
        }
        if entry.is_domain() {
            return self.write_domain(at, bytes);
        }
        entry.check_length(bytes.len())?;
        let value = little_endian(bytes);
        entry.check_value(value)?;
        match entry.rule() {
            Rule::Plain => entry.field.set(&mut self.image, bytes),
            _ => self.write_by_rule(entry, value, bytes, now)?,
        }
        if entry.is_parameter() {
            self.pending.parameters_changed();
        }
        self.application.written(entry, &mut self.image);
        Ok(())
    }

    fn take_deferred(&mut self) -> bool {
        self.jobs.take_deferred()
    }

    fn stream(&mut self, at: Multiplexer, part: Part<'_>) -> Result<(), Abort> {
        self.application.write_domain(at, part)
    }
}

impl<A: Application, const N: usize, const T: usize, const R: usize, const W: usize, const M: usize>
    Core<A, N, T, R, W, M>
{
    fn write_domain(&mut self, at: Multiplexer, bytes: &[u8]) -> Result<(), Abort> {
        self.stream(at, Part::Begin(Some(bytes.len())))?;
        self.stream(at, Part::Data(0, bytes))?;
        self.stream(at, Part::End(bytes.len()))
    }

    pub(super) fn is_initialising(&self) -> bool {
        self.state == State::Initialising
    }

    /// An integer of at most 32 bits; 0 where the dictionary has no such entry.
    #[inline(never)]
    pub(super) fn number(&self, index: u16, sub: u8) -> u32 {
        self.number_or(index, sub, 0)
    }

    pub(super) fn number_or(&self, index: u16, sub: u8, absent: u32) -> u32 {
        self.dictionary.find(index, sub).map_or(absent, |entry| self.word(entry.field))
    }

    /// The default value of an integer of at most 32 bits, with the node-ID where it counts from that.
    pub(super) fn default_number(&self, entry: &Entry) -> u32 {
        self.dictionary.default_number(entry, self.node_id)
    }

    fn word(&self, field: Field) -> u32 {
        little_endian(field.get(&self.image))
    }

    /// Replaces the value of an entry that does more than holding one.
    #[inline(never)]
    fn write_by_rule(&mut self, entry: &Entry, value: u32, bytes: &[u8], now: Instant) -> Result<(), Abort> {
        self.admit(entry, value, bytes)?;
        if !entry.rule().is_computed() && !entry.rule().is_command() {
            entry.field.set(&mut self.image, bytes);
        }
        self.follow(entry, value, now);
        Ok(())
    }

    /// Whether the rule of the entry allows the value.
    fn admit(&mut self, entry: &Entry, value: u32, bytes: &[u8]) -> Result<(), Abort> {
        match entry.rule() {
            Rule::Application => self.application.write(entry, bytes, &mut self.image),
            _ if A::SERVICES_ONLY => Ok(()),
            Rule::ErrorCount if value != 0 => Err(Abort::InvalidValue),
            Rule::SyncCobId => sync::check_cob_id(value),
            Rule::SyncOverflow => sync::check_overflow(value, self.number(0x1006, 0)),
            Rule::EmcyCobId => emcy::check_cob_id(self.word(entry.field), value),
            Rule::StartUp if value != 0 && value != super::state::SELF_START => Err(Abort::InvalidValue),
            Rule::Store | Rule::Restore => self.admit_store(entry, value),
            Rule::StoreCalibration => self.admit_store_calibration(value),
            Rule::Setting => self.begin_deferred(Job::Setting(value.to_le_bytes()[0])),
            Rule::ProgramControl => self.admit_program_control(value),
            Rule::HeartbeatWatch => self.admit_watch(entry, value),
            Rule::PdoCobId
            | Rule::PdoPredefined
            | Rule::PdoType
            | Rule::PdoInhibit
            | Rule::PdoSyncStart
            | Rule::PdoCount
            | Rule::PdoSlot => self.admit_pdo(entry, value),
            _ => Ok(()),
        }
    }

    /// What follows from a new value.
    fn follow(&mut self, entry: &Entry, value: u32, now: Instant) {
        match entry.rule() {
            Rule::Application => {
                self.pending.parameters_changed();
                if !A::SERVICES_ONLY {
                    self.follow_application(now);
                }
            }
            Rule::HeartbeatTime => self.heartbeat.set_period(low_half(value), now),
            _ if A::SERVICES_ONLY => (),
            Rule::ErrorCount => self.emcy.clear_history(),
            Rule::SyncCobId | Rule::SyncPeriod | Rule::SyncWindow | Rule::SyncOverflow => {
                self.configure_sync(now);
            }
            Rule::EmcyInhibit => self.emcy.set_inhibit(low_half(value)),
            Rule::EmcyCobId => self.emcy.configure(value),
            Rule::HeartbeatWatch => self.configure_watch(entry.sub(), now),
            Rule::ScannerLine => self.configure_pdos(now),
            Rule::PdoCobId
            | Rule::PdoPredefined
            | Rule::PdoType
            | Rule::PdoInhibit
            | Rule::PdoEventTimer
            | Rule::EventTimerOf(_)
            | Rule::PdoSyncStart => self.configure_pdo(entry, now),
            _ => (),
        }
        if matches!(
            entry.rule(),
            Rule::SyncCobId | Rule::PdoCobId | Rule::PdoPredefined | Rule::HeartbeatWatch
        ) {
            self.pending.identifiers_changed();
        }
        (self.process_due, self.services_due) = (STALE, STALE);
    }
}

/// A string as an upload gives it: it ends where its zeros begin.
fn text(value: &[u8]) -> &[u8] {
    value.split(|&byte| byte == 0).next().unwrap_or(value)
}
