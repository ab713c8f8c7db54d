//! SDO access to the dictionary: the rules of the communication objects.

use super::Definition;
use super::inner::Inner;
use super::pdos::low_half;
use super::state::SELF_START;
use super::store::check_program_control;
use super::{Application, STALE};
use crate::dictionary::{Entry, Kind, Rule, Services, little_endian};
use crate::sdo::{Abort, Multiplexer, Objects, Part, Writable};
use crate::{CobId, Tick, sync, time_stamp};

impl<D: Definition> Objects for Inner<D> {
    const BLOCK_UPLOAD: bool = D::Application::BLOCK_UPLOAD;
    const BLOCK_DOWNLOAD: bool = D::Application::BLOCK_DOWNLOAD;
    const PARTS: bool = D::Application::DOMAIN_PARTS;
    /// For a heartbeat and an LSS response, and beside process data for all PDOs of a SYNC, a heartbeat and an EMCY.
    const RESERVED_ROOM: usize = if Self::has(Services::FAULTS) { 10 } else { 2 };

    fn read(&mut self, at: Multiplexer) -> Result<&[u8], Abort> {
        let entry = self.dictionary.find(at.index, at.sub)?;
        if !entry.attributes.access.is_readable() {
            return Err(Abort::WriteOnly);
        }
        if !entry.is_domain() {
            self.application.read(&entry, self.image.as_mut())?;
        }
        match entry.attributes.kind {
            Kind::Domain => self.application.read_domain(at),
            Kind::Text => Ok(text(entry.field.get(self.image.as_ref()))),
            _ if entry.rule().is_computed() => self.computed(&entry),
            _ => Ok(entry.field.get(self.image.as_ref())),
        }
    }

    fn writable(&self, at: Multiplexer) -> Result<Writable, Abort> {
        let entry = self.dictionary.find(at.index, at.sub)?;
        if !entry.is_writable() {
            return Err(Abort::ReadOnly);
        }
        Ok(if entry.is_domain() { Writable::Stream } else { Writable::Value(entry.field.size.into()) })
    }

    fn write(&mut self, at: Multiplexer, bytes: &[u8], now: Tick) -> Result<(), Abort> {
        let found = self.dictionary.find(at.index, at.sub);
        // By reference: a move out of the result takes a dozen instructions.
        let entry = found.as_ref().map_err(|abort| *abort)?;
        if !entry.is_writable() {
            return Err(Abort::ReadOnly);
        }
        self.application.admits(entry)?;
        if entry.is_domain() {
            return self.write_domain(at, bytes);
        }
        entry.check_length(bytes.len())?;
        let value = little_endian(bytes);
        entry.check_value(value)?;
        let job = self.job_of(entry)?;
        match entry.rule() {
            Rule::Plain => entry.field.set_number(self.image.as_mut(), value, bytes),
            Rule::Application => self.write_handled(entry, bytes, now)?,
            _ => self.write_by_rule(entry, value, bytes, now)?,
        }
        if entry.is_parameter() {
            self.pending.parameters_changed();
        }
        self.application.written(entry, self.image.as_mut());
        job.map_or(Ok(()), |job| self.begin_deferred(job))
    }

    fn take_deferred(&mut self) -> bool {
        Self::has(Services::FAULTS) && self.jobs.take_deferred()
    }

    fn stream(&mut self, at: Multiplexer, part: Part<'_>) -> Result<(), Abort> {
        self.application.write_domain(at, part)
    }

    fn abandon(&mut self, at: Multiplexer) {
        self.application.download_aborted(at);
    }

    fn open(&mut self, at: Multiplexer) -> Result<Option<usize>, Abort> {
        let entry = self.dictionary.find(at.index, at.sub)?;
        if !entry.attributes.access.is_readable() {
            return Err(Abort::WriteOnly);
        }
        if entry.is_domain() { self.application.begin_upload(at) } else { Ok(None) }
    }

    fn part(&mut self, at: Multiplexer, offset: usize, part: &mut [u8]) -> Result<(), Abort> {
        self.application.upload_part(at, offset, part)
    }

    fn close(&mut self, at: Multiplexer, is_complete: bool) {
        self.application.end_upload(at, is_complete);
    }
}

impl<D: Definition> Inner<D> {
    /// Writes a domain whose download arrived in one piece.
    fn write_domain(&mut self, at: Multiplexer, bytes: &[u8]) -> Result<(), Abort> {
        let application = &mut self.application;
        application.write_domain(at, Part::Begin(Some(bytes.len())))?;
        let data = application.write_domain(at, Part::Data(0, bytes));
        let result = data.and_then(|()| application.write_domain(at, Part::End(bytes.len())));
        if D::Application::DOMAIN_PARTS && result.is_err() {
            application.download_aborted(at);
        }
        result
    }

    /// Writes an entry whose values the application accepts or refuses.
    fn write_handled(&mut self, entry: &Entry, bytes: &[u8], now: Tick) -> Result<(), Abort> {
        self.application.write(entry, bytes, self.image.as_mut())?;
        entry.field.set(self.image.as_mut(), bytes);
        self.pending.parameters_changed();
        if Self::has_process() && self.application.switches_pdos(entry) {
            self.apply_application_changes(now);
            (self.process_due, self.services_due) = (STALE, STALE);
        }
        Ok(())
    }

    /// Writes an entry whose rule does more than storing a value: everything that can refuse the value comes before
    /// any effect.
    #[inline(never)]
    fn write_by_rule(&mut self, entry: &Entry, value: u32, bytes: &[u8], now: Tick) -> Result<(), Abort> {
        let rule = entry.rule();
        self.check(entry, value)?;
        if !rule.is_computed() && !rule.is_command() {
            entry.field.set(self.image.as_mut(), bytes);
        }
        self.apply(entry, value, now);
        self.services_due = STALE;
        if Self::has_process() {
            self.process_due = STALE;
        }
        Ok(())
    }

    /// The value of an entry whose value is not in the image.
    fn computed(&self, entry: &Entry) -> Result<&[u8], Abort> {
        let history = self.emcy.history();
        match entry.rule() {
            Rule::ErrorCount if Self::has(Services::FAULTS) => Ok(core::slice::from_ref(history.count())),
            Rule::ErrorEntry if Self::has(Services::EMCY) => {
                Ok(history.error(entry.sub()).ok_or(Abort::NoData)?)
            }
            _ => Err(Abort::NoData),
        }
    }

    /// Whether the rule of the entry allows the value. Nothing changes.
    fn check(&self, entry: &Entry, value: u32) -> Result<(), Abort> {
        match entry.rule() {
            Rule::ErrorCount if value != 0 && Self::has(Services::FAULTS) => Err(Abort::InvalidValue),
            Rule::SyncCobId if Self::has(Services::SYNC) => sync::check_cob_id(value),
            Rule::SyncProducer if Self::has(Services::SYNC_PRODUCER) => {
                sync::check_producer(self.word(entry.field), value)
            }
            Rule::TimeCobId if Self::has(Services::TIME) => {
                time_stamp::check_cob_id(self.word(entry.field), value)
            }
            Rule::SyncOverflow if Self::has(Services::SYNC) => {
                sync::check_overflow(value, self.number(0x1006, 0))
            }
            Rule::EmcyCobId if Self::has(Services::EMCY) => {
                CobId::check_change(self.word(entry.field), value)
            }
            Rule::EmcyWatch if Self::has(Services::EMCY_CONSUMER) => {
                CobId::check_change(self.word(entry.field), value)
            }
            Rule::SdoServerCobId if Self::has(Services::SDO_SERVERS) => {
                CobId::check_change(self.word(entry.field), value)
            }
            Rule::SdoClientCobId if Self::has(Services::SDO_CLIENT) => self.check_client(entry, value),
            Rule::StartUp if Self::has(Services::SELF_START) => {
                if matches!(value, 0 | SELF_START) {
                    Ok(())
                } else {
                    Err(Abort::InvalidValue)
                }
            }
            Rule::ProgramControl if Self::has(Services::PROGRAM_CONTROL) => check_program_control(value),
            Rule::Store | Rule::Restore | Rule::StoreCalibration | Rule::Setting
                if Self::has(Services::STORE) =>
            {
                self.check_job(self.command(entry, value)?)
            }
            rule if rule.is_command() => Err(Abort::NotStored),
            Rule::HeartbeatWatch if Self::has(Services::HEARTBEAT_CONSUMER) => self.check_watch(entry, value),
            Rule::PdoCobId
            | Rule::PdoPredefined
            | Rule::PdoType
            | Rule::PdoInhibit
            | Rule::PdoSyncStart
            | Rule::PdoCount
            | Rule::PdoSlot
                if Self::has_process() =>
            {
                self.check_pdo(entry, value)
            }
            _ => Ok(()),
        }
    }

    /// Hands a new value to the protocol that uses it, or carries out a command.
    fn apply(&mut self, entry: &Entry, value: u32, now: Tick) {
        match entry.rule() {
            Rule::HeartbeatTime => {
                self.heartbeat.set_period(low_half(value), now);
                if Self::has(Services::GUARDING) {
                    self.configure_guarding(now);
                }
            }
            Rule::ErrorCount if Self::has(Services::EMCY) => self.emcy.clear_history(),
            Rule::TimeCobId if Self::has(Services::TIME) => self.configure_time(),
            Rule::GuardTime | Rule::LifeTimeFactor if Self::has(Services::GUARDING) => {
                self.configure_guarding(now);
            }
            Rule::SyncCobId | Rule::SyncProducer | Rule::SyncPeriod | Rule::SyncOverflow
                if Self::has(Services::SYNC) =>
            {
                self.configure_sync(now);
            }
            Rule::SyncWindow if Self::has(Services::SYNC) => self.sync.set_window(value),
            Rule::EmcyInhibit if Self::has(Services::EMCY) => self.emcy.set_inhibit(low_half(value), now),
            Rule::EmcyCobId if Self::has(Services::EMCY) && self.emcy.configure(value) => {
                self.report_active(now);
            }
            Rule::ProgramControl if Self::has(Services::PROGRAM_CONTROL) => self.control_program(value),
            Rule::Store | Rule::Restore | Rule::StoreCalibration | Rule::Setting
                if Self::has(Services::STORE) =>
            {
                // `check` has made sure that the job can begin.
                let _ = self.command(entry, value).and_then(|job| self.begin_deferred(job));
            }
            Rule::HeartbeatWatch if Self::has(Services::HEARTBEAT_CONSUMER) => {
                self.configure_watch(entry.sub(), now);
            }
            Rule::ScannerCount | Rule::ScannerLine if Self::has(Services::MULTIPLEXED_TPDO) => {
                self.restart_scanner();
            }
            Rule::PdoCobId
            | Rule::PdoPredefined
            | Rule::PdoType
            | Rule::PdoInhibit
            | Rule::PdoEventTimer
            | Rule::EventTimerOf(_)
            | Rule::PdoSyncStart
                if Self::has_process() =>
            {
                self.configure_pdo(entry, now);
            }
            _ => (),
        }
        if matches!(
            entry.rule(),
            Rule::SyncCobId
                | Rule::SyncProducer
                | Rule::TimeCobId
                | Rule::PdoCobId
                | Rule::PdoPredefined
                | Rule::HeartbeatWatch
                | Rule::EmcyWatch
                | Rule::SdoServerCobId
                | Rule::SdoClientCobId
        ) && Self::has(Services::FAULTS)
        {
            self.pending.identifiers_changed();
        }
    }
}

/// The string that an upload returns: without the zeros at its end. An empty string is one zero.
fn text(value: &[u8]) -> &[u8] {
    let len = value.iter().rposition(|&byte| byte != 0).map_or(1, |last| last + 1);
    value.get(..len).unwrap_or(value)
}
