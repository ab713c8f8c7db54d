//! Faults of hardware, each with the step that must be red and the words that it must say.

use canbus::Time;
use chip::Loss;
use programmer::protect::OptionBytes;
use sim::world::World;

use crate::bringup::desk::{EmulatedDesk, Mistake};
use crate::bringup::probe::Probe;

/// How a fault comes into the world.
#[derive(Clone, Copy)]
pub enum Kind {
    /// Flags of the simulator.
    Flags(&'static str),
    /// A change of the running board.
    Board(fn(&mut World)),
    /// A change of the board, which is reset afterwards.
    Start(fn(&mut World)),
    /// A mistake at the desk.
    Desk(Mistake),
}

/// A fault.
pub struct Fault {
    /// The broken part.
    pub name: &'static str,
    /// The step that is red.
    pub step: &'static str,
    /// Words of a check that is red.
    pub says: &'static str,
    /// The fault.
    pub kind: Kind,
}

const fn fault(name: &'static str, step: &'static str, says: &'static str, kind: Kind) -> Fault {
    Fault { name, step, says, kind }
}

/// All faults.
pub const ALL: [Fault; 28] = [
    fault("the debug probe is not connected", "supply", "no debug probes", Kind::Desk(Mistake::NoProbe)),
    fault("VDDA is 2.95 V", "supply", "VDDA", Kind::Board(|world| rails(world, 2.95))),
    fault("VDDA is 3.7 V", "supply", "VDDA", Kind::Board(|world| rails(world, 3.7))),
    fault("another chip", "identity", "device in DBGMCU_IDCODE", Kind::Flags("--chip stm32f405")),
    fault("the flash is protected against reading", "identity", "option bytes", Kind::Board(protect)),
    fault(
        "a bit of the bootloader in flash has flipped",
        "flash",
        "bootloader",
        Kind::Board(|world| flip(world, 0x0800_0104)),
    ),
    fault(
        "a bit of the application in flash has flipped",
        "flash",
        "application",
        Kind::Board(|world| flip(world, 0x0803_0000)),
    ),
    fault("the clock on OSC_IN stops", "clock", "oscillator and PLL", Kind::Flags("--fault no-crystal@1.5")),
    fault(
        "the oscillator is 1000 ppm fast",
        "clock",
        "clock against that of the adapter",
        Kind::Flags("--oscillator 1000"),
    ),
    fault(
        "the oscillator is 300 ppm slow",
        "clock",
        "clock against that of the adapter",
        Kind::Flags("--oscillator -300"),
    ),
    fault("the crystal starts slowly", "clock", "start of the clock", Kind::Start(slow_crystal)),
    fault("the LSI has 60 kHz", "watchdog", "LSI by TIM5", Kind::Start(fast_lsi)),
    fault(
        "the CAN controller does not receive its own frames",
        "loop-back",
        "not received",
        Kind::Start(|world| world.machine(0).peripherals_mut().lose(Loss::LoopBack, 1)),
    ),
    fault("the receive pin is held low", "receive", "PB8", Kind::Board(hold_receive)),
    fault("one frame in ten has a wrong bit", "bus", "frames at", Kind::Board(|world| noise(world, 0.1))),
    fault("the bus stays short-circuited", "bus-faults", "an answer", Kind::Desk(Mistake::BusStaysShort)),
    fault(
        "the wire of the transducer is broken",
        "analogue",
        "level of pressure",
        Kind::Flags("--fault open-sensor@1"),
    ),
    fault(
        "the transducer is shorted to its supply",
        "analogue",
        "level of pressure",
        Kind::Flags("--fault rail-high@1"),
    ),
    fault(
        "the pressure input is noisy",
        "analogue",
        "noise of pressure",
        Kind::Flags("--pressure noise:250000,4000"),
    ),
    fault("the transducer has no supply", "analogue", "level of supply", Kind::Board(no_transducer)),
    fault("the chip is hot", "analogue", "temperature of the chip", Kind::Flags("--temperature const:370")),
    fault("the pressure input does not follow", "analogue", "PA0 at", Kind::Desk(Mistake::NoInput)),
    fault(
        "DMA loses requests of the converter",
        "analogue",
        "lost:",
        Kind::Board(|world| lose(world, Loss::DmaRequest { controller: 2, stream: 0 })),
    ),
    fault(
        "the encoder does not turn with the shaft",
        "encoder",
        "steps in a revolution",
        Kind::Desk(Mistake::Loose),
    ),
    fault("A and B are swapped", "encoder", "steps in a revolution", Kind::Desk(Mistake::Backwards)),
    fault("the supply is 2.8 V", "saves", "the step", Kind::Flags("--supply const:2.8")),
    fault("the stack is nearly used up", "saves", "unused stack", Kind::Board(deep_stack)),
    fault("the flash does not come to an end", "saves", "the step", Kind::Board(hang)),
];

impl Fault {
    /// The flags of the simulator.
    #[must_use]
    pub fn flags(&self) -> &'static str {
        if let Kind::Flags(flags) = self.kind { flags } else { "" }
    }

    /// Brings the fault to a desk whose board runs.
    pub fn bring(&self, desk: &mut EmulatedDesk) {
        match self.kind {
            Kind::Flags(_) => {}
            Kind::Board(act) => desk.with(act),
            Kind::Start(act) => {
                desk.with(act);
                desk.restart();
            }
            Kind::Desk(mistake) => desk.mistake = Some(mistake),
        }
    }
}

/// 50 ms, also for the bootloader, which waits up to a second.
fn slow_crystal(world: &mut World) {
    world.machine(0).peripherals_mut().set_hse_start(Time::from_millis(50));
}

fn fast_lsi(world: &mut World) {
    world.machine(0).peripherals_mut().set_lsi(60_000);
}

/// The marks of the lowest kilobytes are gone.
fn deep_stack(world: &mut World) {
    const LOW: u32 = 0x2000_0400;
    // A write to RAM does not fail.
    let _ = world.machine(0).write(LOW, &[0; 4]);
}

fn rails(world: &mut World, vdda: f64) {
    let now = world.now();
    world.machine(0).peripherals_mut().plant_mut(now).rails.vdda = vdda;
}

fn no_transducer(world: &mut World) {
    let now = world.now();
    world.machine(0).peripherals_mut().plant_mut(now).rails.transducer = 0.0;
}

/// Read-out protection at level 1, programmed with the sequence of `cargo xtask protect`.
fn protect(world: &mut World) {
    // A probe that fails leaves the chip unprotected, and the step tells.
    let _ = programmer::protect::program(&mut Probe(world), OptionBytes::FACTORY.with_read_out(true));
}

fn flip(world: &mut World, address: u32) {
    let mut byte = [0];
    let machine = world.machine(0);
    if machine.read(address, &mut byte).is_ok() {
        let _ = machine.write(address, &[byte[0] ^ 1]);
    }
}

/// PB8 is tied to ground.
fn hold_receive(world: &mut World) {
    let now = world.now();
    world.machine(0).peripherals_mut().drive('B', 8, Some(false), now);
}

fn noise(world: &mut World, share: f64) {
    world.bus().faults.noise(1, share);
}

fn lose(world: &mut World, loss: Loss) {
    world.machine(0).peripherals_mut().lose(loss, 3);
}

fn hang(world: &mut World) {
    world.machine(0).peripherals_mut().flash_mut().hang(Time::NEVER);
}
