//! The protocol's side of the parameter store: what is packed for it, and what is taken over when it is done.

use crate::profile::Profile;
use crate::stored::{Kept, layout};
use crate::{Parcel, Protocol};
use canopen::dictionary::Group;
use canopen::sdo::Abort;
use canopen::{Instant, Job, Selection, Transmit};
use embedded_storage::nor_flash::ReadNorFlash;
use heapless::Vec;
use storage::View;

impl Protocol {
    /// Reads the stored parameters, for [`start`](Protocol::start) and every reset after it.
    pub fn load<F: ReadNorFlash>(&mut self, view: &mut View<F>) {
        let profile = self.device.application_mut();
        profile.stored.load(layout(profile.setup.personality), view);
    }

    /// Packs the job that `Request::Store` announced, with the values of this moment. `false` when there is none.
    pub fn pack(&mut self, parcel: &mut Parcel) -> bool {
        parcel.job = self.job.take();
        parcel.layout = layout(self.device.application().setup.personality);
        match parcel.job {
            None => return false,
            Some(Job::Save(selection)) => {
                self.pack_group(Group::Communication, selection, &mut parcel.communication);
                self.pack_group(Group::Application, selection, &mut parcel.application);
                self.pack_group(Group::Calibration, selection, &mut parcel.calibration);
            }
            Some(Job::Restore(_)) => {
                parcel.communication.clear();
                parcel.application.clear();
                parcel.calibration.clear();
            }
            Some(job @ (Job::Configure(_) | Job::Set(_))) => {
                parcel.device = self.device.application().configured.after(job).encode();
            }
        }
        true
    }

    fn pack_group<const N: usize>(&self, group: Group, selection: Selection, out: &mut Vec<u8, N>) {
        out.clear();
        if selection.contains(group) {
            let dictionary = self.device.application().definition().dictionary;
            // The buffers are as large as the largest dictionary needs: `profile` computes them from the tables.
            let _ = dictionary.pack(group, self.device.node_id(), self.device.image(), out);
        }
    }

    /// The job of the parcel is done or has failed: the next reset finds what is stored now, and the client is answered.
    pub fn finish(
        &mut self,
        parcel: &Parcel,
        result: Result<(), Abort>,
        now: Instant,
        out: &mut impl Transmit,
    ) {
        if let (Ok(()), Some(job)) = (result, parcel.job) {
            self.take_over(job, parcel);
        }
        self.device.finish(result, now, out);
    }

    fn take_over(&mut self, job: Job, parcel: &Parcel) {
        let profile = self.device.application_mut();
        profile.configured = profile.configured.after(job);
        if let Job::Save(selection) | Job::Restore(selection) = job {
            let stored = &mut profile.stored;
            take_over(&mut stored.communication, Group::Communication, selection, &parcel.communication);
            take_over(&mut stored.application, Group::Application, selection, &parcel.application);
            take_over(&mut stored.calibration, Group::Calibration, selection, &parcel.calibration);
        }
        self.device.show(Profile::show_personality);
    }
}

fn take_over<const N: usize>(kept: &mut Kept<N>, group: Group, selection: Selection, packed: &[u8]) {
    if selection.contains(group) {
        kept.replace(packed);
    }
}
