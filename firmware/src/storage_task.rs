//! The task of the parameter store, at the lowest priority: it carries out the store jobs of the protocol. The flash
//! stops the core for 16 us with every word, so all other tasks run between two words.

use bsp::Clock;
use bsp::ParameterFlash;
use bsp::update_layout::LAYOUT;
use canopen::sdo::Abort;
use node::{StoreJob, StoredPositionRecord, Verdict};
use profiles::board::RETAINED_WORDS;
use storage::Store;
use update::Trial;

use crate::SERVICES;
use crate::shared::Shared;

/// The data that the task owns.
pub(crate) struct StorageTask {
    /// `None` if the flash could not be prepared, so that nothing can be stored.
    store: Option<Store<ParameterFlash>>,
    job: &'static mut StoreJob,
    position_record: StoredPositionRecord,
}

/// The words retained by the last sample; `None` if the profile retains nothing.
pub(crate) type Retained = Option<[u32; RETAINED_WORDS]>;

impl StorageTask {
    pub(crate) fn new(
        store: Option<Store<ParameterFlash>>,
        job: &'static mut StoreJob,
        position_record: StoredPositionRecord,
    ) -> StorageTask {
        StorageTask { store, job, position_record }
    }

    /// Whether the store works.
    pub(crate) fn is_working(&self) -> bool {
        self.store.is_some()
    }

    /// Stores the record about the retained state, which a start with an empty battery needs.
    pub(crate) fn keep(&mut self, retained: &Retained, node: &mut impl Shared) {
        if let (Some(store), Some(words)) = (&mut self.store, retained) {
            let device = node.call(|protocol, _| protocol.device_record());
            match self.position_record.keep(words, &device, store) {
                Ok(true) => defmt::info!("the record of the positions is stored"),
                Ok(false) => {}
                Err(_) => defmt::error!("the record of the positions is not stored"),
            }
        }
    }

    /// Carries out the verdict on the trial of this program.
    pub(crate) fn judge(&mut self, node: &mut impl Shared) {
        let Some(verdict) = node.call(|protocol, _| protocol.verdict()) else { return };
        let Some(store) = &mut self.store else { return };
        let mut records = store.flash().trial();
        let is_done = match verdict {
            Verdict::Confirm => Trial::confirm(&mut records, &LAYOUT).is_ok(),
            Verdict::TakeBack => Trial::withdraw(&mut records, &LAYOUT).is_ok(),
        };
        match verdict {
            // The next run tries again.
            _ if !is_done => defmt::error!("the trial of this program cannot be ended"),
            Verdict::Confirm => {
                defmt::info!("this program is confirmed");
                node.call(|protocol, _| protocol.end_trial());
            }
            Verdict::TakeBack => {
                defmt::warn!("the program before this one comes back");
                cortex_m::peripheral::SCB::sys_reset()
            }
        }
    }

    /// Carries out the waiting job, if there is one. A program on trial stores nothing, because the previous program
    /// has to find its settings.
    pub(crate) fn run(&mut self, node: &mut impl Shared) {
        let job = &mut *self.job;
        if !node.call(|protocol, _| protocol.take_job(job)) {
            return;
        }
        let is_on_trial = node.call(|protocol, _| protocol.is_on_trial());
        let result = match &mut self.store {
            Some(_) if is_on_trial => Err(Abort::DeviceState),
            Some(store) => job.run(store),
            None => Err(Abort::Hardware),
        };
        match result {
            Ok(()) => defmt::info!("stored"),
            Err(abort) => defmt::error!("not stored: {=u32:#010x}", abort.code()),
        }
        // The resulting actions are left to the services task, which finds them at its next poll.
        let _ = node.call(|protocol, out| protocol.finish(job, result, Clock::now(), out));
        rtic::pend(SERVICES);
    }
}
