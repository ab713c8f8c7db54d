//! Storing and restoring: objects 1010h, 1011h and 1F51h, settings, the LSS configuration, and loading at the start.
//!
//! The device does not access the memory. It hands a [`Job`] to its caller, and answers the client when the job is
//! done.

use super::Definition;
use super::inner::Inner;
use super::state::Scope;
use super::{Action, Application, Device, Next, STALE};
use crate::dictionary::{Entry, Group, Groups, Rule, Services};
use crate::emcy::Fault;
use crate::lss::Configuration;
use crate::nmt::State;
use crate::sdo::Abort;
use crate::{Duration, Instant, Transmit};

/// Signatures that 1010h and 1011h take: "save" and "load".
const SAVE: u32 = u32::from_le_bytes(*b"save");
const LOAD: u32 = u32::from_le_bytes(*b"load");

/// Commands of 1F51h (CiA 302-3). Only the bootloader can clear a program.
const STOP_PROGRAM: u32 = 0;
const START_PROGRAM: u32 = 1;
const RESET_PROGRAM: u32 = 2;

/// A job to store or restore values. The caller copies the values after the job has been handed over, and reports its
/// end by [`Device::finish`]. If another request for the same [`Job::Store`] comes in between, there may be newer values:
/// the device hands the job over a second time, and the response waits for the second run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Job {
    /// Store the present values of these groups.
    Store(Groups),
    /// Restore the defaults of these groups with the next reset: erase the stored values of the groups.
    Restore(Groups),
    /// Store node-ID and bit rate.
    Configure(Configuration),
    /// Store the value of the entry that is a [`setting`](crate::dictionary::Object::setting).
    Setting(u8),
}

/// The stored values of a group, and their condition.
#[derive(Clone, Copy, Debug)]
pub struct Stored<'a> {
    /// The values in the format of [`Dictionary::pack`](crate::dictionary::Dictionary::pack); empty for the defaults.
    pub packed: &'a [u8],
    /// Whether these are the newest values that were stored.
    pub soundness: Soundness,
}

/// Whether the newest stored values of a group could be read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Soundness {
    /// The newest stored values were read, or nothing has ever been stored.
    #[default]
    Whole,
    /// The newest stored values are damaged; these are from the save before.
    Older,
    /// The stored values are damaged, and no older ones are left.
    Lost,
}

/// The soundness of the stored values of all groups.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Damage {
    /// The groups whose stored values are lost.
    lost: Groups,
    /// The groups whose values are from the save before.
    older: Groups,
}

impl Damage {
    /// The stored values of every group are whole.
    pub const NONE: Damage = Damage { lost: Groups::NONE, older: Groups::NONE };

    /// Sets the soundness of a group.
    pub fn set(&mut self, group: Group, soundness: Soundness) {
        self.lost.set(group, soundness == Soundness::Lost);
        self.older.set(group, soundness == Soundness::Older);
    }

    /// The soundness of a group.
    #[must_use]
    pub fn of(self, group: Group) -> Soundness {
        match (self.lost.contains(group), self.older.contains(group)) {
            (true, _) => Soundness::Lost,
            (_, true) => Soundness::Older,
            _ => Soundness::Whole,
        }
    }
}

/// The job under way, and the clients that wait for its end.
#[derive(Debug)]
#[allow(clippy::struct_excessive_bools)] // Independent flags.
pub(super) struct Jobs {
    running: Option<Job>,
    /// The job waits to be handed over.
    is_new: bool,
    /// An equal request has followed the handover, so the job runs a second time.
    is_repeated: bool,
    /// Whether the SDO request just served has begun the job or waits for it.
    is_deferred: bool,
    lss_waits: bool,
}

impl Jobs {
    pub(super) const fn new() -> Jobs {
        Jobs { running: None, is_new: false, is_repeated: false, is_deferred: false, lss_waits: false }
    }

    /// Whether the response to the request just served has to wait. Returns `true` once.
    pub(super) fn take_deferred(&mut self) -> bool {
        core::mem::take(&mut self.is_deferred)
    }

    /// Whether the job waits to be handed over.
    pub(super) fn is_new(&self) -> bool {
        self.is_new
    }

    /// The job that waits to be handed over.
    pub(super) fn hand_over(&mut self) -> Option<Job> {
        self.running.filter(|_| core::mem::take(&mut self.is_new))
    }
}

impl<D: Definition> Device<D> {
    /// Reports the end of the job: `result` goes to the clients that wait for it. If an equal request has followed the
    /// handover, the job is handed over again instead, and the clients wait for the second run. A job may take any time: the
    /// device sends no abort message meanwhile, because the time-out is the client's.
    pub fn finish(&mut self, result: Result<(), Abort>, now: Instant, out: &mut impl Transmit) -> Next {
        let now = self.tick(now);
        let jobs = &mut self.inner.jobs;
        if jobs.running.is_some() && core::mem::take(&mut jobs.is_repeated) {
            jobs.is_new = true;
            self.inner.pending.job_waits();
            self.inner.services_due = STALE;
            return self.process_next();
        }
        if Inner::<D>::has(Services::STORE) && result.is_ok() {
            self.inner.note_restore();
        }
        let lss_waits = core::mem::take(&mut self.inner.jobs).lss_waits;
        let context = &mut self.services.context(now, out);
        self.finish_job(result, lss_waits, context);
        self.process_next()
    }

    /// Whether a pause of `span` disturbs no service, for example while the erase of a flash page stops the core. The
    /// device is Pre-operational or Stopped. No SDO transfer is under way, except one whose response waits for a job. The
    /// next heartbeat is sent within 1.5 times the heartbeat time (1017h), and neither a heartbeat of another node (1016h)
    /// nor a remote frame of a guarding master (100Ch) nor an own SYNC (1006h) is due.
    #[must_use]
    pub fn can_pause(&self, span: Duration, now: Instant) -> bool {
        let inner = &self.inner;
        let due = inner.heartbeat.latest().min(inner.watches.due()).min(inner.guarding.due());
        let due = due.min(inner.sync_producer.due());
        matches!(inner.state, State::PreOperational | State::Stopped)
            && self.services.is_between_requests()
            && now + span <= self.clock.instant(due)
    }
}

impl Default for Jobs {
    fn default() -> Jobs {
        Jobs::new()
    }
}

impl<D: Definition> Inner<D> {
    /// Whether a job could begin now. Another job is refused while one runs.
    pub(super) fn check_job(&self, job: Job) -> Result<(), Abort> {
        match self.jobs.running {
            Some(running) if running != job => Err(Abort::DeviceState),
            _ => self.application.can_store(),
        }
    }

    /// The running job is done: a restored group waits for its reset, a stored one no longer does.
    fn note_restore(&mut self) {
        match self.jobs.running {
            Some(Job::Restore(groups)) => self.restored.set_all(groups, true),
            Some(Job::Store(groups)) => self.restored.set_all(groups, false),
            _ => (),
        }
    }

    /// Hands a job to the caller. An equal [`Job::Store`] that has been handed over already runs again, because its
    /// values may have been copied before this request. The other jobs carry their values.
    fn begin(&mut self, job: Job) -> Result<(), Abort> {
        self.check_job(job)?;
        if self.jobs.running.is_none() {
            (self.jobs.running, self.jobs.is_new) = (Some(job), true);
            self.pending.job_waits();
        } else if matches!(job, Job::Store(_)) && !self.jobs.is_new {
            self.jobs.is_repeated = true;
        }
        Ok(())
    }

    /// The job that a write to the entry begins, for an entry that the application stores at once. Nothing changes: an
    /// error refuses the write. So does a restore that waits for its reset, because the job would store all values of the
    /// group again.
    pub(super) fn job_of(&self, entry: &Entry) -> Result<Option<Job>, Abort> {
        if !Self::has(Services::FAULTS) {
            return Ok(None);
        }
        let groups = self.application.stores(entry).filter(|_| !entry.rule().is_command());
        if Self::has(Services::STORE) && groups.is_some_and(|groups| groups.meets(self.restored)) {
            return Err(Abort::DeviceState);
        }
        let job = groups.map(Job::Store);
        job.map_or(Ok(()), |job| self.check_job(job))?;
        Ok(job)
    }

    /// Begins a job for a value that was received by PDO. No client waits.
    pub(super) fn begin_checked(&mut self, job: Option<Job>) {
        if let Some(job) = job {
            let _ = self.begin(job);
            self.services_due = STALE;
        }
    }

    /// Begins to store a configuration from LSS. `false` when another job is under way.
    pub(super) fn store_configuration(&mut self, configuration: Configuration) -> bool {
        if !Self::has(Services::FAULTS) {
            return false;
        }
        let is_begun = self.begin(Job::Configure(configuration)).is_ok();
        self.jobs.lss_waits |= is_begun;
        is_begun
    }

    /// Begins a job; the response to the client waits for its end.
    pub(super) fn begin_deferred(&mut self, job: Job) -> Result<(), Abort> {
        self.begin(job)?;
        self.jobs.is_deferred = true;
        Ok(())
    }

    /// Stop and reset of the program start the bootloader. The request gets no response; the bootloader answers the
    /// next one.
    pub(super) fn control_program(&mut self, value: u32) {
        if value != START_PROGRAM {
            self.pending.ask(Action::Bootloader);
            self.jobs.is_deferred = true;
        }
    }

    /// The job that a write to a command begins. A calibration cannot be restored: no defaults would fit a real transducer.
    pub(super) fn command(&self, entry: &Entry, value: u32) -> Result<Job, Abort> {
        match (entry.rule(), value) {
            (Rule::Setting, _) => Ok(Job::Setting(value.to_le_bytes()[0])),
            (Rule::StoreCalibration, SAVE) => Ok(Job::Store(Groups::one(Group::Calibration))),
            (Rule::Store, SAVE) => self.groups_of(entry).map(Job::Store),
            (Rule::Restore, LOAD) => self.groups_of(entry).map(Job::Restore),
            _ => Err(Abort::NotStored),
        }
    }

    /// The groups of a sub-index of 1010h or 1011h. Sub-index 1 covers the groups of the product, too.
    fn groups_of(&self, entry: &Entry) -> Result<Groups, Abort> {
        let mut groups = Groups::of_sub(entry.sub()).ok_or(Abort::Access)?;
        if Self::has(Services::OWN_GROUPS) && entry.sub() == 1 {
            for group in Group::OWN {
                groups.set(group, self.dictionary.find(entry.index(), group.sub()).is_ok());
            }
        }
        Ok(groups)
    }

    /// Loads the stored values of a group. If they are damaged or do not fit, the whole group keeps its defaults.
    pub(super) fn load_stored(&mut self, group: Group) {
        let Stored { packed, soundness } = self.application.stored(group);
        let (dictionary, node_id) = (self.dictionary, self.node_id);
        if Self::has(Services::STORE) {
            self.restored.set(group, false);
        }
        // An application that stores nothing returns this constant, and the compiler removes the rest.
        if packed.is_empty() && soundness == Soundness::Whole {
            self.damage.set(group, soundness);
            return self.application.loaded(group, true);
        }
        let fits = dictionary.unpack(group, node_id, packed, self.image.as_mut()).is_ok()
            && self.mappings_are_sound();
        if !fits {
            self.load_defaults(Scope::Group(group));
        }
        let soundness = if fits { soundness } else { Soundness::Lost };
        self.damage.set(group, soundness);
        self.application.loaded(group, soundness == Soundness::Whole);
    }

    /// Sets the faults of the groups that could not be loaded, and clears those of all others, without an EMCY.
    pub(super) fn set_stored(&mut self) {
        let Damage { lost, older } = self.damage;
        let changes = self.emcy.set_stored(lost, older);
        for fault in Fault::of_storage() {
            if changes.has(fault) {
                self.application.fault(fault, self.emcy.has(fault), self.image.as_mut());
            }
        }
    }
}

/// Checks a command for the running program (1F51h).
pub(super) fn check_program_control(value: u32) -> Result<(), Abort> {
    if matches!(value, STOP_PROGRAM | START_PROGRAM | RESET_PROGRAM) {
        Ok(())
    } else {
        Err(Abort::InvalidValue)
    }
}
