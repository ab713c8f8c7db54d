//! SDO access to the dictionary: the rules of the communication objects.

use super::body::Body;
use super::full::Full;
use super::pdos::low_half;
use super::{Application, Job, Part, STALE};
use crate::dictionary::{Entry, Rule, Services, Type, little_endian};
use crate::sdo::{Abort, Multiplexer, Objects, Writable};
use crate::{Instant, emcy, sync};

impl<B: Body> Objects for B {
    const BLOCK_UPLOAD: bool = B::Application::BLOCK_UPLOAD;

    fn read(&self, at: Multiplexer) -> Result<&[u8], Abort> {
        let basic = self.basic();
        let entry = basic.dictionary.find(at.index, at.sub)?;
        if !entry.attributes.access.is_readable() {
            return Err(Abort::WriteOnly);
        }
        match entry.attributes.kind {
            Type::Domain => basic.application.read_domain(at),
            Type::VisibleString(_) => Ok(text(entry.field.get(&basic.image))),
            _ if entry.rule().is_computed() => self.computed(&entry),
            _ => Ok(entry.field.get(&basic.image)),
        }
    }

    fn writable(&self, at: Multiplexer) -> Result<Writable, Abort> {
        let entry = self.basic().dictionary.find(at.index, at.sub)?;
        if !entry.is_writable() {
            return Err(Abort::ReadOnly);
        }
        Ok(if entry.is_domain() { Writable::Stream } else { Writable::Value(entry.field.size.into()) })
    }

    fn write(&mut self, at: Multiplexer, bytes: &[u8], now: Instant) -> Result<(), Abort> {
        let found = self.basic().dictionary.find(at.index, at.sub);
        // By reference: a move out of the result takes a dozen instructions.
        let entry = found.as_ref().map_err(|abort| *abort)?;
        if !entry.is_writable() {
            return Err(Abort::ReadOnly);
        }
        self.basic().application.admits(entry)?;
        if entry.is_domain() {
            return write_domain(self, at, bytes);
        }
        entry.check_length(bytes.len())?;
        let value = little_endian(bytes);
        entry.check_value(value)?;
        let job = self.check_store(entry)?;
        match entry.rule() {
            Rule::Plain => entry.field.set_number(&mut self.basic_mut().image, value, bytes),
            _ => write_by_rule(self, entry, value, bytes, now)?,
        }
        let basic = self.basic_mut();
        if entry.is_parameter() {
            basic.pending.parameters_changed();
        }
        basic.application.written(entry, &mut basic.image);
        job.map_or(Ok(()), |job| self.store_at_once(job))
    }

    fn take_deferred(&mut self) -> bool {
        Body::take_deferred(self)
    }

    fn stream(&mut self, at: Multiplexer, part: Part<'_>) -> Result<(), Abort> {
        self.basic_mut().application.write_domain(at, part)
    }
}

/// Writes a domain whose download arrived in one piece.
fn write_domain(body: &mut impl Body, at: Multiplexer, bytes: &[u8]) -> Result<(), Abort> {
    let application = &mut body.basic_mut().application;
    application.write_domain(at, Part::Begin(Some(bytes.len())))?;
    application.write_domain(at, Part::Data(0, bytes))?;
    application.write_domain(at, Part::End(bytes.len()))
}

/// Writes an entry whose rule does more than storing a value.
#[inline(never)]
fn write_by_rule(
    body: &mut impl Body,
    entry: &Entry,
    value: u32,
    bytes: &[u8],
    now: Instant,
) -> Result<(), Abort> {
    let basic = body.basic_mut();
    let rule = entry.rule();
    if rule == Rule::Application {
        basic.application.write(entry, bytes, &mut basic.image)?;
        basic.pending.parameters_changed();
    } else {
        body.admit(entry, value)?;
    }
    let basic = body.basic_mut();
    if !rule.is_computed() && !rule.is_command() {
        entry.field.set(&mut basic.image, bytes);
    }
    if rule == Rule::HeartbeatTime {
        basic.heartbeat.set_period(low_half(value), now);
    }
    body.value_written(entry, value, now);
    let basic = body.basic_mut();
    (basic.process_due, basic.services_due) = (STALE, STALE);
    Ok(())
}

impl<
    A: Application,
    const N: usize,
    const T: usize,
    const R: usize,
    const W: usize,
    const M: usize,
    const S: u16,
> Full<A, N, T, R, W, M, S>
{
    /// Whether the rule of the entry allows the value.
    pub(super) fn admit_value(&mut self, entry: &Entry, value: u32) -> Result<(), Abort> {
        match entry.rule() {
            Rule::ErrorCount if value != 0 => Err(Abort::InvalidValue),
            Rule::SyncCobId if Self::has(Services::SYNC) => sync::check_cob_id(value),
            Rule::SyncOverflow if Self::has(Services::SYNC) => {
                sync::check_overflow(value, self.basic().number(0x1006, 0))
            }
            Rule::EmcyCobId if Self::has(Services::EMCY) => {
                emcy::check_cob_id(self.basic().word(entry.field), value)
            }
            Rule::StartUp if value != 0 && value != super::state::SELF_START => Err(Abort::InvalidValue),
            Rule::Store | Rule::Restore | Rule::StoreCalibration | Rule::Setting
                if !Self::has(Services::STORE) =>
            {
                Err(Abort::NotStored)
            }
            Rule::Store | Rule::Restore => self.admit_store(entry, value),
            Rule::StoreCalibration => self.admit_store_calibration(value),
            Rule::Setting => self.begin_deferred(Job::Setting(value.to_le_bytes()[0])),
            Rule::ProgramControl => self.admit_program_control(value),
            Rule::HeartbeatWatch if W > 0 => self.admit_watch(entry, value),
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

    /// Hands a new value to the protocol that uses it.
    pub(super) fn apply_value(&mut self, entry: &Entry, value: u32, now: Instant) {
        match entry.rule() {
            Rule::Application => self.apply_application_changes(now),
            Rule::ErrorCount => self.emcy.clear_history(),
            Rule::SyncCobId | Rule::SyncPeriod | Rule::SyncWindow | Rule::SyncOverflow
                if Self::has(Services::SYNC) =>
            {
                self.configure_sync(now);
            }
            Rule::EmcyInhibit if Self::has(Services::EMCY) => self.emcy.set_inhibit(low_half(value), now),
            Rule::EmcyCobId if Self::has(Services::EMCY) && self.emcy.configure(value) => {
                self.report_active(now);
            }
            Rule::HeartbeatWatch if W > 0 => self.configure_watch(entry.sub(), now),
            Rule::ScannerLine if M > 0 => self.configure_pdos(now),
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
            self.basic.pending.identifiers_changed();
        }
    }
}

/// The string that an upload returns: without the zeros at its end.
fn text(value: &[u8]) -> &[u8] {
    value.split(|&byte| byte == 0).next().unwrap_or(value)
}
