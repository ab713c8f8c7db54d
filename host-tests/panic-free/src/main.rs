//! All code of a node that handles the bus, the sensors and the flash, linked with a panic handler that cannot be
//! linked. `cargo xtask test --only "no panic"` builds the program for the target; the program never runs.
//!
//! The optimiser removes panics that it proves unreachable; any remaining panic makes the link fail with the name of
//! the missing symbol.
#![no_std]
#![no_main]

use canopen::{Duration, Frame, Instant, QueueFull, Transmit};
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use node::{
    BusEvent, EraseBudget, Fault, Measurement, ParameterMemory, Personality, Protocol, Setup, StoreJob,
};
use profiles::board::{Inputs, Outputs, PowerOn};
use storage::{Pages, View};

unsafe extern "C" {
    /// Not defined anywhere.
    fn a_panic_path_is_left() -> !;
    /// Functions of the outside, which the optimiser must know nothing about.
    safe fn send(id: u16, bytes: *const u8, len: usize) -> bool;
    safe fn room() -> usize;
    safe fn read(offset: u32, to: *mut u8, len: usize) -> bool;
    safe fn program(offset: u32, from: *const u8, len: usize) -> bool;
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    // SAFETY: the link fails if a call remains.
    unsafe { a_panic_path_is_left() }
}

/// A transmit queue.
struct Queue;

impl Transmit for Queue {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        if send(frame.id(), frame.data().as_ptr(), frame.len()) { Ok(()) } else { Err(QueueFull) }
    }

    fn room(&self) -> usize {
        room()
    }
}

/// A flash of two pages of 16 KiB.
struct Flash;

impl ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        if read(offset, bytes.as_mut_ptr(), bytes.len()) { Ok(()) } else { Err(NorFlashErrorKind::Other) }
    }

    fn capacity(&self) -> usize {
        32 * 1024
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = 16 * 1024;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        if program(from, core::ptr::null(), (to - from) as usize) {
            Ok(())
        } else {
            Err(NorFlashErrorKind::Other)
        }
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        if program(offset, bytes.as_ptr(), bytes.len()) { Ok(()) } else { Err(NorFlashErrorKind::Other) }
    }
}

/// Start-up: reads and prepares the parameter store.
#[unsafe(no_mangle)]
extern "C" fn start(
    protocol: &mut Protocol,
    setup: &Setup,
    memory: &mut Option<ParameterMemory<Flash>>,
    budget: u16,
    now: u64,
) {
    *protocol = Protocol::new(setup);
    let Ok(mut view) = View::open(Flash, Pages::new(0, 16 * 1024)) else { return };
    let _ = protocol.load(&mut view);
    *memory = ParameterMemory::prepare(view, EraseBudget::new(Some(budget))).ok();
    let _ = protocol.start(Instant(now), &mut Queue);
}

/// Frames of every kind, and time.
#[unsafe(no_mangle)]
extern "C" fn communicate(protocol: &mut Protocol, frame: &Frame, now: u64, ids: &mut u32) {
    let now = Instant(now);
    let _ = protocol.on_process_frame(frame, now, &mut Queue);
    let _ = protocol.on_service_frame(frame, now, &mut Queue);
    let _ = protocol.poll_process(now, &mut Queue);
    while protocol.poll_services(now, &mut Queue).action.is_some() {}
    *ids = protocol.process_ids().chain(protocol.service_ids()).map(u32::from).sum();
}

/// Faults.
#[unsafe(no_mangle)]
extern "C" fn fail(protocol: &mut Protocol, fault: &Fault, event: &BusEvent, active: bool, now: u64) {
    let _ = protocol.set_fault(fault, active, Instant(now));
    let _ = protocol.bus_event(*event, Instant(now));
}

/// The measurement, and the transfer of its values into the dictionary.
#[unsafe(no_mangle)]
extern "C" fn measure(
    protocol: &mut Protocol,
    measurement: &mut Measurement,
    inputs: &Inputs,
    outputs: &mut Outputs,
    now: u64,
) {
    measurement.apply(&protocol.parameters());
    measurement.update(inputs, protocol.snapshot_mut());
    let _ = protocol.publish(Instant(now), &mut Queue);
    *outputs = protocol.outputs();
}

/// Saves and restores the values that survive a loss of power.
#[unsafe(no_mangle)]
extern "C" fn power_cycle(measurement: &mut Measurement, personality: &Personality, power_on: &PowerOn) {
    let retained = measurement.retained();
    *measurement = Measurement::new(*personality, &PowerOn { retained, ..*power_on });
}

/// Storing.
#[unsafe(no_mangle)]
extern "C" fn store(
    protocol: &mut Protocol,
    job: &mut StoreJob,
    memory: &mut ParameterMemory<Flash>,
    budget: &mut u16,
    now: u64,
) {
    let now = Instant(now);
    if protocol.take_job(job) {
        let result = memory.run(job);
        let _ = protocol.finish(job, result, now, &mut Queue);
    }
    if memory.can_make_room(now) && protocol.can_pause(Duration::from_millis(500), now) {
        let _ = memory.make_room();
    }
    protocol.show_memory(memory.state());
    *budget = memory.budget().word();
}

/// The negative control: an index that may panic.
#[cfg(feature = "with-a-panic")]
#[unsafe(no_mangle)]
extern "C" fn index(values: &[u8; 4], at: usize) -> u8 {
    values[at]
}
