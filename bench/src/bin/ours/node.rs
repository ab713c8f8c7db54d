//! A device of ours. With `HALVES`, it is called as the firmware calls it: one task for process data and one for services, each
//! asks for its next deadline at its end. Without, one loop takes every frame. The program around it defines `Measured`,
//! `Keeper`, `DICTIONARY` and `HALVES`.

use bench_images::Node;
use core::hint::black_box;
use core::mem::MaybeUninit;

use canopen::{Action, BusEvent, CanId, Device, Frame, Instant, Next, NodeId};

use crate::driver::{Driver, Received};

/// The node-ID that the host talks to.
const ID: u8 = 1;

pub(crate) struct Ours {
    device: crate::Measured,
    driver: Driver,
    /// When each half wants to be called, as the firmware keeps it.
    alarms: [Instant; 2],
}

impl Node for Ours {
    type Frame = Received;

    fn pass(&mut self, now: u64) {
        let mut next = self.device.poll(Instant(now), &mut self.driver);
        while let Some(action) = next.action {
            next = self.fulfil(action, Instant(now));
        }
    }

    fn disturb(&mut self, now: u64) {
        let _ = self.device.set_condition(0, true, Instant(now));
        let _ = self.device.on_bus(BusEvent::Overrun, Instant(now));
        let _ = self.device.publish(Instant(now), &mut self.driver, |_, image| image.fill(0));
        let _ = self.device.set_condition(0, false, Instant(now));
    }

    fn sort(&mut self, Received(frame): &Received, now: u64) {
        if !crate::HALVES {
            return self.take(frame, now);
        }
        let _ = self.device.on_frame(frame, Instant(now), &mut self.driver);
    }

    fn process(&mut self, Received(frame): &Received, now: u64) {
        if !crate::HALVES {
            return self.take(frame, now);
        }
        let next = self.device.on_process_frame(frame, Instant(now), &mut self.driver);
        self.alarms[0] = next.process;
    }

    fn serve(&mut self, Received(frame): &Received, now: u64) {
        if !crate::HALVES {
            return self.take(frame, now);
        }
        let next = self.device.on_service_frame(frame, Instant(now), &mut self.driver);
        self.alarms[1] = next.services;
    }
}

impl Ours {
    #[inline(never)]
    fn take(&mut self, frame: &Frame, now: u64) {
        let next = self.device.on_frame(frame, Instant(now), &mut self.driver);
        self.alarms = [next.process, next.services];
    }

    /// Does what the device leaves to its caller.
    fn fulfil(&mut self, action: Action, now: Instant) -> Next {
        match action {
            Action::ResetNode | Action::ResetCommunication => {
                return self.device.start(now, &mut self.driver);
            }
            Action::Identifiers => {
                let ids = self.device.process_ids().chain(self.device.service_ids());
                black_box(ids.map(CanId::get).fold(0, u16::wrapping_add));
            }
            Action::Store(_) => return self.device.finish(Ok(()), now, &mut self.driver),
            Action::BitRate(_) | Action::Bootloader => (),
        }
        self.device.poll(now, &mut self.driver)
    }
}

/// Starts the device, and carries out the host's requests.
pub(crate) fn run(node: &mut MaybeUninit<Ours>, application: crate::Keeper) -> ! {
    let node = node.write(Ours {
        device: Device::new(&crate::DICTIONARY, NodeId::new(ID), application),
        driver: Driver::new(),
        alarms: [Instant(0); 2],
    });
    let _ = node.device.start(Instant(0), &mut node.driver);
    bench_images::run(node)
}
