//! The update of one node. The job keeps its state while the node is lost, so that the update can continue afterwards.

use canopen::sdo::{Abort, Multiplexer};
use canopen::{Duration, Instant, NodeId};

use ::update::Refusal;

use super::image::version;
use super::waiting::{POLL, Patience, RESTART, pauses, wait_for_return, wait_until_running};
use super::{AuthorisationKey, Command, Error, Image, Program, Status, Step, Watcher, trial};
use crate::object::at;
use crate::sdo::{self, Client};
use crate::{Network, value};

/// How long a program may still run after the command to stop it. A node that has lost its power in the meantime runs its
/// program again.
const STOP: Duration = Duration::from_millis(5_000);
/// How often a node gets the command to stop its program.
const STOPS: usize = 3;
/// How long the rest of a broken download may take to arrive.
const REST: Duration = Duration::from_millis(4_000);
/// How long a node may take to erase the flash, or to check the program.
const FLASH: Duration = Duration::from_millis(60_000);
/// The number of tries to clear the flash when the node refuses although its flash is not busy.
const CLEARS: usize = 5;
/// How often a run continues after the node was lost.
const RESUMES: usize = 10;
/// How often a run continues after another client was in the way.
const DISTURBANCES: usize = 5;

/// The options of an update.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Time-outs and retries of the transfers.
    pub sdo: sdo::Options,
    /// How long to wait for a node that is lost.
    pub patience: Duration,
    /// Update also where the node runs this program already, or a newer one.
    pub force: bool,
    /// The key for nodes that demand an authorisation.
    pub key: Option<AuthorisationKey>,
    /// Whether to confirm the new program once it runs. Otherwise the program stays on trial, and the node may take it
    /// back.
    pub confirm: bool,
}

/// The result of the update of a node.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// Version before the update (100Ah), where a program ran.
    pub old_version: Option<String>,
    /// Identification before the update (1F56h).
    pub old_identification: Option<u32>,
    /// Version after the update.
    pub new_version: Option<String>,
    /// Identification after the update.
    pub new_identification: Option<u32>,
    /// Whether a program was downloaded. `false` when the node had this program already.
    pub is_changed: bool,
    /// Whether the node may still take the program back.
    pub is_on_trial: bool,
}

/// The state of the program on a node.
#[derive(Clone, Debug, Default)]
struct State {
    is_running: bool,
    version: Option<String>,
    identification: Option<u32>,
    /// Whether the program is valid, by the status that the loader tells.
    is_valid: bool,
}

/// The progress of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Progress {
    /// The node is unchanged.
    Untouched,
    /// The old program is erased: a program that is there afterwards is the new one.
    Cleared,
    /// The new program is downloaded and valid.
    Complete,
    /// The loader has a complete program of an earlier download, which the user may have interrupted. Its identification
    /// is known once it runs.
    Found,
}

/// The update of one node.
pub(super) struct Job<'a> {
    pub(super) node: NodeId,
    image: &'a Image,
    options: &'a Options,
    before: Option<State>,
    progress: Progress,
    /// How often the node may still be told to stop its program.
    stops: usize,
    /// Whether a download in blocks has failed.
    has_failed: bool,
}

impl<'a> Job<'a> {
    pub(super) fn new(node: NodeId, image: &'a Image, options: &'a Options) -> Job<'a> {
        Job {
            node,
            image,
            options,
            before: None,
            progress: Progress::Untouched,
            stops: STOPS,
            has_failed: false,
        }
    }

    /// Runs the update, and continues after each loss of the node or of the bus that is not longer than `patience`.
    pub(super) fn run(
        &mut self,
        network: &mut Network,
        patience: Patience,
        watcher: &mut dyn Watcher,
    ) -> Result<Outcome, Error> {
        let (mut resumes, mut disturbances) = (RESUMES, DISTURBANCES);
        for pause in pauses().take(RESUMES + DISTURBANCES) {
            match self.attempt(network, watcher) {
                // A node that has never answered does not count as lost.
                Err(error) if error.can_continue() && self.is_lost(&error) && resumes > 0 => {
                    resumes -= 1;
                    watcher.step(self.node, Step::Lost);
                    wait_for_return(network, self.node, self.options.sdo, patience)?;
                    watcher.step(self.node, Step::Back);
                }
                Err(error) if error.is_disturbance() && disturbances > 0 => {
                    disturbances -= 1;
                    watcher.step(self.node, Step::Disturbed);
                    wait_for_return(network, self.node, self.options.sdo, patience)?;
                }
                result => return result,
            }
            // A bus that is lost in the pause is noticed afterwards.
            let _ = network.pause(pause);
        }
        self.attempt(network, watcher)
    }

    /// Whether an error means that something was there before.
    fn is_lost(&self, error: &Error) -> bool {
        self.before.is_some() || error.is_bus_lost()
    }

    /// Brings the node from any state to the new program.
    fn attempt(&mut self, network: &mut Network, watcher: &mut dyn Watcher) -> Result<Outcome, Error> {
        watcher.step(self.node, Step::Identify);
        let now = self.settled_state(network, watcher)?;
        if self.before.is_none() {
            self.check(network, &now)?;
            self.before = Some(now.clone());
        }
        let is_there = self.is_there(network, &now)?;
        if !is_there {
            self.replace(network, now.is_running, watcher)?;
        }
        if !(is_there && now.is_running) {
            self.wait_while_busy(network, watcher)?;
            self.open(network)?;
            watcher.step(self.node, Step::Start);
            self.program(network).restart(Command::Start)?;
            self.wait_until_running(network, true, RESTART, "start the new program")?;
        }
        let after = self.state(network)?;
        let is_on_trial = self.end_trial(network, &after, watcher)?;
        Ok(Outcome { is_on_trial, ..self.outcome(after) })
    }

    /// Confirms the new program if the options say so. Returns whether the program is still on trial.
    fn end_trial(
        &self,
        network: &mut Network,
        after: &State,
        watcher: &mut dyn Watcher,
    ) -> Result<bool, Error> {
        // Object 2002h is only known for nodes of this project.
        let Some(info) = &self.image.info else { return Ok(false) };
        if let Some(found) = after.identification.filter(|found| *found != info.identification) {
            return Err(self.is_another(network, info.identification, found)?);
        }
        let is_on_trial = self.program(network).is_on_trial()?;
        if !(is_on_trial && self.options.confirm) {
            return Ok(is_on_trial);
        }
        watcher.step(self.node, Step::Confirm);
        self.open(network)?;
        trial::confirm(network, self.node, self.options.sdo)?;
        Ok(false)
    }

    /// Answers the challenge of a node that demands an authorisation.
    fn open(&self, network: &mut Network) -> Result<(), Error> {
        // Object 2003h is only known for nodes of this project.
        if self.image.info.is_none() {
            return Ok(());
        }
        trial::open(network, self.node, self.options.sdo, self.options.key.as_ref())
    }

    /// The error of a node that runs another program than the new one. A node that has taken the new program back tells
    /// the reason in its status.
    fn is_another(&self, network: &mut Network, expected: u32, found: u32) -> Result<Error, Error> {
        let node = self.node;
        if self.progress == Progress::Found {
            return Ok(Error::OtherDownload { node });
        }
        Ok(match self.program(network).status()? {
            Some(status) if !is_good(status) => Error::Flash { node, status },
            _ => Error::Identification { node, expected, found },
        })
    }

    /// Refuses a wrong image before anything is changed.
    fn check(&self, network: &mut Network, now: &State) -> Result<(), Error> {
        let Some(info) = &self.image.info else { return Ok(()) };
        // A node without the object leaves the check to its bootloader.
        let device = self.program(network).board()?.filter(|device| *device != info.board);
        if let Some(device) = device {
            return Err(Error::Board { node: self.node, image: info.board, device });
        }
        let running = now.version.as_deref().and_then(version);
        match &now.version {
            Some(device) if running > Some(info.version) && !self.options.force => {
                Err(Error::Older { node: self.node, image: info.version.to_string(), device: device.clone() })
            }
            _ => Ok(()),
        }
    }

    /// Replaces the old program by the new one.
    fn replace(
        &mut self,
        network: &mut Network,
        is_running: bool,
        watcher: &mut dyn Watcher,
    ) -> Result<(), Error> {
        // Object 2002h is only known for nodes of this project.
        if is_running && self.image.info.is_some() && self.program(network).is_on_trial()? {
            return Err(Error::OnTrial { node: self.node });
        }
        // A node that is open now is closed when the new program runs, and the key is needed to confirm it.
        if self.image.info.is_some() && self.options.key.is_none() && self.program(network).is_guarded()? {
            return Err(Error::Closed { node: self.node });
        }
        self.open(network)?;
        if is_running {
            watcher.step(self.node, Step::Stop);
            self.stop(network)?;
        }
        let cleared = self.clear(network, watcher);
        self.progress = match (cleared, self.progress) {
            // The download was complete when the node was lost, so the program on trial is the new one.
            (Err(Error::OnTrial { .. }), Progress::Cleared) => Progress::Complete,
            (Err(Error::OnTrial { .. }), _) if self.image.info.is_some() => Progress::Found,
            (cleared, _) => {
                cleared?;
                self.progress = Progress::Cleared;
                self.fill(network, watcher)?;
                Progress::Complete
            }
        };
        Ok(())
    }

    /// Stops the program. The command is in the RAM of the node: after a loss of power, the program runs again.
    fn stop(&mut self, network: &mut Network) -> Result<(), Error> {
        self.program(network).restart(Command::Stop)?;
        self.stops = self.stops.saturating_sub(1);
        match self.wait_until_running(network, false, STOP, "stop its program") {
            Err(Error::Stuck { node, .. }) if self.stops > 0 => Err(Error::Left { node }),
            result => result,
        }
    }

    /// Downloads the new program into the cleared flash, and waits until the node has checked it.
    fn fill(&mut self, network: &mut Network, watcher: &mut dyn Watcher) -> Result<(), Error> {
        self.download(network, watcher)?;
        watcher.step(self.node, Step::Verify);
        self.wait_for_flash(network, is_good)?;
        self.compare(network)
    }

    fn compare(&self, network: &mut Network) -> Result<(), Error> {
        match (&self.image.info, self.program(network).identification()?) {
            (Some(info), Some(found)) if found != info.identification => {
                Err(Error::Identification { node: self.node, expected: info.identification, found })
            }
            _ => Ok(()),
        }
    }

    /// Clears the program. A node whose update was interrupted may still be busy with its flash, and refuses the
    /// command until it is done.
    fn clear(&self, network: &mut Network, watcher: &mut dyn Watcher) -> Result<(), Error> {
        self.wait_while_busy(network, watcher)?;
        watcher.step(self.node, Step::Clear);
        let until = network.now() + FLASH;
        let mut tries = CLEARS;
        while let Err(error) = self.program(network).command(Command::Clear) {
            if self.program(network).status()?.is_some_and(is_on_trial) {
                return Err(Error::OnTrial { node: self.node });
            }
            if error.abort().is_some() && self.program(network).is_running()? {
                return Err(Error::Left { node: self.node });
            }
            tries -= 1;
            let is_late = network.now() >= until;
            if tries == 0 || is_late || error.abort().is_none() {
                return Err(error.into());
            }
            network.pause(POLL)?;
            self.wait_while_busy(network, watcher)?;
        }
        self.wait_for_flash(network, is_cleared)
    }

    /// Waits until the flash is no longer busy with an earlier command. Returns whether it was.
    fn wait_while_busy(&self, network: &mut Network, watcher: &mut dyn Watcher) -> Result<bool, Error> {
        let is_busy = self.program(network).status()?.is_some_and(|status| status.busy);
        if is_busy {
            watcher.step(self.node, Step::Busy);
            self.wait_for_flash(network, |_| true)?;
        }
        Ok(is_busy)
    }

    /// Downloads the program in blocks; in segments where the node does not support blocks.
    fn download(&mut self, network: &mut Network, watcher: &mut dyn Watcher) -> Result<(), Error> {
        let (node, total, begin) = (self.node, self.image.bytes.len(), network.now());
        watcher.step(node, Step::Download);
        let mut arrived = 0;
        let blocks = self.program(network).download_blocks(&self.image.bytes, |done| {
            arrived = done;
            watcher.progress(node, done, total);
        });
        let Err(error) = blocks else { return Ok(()) };
        let is_protocol = error.abort().is_some_and(sdo::AbortCode::is_protocol);
        let is_disturbed = network.has_other_request_since(node, begin);
        let is_first = !std::mem::replace(&mut self.has_failed, true);
        if !is_protocol || is_disturbed || arrived > 0 && is_first {
            return Err(self.reason(network, error, begin, arrived));
        }
        if arrived > 0 {
            self.clear(network, watcher)?;
        }
        watcher.step(node, Step::DownloadSegments);
        let segments = self.program(network).download_segments(&self.image.bytes, |done| {
            arrived = done;
            watcher.progress(node, done, total);
        });
        segments.map_err(|error| self.reason(network, error, begin, arrived))
    }

    /// Why the download has failed. The status of the node has the details, which the abort code has not. Without a reason in
    /// the status, the frames of the download may have been mixed up with those of another client.
    fn reason(&self, network: &mut Network, error: sdo::Error, begin: Instant, arrived: usize) -> Error {
        // The node also answers the segments that were on their way.
        let _ = network.wait_for_silence(self.node, POLL, REST);
        let is_refused = |status: &Status| !status.busy && status.code != 0;
        let code = error.abort().filter(|code| !code.is_time_out());
        let status = code.and_then(|_| self.program(network).status().ok().flatten());
        match status.filter(is_refused) {
            Some(status) => Error::Flash { node: self.node, status },
            // The node may have taken a segment for any request.
            None if code.is_some() && network.has_other_request_since(self.node, begin) => {
                Error::Mixed(error)
            }
            None if arrived > 0 && code.is_some_and(is_of_a_mixture) => Error::Mixed(error),
            None => error.into(),
        }
    }

    /// Waits until the flash is no longer busy. Fails unless the status then `is_fine`.
    fn wait_for_flash(&self, network: &mut Network, is_fine: impl Fn(Status) -> bool) -> Result<(), Error> {
        let until = network.now() + FLASH;
        while network.now() < until {
            match self.program(network).status()? {
                Some(status) if status.busy => network.pause(POLL)?,
                Some(status) if !is_fine(status) => return Err(Error::Flash { node: self.node, status }),
                _ => return Ok(()),
            }
        }
        Err(Error::Stuck { node: self.node, what: "get done with its flash" })
    }

    /// Waits until the node is back from a restart, with or without a running program as `wanted`. A node that answers may
    /// take until `limit`.
    fn wait_until_running(
        &self,
        network: &mut Network,
        wanted: bool,
        limit: Duration,
        what: &'static str,
    ) -> Result<(), Error> {
        wait_until_running(network, self.node, self.options.sdo, (wanted, limit), what)
    }

    /// The state of a node whose loader is not busy. One that lost its power in a copy finishes the copy first, and has
    /// another program then.
    fn settled_state(&self, network: &mut Network, watcher: &mut dyn Watcher) -> Result<State, Error> {
        let now = self.state(network)?;
        let is_settled = now.is_running || !self.wait_while_busy(network, watcher)?;
        if is_settled { Ok(now) } else { self.state(network) }
    }

    fn state(&self, network: &mut Network) -> Result<State, Error> {
        let is_running = self.program(network).is_running()?;
        let identification = self.program(network).identification()?;
        // 100Ah of a loader is the version of the loader, not of the program.
        let version = if is_running { self.text(network, at(0x100A, 0))? } else { None };
        let is_valid = is_running || self.program(network).status()?.is_none_or(is_good);
        Ok(State { is_running, version, identification, is_valid })
    }

    fn outcome(&self, after: State) -> Outcome {
        let before = self.before.clone().unwrap_or_default();
        Outcome {
            old_version: before.version,
            old_identification: before.identification,
            new_version: after.version,
            new_identification: after.identification,
            is_changed: self.progress != Progress::Untouched,
            is_on_trial: false,
        }
    }

    /// Whether the node has the new program. A forced update has to clear and download first, even if the node has the
    /// program already. If a loader does not tell its program (1F56h reads 0), the download is trusted.
    fn is_there(&self, network: &mut Network, now: &State) -> Result<bool, Error> {
        let is_complete = self.progress == Progress::Complete;
        let Some(info) = &self.image.info else { return Ok(is_complete) };
        let is_it =
            now.is_valid && now.identification.map_or(is_complete, |found| found == info.identification);
        if !is_it || is_complete || !self.options.force {
            return Ok(is_it);
        }
        // A node that keeps its old program while it receives the new one may have the same program as before. Only a new
        // one is on trial.
        let before = self.before.as_ref().and_then(|before| before.identification);
        let is_other = before != Some(info.identification);
        let is_new = is_other || now.is_running && self.program(network).is_on_trial()?;
        Ok(matches!(self.progress, Progress::Cleared | Progress::Found) && is_new)
    }

    fn text(&self, network: &mut Network, at: Multiplexer) -> Result<Option<String>, Error> {
        match Client::new(network, self.node, self.options.sdo).upload(at) {
            Ok(bytes) => Ok(Some(value::text(&bytes))),
            Err(error) if error.is_absent() => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    fn program<'n>(&self, network: &'n mut Network) -> Program<'n> {
        Program::new(network, self.node, self.options.sdo)
    }
}

/// Whether a server aborts with this code when it takes frames of another transfer for segments, or segments twice.
fn is_of_a_mixture(code: sdo::AbortCode) -> bool {
    code.is_protocol() || code == Abort::TooLong.into() || code == Abort::TooShort.into()
}

/// Whether a status means a valid program that can be started.
fn is_good(status: Status) -> bool {
    status == Status::GOOD
}

/// Whether a status means that the program has to be confirmed or rolled back first.
fn is_on_trial(status: Status) -> bool {
    status.code == Refusal::OnTrial.code()
}

/// Whether a status means a flash without a program: no error, or no valid program.
fn is_cleared(status: Status) -> bool {
    !status.busy && status.code <= 1
}
