//! The task of the parameter memory, at the lowest priority: it carries out the store jobs of the protocol. The flash
//! stops the core for 16 us with every word, so all other tasks run between two words. The erase of a page stops the core
//! for 0.25 s, so a page is erased only while that disturbs no service.

use bsp::chip::retained;
use bsp::flash::update_layout::LAYOUT;
use bsp::{Clock, ParameterFlash, Watchdog};
use canopen::sdo::Abort;
use canopen::{Duration, Instant};
use node::{MemoryState, ParameterMemory, StoreJob, StoredPositionRecord, Verdict, log_event, stored_log};
use profiles::board::RETAINED_WORDS;
use update::{Clears, Event, Programs, Trial};

use crate::SERVICES;
use crate::exchange::Retained;
use crate::shared::Shared;

/// The longest erase of a page of 16 KiB (STM32F446 datasheet, flash memory programming).
const ERASE: Duration = Duration::from_millis(500);
/// A sensor at rest for this time stays at rest during an erase. During an erase nothing counts the turns of a shaft.
const REST: Duration = Duration::from_millis(100);

/// The data that the task owns.
pub(crate) struct StorageTask {
    /// `None` if the flash could not be prepared, so that nothing can be stored.
    memory: Option<ParameterMemory<ParameterFlash>>,
    job: &'static mut StoreJob,
    position_record: StoredPositionRecord,
    /// The retained positions, and the time of their last change.
    positions: Option<[u32; POSITIONS]>,
    moved: Instant,
    /// The programs in the flash and the log of updates are reported to the node (2004h, 2006h).
    has_reported_programs: bool,
    /// The intervals for which the budget of clears was refilled.
    intervals: u8,
}

/// The retained words about positions. The others are the operating time.
const POSITIONS: usize = RETAINED_WORDS - 2;

impl StorageTask {
    pub(crate) fn new(
        memory: Option<ParameterMemory<ParameterFlash>>,
        job: &'static mut StoreJob,
        position_record: StoredPositionRecord,
    ) -> StorageTask {
        StorageTask {
            memory,
            job,
            position_record,
            positions: None,
            moved: Instant(0),
            has_reported_programs: false,
            intervals: 0,
        }
    }

    /// Whether the store works.
    pub(crate) fn is_working(&self) -> bool {
        self.memory.is_some()
    }

    /// Takes note of a movement of the sensors.
    pub(crate) fn watch_positions(&mut self, retained: &Retained) {
        let positions = retained.as_ref().and_then(|words| words.first_chunk().copied());
        if positions != self.positions {
            (self.positions, self.moved) = (positions, Clock::now());
        }
    }

    /// Stores the record about the retained state, which a start with an empty battery needs.
    pub(crate) fn keep(&mut self, retained: &Retained, node: &mut impl Shared) {
        if let (Some(memory), Some(words)) = (&mut self.memory, retained) {
            let device = node.call(|protocol, _| protocol.device_record());
            match self.position_record.keep(words, &device, memory.store()) {
                Ok(true) => {
                    defmt::info!("the record of the positions is stored");
                    self.report(node);
                }
                Ok(false) => {}
                Err(_) => defmt::error!("the record of the positions is not stored"),
            }
        }
    }

    /// Refills the budget of clears.
    pub(crate) fn refill_clears(&mut self) {
        let intervals = Clears::intervals(Clock::now().0);
        if intervals != self.intervals {
            retained::set_clears(retained::clears().refill(intervals.wrapping_sub(self.intervals)));
            self.intervals = intervals;
            self.has_reported_programs = false;
        }
    }

    /// Reports the programs in the flash and the log of updates, once. To look at them takes milliseconds, which the start
    /// does not wait for.
    #[inline(never)]
    pub(crate) fn report_programs(&mut self, node: &mut impl Shared) {
        let Some(memory) = self.memory.as_mut().filter(|_| !self.has_reported_programs) else { return };
        self.has_reported_programs = true;
        let store = memory.store();
        let programs = Programs::read(&mut store.flash().trial(), &LAYOUT, retained::clears());
        let event = Event::pending(&mut store.flash().trial(), &LAYOUT);
        if let Some(event) = event {
            match log_event(&event, store) {
                Ok(()) => event.settle(&mut store.flash().trial(), &LAYOUT),
                Err(_) => defmt::error!("an event of the update is not stored"),
            }
        }
        let log = stored_log(store);
        node.call(|protocol, _| {
            protocol.set_programs(programs);
            protocol.set_update_log(log);
        });
        self.report(node);
    }

    /// Carries out the verdict on the trial of this program.
    pub(crate) fn judge(&mut self, node: &mut impl Shared) {
        let Some(verdict) = node.call(|protocol, _| protocol.verdict()) else { return };
        let Some(memory) = &mut self.memory else { return };
        let mut records = memory.store().flash().trial();
        let (cause, outcome) = match verdict {
            Verdict::Confirm(cause) => (cause, Trial::confirm(&mut records, &LAYOUT)),
            Verdict::TakeBack(cause) => (cause, Trial::withdraw(&mut records, &LAYOUT)),
        };
        let is_done = outcome.is_ok();
        if is_done {
            cause.note(&mut records, &LAYOUT);
        }
        match verdict {
            // The next run tries again.
            _ if !is_done => defmt::error!("the trial of this program cannot be ended"),
            Verdict::Confirm(_) => {
                defmt::info!("this program is confirmed");
                self.has_reported_programs = false;
                node.call(|protocol, _| protocol.end_trial());
            }
            Verdict::TakeBack(_) => {
                defmt::warn!("the program before this one comes back");
                cortex_m::peripheral::SCB::sys_reset()
            }
        }
    }

    /// Carries out the waiting job, if there is one. If the job has moved the store to another page, the old page is
    /// erased before the response where that is possible: the client waits, and sends nothing.
    pub(crate) fn run(&mut self, node: &mut impl Shared, watchdog: &Watchdog) {
        let job = &mut *self.job;
        if !node.call(|protocol, _| protocol.take_job(job)) {
            return;
        }
        let result = self.memory.as_mut().map_or(Err(Abort::Hardware), |memory| memory.run(job));
        match result {
            Ok(()) => defmt::info!("stored"),
            Err(abort) => defmt::error!("not stored: {=u32:#010x}", abort.code()),
        }
        self.make_room(node, watchdog);
        self.report(node);
        let job = &*self.job;
        // The resulting actions are left to the services task, which finds them at its next poll.
        let _ = node.call(|protocol, out| protocol.finish(job, result, Clock::now(), out));
        rtic::pend(SERVICES);
    }

    /// Erases the page that is not in use, if it is used up, a pause disturbs no service, and no frame waits.
    pub(crate) fn make_room(&mut self, node: &mut impl Shared, watchdog: &Watchdog) {
        let now = Clock::now();
        let Some(memory) = &mut self.memory else { return };
        let can_make_room = memory.can_make_room(now);
        retained::set_erase_budget(memory.budget().word());
        if !can_make_room || now < self.moved + REST {
            return;
        }
        if !node.call(|protocol, queue| queue.is_empty() && protocol.can_pause(ERASE, now)) {
            return;
        }
        match watchdog.extend(|| memory.make_room()) {
            Ok(()) => defmt::info!("a parameter page is erased"),
            Err(_) => defmt::error!("a parameter page cannot be erased"),
        }
        retained::set_erase_budget(memory.budget().word());
        self.report(node);
    }

    /// Reports room and wear of the memory.
    fn report(&self, node: &mut impl Shared) {
        let state = self.memory.as_ref().map_or(MemoryState::BROKEN, ParameterMemory::state);
        node.call(|protocol, _| protocol.show_memory(state));
    }
}
