//! The device in an RTIC application for a NUCLEO-F446RE with a CAN transceiver at PB8 and PB9, at 250 kbit/s: the blue
//! button is an input with a TPDO, the green LED an output with an RPDO.
//!
//! Three interrupts of one priority share the device: a received frame, a sent frame, and the next deadline.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// The example needs a microcontroller.
#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
mod node;

#[cfg(target_os = "none")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        cortex_m::asm::bkpt();
    }
}

#[cfg(target_os = "none")]
#[rtic::app(device = stm32f4xx_hal::pac, peripherals = true)]
mod app {
    use bxcan::filter::Mask32;
    use bxcan::{Can, Fifo, Interrupt};
    use stm32f4xx_hal::prelude::*;
    use stm32f4xx_hal::rcc::Config;
    use stm32f4xx_hal::timer::Event;

    use crate::node::{Clock, Node};

    /// 250 kbit/s from 42 MHz: 12 clocks for a quantum, 14 quanta for a bit, sampled after 12.
    const BIT_TIMING: u32 = 1 << 20 | 10 << 16 | 11;

    #[shared]
    struct Shared {
        node: Node,
    }

    #[local]
    struct Local {}

    #[init]
    fn init(cx: init::Context) -> (Shared, Local) {
        let clocks = Config::hse(8.MHz()).bypass_hse_oscillator().sysclk(168.MHz()).pclk1(42.MHz());
        let mut rcc = cx.device.RCC.freeze(clocks);
        let (a, b, c) = (
            cx.device.GPIOA.split(&mut rcc),
            cx.device.GPIOB.split(&mut rcc),
            cx.device.GPIOC.split(&mut rcc),
        );
        let mut can = Can::builder(cx.device.CAN1.can((b.pb9, b.pb8), &mut rcc)).leave_disabled();
        can.modify_config().set_bit_timing(BIT_TIMING).leave_disabled();
        can.modify_filters().enable_bank(0, Fifo::Fifo0, Mask32::accept_all());
        can.enable_interrupt(Interrupt::Fifo0MessagePending);
        can.enable_interrupt(Interrupt::TransmitMailboxEmpty);
        // On the bus after 11 recessive bits, whenever those come.
        let _ = can.enable_non_blocking();
        let clock = Clock::new(cx.device.TIM5.counter_us(&mut rcc));
        let mut alarm = cx.device.TIM2.counter_us(&mut rcc);
        alarm.listen(Event::Update);
        let led = a.pa5.into_push_pull_output();
        let mut node = Node::new(can, clock, alarm, c.pc13.into_input(), led);
        node.start();
        (Shared { node }, Local {})
    }

    /// A frame has arrived.
    #[task(binds = CAN1_RX0, shared = [node])]
    fn receive(mut cx: receive::Context) {
        cx.shared.node.lock(Node::receive);
    }

    /// A frame has been sent.
    #[task(binds = CAN1_TX, shared = [node])]
    fn transmit(mut cx: transmit::Context) {
        cx.shared.node.lock(Node::transmit);
    }

    /// The next deadline has come.
    #[task(binds = TIM2, shared = [node])]
    fn alarm(mut cx: alarm::Context) {
        cx.shared.node.lock(Node::alarm);
    }

    #[idle]
    fn idle(_: idle::Context) -> ! {
        loop {
            cortex_m::asm::wfi();
        }
    }
}
