//! The three transmit mailboxes and the scheduler (RM0390, bxCAN transmission handling).

use canbus::{Frame, Time};

use super::mailbox::Registers;
use crate::register::{bit, flag};

const MAILBOXES: usize = 3;
const TXRQ: u32 = 0;
/// Bits in each mailbox's byte of CAN_TSR.
const RQCP: u32 = 0;
const TXOK: u32 = 1;
const ALST: u32 = 2;
const TERR: u32 = 3;
const ABRQ: u32 = 7;
/// Bits that software can set in CAN_TDTxR: TIME, TGT, DLC.
const CONTROL_WRITABLE: u32 = 0xFFFF_010F;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    #[default]
    Empty,
    /// Pending, or scheduled if its priority is the highest.
    Pending,
    /// On the wire.
    Transmit,
}

/// The outcome of an attempt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Outcome {
    #[default]
    None,
    Sent,
    Lost,
    Failed,
}

#[derive(Clone, Copy, Debug, Default)]
struct Mailbox {
    registers: Registers,
    state: State,
    requested: Time,
    /// The number of the request in the order of all requests.
    turn: u64,
    abort: bool,
    completed: bool,
    outcome: Outcome,
}

impl Mailbox {
    /// The request is over: sent, aborted, or failed without retransmission.
    fn complete(&mut self) {
        self.state = State::Empty;
        self.abort = false;
        self.completed = true;
    }

    /// An attempt has failed. The attempt was the last one with `give_up`, or after an abort request.
    fn fail(&mut self, outcome: Outcome, give_up: bool) {
        self.outcome = outcome;
        self.state = State::Pending;
        if give_up || self.abort {
            self.complete();
        }
    }

    fn abort(&mut self) {
        match self.state {
            State::Empty => {}
            State::Pending => {
                self.outcome = Outcome::None;
                self.complete();
            }
            State::Transmit => self.abort = true,
        }
    }

    fn status(&self) -> u32 {
        flag(self.completed, RQCP)
            | flag(self.outcome == Outcome::Sent, TXOK)
            | flag(self.outcome == Outcome::Lost, ALST)
            | flag(self.outcome == Outcome::Failed, TERR)
            | flag(self.abort, ABRQ)
    }

    /// Writes the mailbox's byte of CAN_TSR.
    fn write_status(&mut self, value: u32) {
        let own = match self.outcome {
            Outcome::None => false,
            Outcome::Sent => bit(value, TXOK),
            Outcome::Lost => bit(value, ALST),
            Outcome::Failed => bit(value, TERR),
        };
        // Clearing RQCP also clears TXOK, ALST and TERR.
        if own || bit(value, RQCP) {
            self.outcome = Outcome::None;
        }
        self.completed &= !bit(value, RQCP);
        if bit(value, ABRQ) {
            self.abort();
        }
    }
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Transmitter {
    mailboxes: [Mailbox; MAILBOXES],
    turns: u64,
    /// Numbers of completions that a test suppresses, and of aborts that a test makes come too late.
    pub(crate) lost_ends: usize,
    pub(crate) late_aborts: usize,
}

impl Transmitter {
    /// CAN_TSR. With `fifo` (TXFP) the order of requests decides the priority, otherwise the identifiers.
    pub(crate) fn status(&self, fifo: bool) -> u32 {
        let each = self.mailboxes.iter().enumerate().fold(0, |word, (n, mailbox)| {
            let empty = flag(mailbox.state == State::Empty, 26 + n as u32);
            word | mailbox.status() << (8 * n) | empty
        });
        let low = self.lowest(fifo).map_or(0, |n| 1 << (29 + n));
        each | low | (self.code(fifo) as u32) << 24
    }

    /// CAN_TSR.CODE: the next free mailbox, or the one of lowest priority when none is free.
    fn code(&self, fifo: bool) -> usize {
        let free = self.mailboxes.iter().position(|mailbox| mailbox.state == State::Empty);
        free.or_else(|| self.lowest(fifo)).unwrap_or(0)
    }

    /// The mailbox of lowest priority, when more than one is pending.
    fn lowest(&self, fifo: bool) -> Option<usize> {
        let pending: Vec<usize> = self.occupied().collect();
        pending.iter().copied().max_by_key(|n| self.priority(*n, fifo)).filter(|_| pending.len() > 1)
    }

    fn occupied(&self) -> impl Iterator<Item = usize> {
        (0..MAILBOXES).filter(|n| self.mailboxes[*n].state != State::Empty)
    }

    /// The lower value goes first; mailboxes of equal priority go by their number.
    fn priority(&self, n: usize, fifo: bool) -> (u64, usize) {
        let mailbox = &self.mailboxes[n];
        let key = if fifo { mailbox.turn } else { mailbox.registers.frame().arbitration().into() };
        (key, n)
    }

    /// Writes CAN_TSR.
    pub(crate) fn write_status(&mut self, value: u32) {
        for (n, mailbox) in self.mailboxes.iter_mut().enumerate() {
            let value = value >> (8 * n) & 0xFF;
            let is_late = self.late_aborts > 0 && bit(value, ABRQ) && mailbox.state == State::Pending;
            if is_late {
                self.late_aborts -= 1;
                mailbox.abort = true;
            }
            mailbox.write_status(if is_late { value & !(1 << ABRQ) } else { value });
        }
    }

    /// Reads the register at `offset` from CAN_TI0R.
    pub(crate) fn read(&self, offset: u32) -> Option<u32> {
        let mailbox = self.mailboxes.get(offset as usize / 16)?;
        let request = offset.is_multiple_of(16) && mailbox.state != State::Empty;
        Some(mailbox.registers.read(offset % 16)? | flag(request, TXRQ))
    }

    /// Writes the register at `offset` from CAN_TI0R. Only an empty mailbox can be written.
    pub(crate) fn write(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        let mailbox = self.mailboxes.get_mut(offset as usize / 16)?;
        let registers = &mut mailbox.registers;
        let target = match offset % 16 {
            0x0 => &mut registers.identifier,
            0x4 => &mut registers.control,
            0x8 => &mut registers.low,
            0xC => &mut registers.high,
            _ => return None,
        };
        if mailbox.state != State::Empty {
            return Some(());
        }
        match offset % 16 {
            0x0 => {
                *target = value & !(1 << TXRQ);
                if bit(value, TXRQ) {
                    self.request(offset as usize / 16, now);
                }
            }
            0x4 => *target = value & CONTROL_WRITABLE,
            _ => *target = value,
        }
        Some(())
    }

    fn request(&mut self, n: usize, now: Time) {
        self.turns += 1;
        let registers = self.mailboxes[n].registers;
        self.mailboxes[n] = Mailbox {
            registers,
            state: State::Pending,
            requested: now,
            turn: self.turns,
            ..Mailbox::default()
        };
    }

    /// The instant of the oldest pending request.
    pub(crate) fn requested(&self) -> Option<Time> {
        self.pending().map(|n| self.mailboxes[n].requested).min()
    }

    fn pending(&self) -> impl Iterator<Item = usize> {
        (0..MAILBOXES).filter(|n| self.mailboxes[*n].state == State::Pending)
    }

    /// The frame of the scheduled mailbox, of the requests made up to `at`.
    pub(crate) fn scheduled(&self, fifo: bool, at: Time) -> Option<Frame> {
        self.schedule(fifo, at).map(|n| self.mailboxes[n].registers.frame())
    }

    fn schedule(&self, fifo: bool, at: Time) -> Option<usize> {
        let ready = self.pending().filter(|n| self.mailboxes[*n].requested <= at);
        ready.min_by_key(|n| self.priority(*n, fifo))
    }

    /// The transmission of the scheduled mailbox begins.
    pub(crate) fn begin(&mut self, fifo: bool, at: Time) {
        if let Some(n) = self.schedule(fifo, at) {
            self.mailboxes[n].state = State::Transmit;
        }
    }

    /// Whether the transmission of a mailbox is under way.
    pub(crate) fn is_transmitting(&self) -> bool {
        self.mailboxes.iter().any(|mailbox| mailbox.state == State::Transmit)
    }

    fn on_wire(&mut self) -> Option<&mut Mailbox> {
        self.mailboxes.iter_mut().find(|mailbox| mailbox.state == State::Transmit)
    }

    pub(crate) fn sent(&mut self) {
        let is_lost = self.lost_ends > 0;
        self.lost_ends = self.lost_ends.saturating_sub(1);
        if let Some(mailbox) = self.on_wire() {
            mailbox.outcome = Outcome::Sent;
            mailbox.complete();
            mailbox.completed = !is_lost;
        }
    }

    pub(crate) fn lost(&mut self, give_up: bool) {
        if let Some(mailbox) = self.on_wire() {
            mailbox.fail(Outcome::Lost, give_up);
        }
    }

    pub(crate) fn failed(&mut self, give_up: bool) {
        if let Some(mailbox) = self.on_wire() {
            mailbox.fail(Outcome::Failed, give_up);
        }
    }

    /// Whether a request has completed and software has not cleared its flag.
    pub(crate) fn interrupt(&self) -> bool {
        self.mailboxes.iter().any(|mailbox| mailbox.completed)
    }
}
