//! The update as a machine that is polled: each poll does one bounded step.

use crate::area::{Area, Layout};
use crate::copy::Copy;
use crate::erase::Erase;
use crate::flash::Flash;
use crate::header::Header;
use crate::image::{self, FullCheck};
use crate::receive::Receiver;
use crate::record::{Commit, Record};
use crate::refusal::Refusal;
use crate::status::Status;
use crate::target::Target;
use crate::trial::{self, Trial};

/// What the next [`Updater::poll`] will do, so that the caller knows when to call it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// Nothing: a command has to come.
    Nothing,
    /// The flash erases by itself, 0.5 to 2 s for a sector; poll again in a millisecond or so.
    Erasing,
    /// A step of at most 64 words programmed, 1 KiB read, or a part of the check of the signature: 1 ms typical, 7 ms
    /// most.
    Step,
}

/// How far an update is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Nothing was begun, or it was refused: [`Updater::status`] says why.
    Idle,
    /// Staging is being erased.
    Clearing,
    /// Staging is erased; a download may begin.
    Cleared,
    /// A download is under way.
    Receiving,
    /// The staged image is being checked, or the one that is to be kept or to come back.
    Checking,
    /// It is good, and will be copied whatever happens.
    Committed,
    /// The image is being copied, or the application before it to where it is kept.
    Copying,
    /// It was copied: ask [`crate::boot`].
    Installed,
}

/// The machine. Nothing in it has to survive a reset: [`crate::boot`] finds in flash what is left to do.
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
    Receiving(Receiver),
    Checking(FullCheck, Plan),
    Committed,
    /// The new place of the image with this header is being erased.
    Erasing(Erase, Header, Plan),
    Copying(Copy, Plan),
    Installed,
}

/// Why an image is checked, and then copied.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Plan {
    /// The staged image, to be committed.
    Commit,
    /// The staged image, to be the application.
    Install,
    /// The application, to be kept while the staged image is on trial. What follows is to install that.
    Keep,
    /// The kept image, to be the application again.
    Revert,
}

impl Plan {
    /// Where the image is, and where it will be.
    fn areas(self, layout: &Layout) -> (Area, Area) {
        match self {
            Plan::Keep => (layout.application(), layout.kept()),
            Plan::Revert => (layout.kept(), layout.application()),
            Plan::Commit | Plan::Install => (layout.staging(), layout.application()),
        }
    }
}

impl<F: Flash> Updater<F> {
    /// A machine with nothing to do. `status` is what 1F57h reads until something was done: [`Status::GOOD`], or that of
    /// [`crate::Stay`].
    pub fn new(flash: F, target: Target, status: Status) -> Updater<F> {
        Updater { flash, target, state: State::Idle, status }
    }

    /// The flash.
    pub fn flash(&mut self) -> &mut F {
        &mut self.flash
    }

    /// How far it is.
    pub fn phase(&self) -> Phase {
        match self.state {
            State::Idle => Phase::Idle,
            State::Clearing(_) => Phase::Clearing,
            State::Cleared => Phase::Cleared,
            State::Receiving(_) => Phase::Receiving,
            State::Checking(..) => Phase::Checking,
            State::Committed => Phase::Committed,
            State::Erasing(..) | State::Copying(..) => Phase::Copying,
            State::Installed => Phase::Installed,
        }
    }

    /// What 1F57h reads.
    pub fn status(&self) -> Status {
        if self.is_busy() { Status::BUSY } else { self.status }
    }

    /// What the next poll will do.
    pub fn next(&self) -> Next {
        match &self.state {
            State::Clearing(erase) | State::Erasing(erase, ..) if erase.is_at_work() => Next::Erasing,
            _ if self.is_busy() => Next::Step,
            _ => Next::Nothing,
        }
    }

    /// Clears the program (1F51h = 3): begins to erase staging. A download under way, or an image that was not copied yet,
    /// is lost; the application is not touched.
    ///
    /// # Errors
    /// [`Refusal::Unspecified`] while the machine is busy; [`Refusal::Write`].
    pub fn clear(&mut self) -> Result<(), Refusal> {
        self.not_busy()?;
        let outcome = self.staged().revoke(&mut self.flash);
        self.state = State::Clearing(Erase::new(self.target.layout.staging()));
        self.settle(outcome)
    }

    /// A download to 1F50h begins. `size` in bytes, where the client has said it.
    ///
    /// # Errors
    /// [`Refusal::NotCleared`] without [`Updater::clear`] before, [`Refusal::TooLong`], [`Refusal::Unspecified`] while busy.
    pub fn begin(&mut self, size: Option<u32>) -> Result<(), Refusal> {
        self.not_busy()?;
        if !matches!(self.state, State::Cleared) {
            return self.refuse(Refusal::NotCleared);
        }
        if size.is_some_and(|size| size > self.target.layout.longest_image()) {
            return self.refuse(Refusal::TooLong);
        }
        self.state = State::Receiving(Receiver::new());
        self.settle(Ok(()))
    }

    /// The next bytes of the download, any number. They are programmed before this returns, in chunks of 64 words, so a
    /// call takes 4 us a byte (25 us most). What is wrong with the header is said as soon as it is there.
    ///
    /// # Errors
    /// Why the download is refused; it is over then. [`Refusal::Unspecified`] when there is none.
    pub fn receive(&mut self, bytes: &[u8]) -> Result<(), Refusal> {
        let State::Receiving(receiver) = &mut self.state else {
            return Err(Refusal::Unspecified);
        };
        let outcome = receiver.receive(&mut self.flash, &self.target, bytes);
        outcome.or_else(|refusal| self.settle(Err(refusal)))
    }

    /// The download is complete: the image is checked, and committed if it is good.
    ///
    /// # Errors
    /// As [`Updater::receive`].
    pub fn finish(&mut self) -> Result<(), Refusal> {
        let State::Receiving(receiver) = &mut self.state else {
            return Err(Refusal::Unspecified);
        };
        let complete = receiver.finish(&mut self.flash, &self.target);
        let check = complete.and_then(|()| FullCheck::new(&mut self.flash, &self.target));
        self.check(Plan::Commit, check)
    }

    /// Copies the staged image to the application area, after another check of it. The application there is kept before, if it is
    /// whole, and the new one is on trial then. For a committed image, of this start
    /// or one before ([`crate::Decision::Copy`]); there nothing else may come first.
    ///
    /// # Errors
    /// [`Refusal::Unspecified`] when nothing is committed, or while busy; why the staged image is refused. It is not tried
    /// again then.
    pub fn install(&mut self) -> Result<(), Refusal> {
        self.not_busy()?;
        if !matches!(self.staged().read(&mut self.flash), Commit::Pending | Commit::Done) {
            return Err(Refusal::Unspecified);
        }
        let check = FullCheck::new(&mut self.flash, &self.target);
        self.check(Plan::Install, check)
    }

    /// Copies the kept image back to the application area, after a check of it: the trial of the application is lost
    /// ([`crate::Decision::Revert`]). If the kept image is not good, the trial ends without it.
    ///
    /// # Errors
    /// [`Refusal::Unspecified`] when no trial is lost, or while busy; why the kept image is refused.
    pub fn revert(&mut self) -> Result<(), Refusal> {
        self.not_busy()?;
        let layout = &self.target.layout;
        if !matches!(Trial::read(&mut self.flash, layout), Trial::Lost(_)) {
            return Err(Refusal::Unspecified);
        }
        // The trial must be lost for good before the application is touched.
        Trial::withdraw(&mut self.flash, layout)?;
        let kept = layout.kept();
        let header = image::admitted(&mut self.flash, &self.target, kept);
        self.check(Plan::Revert, header.map(|header| FullCheck::of(header, kept)))
    }

    /// Begins a check.
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

    /// One step of what was begun, if anything was. Returns what the next one will do.
    pub fn poll(&mut self) -> Next {
        let keeps = matches!(self.state, State::Erasing(.., Plan::Keep) | State::Copying(_, Plan::Keep));
        if let Err(refusal) = self.step() {
            if keeps {
                // The application is whole, and stays: the next start must not try the staged image again.
                let _ = self.staged().revoke(&mut self.flash);
            }
            // Whoever wants to know reads the status.
            let _ = self.settle(Err(refusal));
        }
        self.next()
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

    /// A command is refused and changes nothing.
    fn refuse(&mut self, refusal: Refusal) -> Result<(), Refusal> {
        self.status = Status::refused(refusal);
        Err(refusal)
    }

    /// What was begun goes on, or is over.
    fn settle(&mut self, outcome: Result<(), Refusal>) -> Result<(), Refusal> {
        if let Err(refusal) = outcome {
            self.state = State::Idle;
            return self.refuse(refusal);
        }
        self.status = Status::GOOD;
        Ok(())
    }

    /// One step, and what follows when what was begun has come to its end.
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
                    Ok(None) => Ok(()),
                    Ok(Some(header)) => self.accept(plan, header),
                    Err(refusal) => self.give_up(plan, refusal),
                }
            }
            State::Erasing(erase, header, plan) => {
                if erase.step(flash)? {
                    let (from, to) = plan.areas(&target.layout);
                    self.state = State::Copying(Copy::new(*header, from, to), *plan);
                }
                Ok(())
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

    /// The image is good.
    fn accept(&mut self, plan: Plan, header: Header) -> Result<(), Refusal> {
        match plan {
            Plan::Commit => {
                self.staged().write(&mut self.flash)?;
                self.state = State::Committed;
                return Ok(());
            }
            Plan::Install => {
                // The commit must hold for good before the application is touched.
                self.staged().close(&mut self.flash)?;
                return self.keep(header);
            }
            Plan::Keep => self.kept().revoke(&mut self.flash)?,
            Plan::Revert => {}
        }
        self.replace(plan, header);
        Ok(())
    }

    /// Keeps the application, unless an image is kept already: the one that ran before an application that nobody has confirmed, or
    /// this application, if the copy was cut.
    fn keep(&mut self, staged: Header) -> Result<(), Refusal> {
        let application = self.target.layout.application();
        if self.kept().read(&mut self.flash) == Commit::Pending {
            self.kept().close(&mut self.flash)?;
        } else if let Ok(header) = image::header(&mut self.flash, application) {
            self.state = State::Checking(FullCheck::of_sum(header, application), Plan::Keep);
            return Ok(());
        }
        self.replace(Plan::Install, staged);
        Ok(())
    }

    /// Begins to erase the new place of an image.
    fn replace(&mut self, plan: Plan, header: Header) {
        let (_, to) = plan.areas(&self.target.layout);
        self.state = State::Erasing(Erase::new(to), header, plan);
    }

    /// The copy is whole.
    fn copied(&mut self, plan: Plan) -> Result<(), Refusal> {
        match plan {
            Plan::Keep => {
                self.kept().write(&mut self.flash)?;
                return self.install_staged();
            }
            Plan::Revert => {
                // Without the record of staging there is no trial. What is left open of the kept image does no harm.
                self.staged().revoke(&mut self.flash)?;
                self.kept().done(&mut self.flash)?;
            }
            Plan::Commit | Plan::Install => self.staged().done(&mut self.flash)?,
        }
        self.state = State::Installed;
        Ok(())
    }

    /// The staged image, which was found good before the application was kept.
    fn install_staged(&mut self) -> Result<(), Refusal> {
        let header = image::candidate(&mut self.flash, &self.target)?;
        self.replace(Plan::Install, header);
        Ok(())
    }

    /// The image is not good. What was committed must not be tried again at the next start.
    fn give_up(&mut self, plan: Plan, refusal: Refusal) -> Result<(), Refusal> {
        match plan {
            Plan::Commit => {}
            Plan::Install => self.staged().revoke(&mut self.flash)?,
            // There is nothing that could be kept.
            Plan::Keep => return self.install_staged(),
            Plan::Revert => self.kept().done(&mut self.flash)?,
        }
        Err(refusal)
    }
}
