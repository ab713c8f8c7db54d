//! The task of the parameter store: at the lowest priority it does what the protocol wants stored. The flash stops the
//! core for 16 us with every word, so everything else runs between two words.

use bsp::Clock;
use bsp::ParameterFlash;
use canopen::sdo::Abort;
use node::{LastingRecord, StoreJob};
use profiles::board::RETAINED_WORDS;
use storage::Store;

use crate::SERVICES;
use crate::shared::Shared;

/// What the task owns.
pub(crate) struct StorageTask {
    /// `None` when the flash could not be prepared: then nothing can be stored.
    store: Option<Store<ParameterFlash>>,
    job: &'static mut StoreJob,
    lasting: LastingRecord,
}

/// What a profile retains, as the last sample has left it; `None` where it retains nothing.
pub(crate) type Retained = Option<[u32; RETAINED_WORDS]>;

impl StorageTask {
    pub(crate) fn new(
        store: Option<Store<ParameterFlash>>,
        job: &'static mut StoreJob,
        lasting: LastingRecord,
    ) -> StorageTask {
        StorageTask { store, job, lasting }
    }

    /// Whether it can store anything.
    pub(crate) fn is_working(&self) -> bool {
        self.store.is_some()
    }

    /// Keeps what a start without a battery has to know of the positions.
    pub(crate) fn keep(&mut self, retained: &Retained, node: &mut impl Shared) {
        if let (Some(store), Some(words)) = (&mut self.store, retained) {
            let device = node.call(|protocol, _| protocol.device_record());
            match self.lasting.keep(words, &device, store) {
                Ok(true) => defmt::info!("the record of the positions is stored"),
                Ok(false) => {}
                Err(_) => defmt::error!("the record of the positions is not stored"),
            }
        }
    }

    /// Does the job that waits, if one does.
    pub(crate) fn run(&mut self, node: &mut impl Shared) {
        let job = &mut *self.job;
        if !node.call(|protocol, _| protocol.take_job(job)) {
            return;
        }
        let result = self.store.as_mut().map_or(Err(Abort::Hardware), |store| job.run(store));
        match result {
            Ok(()) => defmt::info!("stored"),
            Err(abort) => defmt::error!("not stored: {=u32:#010x}", abort.code()),
        }
        // What follows is left to the services, which find it when they poll.
        let _ = node.call(|protocol, out| protocol.finish(job, result, Clock::now(), out));
        rtic::pend(SERVICES);
    }
}
