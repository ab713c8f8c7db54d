//! The protocol's side of the parameter store: what is packed for it, and what is taken over when it is done.

use crate::stored::Kept;
use crate::{Parcel, Protocol};
use canopen::dictionary::Group;
use canopen::sdo::Abort;
use canopen::{Instant, Job, Selection, Transmit};
use embedded_storage::nor_flash::ReadNorFlash;
use heapless::Vec;
use storage::{DeviceRecord, View};

impl Protocol {
    /// Reads the stored parameters, for [`start`](Protocol::start) and every reset after it.
    pub fn load<F: ReadNorFlash>(&mut self, view: &mut View<F>) {
        self.device.application_mut().stored.load(view);
    }

    /// Packs the job that `Request::Store` announced, with the values of this moment. `false` when there is none.
    pub fn pack(&mut self, parcel: &mut Parcel) -> bool {
        parcel.job = self.job.take();
        match parcel.job {
            None => return false,
            Some(Job::Save(selection)) => {
                self.pack_group(Group::Communication, selection, &mut parcel.communication);
                self.pack_group(Group::Application, selection, &mut parcel.application);
            }
            Some(Job::Restore(_)) => {
                parcel.communication.clear();
                parcel.application.clear();
            }
            Some(Job::Configure(configuration)) => {
                let node_id = configuration.node_id.map_or(DeviceRecord::UNCONFIGURED, canopen::NodeId::get);
                let personality = self.device.application().setup.personality.number();
                let record = DeviceRecord::new(node_id, configuration.bit_rate.kbit(), personality);
                parcel.device = record.map_or([0; DeviceRecord::LEN], |record| record.encode());
            }
        }
        true
    }

    fn pack_group<const N: usize>(&self, group: Group, selection: Selection, out: &mut Vec<u8, N>) {
        out.clear();
        if selection.contains(group) {
            let dictionary = self.device.application().setup.personality.dictionary();
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
        if let (Ok(()), Some(Job::Save(selection) | Job::Restore(selection))) = (result, parcel.job) {
            let stored = &mut self.device.application_mut().stored;
            take_over(&mut stored.communication, Group::Communication, selection, &parcel.communication);
            take_over(&mut stored.application, Group::Application, selection, &parcel.application);
        }
        self.device.finish(result, now, out);
    }
}

fn take_over<const N: usize>(kept: &mut Kept<N>, group: Group, selection: Selection, packed: &[u8]) {
    if selection.contains(group) {
        kept.replace(packed);
    }
}
