//! Steps 12 and 13: analogue inputs and encoders.

use anyhow::{Result, ensure};
use canopen::Duration;

use crate::bench::Bench;
use crate::desk::Action;
use crate::{chip, values};

/// The channels of a scan, in their order in the buffer.
pub(super) const PRESSURE: usize = 0;
pub(super) const SUPPLY: usize = 1;
pub(super) const TEMPERATURE: usize = 3;
pub(super) const REFERENCE: usize = 4;
const CHANNELS: usize = 5;
/// FLASH_ACR: PRFTEN.
const PREFETCH: u32 = 1 << 8;
/// Conversions in the buffer: two milliseconds of 16 scans, two conversions in a word.
const WORDS: usize = 2 * 16 * CHANNELS / 2;
/// The output of an intact transducer, as ratios of its supply: the defaults of 2200h:10 and 2200h:11.
const INTACT: (f64, f64) = (0.025, 0.975);
/// Noise of an input, standard deviation in codes.
const NOISE: f64 = 4.0;
/// Temperatures of the calibration in degC.
const CALIBRATED: (f64, f64) = (30.0, 110.0);

/// Mean and standard deviation in codes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Channel {
    pub(super) mean: f64,
    pub(super) sigma: f64,
}

/// The conversions of a channel, from the buffer in RAM that DMA fills.
pub(super) fn channel(bench: &mut Bench<'_>, number: usize) -> Result<Channel> {
    let buffer = bench.word(chip::CONVERSIONS)?;
    ensure!(
        (0x2000_0000..0x2002_0000).contains(&buffer),
        "the program does not sample: DMA2_S0M0AR is {buffer:08X}h"
    );
    let mut codes = Vec::new();
    for _ in 0..bench.effort.times {
        let words = bench.desk.words(buffer, WORDS)?;
        let conversions = words.iter().flat_map(|word| [word & 0xFFFF, word >> 16]);
        codes.extend(conversions.skip(number).step_by(CHANNELS).map(f64::from));
        bench.wait(Duration::from_millis(5))?;
    }
    #[allow(clippy::cast_precision_loss, reason = "some hundred codes")]
    let count = codes.len() as f64;
    let mean = codes.iter().sum::<f64>() / count;
    let variance = codes.iter().map(|code| (code - mean).powi(2)).sum::<f64>() / count;
    Ok(Channel { mean, sigma: variance.sqrt() })
}

pub(super) fn analogue(bench: &mut Bench<'_>) -> Result<()> {
    let supply = channel(bench, SUPPLY)?.mean;
    let inputs = [
        (PRESSURE, "pressure (PA0)", (INTACT.0 * supply, INTACT.1 * supply)),
        (SUPPLY, "supply of the transducer (PA1)", (2000.0, 4095.0)),
        (REFERENCE, "VREFINT", (1400.0, 1700.0)),
    ];
    for (number, name, range) in inputs {
        let found = channel(bench, number)?;
        bench.check_range(
            &format!("noise of {name}"),
            found.sigma,
            (0.0, NOISE),
            "codes",
            "100 nF from the pin to ground, short wires, one ground; a source below 15 kohm",
        );
        bench.check_range(
            &format!("level of {name}"),
            found.mean,
            range,
            "codes",
            "At a rail: a broken or shorted wire, or the divider is missing (docs/board.md, Pressure transducer)",
        );
    }
    noise_without_prefetch(bench)?;
    let temperature = temperature(bench)?;
    bench.check_range(
        "temperature of the chip",
        temperature,
        (0.0, 60.0),
        "degC",
        "A reading far off on a cold board: VDDA, see the step supply",
    );
    for percent in [0, 100] {
        if bench.by_hand(Action::Input { percent })? {
            let found = channel(bench, PRESSURE)?.mean;
            let expected = f64::from(percent) * 40.95;
            let range = (expected - 20.0, expected + 20.0);
            bench.check_range(
                &format!("PA0 at {percent} %"),
                found,
                range,
                "codes",
                "The input does not follow: a wrong pin, or a resistor in series",
            );
        }
    }
    bench.by_hand(Action::Transducer)?;
    lost_events(bench)
}

/// The noise of the pressure without prefetch: it disturbs the converter on some boards (AN4073). The maker of the product selects
/// the better setting.
fn noise_without_prefetch(bench: &mut Bench<'_>) -> Result<()> {
    let settings = bench.word(chip::FLASH_ACR)?;
    bench.desk.write(chip::FLASH_ACR, settings & !PREFETCH)?;
    let quiet = channel(bench, PRESSURE)?.sigma;
    bench.desk.write(chip::FLASH_ACR, settings)?;
    bench.remark(
        "noise of pressure (PA0) without prefetch",
        format!("{quiet:.2} codes"),
        "no less than with it",
        "",
    );
    Ok(())
}

/// The first eight bytes of the SSI word.
fn raw_word(bench: &mut Bench<'_>) -> Result<[u32; 2]> {
    Ok([bench.self_test(values::SSI_WORD)?, bench.self_test(values::SSI_WORD + 1)?])
}

/// The temperature of the chip in degC, by its calibration at 3.3 V.
fn temperature(bench: &mut Bench<'_>) -> Result<f64> {
    let calibration = bench.word(chip::TEMPERATURE_CALIBRATION)?;
    let (low, high) = (f64::from(calibration & 0xFFFF), f64::from(calibration >> 16));
    let reference = f64::from(bench.word(chip::REFERENCE_CALIBRATION)? >> 16);
    let now = channel(bench, REFERENCE)?.mean;
    // As it would be at the supply of the calibration.
    let code = channel(bench, TEMPERATURE)?.mean * reference / now.max(1.0);
    Ok(CALIBRATED.0 + (code - low) * (CALIBRATED.1 - CALIBRATED.0) / (high - low).max(1.0))
}

/// Checks that no event of the hardware was lost: 2001h.
pub(super) fn lost_events(bench: &mut Bench<'_>) -> Result<()> {
    const NAMES: [&str; 10] = [
        "received frames",
        "milliseconds of samples",
        "restarts of the sampling",
        "SSI words",
        "restarts of the index capture",
        "timer alarms",
        "writes to the backup memory",
        "flash operations",
        "resets of the CAN controller",
        "flash operations refused by a low supply",
    ];
    for (sub, name) in (1..).zip(NAMES) {
        let count = bench.object(0x2001, sub)?;
        bench.check(
            &format!("lost: {name} (2001h:{sub})"),
            count,
            0,
            count == 0,
            "docs/evidence.md, Lost events, says who notices this event and what may lose it",
        );
    }
    Ok(())
}

pub(super) fn encoder(bench: &mut Bench<'_>) -> Result<()> {
    if bench.object(0x6501, 0).is_err() {
        bench.remark(
            "an encoder",
            "none: 6501h does not exist",
            "the profile of an encoder",
            "Choose the personality encoder or combined (2000h) for this step",
        );
        return Ok(());
    }
    let is_absolute = bench.object(0x2100, 1)? != 0;
    if is_absolute {
        rest(bench)?;
    }
    let before = bench.object(0x6004, 0)?;
    if bench.by_hand(Action::Turn)? {
        let after = bench.object(0x6004, 0)?;
        let steps = bench.object(0x6501, 0)?;
        let moved = i64::from(after.wrapping_sub(before) as i32);
        let wanted = i64::from(steps);
        bench.check(
            "steps in a revolution forwards",
            moved,
            format!("{wanted} within 2 %"),
            (moved - wanted).abs() * 50 <= wanted,
            "None: A, B or the supply of the encoder. Negative: A and B are swapped (or 6000h bit 0). Half: one signal is missing",
        );
    }
    let alarms = bench.object(0x6503, 0)?;
    bench.remark(
        "alarms (6503h)",
        format!("{alarms:04X}h"),
        "0000h after a preset",
        "docs/measuring.md, Encoder",
    );
    lost_events(bench)
}

/// Positions at rest: no bit toggles but the lowest ones.
fn rest(bench: &mut Bench<'_>) -> Result<()> {
    let first = bench.object(0x6004, 0)?;
    let mut toggled = 0;
    for _ in 0..bench.effort.frames {
        toggled |= bench.object(0x6004, 0)? ^ first;
    }
    let word = raw_word(bench)?;
    let mut raw = [0; 2];
    for _ in 0..bench.effort.frames {
        let again = raw_word(bench)?;
        raw = [raw[0] | again[0] ^ word[0], raw[1] | again[1] ^ word[1]];
    }
    bench.remark(
        "bits of the raw SSI word that toggle (2005h)",
        format!("{raw:08X?}"),
        "the lowest ones",
        "",
    );
    let state = bench.object(0x210B, 1)?;
    bench.check(
        "bits that toggle at rest",
        format!("{toggled:08X}h, sensor state {state:02X}h"),
        "the lowest two at most, no error",
        toggled & !0b11 == 0 && state & 0b1011 == 0,
        "Toggling high bits: the clock line (PB13), the termination at the receiver. An error: the data line (PB14) or its supply",
    );
    Ok(())
}
