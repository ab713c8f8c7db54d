//! The bootloader (CiA 302-3): it starts the application, or receives a new one from the bus. All of its code runs from
//! RAM (bootloader.x), vectors included, so that it responds while the flash erases.
//!
//! | priority | task | why there |
//! |---|---|---|
//! | 2 | `receive` | a FIFO of three places fills in 141 us at 1 Mbit/s |
//! | 1 | `wake`, `bus_error` | the time base, an error on the bus: end the sleep of `idle` |
//! | 0 | `idle` | everything else, in steps of a few milliseconds at most |
#![no_std]
#![no_main]

mod dictionary;
mod identity;
mod memory;
mod outbox;
mod program;
mod run;
mod session;
mod start;
mod target;
mod visit;

/// Without a record of the location, because the names of all source files would take 3 KiB.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    cortex_m::peripheral::SCB::sys_reset()
}

#[rtic::app(device = bsp::pac, peripherals = true)]
mod app {
    use bsp::can::filters::Fifo;
    use bsp::chip::application;
    use bsp::losses::Losses;
    use bsp::start::loader::Loader;
    use bsp::{ReceiveQueue, Receiver, TaskEnd, TimeInterrupt};

    use crate::identity::Identity;
    use crate::outbox::Outbox;
    use crate::run::Run;
    use crate::session::Session;
    use crate::start::{self, Outcome};

    /// Room for a whole block of 127 segments and other frames: programming may fall behind the bus by a block.
    const BLOCK: usize = 160;

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        receiver: Receiver,
        time: TimeInterrupt,
        run: Run,
    }

    #[init(local = [
        queue: ReceiveQueue<BLOCK> = ReceiveQueue::new(),
        lost: Losses = Losses::new(),
    ])]
    fn init(cx: init::Context) -> (Shared, Local) {
        let mut loader = Loader::start(cx.device, cfg!(feature = "development"));
        let (reason, note) = match start::decide(&mut loader) {
            Outcome::Application(vectors) => {
                loader.rest.stop();
                application::start(&cx.core, vectors)
            }
            Outcome::Stay(reason, note) => (reason, note),
        };
        let lost: &'static Losses = cx.local.lost;
        let bus = loader.rest.start(lost);
        let (receiver, frames) = Receiver::new(Fifo::Services, cx.local.queue, lost);
        let identity = Identity::read(note);
        let authorisation = start::authorisation(note);
        let run = Run {
            session: Session::new(reason, identity, authorisation, loader.flash, bus.can),
            identity,
            frames,
            queue: Outbox::new(),
            transmitter: bus.transmitter,
            alarm: bus.alarm,
            watchdog: loader.watchdog,
            led: bus.led,
        };
        (Shared {}, Local { receiver, time: bus.time, run })
    }

    #[idle(local = [run])]
    fn idle(cx: idle::Context) -> ! {
        cx.local.run.forever()
    }

    #[task(binds = CAN1_RX1, priority = 2, local = [receiver])]
    fn receive(cx: receive::Context) {
        let _end = TaskEnd;
        cx.local.receiver.drain();
    }

    /// Wakes the guest at an error on the bus.
    #[task(binds = CAN1_SCE, priority = 1)]
    fn bus_error(_: bus_error::Context) {
        let _end = TaskEnd;
        bsp::can::acknowledge_error();
    }

    #[task(binds = TIM2, priority = 1, local = [time])]
    fn wake(cx: wake::Context) {
        let _end = TaskEnd;
        cx.local.time.acknowledge();
    }
}
