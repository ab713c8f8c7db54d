//! CAN1: bring-up, filters and state. The mailboxes are in `transmit` and `receive`.
//!
//! The crate bxcan brings the controller to initialisation after a reset, and switches its interrupts. Timing,
//! filters and modes are set here, because the crate's code for them does not fit the bootloader. The crate waits without a bound
//! for each change of the mode: to leave the bus, the controller waits for the end of a frame, and with RX held dominant
//! for ever (RM0390, 30.4). That change has a bound here.
#![expect(unsafe_code, reason = "registers, and the trait of bxcan")]

use bxcan::Interrupts;
use canopen::Duration;
use stm32f4xx_hal::pac::{CAN1, RCC, can1};
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

use crate::boards::BOARD;
use crate::can::bit_timing::BitTiming;
use crate::can::bus_state::{BusState, Heard};
use crate::can::filters::{self, BANKS, Bank, Fifo, Pair};
use crate::can::transmit::Transmitter;
use crate::losses::{Event, Losses};
use crate::pins::gpio::{enable, output_of, port};
use crate::time::time_base::Clock;

/// The registers for the crate bxcan.
pub(crate) struct Registers;

// SAFETY: CAN1 is owned by `Controller`. The parts that share its registers use disjoint ones: the controller uses
// those of mode, timing, errors and filters, the transmitter those of the transmit mailboxes, each receiver those of
// its FIFO.
unsafe impl bxcan::Instance for Registers {
    const REGISTERS: *mut bxcan::RegisterBlock = CAN1::ptr().cast_mut().cast();
}

pub(crate) fn registers() -> &'static can1::RegisterBlock {
    // SAFETY: see the implementation of `Instance`; each caller uses its own registers only.
    unsafe { &*CAN1::ptr() }
}

/// Takes the controller off the bus at once, even in the middle of a frame, until the next reset of the chip.
pub(crate) fn hold_in_reset() {
    // SAFETY: the program has ended, so no other code writes the register.
    unsafe { (*RCC::ptr()).apb1rstr().modify(|_, reset| reset.can1rst().set_bit()) };
}

/// Mode, timing, filters and errors of the controller.
pub struct Controller {
    can: bxcan::Can<Registers>,
    losses: &'static Losses,
}

impl Controller {
    /// Takes the peripheral and its pins, without going on the bus until [`Controller::start`]. A mode that the
    /// controller does not change is counted in `losses`.
    /// The transceiver is awake from here on.
    pub(crate) fn new(_can: CAN1, losses: &'static Losses, rcc: &mut Rcc) -> (Controller, Transmitter) {
        make_pins(rcc);
        CAN1::enable(rcc);
        CAN1::reset(rcc);
        let can = bxcan::Can::builder(Registers).leave_disabled();
        (Controller { can, losses }, Transmitter::new())
    }

    /// Joins the bus, or restarts on the bus: drops the content of the mailboxes and takes new timing and filters.
    /// Error counters start from zero. The function does not wait for the bus, because a stuck bus must not keep the
    /// node from starting.
    pub fn start(&mut self, timing: BitTiming, banks: &[Bank]) {
        self.join(timing, banks, false);
    }

    /// Joins the bus silently: no frame, no acknowledge, no error frame. All frames come to FIFO 1.
    pub fn listen(&mut self, timing: BitTiming) {
        self.join(timing, &filters::everything(), true);
    }

    fn join(&mut self, timing: BitTiming, banks: &[Bank], silent: bool) {
        registers().tsr().write(|w| w.abrq0().set_bit().abrq1().set_bit().abrq2().set_bit());
        self.stop();
        registers().btr().write(|w| {
            // SAFETY: `BitTiming` asserts that its values fit the register.
            unsafe { w.bits(timing.btr()) };
            w.silm().bit(silent)
        });
        self.set_filters(banks);
        self.enable_interrupts();
        mark_error_code();
        // The controller joins after 11 recessive bits. The automatic return from bus-off is off: `crate::policy::back_off`
        // decides on the return.
        registers().mcr().modify(|_, w| w.abom().clear_bit().sleep().clear_bit().inrq().clear_bit());
    }

    /// Leaves the bus for initialisation, at the end of the frame on the bus. A controller that does not leave the bus
    /// in time is reset, which cuts a frame that it sends.
    fn stop(&mut self) {
        if !is_initialising() {
            self.losses.count(Event::CanMode);
            hold_in_reset();
            // SAFETY: only this function and `hold_in_reset` write the bit; after the latter the program has ended.
            unsafe { (*RCC::ptr()).apb1rstr().modify(|_, reset| reset.can1rst().clear_bit()) };
            // Out of a reset the controller sleeps, so it follows at once.
            is_initialising();
        }
    }

    /// Returns from bus-off: after 128 times 11 recessive bits the controller takes part again (RM0390, 30.7.6). No
    /// effect in any other state. To be called again if the controller is still off some time later.
    pub fn recover(&mut self) {
        if self.state() == BusState::Off {
            registers().mcr().modify(|_, w| w.inrq().set_bit());
            // Off the bus, no frame has to end first, so this takes a few clocks only.
            let _ = (0..ACKNOWLEDGE_POLLS).find(|_| registers().msr().read().inak().bit_is_set());
            registers().mcr().modify(|_, w| w.inrq().clear_bit());
        }
    }

    /// Events since the last call, apart from frames that wait in a FIFO. Also acknowledges the error interrupt, which
    /// would otherwise be raised again at once.
    pub fn heard(&mut self) -> Heard {
        acknowledge_error();
        let code = registers().esr().read().lec().bits();
        mark_error_code();
        match code {
            NO_ERROR => Heard::Frame,
            UNTOUCHED => Heard::Silence,
            NO_ACKNOWLEDGE => Heard::Nobody,
            _ => Heard::Error,
        }
    }

    /// Makes every error raise the error interrupt, until the next start.
    pub fn watch_errors(&mut self) {
        registers().ier().modify(|_, w| w.lecie().set_bit());
    }

    /// Replaces the filters. Frames that end during the change, a few microseconds, are not received. CAN1 owns all
    /// banks of the pair CAN1 and CAN2, and each bank has two pairs of identifier and mask (RM0390, 30.7.4).
    pub fn set_filters(&mut self, banks: &[Bank]) {
        let can = registers();
        // SAFETY: the value is the number of banks.
        can.fmr().modify(|_, w| unsafe { w.finit().set_bit().can2sb().bits(BANKS as u8) });
        let [mut active, mut services, mut bit] = [0, 0, 1];
        for (place, bank) in can.fb_iter().zip(banks) {
            let [first, second] = bank.pairs.map(Pair::register);
            // SAFETY: any identifiers and masks.
            unsafe {
                place.fr1().write(|w| w.bits(first));
                place.fr2().write(|w| w.bits(second));
            }
            active |= bit;
            services |= if bank.fifo == Fifo::Services { bit } else { 0 };
            bit <<= 1;
        }
        // SAFETY: a bit for each bank in all of these registers.
        unsafe {
            can.fm1r().write(|w| w.bits(0));
            can.fs1r().write(|w| w.bits(0));
            can.ffa1r().write(|w| w.bits(services));
            can.fa1r().write(|w| w.bits(active));
        }
        can.fmr().modify(|_, w| w.finit().clear_bit());
    }

    /// State of the fault confinement; acknowledges the error interrupt.
    pub fn state(&mut self) -> BusState {
        acknowledge_error();
        BusState::from_esr(registers().esr().read().bits())
    }

    fn enable_interrupts(&mut self) {
        self.can.enable_interrupts(
            Interrupts::TRANSMIT_MAILBOX_EMPTY
                | Interrupts::FIFO0_MESSAGE_PENDING
                | Interrupts::FIFO1_MESSAGE_PENDING
                | Interrupts::ERROR,
        );
        // The events that count as errors for the last of these interrupts; bxcan cannot set them.
        registers()
            .ier()
            .modify(|_, w| w.ewgie().set_bit().epvie().set_bit().bofie().set_bit().lecie().clear_bit());
    }
}

/// Switches PB8 and PB9 to CAN1: alternate function 9 (STM32F446 datasheet, table 11).
///
/// TX has medium speed: at low speed its edges take up to 100 ns, a tenth of a bit at 1 Mbit/s (STM32F446 datasheet, I/O AC
/// characteristics). RX is pulled up, so that without a transceiver the bus is recessive.
fn make_pins(rcc: &RCC) {
    <output_of!(BOARD.standby)>::new(rcc);
    enable('B', rcc);
    let port = port('B');
    port.afrh().modify(|_, w| w.afrh8().af9().afrh9().af9());
    port.ospeedr().modify(|_, w| w.ospeedr9().medium_speed());
    port.pupdr().modify(|_, w| w.pupdr8().pull_up());
    port.moder().modify(|_, w| w.moder8().alternate().moder9().alternate());
}

/// Requests initialisation, and waits until the controller acknowledges it and has left sleep.
pub(crate) fn is_initialising() -> bool {
    registers().mcr().modify(|_, w| w.sleep().clear_bit().inrq().set_bit());
    let latest = Clock::now() + LONGEST_FRAME;
    loop {
        let state = registers().msr().read();
        if state.inak().bit_is_set() && state.slak().bit_is_clear() {
            return true;
        }
        if Clock::now() >= latest {
            return false;
        }
    }
}

/// Sets LEC to a value that the hardware never sets, so that any other value is new (RM0390, 30.9.2, LEC).
pub(crate) fn mark_error_code() {
    // SAFETY: LEC takes any value.
    registers().esr().modify(|_, w| unsafe { w.lec().bits(UNTOUCHED) });
}

/// Acknowledges the error interrupt, which is raised again until then. The error code can still be read afterwards.
pub fn acknowledge_error() {
    registers().msr().write(|w| w.erri().set_bit());
}

/// Number of polls for an acknowledge, which comes at once if at all.
const ACKNOWLEDGE_POLLS: u32 = 1_000;

/// Longer than a frame of 160 bits with an error frame at 10 kbit/s.
const LONGEST_FRAME: Duration = Duration::from_millis(25);

/// Values of LEC (RM0390, 30.9.2): a frame without an error; a frame without an acknowledge; set by software.
const NO_ERROR: u8 = 0;
const NO_ACKNOWLEDGE: u8 = 3;
const UNTOUCHED: u8 = 7;
