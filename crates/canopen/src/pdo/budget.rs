//! One call of the device for its process data, and the share of the bus that they may take.
//!
//! The CAN-IDs of PDOs are more urgent than those of SDO and heartbeat. A node whose PDOs fill the bus would silence its
//! own heartbeat and its own SDO server, and no master could correct its settings. PDOs therefore take at most three
//! quarters of the bus, after a burst of a few milliseconds, and leave gaps on a bus that other nodes keep busy. A PDO without credit waits, and is sent with its newest
//! values. The longest waiting PDO has the first claim, so no PDO starves another one.
//!
//! A burst leaves the bus to the services again after 36 ms and the time of four PDOs at most, 90 ms at 10 kbit/s.

use crate::transmit::RETRY;
use crate::{Frame, Span, Tick, Transmit};
use core::marker::PhantomData;

/// The share: `SHARE` / 4 of the bus.
const SHARE: u32 = 3;
/// A burst: the share of this number of microseconds, and a PDO.
const BURST: u32 = 12_000;
/// Time in microseconds after which the credit is full at every bit rate.
const FULL_AFTER: u32 = 50_000;
const _: () = assert!(limit(10) <= FULL_AFTER * 10 * SHARE / 4, "the credit is full");
/// A claim that is not renewed has ended: a waiting PDO tries again each millisecond.
const CLAIM: Span = Span(3 * RETRY.0);

/// Credit that is enough for any PDO; a power of two, which one instruction compares.
const ENOUGH: u32 = 1 << 18;
const _: () = assert!(ENOUGH > cost(8), "the longest PDO costs less");
/// Credit that is enough for one call of the device, as a rule: it earns nothing yet.
const PLENTY: u32 = 1 << 22;

/// Credit for process data, in thousandths of a bit.
#[derive(Debug)]
pub(crate) struct Budget {
    /// The bit rate in kbit/s: bits a millisecond.
    kbit: u16,
    /// The CAN-ID of the PDO with the first claim.
    claimant: u16,
    /// The end of the claim.
    claim_end: Tick,
    credit: u32,
    /// The credit with which a PDO is admitted without a look at the claim; out of reach while there is one.
    enough: u32,
    refilled: Tick,
    /// The credit after the last refill.
    after_refill: u32,
    /// The cost of the PDOs that may be unsent without foreign frames on the bus.
    unsent: u32,
}

impl Budget {
    /// A full budget.
    pub(crate) const fn new(kbit: u16) -> Budget {
        Budget {
            kbit,
            claimant: 0,
            claim_end: Tick::PAST,
            credit: limit(kbit),
            enough: ENOUGH,
            refilled: Tick::PAST,
            after_refill: limit(kbit),
            unsent: 0,
        }
    }

    /// The epoch of the clock has moved.
    pub(crate) fn shift(&mut self, by: Span) {
        self.claim_end.shift(by);
        self.refilled.shift(by);
    }

    /// Sets the bit rate of the bus. At an unknown rate (0) nothing is limited.
    pub(crate) fn set_bit_rate(&mut self, kbit: u16) {
        *self = Budget::new(kbit);
    }

    /// A call of the device begins. `is_waiting`: whether a PDO that was queued before waits for the bus.
    #[inline]
    pub(crate) fn begin(&mut self, now: Tick, is_waiting: impl FnOnce() -> bool) {
        if self.credit < PLENTY {
            self.refill(now, is_waiting());
        }
    }

    /// Whether the PDO with this CAN-ID and number of bytes may be sent now.
    #[inline]
    pub(crate) fn admits(&mut self, id: u16, len: usize, now: Tick) -> bool {
        self.credit >= self.enough || self.admits_scarce(id, len, now)
    }

    #[inline(never)]
    fn admits_scarce(&mut self, id: u16, len: usize, now: Tick) -> bool {
        if self.claimant != id && self.claim_end > now {
            return false;
        }
        let is_admitted = self.credit >= cost(len) || self.kbit == 0;
        self.claimant = id;
        (self.claim_end, self.enough) =
            if is_admitted { (Tick::PAST, ENOUGH) } else { (now.plus(CLAIM), u32::MAX) };
        is_admitted
    }

    /// A PDO with this number of bytes has been queued.
    pub(crate) fn spend(&mut self, len: usize) {
        self.credit = self.credit.saturating_sub(cost(len));
    }

    /// Earns credit for the time since the last refill. A PDO that still waits, although the bus had the time for it, shows
    /// that others hold the bus. Then nothing is earned: the PDOs leave the next gaps to less urgent frames.
    #[inline(never)]
    fn refill(&mut self, now: Tick, is_waiting: bool) {
        let elapsed = now.since(self.refilled).min(FULL_AFTER);
        let passed = elapsed * u32::from(self.kbit);
        let spent = self.after_refill.saturating_sub(self.credit);
        self.unsent = (self.unsent + spent).saturating_sub(passed);
        if !is_waiting || self.unsent > 0 {
            self.credit = (self.credit + passed / 4 * SHARE).min(limit(self.kbit));
        }
        (self.after_refill, self.refilled) = (self.credit, now);
    }
}

/// The most credit that accumulates.
const fn limit(kbit: u16) -> u32 {
    BURST * SHARE / 4 * kbit as u32 + cost(8)
}

/// The longest frame with this number of bytes, with stuff bits and the space after it: 55 bits and ten for each byte.
const fn cost(len: usize) -> u32 {
    #[allow(clippy::cast_possible_truncation, reason = "a frame has at most eight bytes")]
    let bits = 55 + 10 * len as u32;
    bits * 1000
}

/// The choice of a product. The compiler removes the code of the rest.
pub(crate) trait Choices {
    /// Some TPDOs send events.
    const SENDS_EVENTS: bool;
    /// Small changes of mapped values are not sent.
    const THRESHOLDS: bool;
    /// The PDOs leave a share of the bus to the services.
    const BUS_SHARE: bool;
}

/// One call of the device for its process data, which have a share of the bus.
pub(crate) struct ProcessContext<'a, T, C> {
    pub(crate) now: Tick,
    pub(crate) out: &'a mut T,
    pub(crate) is_open: bool,
    pub(crate) budget: &'a mut Budget,
    pub(crate) choices: PhantomData<C>,
}

impl<T: Transmit, C: Choices> ProcessContext<'_, T, C> {
    /// Queues a PDO with present values, which a newer one may replace. `false` when there is no room beside the services,
    /// or the process data have taken their share of the bus.
    #[inline]
    pub(crate) fn send_pdo(&mut self, frame: Frame) -> bool {
        let (id, len) = (frame.id(), frame.len());
        let replaces = self.out.replaces(id);
        let is_admitted = self.room() > ROOM_FOR_SERVICES && (replaces || self.admits(id, len));
        is_admitted && self.out.send_state(frame).is_ok() && (replaces || self.spend(len))
    }

    /// Queues a PDO that no newer one may replace: a multiplexed PDO, or one with an event. `false` when there is no room
    /// beside all others, or the process data have taken their share of the bus.
    pub(crate) fn send_event(&mut self, frame: Frame) -> bool {
        let len = frame.len();
        self.takes_event(frame.id(), len) && self.out.send(frame).is_ok() && self.spend(len)
    }

    /// Queues a SYNC or a time stamp. `false` when there is no room.
    pub(crate) fn send(&mut self, frame: Frame) -> bool {
        self.is_open && self.out.send(frame).is_ok()
    }

    /// Whether `send_event` would take a frame with this CAN-ID and number of bytes now.
    pub(crate) fn takes_event(&mut self, id: u16, len: usize) -> bool {
        self.room() > ROOM_FOR_OTHERS && self.admits(id, len)
    }

    fn admits(&mut self, id: u16, len: usize) -> bool {
        !C::BUS_SHARE || self.budget.admits(id, len, self.now)
    }

    fn spend(&mut self, len: usize) -> bool {
        if C::BUS_SHARE {
            self.budget.spend(len);
        }
        true
    }

    fn room(&self) -> usize {
        if self.is_open { self.out.room() } else { 0 }
    }
}

/// Free places that PDOs leave in the queue: for a heartbeat, an EMCY, an SDO response and an LSS response.
const ROOM_FOR_SERVICES: usize = 4;

/// Free places that events leave in the queue. The bus may be busy for minutes, but events can wait in the application.
/// A block upload, which leaves fewer places, continues beside them.
const ROOM_FOR_OTHERS: usize = 12;

#[cfg(test)]
mod tests {
    use super::*;

    const RATES: [u16; 8] = [10, 20, 50, 125, 250, 500, 800, 1000];

    /// Eight PDOs of eight bytes that are due at every millisecond: the frames of each in ten seconds.
    fn frames_of_eight(kbit: u16) -> [u32; 8] {
        let mut budget = Budget::new(kbit);
        let mut frames = [0; 8];
        for ms in 0..10_000 {
            budget.begin(Tick::since_epoch(ms * 1000), || false);
            for (id, count) in (0x181..).zip(&mut frames) {
                if budget.admits(id, 8, Tick::since_epoch(ms * 1000)) {
                    budget.spend(8);
                    *count += 1;
                }
            }
        }
        frames
    }

    #[test]
    fn pdos_take_at_most_three_quarters_of_the_bus_at_every_bit_rate() {
        for kbit in RATES {
            let bits = frames_of_eight(kbit).iter().sum::<u32>() * 135;
            let seconds = f64::from(bits) / f64::from(kbit) / 1000.0;
            let may = 0.75 * (10.0 + 0.012) + 135.0 / f64::from(kbit) / 1000.0;
            assert!(seconds <= may, "{kbit} kbit/s: {seconds} s of 10 s");
            assert!(seconds > 0.72 * 10.0 || kbit == 1000, "{kbit} kbit/s: {seconds} s of 10 s");
        }
    }

    #[test]
    fn no_pdo_starves_another_one_at_any_bit_rate() {
        for kbit in RATES {
            let frames = frames_of_eight(kbit);
            let (least, most) = (frames.iter().min().unwrap(), frames.iter().max().unwrap());
            assert!(least * 2 >= *most, "{kbit} kbit/s: {frames:?}");
        }
    }

    /// Foreign frames leave 40 per cent of the bus, in which a frame takes two and a half times as long. Eight PDOs are due
    /// at every millisecond.
    #[test]
    fn on_a_busy_bus_gaps_are_left() {
        for kbit in RATES {
            let (mut budget, mut free_at, mut waiting) = (Budget::new(kbit), 0, 0);
            let span = 135_000 * 5 / 2 / u32::from(kbit);
            for ms in 0..10_000 {
                let now = ms * 1000;
                budget.begin(Tick::since_epoch(now), || now < free_at);
                for id in 0x181..0x189 {
                    if budget.admits(id, 8, Tick::since_epoch(now)) {
                        budget.spend(8);
                        free_at = free_at.max(now) + span;
                    }
                }
                waiting += (free_at.max(now) - now).min(1000);
            }
            assert!(
                (5_000_000..9_500_000).contains(&waiting),
                "{kbit} kbit/s: a PDO waits for {waiting} us of 10 s"
            );
        }
    }

    #[test]
    fn an_instant_before_the_last_refill_earns_nothing() {
        let mut budget = Budget::new(10);
        budget.begin(Tick::since_epoch(1_000_000), || false);
        while budget.admits(0x181, 8, Tick::since_epoch(1_000_000)) {
            budget.spend(8);
        }
        budget.begin(Tick::since_epoch(999_999), || false);
        assert!(!budget.admits(0x181, 8, Tick::since_epoch(999_999)));
    }

    #[test]
    fn a_claim_ends_when_its_pdo_does_not_wait_any_more() {
        let mut budget = Budget::new(10);
        while budget.admits(0x181, 8, Tick::PAST) {
            budget.spend(8);
        }
        assert!(!budget.admits(0x281, 8, Tick::since_epoch(2_000)), "181h has the claim");
        budget.begin(Tick::since_epoch(40_000), || false);
        assert!(budget.admits(0x281, 8, Tick::since_epoch(40_000)), "the claim of 181h has ended");
    }
}
