//! The parameter memory: the store of the parameters, its room (2010h), and the limit of its wear.

use canopen::sdo::Abort;
use canopen::{Duration, Instant};
use embedded_storage::nor_flash::NorFlash;
use storage::{DeviceRecord, Error, Store, View};

use crate::packed::LONGEST;
use crate::{Protocol, StoreJob};

/// Room and wear of the parameter memory: object 2010h.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryState {
    /// Number of saves of all groups that fit without an erase; `None` if nothing can be stored.
    pub saves_left: Option<u16>,
    /// Number of page erases since the pages were new, modulo 65,536.
    pub erases: u16,
    /// Number of page erases that the budget allows now.
    pub erases_allowed: u8,
}

impl MemoryState {
    /// The state of a memory that cannot be used.
    pub const BROKEN: MemoryState = MemoryState { saves_left: None, erases: 0, erases_allowed: 0 };
    /// The state until the caller reports one: room for everything.
    pub(crate) const UNKNOWN: MemoryState =
        MemoryState { saves_left: Some(u16::MAX), erases: 0, erases_allowed: 0 };

    /// Whether a request can be accepted: a job that runs, and one more, fit.
    pub(crate) fn check(self) -> Result<(), Abort> {
        match self.saves_left {
            None => Err(Abort::Hardware),
            Some(0 | 1) => Err(Abort::DeviceState),
            Some(_) => Ok(()),
        }
    }

    /// 2010h:1: the number of saves that are accepted.
    pub(crate) fn accepted(self) -> u16 {
        self.saves_left.unwrap_or(0).saturating_sub(1)
    }
}

/// The limit of the page erases: [`BURST`](EraseBudget::BURST) at once, and one more every
/// [`INTERVAL`](EraseBudget::INTERVAL) of operation. Both pages last for 20,000 erases (10,000 each).
///
/// The budget survives resets ([`word`](EraseBudget::word)), but no loss of power.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EraseBudget {
    /// Minutes of operation that are not used up.
    minutes: u16,
    /// When the last minute was added.
    counted: Instant,
}

impl EraseBudget {
    /// Erases allowed at once.
    pub const BURST: u16 = 20;
    /// Time until one more erase is allowed.
    pub const INTERVAL: Duration = Duration::from_millis(10 * 60_000);

    const MINUTE: Duration = Duration::from_millis(60_000);
    const MINUTES: u16 = 10;
    const FULL: u16 = Self::BURST * Self::MINUTES;

    /// The budget at a start: the [`word`](EraseBudget::word) of the run before; `None` after a loss of power.
    #[must_use]
    pub fn new(left: Option<u16>) -> EraseBudget {
        EraseBudget { minutes: left.unwrap_or(Self::FULL).min(Self::FULL), counted: Instant(0) }
    }

    /// The state of the budget, for the next start.
    #[must_use]
    pub fn word(&self) -> u16 {
        self.minutes
    }

    /// Number of erases allowed now.
    #[must_use]
    pub fn erases(&self) -> u8 {
        u8::try_from(self.minutes / Self::MINUTES).unwrap_or(u8::MAX)
    }

    /// Adds the minutes that have passed. `now` counts from the start of the program.
    pub fn refill(&mut self, now: Instant) {
        while now >= self.counted + Self::MINUTE && self.minutes < Self::FULL {
            self.minutes += 1;
            self.counted = self.counted + Self::MINUTE;
        }
        if self.minutes == Self::FULL {
            self.counted = now;
        }
    }

    fn spend(&mut self, erases: u32) {
        let erases = u16::try_from(erases).unwrap_or(u16::MAX);
        self.minutes = self.minutes.saturating_sub(erases.saturating_mul(Self::MINUTES));
    }
}

/// The parameter store of a node, with its erase budget.
#[derive(Debug)]
pub struct ParameterMemory<F> {
    store: Store<F>,
    budget: EraseBudget,
}

impl<F: NorFlash> ParameterMemory<F> {
    /// Makes the store ready for saving, at start-up: erases what the store needs and the budget allows.
    ///
    /// # Errors
    /// Errors of [`Store::prepare_within`].
    pub fn prepare(view: View<F>, mut budget: EraseBudget) -> Result<ParameterMemory<F>, Error<F::Error>> {
        let store = Store::prepare_within(view, budget.erases().into())?;
        budget.spend(store.erases());
        Ok(ParameterMemory { store, budget })
    }

    /// Carries out a job.
    ///
    /// # Errors
    /// Errors of [`StoreJob::run`].
    pub fn run(&mut self, job: &mut StoreJob) -> Result<(), Abort> {
        job.run(&mut self.store)
    }

    /// Whether a page has to be erased, and the budget allows it at this time.
    pub fn can_make_room(&mut self, now: Instant) -> bool {
        self.budget.refill(now);
        self.store.needs_room() && self.budget.erases() > 0
    }

    /// Erases the page that is not in use, which stops the core for 0.25 s, 0.5 s at most. To be called when
    /// [`Protocol::can_pause`] allows it.
    ///
    /// # Errors
    /// Errors of [`Store::make_room`].
    pub fn make_room(&mut self) -> Result<(), Error<F::Error>> {
        let before = self.store.erases();
        let result = self.store.make_room();
        self.budget.spend(self.store.erases().saturating_sub(before));
        result
    }

    /// The state to be reported with [`Protocol::show_memory`].
    #[must_use]
    pub fn state(&self) -> MemoryState {
        let saves_left = self.store.saves_left(&LONGEST);
        MemoryState {
            saves_left: Some(u16::try_from(saves_left).unwrap_or(u16::MAX)),
            erases: self.store.moves(),
            erases_allowed: self.budget.erases(),
        }
    }

    /// The budget, which has to survive a reset.
    #[must_use]
    pub fn budget(&self) -> EraseBudget {
        self.budget
    }

    /// The store.
    pub fn store(&mut self) -> &mut Store<F> {
        &mut self.store
    }

    /// Returns the flash.
    pub fn into_flash(self) -> F {
        self.store.into_flash()
    }
}

impl Protocol {
    /// Reports the state of the parameter memory, at the start and after each change. Requests that cannot be stored
    /// are refused from then on.
    pub fn show_memory(&mut self, state: MemoryState) {
        self.device.application_mut().memory = state;
        self.device.show(|application, image| application.show_memory(image));
    }

    /// Whether an erase that stops the node for `span` disturbs no service: see [`canopen::Device::can_pause`].
    #[must_use]
    pub fn can_pause(&self, span: Duration, now: Instant) -> bool {
        self.device.can_pause(span, now)
    }
}

const _: () = assert!(LONGEST[0] == DeviceRecord::ROOM);

#[cfg(test)]
mod tests {
    use super::*;

    const HOUR: u64 = 3_600_000_000;

    #[test]
    fn the_budget_allows_a_burst_and_then_six_erases_an_hour() {
        let mut budget = EraseBudget::new(None);
        assert_eq!(budget.erases(), 20);
        budget.spend(20);
        assert_eq!(budget.erases(), 0);
        budget.refill(Instant(HOUR / 6 - 1));
        assert_eq!(budget.erases(), 0);
        budget.refill(Instant(HOUR / 6));
        assert_eq!(budget.erases(), 1);
        budget.refill(Instant(HOUR));
        assert_eq!(budget.erases(), 6);
        budget.refill(Instant(1000 * HOUR));
        assert_eq!(budget.erases(), 20, "no more than the burst");
        budget.spend(1);
        budget.refill(Instant(1000 * HOUR + HOUR / 6 - 1));
        assert_eq!(budget.erases(), 19);
    }

    #[test]
    fn the_budget_survives_a_reset_and_is_full_after_a_loss_of_power() {
        let mut budget = EraseBudget::new(None);
        budget.spend(19);
        assert_eq!(EraseBudget::new(Some(budget.word())).erases(), 1);
        budget.spend(u32::MAX);
        assert_eq!(EraseBudget::new(Some(budget.word())).erases(), 0);
        assert_eq!(EraseBudget::new(Some(u16::MAX)).erases(), 20);
    }

    /// The figures of docs/safety.md.
    #[test]
    fn the_memory_lasts_for_138_days_of_saves_in_a_loop() {
        let erases = 2 * 10_000;
        let hours = u64::from(erases - u32::from(EraseBudget::BURST)) * EraseBudget::INTERVAL.0 / HOUR;
        assert_eq!((hours, hours / 24), (3330, 138));
    }
}
