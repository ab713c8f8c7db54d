//! The update as a machine that is polled: each poll does one bounded step.

use crate::commit::{Commit, Record};
use crate::copy::Copy;
use crate::erase::Erase;
use crate::flash::Flash;
use crate::header::Header;
use crate::image::FullCheck;
use crate::receive::Receiver;
use crate::refusal::Refusal;
use crate::status::Status;
use crate::target::Target;

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
    /// The staged image is being checked.
    Checking,
    /// It is good, and will be copied whatever happens.
    Committed,
    /// It is being copied.
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
    /// Of the last download that was found good.
    identification: Option<u32>,
}

#[expect(clippy::large_enum_variant, reason = "there is one machine, and no heap")]
enum State {
    Idle,
    Clearing(Erase),
    Cleared,
    Receiving(Receiver),
    Checking(FullCheck, Then),
    Committed,
    /// The application area is being erased for this image.
    Erasing(Erase, Header),
    Copying(Copy),
    Installed,
}

/// What follows when the staged image is good.
#[derive(Clone, Copy)]
enum Then {
    Commit,
    Copy,
}

impl<F: Flash> Updater<F> {
    /// A machine with nothing to do. `status` is what 1F57h reads until something was done: [`Status::GOOD`], or that of
    /// [`crate::Stay`].
    pub fn new(flash: F, target: Target, status: Status) -> Updater<F> {
        Updater { flash, target, state: State::Idle, status, identification: None }
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
            State::Erasing(..) | State::Copying(_) => Phase::Copying,
            State::Installed => Phase::Installed,
        }
    }

    /// What 1F57h reads.
    pub fn status(&self) -> Status {
        if self.is_busy() { Status::BUSY } else { self.status }
    }

    /// What identifies the program that was downloaded and found good: the CRC of its code. `None` until then.
    pub fn identification(&self) -> Option<u32> {
        self.identification
    }

    /// What the next poll will do.
    pub fn next(&self) -> Next {
        match &self.state {
            State::Clearing(erase) | State::Erasing(erase, _) if erase.is_at_work() => Next::Erasing,
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
        self.identification = None;
        let outcome = self.record().revoke(&mut self.flash);
        let erase = Erase::new(self.target.layout.staging());
        self.settle(outcome.map(|()| State::Clearing(erase)))
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
        self.settle(Ok(State::Receiving(Receiver::new())))
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
        self.settle(check.map(|check| State::Checking(check, Then::Commit)))
    }

    /// Copies the staged image to the application area, after another check of it. For a committed image, of this start
    /// or one before ([`crate::Decision::Copy`]); there nothing else may come first.
    ///
    /// # Errors
    /// [`Refusal::Unspecified`] when nothing is committed, or while busy; why the staged image is refused. It is not tried
    /// again then.
    pub fn install(&mut self) -> Result<(), Refusal> {
        self.not_busy()?;
        if !matches!(self.record().read(&mut self.flash), Ok(Commit::Pending | Commit::Done)) {
            return Err(Refusal::Unspecified);
        }
        let outcome = match FullCheck::new(&mut self.flash, &self.target) {
            Ok(check) => Ok(State::Checking(check, Then::Copy)),
            Err(refusal) => self.give_up(Then::Copy, refusal),
        };
        self.settle(outcome)
    }

    /// One step of what was begun, if anything was. Returns what the next one will do.
    pub fn poll(&mut self) -> Next {
        if let Some(outcome) = self.step().transpose() {
            // Whoever wants to know reads the status.
            let _ = self.settle(outcome);
        }
        self.next()
    }

    fn record(&self) -> Record {
        Record(self.target.layout.staging().end())
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
    fn settle(&mut self, outcome: Result<State, Refusal>) -> Result<(), Refusal> {
        match outcome {
            Ok(state) => {
                (self.state, self.status) = (state, Status::GOOD);
                Ok(())
            }
            Err(refusal) => {
                self.state = State::Idle;
                self.refuse(refusal)
            }
        }
    }

    /// What follows, when what was begun has come to its end.
    fn step(&mut self) -> Result<Option<State>, Refusal> {
        let (flash, target) = (&mut self.flash, &self.target);
        match &mut self.state {
            State::Clearing(erase) => Ok(erase.step(flash)?.then_some(State::Cleared)),
            State::Checking(check, then) => {
                let (then, checked) = (*then, check.step(flash, target));
                self.follow(then, checked)
            }
            State::Erasing(erase, header) => {
                Ok(erase.step(flash)?.then(|| State::Copying(Copy::new(*header, target))))
            }
            State::Copying(copy) => {
                if !copy.step(flash)? {
                    return Ok(None);
                }
                self.record().done(&mut self.flash).map(|()| Some(State::Installed))
            }
            State::Idle | State::Cleared | State::Receiving(_) | State::Committed | State::Installed => {
                Ok(None)
            }
        }
    }

    /// What a step of the check has found.
    fn follow(
        &mut self,
        then: Then,
        checked: Result<Option<Header>, Refusal>,
    ) -> Result<Option<State>, Refusal> {
        match checked {
            Ok(None) => Ok(None),
            Ok(Some(header)) => self.accept(then, header).map(Some),
            Err(refusal) => self.give_up(then, refusal).map(Some),
        }
    }

    /// The staged image is good.
    fn accept(&mut self, then: Then, header: Header) -> Result<State, Refusal> {
        self.identification = Some(header.code_crc());
        match then {
            Then::Commit => self.record().write(&mut self.flash).map(|()| State::Committed),
            Then::Copy => {
                // The commit must hold for good before the application is touched.
                self.record().close(&mut self.flash)?;
                Ok(State::Erasing(Erase::new(self.target.layout.application()), header))
            }
        }
    }

    /// The staged image is not good; if it was committed, the next start must not try it again.
    fn give_up(&mut self, then: Then, refusal: Refusal) -> Result<State, Refusal> {
        if matches!(then, Then::Copy) {
            self.record().revoke(&mut self.flash)?;
        }
        Err(refusal)
    }
}
