//! The services only: NMT, heartbeat, SDO expedited, segmented and by block download, LSS.
#![no_std]
#![no_main]

#[path = "ours/driver.rs"]
mod driver;

use bench_images::Node;
use core::mem::MaybeUninit;

use canopen::dictionary::{Dictionary, Object};
use canopen::{Action, Application, Instant, NodeId, ServiceDevice, objects};
use cortex_m_rt::entry;
use driver::{Driver, Received};

/// The node-ID that the host talks to.
const ID: u8 = 1;

/// An application without behaviour.
struct Keeper;

impl Application for Keeper {
    const BLOCK_UPLOAD: bool = false;
}

const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register(), objects::heartbeat_producer(1000)],
    objects::identity(0x1A, 0x2B, 1),
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

struct Services {
    device: canopen::service_device!(Keeper, ROWS),
    driver: Driver,
}

impl Node for Services {
    type Frame = Received;

    fn pass(&mut self, now: u64) {
        let mut next = self.device.poll(Instant(now), &mut self.driver);
        while let Some(action) = next.action {
            next = match action {
                Action::ResetNode | Action::ResetCommunication => {
                    self.device.start(Instant(now), &mut self.driver)
                }
                _ => self.device.poll(Instant(now), &mut self.driver),
            };
        }
    }

    fn sort(&mut self, Received(frame): &Received, now: u64) {
        let _ = self.device.on_frame(frame, Instant(now), &mut self.driver);
    }

    fn process(&mut self, frame: &Received, now: u64) {
        self.sort(frame, now);
    }

    fn serve(&mut self, frame: &Received, now: u64) {
        self.sort(frame, now);
    }

    fn disturb(&mut self, _: u64) {}
}

#[entry]
fn main() -> ! {
    static mut NODE: MaybeUninit<Services> = MaybeUninit::uninit();
    let node = NODE.write(Services {
        device: ServiceDevice::new(&DICTIONARY, NodeId::new(ID), Keeper),
        driver: Driver::new(),
    });
    let _ = node.device.start(Instant(0), &mut node.driver);
    bench_images::run(node)
}
