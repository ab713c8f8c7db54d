//! The transmit mailboxes of CAN1 (RM0390, 30.7.1).
//!
//! The crate bxcan is not used for transmission: it panics at a mailbox number or a length that only a broken register
//! could hold.
#![expect(unsafe_code, reason = "registers")]

use canopen::Frame;
use stm32f4xx_hal::pac::can1::TX;

use crate::can::controller::registers;
use crate::can::mailbox::{Mailbox, REMOTE};
use crate::can::transmit_queue::{Mailboxes, Offer};

/// TIxR: the place of the identifier, and the transmit request (RM0390, 30.9.3). In this register, identifier and RTR
/// sort in the order of bus arbitration.
const STID: u32 = 21;
const TXRQ: u32 = 1 << 0;

/// TSR of mailbox 0: transmission OK and abort request. The bits of the next mailbox are 8 bits higher (RM0390,
/// 30.9.2).
const TXOK: u32 = 1 << 1;
const ABRQ: u32 = 1 << 7;

/// Number of polls for an abort: it takes a few clocks of APB1, unless the transmission has just begun. A poll takes
/// three of these clocks at least. More polls would only make the task longer: it does not need the result at once.
const ABORT_POLLS: u32 = 16;

/// The transmit mailboxes.
pub struct Transmitter {
    /// A frame whose abort was requested, and the number of its mailbox. Its transmission had just begun, so the end of
    /// the transmission decides whether the frame was sent.
    aborted: Option<(u32, Frame)>,
}

impl Transmitter {
    /// The only instance.
    pub(crate) fn new() -> Transmitter {
        Transmitter { aborted: None }
    }

    /// Puts a frame into the first mailbox, if that is free. For a caller that uses no other mailbox, so that frames
    /// keep their order.
    pub fn put(&mut self, frame: &Frame) -> bool {
        let is_free = registers().tsr().read().tme0().bit_is_set();
        if is_free {
            load(registers().tx(0), frame);
        }
        is_free
    }
}

impl Mailboxes for Transmitter {
    /// The hardware sends the most urgent of the pending frames. Among equal identifiers it sends the lowest mailbox
    /// number first, not the oldest frame, so only one frame of an identifier is pending at a time.
    fn offer(&mut self, frame: &Frame) -> Offer {
        if self.aborted.is_some()
            || would_wait()
            || pending().any(|(_, other)| order(other) == identifier(frame))
        {
            return Offer::Refused;
        }
        if let Some(free) = registers().tx_iter().find(|mailbox| !is_pending(mailbox)) {
            load(free, frame);
            return Offer::Taken;
        }
        let least = pending().max_by_key(|(_, mailbox)| order(mailbox));
        let Some((number, last)) = least.filter(|(_, last)| order(last) > identifier(frame)) else {
            return Offer::Refused;
        };
        let replaced = content(last);
        abort(number);
        if is_aborting(number) {
            self.aborted = replaced.map(|replaced| (number, replaced));
            return Offer::Refused;
        }
        let replaced = replaced.filter(|_| !is_sent(number));
        load(last, frame);
        replaced.map_or(Offer::Taken, Offer::Replaced)
    }

    fn is_idle(&self) -> bool {
        let status = registers().tsr().read();
        status.tme0().bit_is_set() && status.tme1().bit_is_set() && status.tme2().bit_is_set()
    }

    /// Checks whether the transmission of the aborted frame has ended. A frame that was not sent goes back into its
    /// mailbox, unless it belongs to the time before a restart of the bus. Acknowledges the transmit interrupt after the
    /// check, which reads the flags, and before the mailboxes are filled: a mailbox that becomes free later raises the
    /// interrupt again.
    fn settle(&mut self, is_cleared: bool) {
        if is_cleared {
            self.aborted = None;
        }
        if let Some((number, frame)) = self.aborted.filter(|(number, _)| !is_aborting(*number)) {
            self.aborted = None;
            if let Some(mailbox) = registers().tx_iter().nth(number as usize).filter(|_| !is_sent(number)) {
                load(mailbox, &frame);
            }
        }
        registers().tsr().write(|w| w.rqcp0().set_bit().rqcp1().set_bit().rqcp2().set_bit());
    }
}

/// Mailboxes with an unsent frame, with their numbers.
fn pending() -> impl Iterator<Item = (u32, &'static TX)> {
    (0..).zip(registers().tx_iter()).filter(|(_, mailbox)| is_pending(mailbox))
}

fn is_pending(mailbox: &TX) -> bool {
    mailbox.tir().read().txrq().bit_is_set()
}

/// The key of the arbitration: identifier and RTR. The lowest key wins.
fn order(mailbox: &TX) -> u32 {
    mailbox.tir().read().bits() & !TXRQ
}

fn identifier(frame: &Frame) -> u32 {
    u32::from(frame.id()) << STID | if frame.is_remote() { REMOTE } else { 0 }
}

/// Whether aborting a frame would mean waiting. A frame leaves its mailbox at once while it waits, but only at the end
/// of the transmission once it is on the wire: after up to 13 ms at 10 kbit/s. No frame is therefore aborted while the
/// controller transmits; the interrupt at the end of the transmission comes soon.
fn would_wait() -> bool {
    let full = registers().tx_iter().all(is_pending);
    full && registers().msr().read().txm().bit_is_set()
}

/// The frame in a mailbox.
fn content(mailbox: &TX) -> Option<Frame> {
    let content = Mailbox {
        rir: mailbox.tir().read().bits(),
        rdtr: mailbox.tdtr().read().bits(),
        rdlr: mailbox.tdlr().read().bits(),
        rdhr: mailbox.tdhr().read().bits(),
    };
    content.frame()
}

/// Requests the abort of the frame in a mailbox. The mailbox is empty some clocks later, or at the end of a
/// transmission that has just begun: see [`is_aborting`].
fn abort(number: u32) {
    // SAFETY: the other bits of TSR are cleared by writing 1, so writing 0 leaves them unchanged.
    registers().tsr().write(|w| unsafe { w.bits(ABRQ << flags_of(number)) });
    let _ = (0..ABORT_POLLS).find(|_| !is_aborting(number));
}

fn is_aborting(number: u32) -> bool {
    registers().tsr().read().bits() & ABRQ << flags_of(number) != 0
}

fn is_sent(number: u32) -> bool {
    registers().tsr().read().bits() & TXOK << flags_of(number) != 0
}

/// Position of a mailbox's flags in TSR.
fn flags_of(number: u32) -> u32 {
    8 * (number % 3)
}

fn load(mailbox: &TX, frame: &Frame) {
    let data = frame.data().iter().rev().fold(0, |word: u64, byte| word << 8 | u64::from(*byte));
    let [low, high] = [data as u32, (data >> 32) as u32];
    // SAFETY: DLC, data and identifier take any value.
    unsafe {
        mailbox.tdtr().write(|w| w.bits(frame.len() as u32));
        mailbox.tdlr().write(|w| w.bits(low));
        mailbox.tdhr().write(|w| w.bits(high));
        mailbox.tir().write(|w| w.bits(identifier(frame) | TXRQ));
    }
}
