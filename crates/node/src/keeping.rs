//! The protocol's side of the parameter store: what is packed for it, and what is taken over when it is done.

use crate::stored::{Kept, layout};
use crate::{Next, Parameters, Parcel, Protocol};
use canopen::dictionary::{Group, Groups};
use canopen::sdo::Abort;
use canopen::{Instant, Job, Transmit};
use embedded_storage::nor_flash::ReadNorFlash;
use storage::View;

impl Protocol {
    /// Reads the stored parameters, for [`start`](Protocol::start) and every reset after it. Gives the parameters of the
    /// measurement: one that has them before the start has a sample for the first PDO.
    pub fn load<F: ReadNorFlash>(&mut self, view: &mut View<F>) -> Parameters {
        let profile = self.device.application_mut();
        profile.stored.load(layout(profile.setup.personality), view);
        self.device.load();
        self.parameters()
    }

    /// The same for a node whose store cannot be read.
    pub fn load_defaults(&mut self) -> Parameters {
        self.device.load();
        self.parameters()
    }

    /// Takes the job that `Action::Store` announced, with the values of this moment. `false` when there is none. The
    /// values are only copied: to pack them takes half a millisecond, in which nobody should have to wait for the protocol.
    pub fn pack(&mut self, parcel: &mut Parcel) -> bool {
        let profile = self.device.application();
        parcel.job = self.job.take();
        parcel.personality = profile.setup.personality;
        parcel.node_id = self.device.node_id();
        match parcel.job {
            None => return false,
            Some(Job::Store(_)) => parcel.image = *self.device.image(),
            Some(Job::Restore(_)) => {}
            Some(job @ (Job::Configure(_) | Job::Setting(_))) => {
                parcel.device = profile.configured.after(job).encode();
            }
        }
        true
    }

    /// The job of the parcel is done or has failed: the next reset finds what is stored now, and the client is answered.
    pub fn finish(
        &mut self,
        parcel: &Parcel,
        result: Result<(), Abort>,
        now: Instant,
        out: &mut impl Transmit,
    ) -> Next {
        if let (Ok(()), Some(job)) = (result, parcel.job) {
            self.take_over(job, parcel);
        }
        self.device.finish(result, now, out)
    }

    fn take_over(&mut self, job: Job, parcel: &Parcel) {
        let profile = self.device.application_mut();
        profile.configured = profile.configured.after(job);
        if let Job::Store(groups) | Job::Restore(groups) = job {
            let stored = &mut profile.stored;
            take_over(&mut stored.communication, Group::Communication, groups, &parcel.communication);
            take_over(&mut stored.application, Group::Application, groups, &parcel.application);
            take_over(&mut stored.calibration, Group::Calibration, groups, &parcel.calibration);
        }
        self.device.show(|profile, image| profile.show_personality(image));
    }
}

fn take_over<const N: usize>(kept: &mut Kept<N>, group: Group, groups: Groups, packed: &[u8]) {
    if groups.contains(group) {
        kept.replace(packed);
    }
}
