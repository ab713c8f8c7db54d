//! The update as a state machine that is polled: each poll does one bounded step.

use crate::area::{Area, Layout};
use crate::clears::Clears;
use crate::copy::Copy;
use crate::download::Download;
use crate::erase::Erase;
use crate::flash::Flash;
use crate::header::Header;
use crate::image::{self, FullCheck};
use crate::record::{Commit, Record};
use crate::refusal::Refusal;
use crate::status::Status;
use crate::target::Target;
use crate::trial::{self, Trial};
use crate::{log, wear};

/// Kind of the next [`Updater::poll`], so that the caller knows when to call it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// Nothing, until the next command.
    Nothing,
    /// The flash erases in the background, 0.5 to 2 s for a sector; poll again after about a millisecond.
    Erasing,
    /// A step: at most 64 words programmed, 1 KiB read, or a part of the signature check. 1 ms typical, 7 ms at most.
    Step,
}

/// Progress of an update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// No update was begun, or it was refused: see [`Updater::status`].
    Idle,
    /// Staging is being erased.
    Clearing,
    /// Staging is erased; a download may begin.
    Cleared,
    /// A download is in progress.
    Receiving,
    /// The staged image is being checked, or the image to be kept or restored.
    Checking,
    /// The staged image is valid and will be copied, whatever happens.
    Committed,
    /// The image is being copied, or the present application is being copied to the area of the kept image.
    Copying,
    /// The image was copied: call [`crate::boot`].
    Installed,
}

/// The state machine. None of its state has to survive a reset: [`crate::boot`] finds the remaining work in flash.
pub struct Updater<F> {
    flash: F,
    target: Target,
    state: State,
    status: Status,
}

#[expect(clippy::large_enum_variant, reason = "there is one machine, and no heap")]
enum State {
    Idle,
    Clearing(Erase),
    Cleared,
    Receiving(Download),
    Checking(FullCheck, Plan),
    Committed,
    Copying(Copy, Plan),
    Installed,
}

/// Purpose of checking and copying an image.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Plan {
    /// Commit the staged image.
    Commit,
    /// Install the staged image as the application.
    Install,
    /// Keep the application while the staged image is on trial; the staged image is installed afterwards.
    Keep,
    /// Restore the kept image as the application.
    Revert,
}

impl Plan {
    /// Source and destination of the image.
    fn areas(self, layout: &Layout) -> (Area, Area) {
        match self {
            Plan::Keep => (layout.application(), layout.kept()),
            Plan::Revert => (layout.kept(), layout.application()),
            Plan::Commit | Plan::Install => (layout.staging(), layout.application()),
        }
    }
}

impl<F: Flash> Updater<F> {
    /// An idle machine. `status` is the value of 1F57h until the first command: [`Status::GOOD`], or the status of
    /// [`crate::Stay`].
    pub fn new(flash: F, target: Target, status: Status) -> Updater<F> {
        Updater { flash, target, state: State::Idle, status }
    }

    /// The flash.
    pub fn flash(&mut self) -> &mut F {
        &mut self.flash
    }

    /// The present phase.
    pub fn phase(&self) -> Phase {
        match self.state {
            State::Idle => Phase::Idle,
            State::Clearing(_) => Phase::Clearing,
            State::Cleared => Phase::Cleared,
            State::Receiving(_) => Phase::Receiving,
            State::Checking(..) => Phase::Checking,
            State::Committed => Phase::Committed,
            State::Copying(..) => Phase::Copying,
            State::Installed => Phase::Installed,
        }
    }

    /// Value of 1F57h.
    pub fn status(&self) -> Status {
        if self.is_busy() { Status::BUSY } else { self.status }
    }

    /// Kind of the next poll.
    pub fn next(&self) -> Next {
        match &self.state {
            State::Clearing(erase) if erase.is_at_work() => Next::Erasing,
            State::Copying(copy, _) if copy.is_erasing() => Next::Erasing,
            _ if self.is_busy() => Next::Step,
            _ => Next::Nothing,
        }
    }

    /// Clears the program (1F51h = 3): starts to erase staging. A download in progress, or an image that was not copied
    /// yet, is lost; the application is unchanged.
    ///
    /// # Errors
    /// [`Refusal::OnTrial`] while the application is on trial, because staging holds its marks;
    /// [`Refusal::Unspecified`] while the machine is busy; [`Refusal::Write`].
    pub fn clear(&mut self) -> Result<(), Refusal> {
        self.not_busy()?;
        // Nothing was programmed since: a command that is repeated wears nothing out.
        if matches!(self.state, State::Cleared) {
            return self.settle(Ok(()));
        }
        let (flash, layout) = (&mut self.flash, &self.target.layout);
        if Trial::read(flash, layout).is_undecided() {
            return self.refuse(Refusal::OnTrial);
        }
        // There is no trial: a record of the kept image that a cut has left pending must not make one later.
        let outcome = trial::kept(layout).done(flash).and_then(|()| trial::staged(layout).revoke(flash));
        self.state = State::Clearing(Erase::new(self.target.layout.staging()));
        wear::count(&mut self.flash, &self.target.layout);
        self.settle(outcome)
    }

    /// Clears the program like [`Updater::clear`], within a budget. A clear that erases nothing costs nothing.
    ///
    /// # Errors
    /// [`Refusal::Worn`] if the budget is used up, and the errors of [`Updater::clear`]. Nothing changes.
    pub fn clear_within(&mut self, clears: &mut Clears) -> Result<(), Refusal> {
        if clears.left() == 0 && !matches!(self.state, State::Cleared) {
            return self.refuse(Refusal::Worn);
        }
        self.clear()?;
        if matches!(self.state, State::Clearing(_)) {
            *clears = clears.spent();
        }
        Ok(())
    }

    /// Begins a download to 1F50h. `size` in bytes, if the client has announced it.
    ///
    /// # Errors
    /// [`Refusal::NotCleared`] without an [`Updater::clear`] before, [`Refusal::TooLong`], [`Refusal::Unspecified`]
    /// while busy.
    pub fn begin(&mut self, size: Option<u32>) -> Result<(), Refusal> {
        self.not_busy()?;
        if !matches!(self.state, State::Cleared) {
            return self.refuse(Refusal::NotCleared);
        }
        if size.is_some_and(|size| size > self.target.layout.longest_image()) {
            return self.refuse(Refusal::TooLong);
        }
        self.state = State::Receiving(Download::new());
        self.settle(Ok(()))
    }

    /// Takes the next bytes of the download, any number. They are programmed before this function returns, in chunks of
    /// 64 words, so a call takes 4 us a byte (25 us at most). An invalid header is refused as soon as it is complete.
    ///
    /// # Errors
    /// The reason for the refusal; the download is over then. [`Refusal::Unspecified`] without a download.
    pub fn receive(&mut self, bytes: &[u8]) -> Result<(), Refusal> {
        let State::Receiving(receiver) = &mut self.state else {
            return Err(Refusal::Unspecified);
        };
        let outcome = receiver.receive(&mut self.flash, &self.target, bytes);
        outcome.or_else(|refusal| self.settle(Err(refusal)))
    }

    /// Ends the download: the image is checked, and committed if it is valid.
    ///
    /// # Errors
    /// The errors of [`Updater::receive`].
    pub fn finish(&mut self) -> Result<(), Refusal> {
        let State::Receiving(receiver) = &mut self.state else {
            return Err(Refusal::Unspecified);
        };
        let complete = receiver.finish(&mut self.flash, &self.target);
        let check = complete.and_then(|()| FullCheck::new(&mut self.flash, &self.target));
        self.check(Plan::Commit, check)
    }

    /// Copies the staged image to the application area, after checking it again. If the present application is
    /// complete, it is kept first, and the new one is then on trial. For a committed image, of this start or of an
    /// earlier one ([`crate::Decision::Copy`]), for which this must be the first command.
    ///
    /// # Errors
    /// [`Refusal::Unspecified`] if nothing is committed, or while busy; the reason why the staged image is refused. It
    /// is not tried again in that case.
    pub fn install(&mut self) -> Result<(), Refusal> {
        self.not_busy()?;
        if !matches!(self.staged().read(&mut self.flash), Commit::Pending | Commit::Done) {
            return Err(Refusal::Unspecified);
        }
        let check = FullCheck::new(&mut self.flash, &self.target);
        self.check(Plan::Install, check)
    }

    /// Copies the kept image back to the application area, after checking it, because the application has lost its
    /// trial or was not restored completely ([`crate::Decision::Revert`]). If the kept image is not valid, the trial
    /// ends without it.
    ///
    /// # Errors
    /// [`Refusal::Unspecified`] if no trial is lost, or while busy; the reason why the kept image is refused.
    pub fn revert(&mut self) -> Result<(), Refusal> {
        self.not_busy()?;
        let layout = &self.target.layout;
        if !Trial::read(&mut self.flash, layout).has_failed() {
            return Err(Refusal::Unspecified);
        }
        trial::fail(&mut self.flash, layout)?;
        let kept = layout.kept();
        let mut header = Header::EMPTY;
        let admitted = image::admitted(&mut self.flash, &self.target, kept, &mut header);
        self.check(Plan::Revert, admitted.map(|()| FullCheck::of(&header, kept, true)))
    }

    /// Starts a check.
    fn check(&mut self, plan: Plan, check: Result<FullCheck, Refusal>) -> Result<(), Refusal> {
        let outcome = match check {
            Ok(check) => {
                self.state = State::Checking(check, plan);
                Ok(())
            }
            Err(refusal) => self.give_up(plan, refusal),
        };
        self.settle(outcome)
    }

    /// Does one step of the operation in progress, if any. Returns the kind of the next poll.
    pub fn poll(&mut self) -> Next {
        let plan = if let State::Copying(_, plan) = self.state { Some(plan) } else { None };
        if let Err(refusal) = self.step() {
            if plan == Some(Plan::Keep) || plan == Some(Plan::Install) && self.has_kept() {
                // The next start must not try the staged image again.
                let _ = self.abandon();
            }
            // The caller can read the result in the status.
            let _ = self.settle(Err(refusal));
        }
        self.next()
    }

    /// Whether the previous program is the kept image, because the application area is being replaced.
    fn has_kept(&mut self) -> bool {
        self.kept().read(&mut self.flash) == Commit::Pending
    }

    /// Gives up the staged image for good. If the previous program is kept, it is restored at the next start.
    fn abandon(&mut self) -> Result<(), Refusal> {
        if self.has_kept() {
            trial::fail(&mut self.flash, &self.target.layout)?;
            self.staged().done(&mut self.flash)
        } else {
            self.staged().revoke(&mut self.flash)
        }
    }

    fn staged(&self) -> Record {
        trial::staged(&self.target.layout)
    }

    fn kept(&self) -> Record {
        trial::kept(&self.target.layout)
    }

    fn is_busy(&self) -> bool {
        matches!(self.phase(), Phase::Clearing | Phase::Checking | Phase::Copying)
    }

    fn not_busy(&self) -> Result<(), Refusal> {
        if self.is_busy() { Err(Refusal::Unspecified) } else { Ok(()) }
    }

    /// Refuses a command, which changes nothing.
    fn refuse(&mut self, refusal: Refusal) -> Result<(), Refusal> {
        self.status = Status::refused(refusal);
        Err(refusal)
    }

    /// Continues after success, or ends the operation after an error.
    fn settle(&mut self, outcome: Result<(), Refusal>) -> Result<(), Refusal> {
        if let Err(refusal) = outcome {
            self.state = State::Idle;
            let refused = self.refuse(refusal);
            log::note(&mut self.flash, &self.target.layout, self.status);
            return refused;
        }
        self.status = Status::GOOD;
        Ok(())
    }

    /// Does one step, and starts the next operation when one has ended.
    fn step(&mut self) -> Result<(), Refusal> {
        let (flash, target) = (&mut self.flash, &self.target);
        match &mut self.state {
            State::Clearing(erase) => {
                if erase.step(flash)? {
                    self.state = State::Cleared;
                }
                Ok(())
            }
            State::Checking(check, plan) => {
                let plan = *plan;
                match check.step(flash, target) {
                    Ok(false) => Ok(()),
                    Ok(true) => {
                        let header = *check.header();
                        self.accept(plan, &header)
                    }
                    Err(refusal) => self.give_up(plan, refusal),
                }
            }
            State::Copying(copy, plan) => {
                let plan = *plan;
                if copy.step(flash)? { self.copied(plan) } else { Ok(()) }
            }
            State::Idle | State::Cleared | State::Receiving(_) | State::Committed | State::Installed => {
                Ok(())
            }
        }
    }

    /// Continues after a successful check of the image.
    fn accept(&mut self, plan: Plan, header: &Header) -> Result<(), Refusal> {
        match plan {
            Plan::Commit => {
                self.staged().write(&mut self.flash)?;
                self.state = State::Committed;
                return Ok(());
            }
            Plan::Install => {
                // The commit must be final before the application is touched.
                self.staged().close(&mut self.flash)?;
                return self.keep(header);
            }
            Plan::Keep => self.kept().revoke(&mut self.flash)?,
            Plan::Revert => {}
        }
        self.replace(plan, header);
        Ok(())
    }

    /// Keeps the application, unless an image is kept already: the image that ran before an unconfirmed application, or
    /// this application if the copy was cut.
    fn keep(&mut self, staged: &Header) -> Result<(), Refusal> {
        let application = self.target.layout.application();
        let mut header = Header::EMPTY;
        if self.has_kept() {
            self.kept().close(&mut self.flash)?;
        } else if header.read(&mut self.flash, application).is_ok() {
            self.state = State::Checking(FullCheck::of(&header, application, false), Plan::Keep);
            return Ok(());
        }
        self.replace(Plan::Install, staged);
        Ok(())
    }

    /// Starts the copy of an image.
    fn replace(&mut self, plan: Plan, header: &Header) {
        wear::count(&mut self.flash, &self.target.layout);
        let (from, to) = plan.areas(&self.target.layout);
        self.state = State::Copying(Copy::new(header, from, to), plan);
    }

    /// Continues after a complete copy.
    fn copied(&mut self, plan: Plan) -> Result<(), Refusal> {
        match plan {
            Plan::Keep => {
                self.kept().write(&mut self.flash)?;
                return self.install_staged();
            }
            Plan::Revert => self.kept().done(&mut self.flash)?,
            Plan::Commit | Plan::Install => self.staged().done(&mut self.flash)?,
        }
        self.state = State::Installed;
        Ok(())
    }

    /// Installs the staged image, which was found valid before the application was kept.
    fn install_staged(&mut self) -> Result<(), Refusal> {
        let check = FullCheck::new(&mut self.flash, &self.target)?;
        self.replace(Plan::Install, check.header());
        Ok(())
    }

    /// Handles an invalid image. A committed image must not be tried again at the next start.
    fn give_up(&mut self, plan: Plan, refusal: Refusal) -> Result<(), Refusal> {
        match plan {
            Plan::Commit => {}
            Plan::Install => self.abandon()?,
            // The application is not valid, so it cannot be kept.
            Plan::Keep => return self.install_staged(),
            // There is no way back: the staged image is the only one.
            Plan::Revert => self.kept().revoke(&mut self.flash)?,
        }
        Err(refusal)
    }
}
