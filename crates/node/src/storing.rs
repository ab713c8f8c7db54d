//! The protocol's side of the parameter store: the copy for a job, and the results of a job.

use canopen::dictionary::Group;
use canopen::sdo::Abort;
use canopen::{Instant, Job, Transmit};
use embedded_storage::nor_flash::ReadNorFlash;
use profiles::{Parameters, Snapshot};
use storage::View;

use crate::stored::layout;
use crate::{Next, Protocol, StoreJob};

impl Protocol {
    /// Reads the stored parameters, for [`start`](Protocol::start) and every later reset. Returns the parameters of the
    /// measurement: with them before the start, there is a sample for the first PDO.
    pub fn load<F: ReadNorFlash>(&mut self, view: &mut View<F>) -> Parameters {
        let application = self.device.application_mut();
        application.stored.load(layout(application.setup.personality), view);
        self.device.load();
        self.parameters()
    }

    /// Loads the defaults, for a node whose store cannot be read.
    pub fn load_defaults(&mut self) -> Parameters {
        self.device.load();
        self.parameters()
    }

    /// The device record, as stored or as it would be stored, which
    /// [`StoredPositionRecord`](crate::StoredPositionRecord) writes together with its own record.
    #[must_use]
    pub fn device_record(&self) -> [u8; storage::DeviceRecord::LEN] {
        self.device.application().configured.encode()
    }

    /// Takes the job that `Action::Store` announced, with the values of this moment. `false` without a job. The
    /// values are only copied: packing them takes half a millisecond, and no task should wait for the protocol that
    /// long.
    ///
    /// Values that the measurement determines, such as the offset of a preset, are stored too. While such values may be
    /// older than the parameters, the job waits: [`publish`](Protocol::publish) makes the services due when to ask again.
    pub fn take_job(&mut self, taken: &mut StoreJob) -> bool {
        let application = self.device.application();
        let is_measured = !matches!(application.snapshot, Snapshot::Nothing);
        if is_measured && self.older_samples.are_left() && matches!(self.job, Some(Job::Store(_))) {
            taken.job = None;
            return false;
        }
        taken.job = self.job.take();
        taken.personality = application.setup.personality;
        taken.node_id = self.device.node_id();
        match taken.job {
            None => return false,
            Some(Job::Store(_)) => taken.image = *self.device.image(),
            Some(Job::Restore(_)) => {}
            Some(job @ (Job::Configure(_) | Job::Setting(_))) => {
                taken.device = application.configured.after(job).encode();
            }
        }
        true
    }

    /// The job is done or has failed: the next reset finds the values now stored, and the client gets its answer.
    pub fn finish(
        &mut self,
        done: &StoreJob,
        result: Result<(), Abort>,
        now: Instant,
        out: &mut impl Transmit,
    ) -> Next {
        if let (Ok(()), Some(job)) = (result, done.job) {
            self.take_over(job, done);
        }
        let next = self.device.finish(result, now, out);
        self.note(next)
    }

    fn take_over(&mut self, job: Job, done: &StoreJob) {
        let application = self.device.application_mut();
        application.configured = application.configured.after(job);
        if let Job::Store(groups) | Job::Restore(groups) = job {
            for group in Group::COMMON.into_iter().filter(|group| groups.contains(*group)) {
                application.stored.replace(group, done.packed.get(group));
            }
        }
        self.device.show(|application, image| application.show_personality(image));
    }
}
