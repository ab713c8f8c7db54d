//! Steps 6 and 7: causes of resets, and the watchdog.

use anyhow::{Result, ensure};
use canopen::client::heartbeat::Heartbeat;
use canopen::nmt::{Command, State};
use canopen::{Duration, Instant};
use nodectl::nmt;

use crate::bench::Bench;
use crate::desk::Action;
use crate::{chip, values};

/// The longest time from a reset to the boot-up message.
const START: Duration = Duration::from_millis(3000);
/// Times without supply, in seconds: memory decays in between.
const PAUSES: [f64; 4] = [0.1, 1.0, 10.0, 60.0];
/// The time-out of the watchdog in milliseconds at 32 kHz, and what the oscillator allows (17 to 47 kHz).
const NOMINAL: f64 = 200.0;
const TIME_OUT: (f64, f64) = (136.0, 376.0);
/// The LSI in kHz (STM32F446 datasheet, LSI oscillator).
const LSI: (f64, f64) = (17.0, 47.0);

pub(super) fn causes(bench: &mut Bench<'_>) -> Result<()> {
    let node = bench.node;
    bench.desk.log(Duration::from_millis(100))?;
    nmt::send(bench.desk.network(), Command::ResetNode, Some(node))?;
    cause(bench, "NMT reset node", "software")?;
    bench.desk.reset()?;
    let lines = bench.desk.log(Duration::from_millis(1500))?;
    let seen = said(&lines);
    let is_good = ["software", "pin"].iter().any(|known| seen.contains(known));
    bench.check(
        "reset by the probe",
        &seen,
        "software or pin",
        is_good,
        "Look at NRST: a capacitor of 100 nF, nothing else",
    );
    for seconds in PAUSES {
        if bench.by_hand(Action::PowerCycle { seconds })? {
            cause(bench, &format!("{seconds} s without supply"), "power on")?;
        }
    }
    let (flags, tries) = (bench.self_test(values::RESET_FLAGS)?, bench.self_test(values::CLOCK_TRIES)?);
    bench.remark("RCC_CSR at the last start (2005h)", format!("{flags:08X}h"), "the cause in the log", "");
    // The upper half is the complement; the word of a RAM without it is none.
    let tries = if tries >> 16 == !tries & 0xFFFF { tries & 0xFFFF } else { 0 };
    bench.remark("resets without a clock on OSC_IN (2005h)", tries, "0; some with an ST-LINK", "");
    let first = bench.object(0x1003, 0)?;
    bench.check(
        "errors in 1003h after the last start",
        first,
        0,
        first == 0,
        "Read 1003h:1 with `nodectl read`: a crash (6101h) after a loss of power shows a supply that comes slowly",
    );
    Ok(())
}

/// The cause that the node tells after a reset.
fn cause(bench: &mut Bench<'_>, what: &str, expected: &str) -> Result<()> {
    let lines = bench.desk.log(Duration::from_millis(1500))?;
    let seen = said(&lines);
    bench.check(
        what,
        &seen,
        expected,
        seen.contains(expected),
        "A wrong cause changes what the node does after a crash: compare the line of the log with RCC_CSR",
    );
    Ok(())
}

fn said(lines: &[String]) -> String {
    let line = lines.iter().rev().find(|line| line.contains("reset by"));
    line.map_or_else(|| "nothing".to_owned(), Clone::clone)
}

/// Switches all interrupts off: the program hangs, and the watchdog ends it. The time is that from the last heartbeat to
/// the boot-up message, without that of a start.
pub(super) fn watchdog(bench: &mut Bench<'_>) -> Result<()> {
    let node = bench.node;
    bench.set(0x1017, 0, &10_u16.to_le_bytes())?;
    let before = bench.desk.network().now();
    nmt::send(bench.desk.network(), Command::ResetNode, Some(node))?;
    let start = boot_up(bench)?.0 - before.0;
    bench.set(0x1017, 0, &10_u16.to_le_bytes())?;
    bench.desk.network().forget();
    bench.wait(Duration::from_millis(200))?;
    for register in 0..3 {
        bench.desk.write(chip::INTERRUPTS_OFF + 4 * register, u32::MAX)?;
    }
    let end = boot_up(bench)?;
    let last = last_heartbeat(bench, end);
    ensure!(last.0 > 0, "no heartbeat before the reset");
    #[allow(clippy::cast_precision_loss, reason = "milliseconds")]
    let time_out = (end.0 - last.0).saturating_sub(start) as f64 / 1000.0;
    bench.check_range(
        "time-out of the watchdog",
        time_out,
        TIME_OUT,
        "ms",
        "Outside of the data sheet: the oscillator LSI is broken, or the program fed the watchdog",
    );
    lsi(bench, time_out)?;
    bench.remark("LSI by this time-out", format!("{:.1} kHz", 32.0 * NOMINAL / time_out), "17 to 47 kHz", "");
    cause(bench, "cause of this reset", "watchdog")
}

/// The LSI as TIM5 measures it, and the time-out that follows from it.
fn lsi(bench: &mut Bench<'_>, time_out: f64) -> Result<()> {
    const WHAT: &str = "LSI by TIM5 (2005h)";
    let Some(hertz) = bench.start_test(WHAT, values::LSI)? else { return Ok(()) };
    let kilohertz = f64::from(hertz) / 1000.0;
    bench.check_range(
        WHAT,
        kilohertz,
        LSI,
        "kHz",
        "Outside of the data sheet: another chip of the same type",
    );
    let expected = 32.0 * NOMINAL / kilohertz.max(1.0);
    let range = (expected * 0.8, expected * 1.1);
    bench.check_range(
        "time-out of the watchdog by this LSI",
        time_out,
        (range.0.floor(), range.1.ceil()),
        "ms",
        "The watchdog counts otherwise than it was set: flash the images again",
    );
    Ok(())
}

/// The time of the next boot-up message. Heartbeats before it stay in the network.
fn boot_up(bench: &mut Bench<'_>) -> Result<Instant> {
    let node = bench.node;
    let network = bench.desk.network();
    let until = network.now() + START;
    let found = network.wait(until, |frame| {
        Heartbeat::parse(frame).filter(|heard| heard.node == node && heard.state == State::Initialising)
    })?;
    ensure!(found.is_some(), "no boot-up message within {} ms", START.0 / 1000);
    Ok(network.newest_stamp().unwrap_or(network.now()))
}

fn last_heartbeat(bench: &mut Bench<'_>, before: Instant) -> Instant {
    let node = bench.node;
    let mut last = Instant(0);
    while let Some(received) = bench.desk.network().take_kept() {
        let is_heartbeat = Heartbeat::parse(&received.frame).is_some_and(|heard| heard.node == node);
        if is_heartbeat && received.at < before {
            last = received.at;
        }
    }
    last
}
