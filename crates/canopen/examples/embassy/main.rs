//! The device in an async main of embassy, for a Cortex-M4 without a board, and for the host.
//!
//! The CAN controller is represented by two channels: its receive interrupt would put frames into one, and its transmit
//! interrupt would send the frames of the other. A board has its own time driver (embassy-stm32 brings one) and its own
//! memory.x; here nothing keeps time.
#![cfg_attr(target_os = "none", no_std, no_main)]

// The host has its own critical section.
#[cfg(not(target_os = "none"))]
use critical_section as _;
// The vectors of interrupts, which cortex-m-rt demands since another example names a chip.
#[cfg(target_os = "none")]
use stm32f4xx_hal as _;

use canopen::dictionary::{Access, Dictionary, Field, Mapping, Object, Type};
use canopen::{Action, Application, Device, Frame, Instant, NodeId, QueueFull, Transmit, objects};
use embassy_executor::Spawner;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{Instant as Time, with_deadline};

const TEMPERATURE: Object = Object::new(0x2000, 0, "Temperature", Type::Integer16, Access::ReadOnly)
    .mappable(Mapping::Tpdo)
    .unit("0.1 degC");

const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register(), objects::device_name("thermometer")],
    objects::identity(0, 1, 0x0001_0000),
    objects::sync_consumer(),
    objects::emergency(),
    [objects::heartbeat_producer(1000), TEMPERATURE],
    objects::with(objects::tpdo(1, &[TEMPERATURE]), 2, 1),
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);
const MEASURED: Field = DICTIONARY.field(0x2000, 0);

/// Frames from the receive interrupt; `SENT` has the frames for the transmit interrupt.
static RECEIVED: Channel<CriticalSectionRawMutex, Frame, 32> = Channel::new();
static SENT: Channel<CriticalSectionRawMutex, Frame, 32> = Channel::new();

struct Queue;

impl Transmit for Queue {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        SENT.try_send(frame).map_err(|_| QueueFull)
    }

    fn room(&self) -> usize {
        SENT.free_capacity()
    }
}

struct Thermometer;

impl Application for Thermometer {
    /// The value is sampled with the SYNC that sends it.
    fn synchronised(&mut self, _counter: Option<u8>, image: &mut [u8]) {
        MEASURED.store(image, 215_i16.to_le_bytes());
    }
}

fn now() -> Instant {
    Instant(Time::now().as_micros())
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let mut device: canopen::device!(Thermometer, ROWS) =
        Device::new(&DICTIONARY, NodeId::new(5), Thermometer);
    let mut next = device.start(now(), &mut Queue);
    loop {
        while let Some(action) = next.action {
            next = match action {
                Action::ResetNode | Action::ResetCommunication => device.start(now(), &mut Queue),
                // A board sets its acceptance filters, bit rate and memory here.
                _ => device.poll(now(), &mut Queue),
            };
        }
        next = match with_deadline(Time::from_micros(next.due().0), RECEIVED.receive()).await {
            Ok(frame) => device.on_frame(&frame, now(), &mut Queue),
            Err(_) => device.poll(now(), &mut Queue),
        };
    }
}

#[cfg(target_os = "none")]
mod target {
    use core::sync::atomic::{AtomicU32, Ordering};
    use core::task::Waker;

    // Provides the critical section.
    use cortex_m as _;

    /// Counts reads of the clock: without a board there is no time.
    struct NoClock(AtomicU32);

    impl embassy_time_driver::Driver for NoClock {
        fn now(&self) -> u64 {
            self.0.fetch_add(1, Ordering::Relaxed).into()
        }

        fn schedule_wake(&self, _at: u64, waker: &Waker) {
            waker.wake_by_ref();
        }
    }

    embassy_time_driver::time_driver_impl!(static CLOCK: NoClock = NoClock(AtomicU32::new(0)));

    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
        loop {
            core::hint::spin_loop();
        }
    }
}
