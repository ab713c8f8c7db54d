//! RTIC: a hardware task, two software tasks of different priorities and a shared resource with a lock.
#![no_std]
#![no_main]

use mechanics_images as _;

#[rtic::app(device = stm32f4::stm32f446, dispatchers = [UART4, UART5])]
mod app {
    use mechanics_images::{expect, finish};
    use stm32f4::stm32f446::Interrupt;

    #[shared]
    struct Shared {
        log: u32,
    }

    #[local]
    struct Local {
        rounds: u32,
    }

    #[init]
    fn init(_: init::Context) -> (Shared, Local) {
        rtic::pend(Interrupt::TIM2);
        (Shared { log: 0 }, Local { rounds: 0 })
    }

    #[idle(shared = [log])]
    fn idle(mut context: idle::Context) -> ! {
        loop {
            let log = context.shared.log.lock(|log| *log);
            if log >> 16 != 0 {
                finish(expect(log == 0x1234_1234, log));
            }
            cortex_m::asm::nop();
        }
    }

    /// Runs twice: spawns the low task, then the high one, which must run first.
    #[task(binds = TIM2, priority = 1, local = [rounds], shared = [log])]
    fn hardware(mut context: hardware::Context) {
        *context.local.rounds += 1;
        context.shared.log.lock(|log| {
            let log: *mut u32 = log;
            let expected = unsafe { log.read_volatile() } << 4 | 1;
            unsafe { log.write_volatile(expected) };
            // No other task may access the resource until the lock ends.
            let _ = high::spawn();
            if unsafe { log.read_volatile() } != expected {
                unsafe { log.write_volatile(0xDEAD_DEAD) };
            }
        });
        // The high task must have run as soon as the lock ended.
        context.shared.log.lock(|log| *log = if *log & 0xF == 2 { *log } else { 0xBEEF_BEEF });
        let _ = low::spawn(*context.local.rounds);
    }

    #[task(priority = 3, shared = [log])]
    async fn high(mut context: high::Context) {
        context.shared.log.lock(|log| *log = *log << 4 | 2);
    }

    #[task(priority = 2, shared = [log])]
    async fn low(mut context: low::Context, round: u32) {
        context.shared.log.lock(|log| *log = *log << 8 | 0x34);
        if round == 1 {
            rtic::pend(Interrupt::TIM2);
        }
    }
}
