//! The loop of a device on a bus of a socketcand server, with its process on standard input.

use std::convert::Infallible;
use std::io::{self, BufRead};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use canopen::sdo::Abort;
use canopen::{Action, BusEvent, Definition, Device, Frame, Instant, Job, Next};

use super::Bus;

/// The work of a product beside its device.
pub(crate) trait Product {
    /// The device of the product.
    type Definition: Definition;
    /// Interval of [`cycle`](Product::cycle).
    const PERIOD: canopen::Duration = canopen::Duration::from_millis(10);

    /// Stores or restores values. The client gets the result.
    fn store(&mut self, _device: &mut Device<Self::Definition>, _job: Job) -> Result<(), Abort> {
        Err(Abort::NotStored)
    }

    /// Takes a frame of the bus, beside the device.
    fn on_frame(&mut self, _frame: &Frame, _now: Instant) {}

    /// Takes the lines of standard input, and publishes the values of the process.
    fn cycle(
        &mut self,
        device: &mut Device<Self::Definition>,
        bus: &mut Bus,
        lines: &Receiver<String>,
        now: Instant,
    ) -> Next;
}

/// Runs a device for ever. While the server is away, the device has a bus without a cable.
pub(crate) fn run<P: Product>(
    mut product: P,
    mut device: Device<P::Definition>,
    address: &str,
    bus: &str,
) -> ! {
    let (lines, process) = channel();
    std::thread::spawn(move || {
        io::stdin().lock().lines().map_while(Result::ok).try_for_each(|line| lines.send(line))
    });
    let start = std::time::Instant::now();
    loop {
        if let Ok(mut bus) = Bus::open(address, bus) {
            let Err(error) = run_on(&mut product, &mut device, &mut bus, &process, start);
            eprintln!("the bus is gone: {error}");
            // For the process, a lost connection is the same as bus-off.
            let _ = device.on_bus(BusEvent::BusOff, now(start));
        }
        std::thread::sleep(Duration::from_millis(100));
    }
}

fn now(since: std::time::Instant) -> Instant {
    Instant(u64::try_from(since.elapsed().as_micros()).unwrap_or(u64::MAX))
}

/// Runs until the connection to the bus is lost.
fn run_on<P: Product>(
    product: &mut P,
    device: &mut Device<P::Definition>,
    bus: &mut Bus,
    lines: &Receiver<String>,
    start: std::time::Instant,
) -> io::Result<Infallible> {
    let mut next = device.start(now(start), bus);
    let mut cycle = now(start);
    loop {
        let patience = next.due().min(cycle).0.saturating_sub(now(start).0);
        let frame = bus.receive(Duration::from_micros(patience))?;
        next = match frame {
            Some(frame) => {
                product.on_frame(&frame, now(start));
                device.on_frame(&frame, now(start), bus)
            }
            None => device.poll(now(start), bus),
        };
        while let Some(action) = next.action {
            next = match action {
                Action::ResetNode | Action::ResetCommunication => device.start(now(start), bus),
                Action::Store(job) => {
                    let result = product.store(device, job);
                    let _ = device.finish(result, now(start), bus);
                    device.poll(now(start), bus)
                }
                // There are no acceptance filters, only one bit rate, and no bootloader.
                _ => device.poll(now(start), bus),
            };
        }
        if now(start) >= cycle {
            cycle = now(start) + P::PERIOD;
            next = product.cycle(device, bus, lines, now(start));
        }
    }
}
