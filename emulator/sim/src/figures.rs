//! The counters of a board's machine as figures for the summary.

use bsp::chip::vectors::UNUSED_STACK;
use canbus::Time;
use chip::Stm32f4;
use emulator::{Exception, Incident, Machine};

use crate::image::Image;
use crate::status::{per_second, share};
use crate::summary::{Cpu, Memory, Receiving, Sampling};

/// DMA2 stream 0 delivers the samples: its interrupt is the sampling task (RM0390, table 38).
const SAMPLING: Exception = Exception::irq(56);
/// CAN1 receive FIFO 0 and 1.
const RECEIVE: [Exception; 2] = [Exception::irq(20), Exception::irq(21)];
/// The sampling period.
const PERIOD: Time = Time::from_millis(1);

/// Figures of the 1 kHz measurement.
pub(crate) fn sampling(machine: &Machine<Stm32f4>) -> Sampling {
    let activity = machine.stats().of(SAMPLING);
    // Without an interval, the shortest and the longest are zero.
    let measured = activity.intervals > 0;
    let early = if measured { PERIOD.since(activity.shortest_interval) } else { Time::ZERO };
    let late = activity.longest_interval.since(PERIOD);
    Sampling {
        samples: activity.entries,
        rate: per_second(activity.intervals, activity.interval_sum),
        worst_jitter: early.max(late).as_secs_f64() * 1e6,
        instructions: mean(activity.instructions, activity.entries),
    }
}

/// Figures of the received frames.
pub(crate) fn receiving(machine: &Machine<Stm32f4>) -> Receiving {
    let reception = machine.peripherals().can1().reception();
    let instructions = RECEIVE.iter().map(|&exception| machine.stats().of(exception).instructions).sum();
    Receiving {
        frames: reception.accepted,
        lost: reception.lost,
        instructions: mean(instructions, reception.accepted),
    }
}

/// Figures of the core.
pub(crate) fn cpu(machine: &Machine<Stm32f4>) -> Cpu {
    let stats = machine.stats();
    let load = share(machine.now().since(stats.asleep), machine.now());
    Cpu { instructions: stats.instructions, load }
}

/// Memory of the images. The stack grows down towards the start of RAM. RAM that was never written still has its
/// content from power-on, which shows the deepest stack.
pub(crate) fn memory(
    machine: &Machine<Stm32f4>,
    image: &Image,
    firmware: &emulator::Image,
    bootloader_flash: u32,
) -> Memory {
    let stack = image.stack_start.map_or(0, |start| stack_depth(machine, start));
    Memory { flash: firmware.flash_size, bootloader_flash, ram: firmware.ram_size, stack }
}

fn stack_depth(machine: &Machine<Stm32f4>, start: u32) -> u32 {
    let bottom = machine.model().ram.start;
    let mut stack = vec![0; start.saturating_sub(bottom) as usize];
    if machine.read(bottom, &mut stack).is_err() {
        return 0;
    }
    let before = machine.ram_at_power_on();
    let marked = UNUSED_STACK.to_le_bytes().into_iter().cycle();
    let is_unused = |((now, before), marked): &((&u8, &u8), u8)| now == before || *now == marked;
    let untouched = stack
        .iter()
        .zip(before)
        .zip(marked)
        .take_while(|(pair, marked)| is_unused(&(*pair, *marked)))
        .count();
    (stack.len() - untouched) as u32
}

/// Rules of the chip that the program has broken, with the places in its source.
pub(crate) fn broken_rules(machine: &Machine<Stm32f4>, place: impl Fn(u32) -> Option<String>) -> Vec<String> {
    let broken = machine.incidents().iter().filter_map(|(at, incident)| match incident {
        Incident::Breach { rule, pc } => Some((at, rule, pc)),
        _ => None,
    });
    let told = broken.map(|(at, rule, &pc)| {
        format!("{at} s: {rule}, at {}", place(pc).unwrap_or_else(|| format!("{pc:#010x}")))
    });
    told.collect()
}

/// Faults and resets after power-on; only the first ones of a board that resets again and again.
pub(crate) fn incidents(machine: &Machine<Stm32f4>) -> impl Iterator<Item = String> {
    const SHOWN: usize = 10;
    let is_told = |incident: &&(Time, Incident)| !matches!(incident.1, Incident::Breach { .. });
    let incidents: Vec<&(Time, Incident)> = machine.incidents().iter().filter(is_told).collect();
    let rest = incidents.len().checked_sub(SHOWN + 1).map(|rest| format!("and {} more", rest + 1));
    let shown = incidents.into_iter().take(SHOWN);
    shown.map(|(at, incident)| format!("{at} s: {}", describe(incident))).chain(rest)
}

fn describe(incident: &Incident) -> String {
    match incident {
        Incident::Fault(fault) => {
            let access =
                fault.address.map(|address| format!(", access to {address:#010x}")).unwrap_or_default();
            format!("fault at {:#010x}, CFSR {:#x}{access}", fault.pc, fault.status)
        }
        Incident::Breach { rule, .. } => rule.to_string(),
        Incident::SoftwareReset => "reset by software".to_owned(),
        Incident::ChipReset => "reset by the chip (watchdog)".to_owned(),
    }
}

/// Accesses that silicon would have answered differently.
pub(crate) fn unmodelled(machine: &Machine<Stm32f4>) -> Vec<String> {
    machine.peripherals().unmodelled().iter().map(ToString::to_string).collect()
}

#[allow(clippy::cast_precision_loss)]
fn mean(sum: u64, count: u64) -> f64 {
    if count == 0 { 0.0 } else { sum as f64 / count as f64 }
}
