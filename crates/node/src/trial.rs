//! 2002h: the trial of a new program (docs/update.md). The previous program is restored unless the new one is confirmed.

use canopen::sdo::Abort;
use canopen::{CanId, Duration, Frame, Instant};
use profiles::Snapshot;
use profiles::communication::{PROGRAM_STATE, PROGRAM_TRIAL};
use update::{Cause, Log, Programs, Reason, Refusal, Status, Trial};

use crate::Protocol;
use crate::application::NodeApplication;

/// Commands of 2002h:2: "conf" and "back" in ASCII, the first character in the low byte.
const CONFIRM: [u8; 4] = *b"conf";
const TAKE_BACK: [u8; 4] = *b"back";

/// Time after its start at which a program is confirmed, if it is on the bus, measures, and has been addressed by a
/// master.
const CONFIRMATION: Duration = Duration::from_millis(10_000);

/// Time for the answer to a command to be sent.
const FAREWELL: Duration = Duration::from_millis(20);

/// Outcome of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The program works: [`Trial::confirm`].
    Confirm(Cause),
    /// The previous program must come back: [`Trial::withdraw`], and a reset.
    TakeBack(Cause),
}

/// The state of the trial in the running program.
#[derive(Debug, Default)]
pub(crate) struct ProgramTrial {
    state: Trial,
    /// A master has addressed the node.
    is_addressed: bool,
    /// The command that a master has written to 2002h:2.
    command: Option<Verdict>,
    /// Time at which the command is carried out, after the answer to the master.
    due: Option<Instant>,
    verdict: Option<Verdict>,
}

impl ProgramTrial {
    /// 2002h:1, state.
    fn state(&self) -> u8 {
        match self.state {
            Trial::None => 0,
            Trial::Begun | Trial::Open | Trial::Lost(_) => 1,
            Trial::Over(Reason::Starts) => 2,
            Trial::Over(Reason::Withdrawn) => 3,
        }
    }

    /// Whether the program is still on trial.
    pub(crate) fn is_open(&self) -> bool {
        self.state == Trial::Open
    }

    /// Why the previous program was restored, in the codes of 1F57h; `None` if it was not.
    pub(crate) fn flash_status(&self) -> Option<u32> {
        let Trial::Over(reason) = self.state else { return None };
        Some(Status::refused(Refusal::TakenBack { reason }).word())
    }

    /// Handles a write to 2002h:2.
    pub(crate) fn command(&mut self, bytes: &[u8], is_at_work: bool, who: Cause) -> Result<(), Abort> {
        let verdict = match <[u8; 4]>::try_from(bytes) {
            Ok(CONFIRM) if is_at_work => Verdict::Confirm(who),
            Ok(CONFIRM) => return Err(Abort::DeviceState),
            Ok(TAKE_BACK) => Verdict::TakeBack(who),
            _ => return Err(Abort::InvalidValue),
        };
        if self.state != Trial::Open {
            return Err(Abort::DeviceState);
        }
        self.command = Some(verdict);
        Ok(())
    }
}

impl Protocol {
    /// Takes the state of this program's trial. To be called before the start.
    pub fn set_trial(&mut self, trial: Trial) {
        self.device.application_mut().trial.state = trial;
    }

    /// Takes the programs in the flash.
    pub fn set_programs(&mut self, programs: Programs) {
        self.device.application_mut().programs = programs;
        self.device.show(|application, image| application.show_programs(image));
    }

    /// Takes the log of updates.
    pub fn set_update_log(&mut self, log: Log) {
        self.device.application_mut().update_log = log;
    }

    /// Whether the program is still on trial. Until then stored data must stay as the previous program has stored it,
    /// so that it finds its settings.
    #[must_use]
    pub fn is_on_trial(&self) -> bool {
        self.device.application().trial.is_open()
    }

    /// Whether the previous program was restored, for a fault on the bus.
    #[must_use]
    pub fn is_taken_back(&self) -> bool {
        matches!(self.device.application().trial.state, Trial::Over(_))
    }

    /// Takes note of a frame from a master: an NMT command, a request to the SDO server, or a monitored heartbeat.
    /// Frames for other nodes do not arrive here. With a key (2003h), frames count once its holder has answered the
    /// challenge.
    pub(crate) fn note_master(&mut self, frame: &Frame) {
        const FUNCTION: u16 = 0x780;
        let function = frame.id() & FUNCTION;
        let application = self.device.application_mut();
        if frame.id() == CanId::NMT.get() || matches!(function, 0x600 | 0x700) {
            application.trial.is_addressed |= application.authorisation.is_open();
        }
    }

    /// Judges the trial, for [`verdict`](Protocol::verdict). `now` counts from the start of the program.
    pub fn judge(&mut self, now: Instant, is_on_bus: bool) {
        if self.is_on_trial() {
            let verdict = self.commanded(now).or_else(|| self.found(now, is_on_bus));
            self.device.application_mut().trial.verdict = verdict;
        }
    }

    /// The outcome of the trial, if decided. It stays until it has been carried out.
    #[must_use]
    pub fn verdict(&self) -> Option<Verdict> {
        self.device.application().trial.verdict
    }

    /// The command of a master, once its answer has had time to be sent.
    fn commanded(&mut self, now: Instant) -> Option<Verdict> {
        let trial = &mut self.device.application_mut().trial;
        trial.command?;
        let due = *trial.due.get_or_insert(now + FAREWELL);
        trial.command.filter(|_| now >= due)
    }

    /// The verdict without a command: from the state of the node and the times of 2002h.
    fn found(&self, now: Instant, is_on_bus: bool) -> Option<Verdict> {
        let is_well = is_on_bus && self.is_at_work();
        let [limit, automatic] = [3, 4].map(|sub| self.seconds(sub));
        let is_past = |time: Option<Duration>| time.is_some_and(|time| now >= Instant(0) + time);
        let is_addressed = self.device.application().trial.is_addressed;
        let is_confirmed = is_addressed && is_past(Some(CONFIRMATION)) || is_past(automatic);
        if is_well && is_confirmed {
            Some(Verdict::Confirm(if is_addressed { Cause::Master } else { Cause::Time }))
        } else {
            is_past(limit).then_some(Verdict::TakeBack(Cause::Time))
        }
    }

    /// Ends the trial: the program is confirmed.
    pub fn end_trial(&mut self) {
        self.device.application_mut().trial = ProgramTrial::default();
        self.device.show(|application, image| application.show_trial(image));
    }

    /// A time of 2002h; `None` if it is 0.
    fn seconds(&self, sub: u8) -> Option<Duration> {
        let dictionary = self.device.application().setup.personality.dictionary();
        let entry = dictionary.find(PROGRAM_TRIAL, sub).ok()?;
        let [low, high] = *entry.field().get(self.device.image()).first_chunk()?;
        let seconds = u64::from(u16::from_le_bytes([low, high]));
        (seconds > 0).then_some(Duration(seconds * 1_000_000))
    }
}

impl NodeApplication {
    pub(crate) fn show_trial(&self, image: &mut [u8]) {
        self.show(PROGRAM_TRIAL, 1, &[self.trial.state()], image);
    }

    pub(crate) fn show_programs(&self, image: &mut [u8]) {
        let Programs { counter, generation, staged, kept, erases, clears_allowed } = self.programs;
        self.show(PROGRAM_STATE, 3, &[(generation & 0xFF) as u8], image);
        self.show(PROGRAM_STATE, 6, &erases.to_le_bytes(), image);
        self.show(PROGRAM_STATE, 7, &[clears_allowed], image);
        for (sub, word) in [(2, counter), (4, staged), (5, kept)] {
            self.show(PROGRAM_STATE, sub, &word.to_le_bytes(), image);
        }
    }

    /// Whether values have been measured.
    pub(crate) fn has_measured(&self) -> bool {
        !matches!(self.snapshot, Snapshot::Nothing)
    }
}
