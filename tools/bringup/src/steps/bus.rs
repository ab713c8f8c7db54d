//! Steps 8 to 11: the CAN controller and the bus.

use anyhow::{Context, Result};
use bsp::can::bit_timing::BitTiming;
use canopen::Duration;
use canopen::lss::BitRate;
use nodectl::lss::{Master, Selection};

use crate::bench::Bench;
use crate::desk::Action;
use crate::{chip, values};

/// All bit rates of the node, in kbit/s.
const RATES: [u16; 8] = [1000, 800, 500, 250, 125, 50, 20, 10];
/// CAN_MCR: INRQ. CAN_MSR: INAK. CAN_BTR: LBKM and SILM. CAN_TSR: TME of all mailboxes.
const INITIALISE: u32 = 1 << 0;
const IS_INITIALISING: u32 = 1 << 0;
const LOOP_BACK: u32 = 1 << 30 | 1 << 31;
const MAILBOXES_EMPTY: u32 = 0b111 << 26;
/// PB8 in GPIOB_IDR.
const RECEIVE_PIN: u32 = 1 << 8;
/// The delay of an activation of the bit rate, in milliseconds.
const DELAY: u16 = 100;
/// A node in bus-off waits 3.2 s at most.
const LONGEST_BACK_OFF: Duration = Duration::from_millis(8000);

pub(super) fn receive_pin(bench: &mut Bench<'_>) -> Result<()> {
    let highs =
        (0..20).map(|_| Ok(u32::from(bench.word(chip::PORT_B)? & RECEIVE_PIN != 0))).sum::<Result<u32>>()?;
    bench.check(
        "PB8 (CAN RX)",
        format!("high in {highs} of 20 reads"),
        "high in 15 at least",
        highs >= 15,
        "Held low: the transceiver has no supply, or D and R are swapped",
    );
    let boots = bench.object(0x2001, 9)?;
    let seconds = u32::try_from(bench.effort.seconds)?;
    if bench.by_hand(Action::HoldReceive { seconds })? {
        bench.answers_within(LONGEST_BACK_OFF)?;
        let after = bench.object(0x2001, 9)?;
        let lines = bench.desk.log(Duration::from_millis(100))?;
        let is_reset = lines.iter().any(|line| line.contains("reset by"));
        bench.check(
            "reset of the chip",
            is_reset,
            false,
            !is_reset,
            "The watchdog has reset the chip: report it with the log",
        );
        bench.remark("resets of the CAN controller (2001h:9)", after.saturating_sub(boots), "any number", "");
    }
    Ok(())
}

/// Loop-back by the registers of the controller: the heartbeats of the node go out and come back inside of the chip.
pub(super) fn loop_back(bench: &mut Bench<'_>) -> Result<()> {
    const WHAT: &str = "frame in loop-back at the start (2005h)";
    if let Some(result) = bench.start_test(WHAT, values::LOOP_BACK)? {
        let names = values::LOOP_BACK_RESULTS;
        let seen = (result as usize).checked_sub(1).and_then(|place| names.get(place));
        bench.check(
            WHAT,
            seen.unwrap_or(&"not tested"),
            names[0],
            result == 1,
            "The controller is broken, or its clock is off: another chip of the same type",
        );
    }
    let before = bench.word(chip::CAN_BTR)?;
    bench.set(0x1017, 0, &100_u16.to_le_bytes())?;
    for kbit in RATES {
        let timing = BitTiming::of(kbit).context("a bit rate of the node")?;
        set_timing(bench, timing.btr() | LOOP_BACK)?;
        bench.wait(Duration::from_millis(500))?;
        let is_sent = mailboxes_empty(bench)?;
        let errors = bench.word(chip::CAN_ESR)?;
        bench.check(
            &format!("{kbit} kbit/s"),
            format!("CAN_ESR {errors:08X}h, mailboxes {}", if is_sent { "empty" } else { "waiting" }),
            "no error, empty mailboxes",
            is_sent && errors >> 16 == 0 && errors & 0b111 == 0,
            "The controller does not send in loop-back: its clock (step clock) or the chip",
        );
    }
    set_timing(bench, before)
}

/// Whether the mailboxes are empty at one of several moments: a frame may be under way.
fn mailboxes_empty(bench: &mut Bench<'_>) -> Result<bool> {
    for _ in 0..20 {
        if bench.word(chip::CAN_TSR)? & MAILBOXES_EMPTY == MAILBOXES_EMPTY {
            return Ok(true);
        }
        bench.wait(Duration::from_millis(7))?;
    }
    Ok(false)
}

fn set_timing(bench: &mut Bench<'_>, timing: u32) -> Result<()> {
    let mode = bench.word(chip::CAN_MCR)?;
    bench.desk.write(chip::CAN_MCR, mode | INITIALISE)?;
    for _ in 0..100 {
        if bench.word(chip::CAN_MSR)? & IS_INITIALISING != 0 {
            break;
        }
        bench.wait(Duration::from_millis(1))?;
    }
    bench.desk.write(chip::CAN_BTR, timing)?;
    bench.desk.write(chip::CAN_MCR, mode & !INITIALISE)
}

pub(super) fn all_rates(bench: &mut Bench<'_>) -> Result<()> {
    let first = bench.kbit;
    for kbit in RATES.into_iter().chain([first]) {
        change_rate(bench, kbit).with_context(|| format!("to {kbit} kbit/s"))?;
        let timing = BitTiming::of(kbit).context("a bit rate of the node")?;
        let found = bench.word(chip::CAN_BTR)?;
        bench.check(
            &format!("bit timing at {kbit} kbit/s"),
            format!("{found:08X}h"),
            format!("{:08X}h", timing.btr()),
            found == timing.btr(),
            "The node has not changed its bit rate by LSS",
        );
        let wanted = bench.effort.frames / 2;
        let (answers, sent, received) = answers(bench, wanted)?;
        bench.check(
            &format!("{} frames at {kbit} kbit/s", bench.effort.frames),
            format!("{answers} of {wanted} answers, highest error counters {sent} and {received}"),
            "all answers, error counters 0",
            answers == wanted && sent == 0 && received == 0,
            "Errors at the fast rates only: termination, stubs, the slope resistor of the transceiver. At all rates: wiring and ground",
        );
    }
    Ok(())
}

/// Number of answers to requests for 1000h, and the highest error counters in between.
fn answers(bench: &mut Bench<'_>, wanted: u32) -> Result<(u32, u32, u32)> {
    const LOOKS: u32 = 20;
    let (mut answers, mut sent, mut received) = (0, 0, 0);
    let every = (wanted / LOOKS).max(1);
    while answers < wanted && bench.object(0x1000, 0).is_ok() {
        answers += 1;
        if answers % every == 0 {
            let errors = bench.word(chip::CAN_ESR)?;
            (sent, received) = (sent.max(errors >> 16 & 0xFF), received.max(errors >> 24));
        }
    }
    Ok((answers, sent, received))
}

/// Sets the bit rate of the node by LSS, then that of the adapter.
fn change_rate(bench: &mut Bench<'_>, kbit: u16) -> Result<()> {
    let rate = BitRate::from_kbit(kbit).context("a bit rate of LSS")?;
    let mut master = Master::new(bench.desk.network(), Duration::from_millis(500));
    master.select(Selection::All)?;
    master.set_bit_rate(rate)?;
    master.activate(DELAY)?;
    bench.wait(Duration::from_millis(u64::from(DELAY)))?;
    bench.desk.set_bit_rate(kbit)?;
    bench.wait(Duration::from_millis(u64::from(DELAY) + 50))?;
    Master::new(bench.desk.network(), Duration::from_millis(500)).release()?;
    Ok(())
}

pub(super) fn short_circuit(bench: &mut Bench<'_>) -> Result<()> {
    if !bench.by_hand(Action::ShortBus)? {
        return Ok(());
    }
    let answer = bench.answers_within(LONGEST_BACK_OFF);
    bench.check(
        "an answer after the short circuit",
        answer.as_ref().map_or_else(|error| format!("{error:#}"), |()| "yes".into()),
        "yes",
        answer.is_ok(),
        "The node does not return from bus-off: read the log",
    );
    let peaks = bench.self_test(values::PEAKS)?;
    let errors: Vec<u32> =
        (0..6).map(|kind| bench.self_test(values::ERRORS + kind)).collect::<Result<_>>()?;
    bench.remark(
        "highest error counters, sent and received (2005h)",
        format!("{} and {}", peaks & 0xFFFF, peaks >> 16),
        "0 in a release",
        "",
    );
    bench.remark(
        "stuff, form, acknowledge, recessive bit, dominant bit, CRC errors (2005h)",
        format!("{errors:?}"),
        "0 in a release",
        "",
    );
    let lines = bench.desk.log(Duration::from_millis(100))?;
    let is_told = lines.iter().any(|line| line.contains("bus-off") || line.contains("error passive"));
    bench.check(
        "the log tells it",
        is_told,
        true,
        is_told,
        "The short circuit did not reach the node: check the place where it was made",
    );
    Ok(())
}
