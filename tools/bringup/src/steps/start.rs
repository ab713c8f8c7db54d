//! Steps 1 to 5: what the debug probe shows.

use anyhow::Result;
use canopen::Duration;
use canopen::client::heartbeat::Heartbeat;

use crate::bench::Bench;
use crate::{chip, values};

/// The calibration of the references was made at this supply (STM32F446 datasheet, 6.3.24).
const CALIBRATED_AT: f64 = 3.3;
/// Bits of RCC_CR: HSERDY, HSEBYP, PLLRDY.
const HSE_IS_READY: u32 = 1 << 17;
const HSE_IS_BYPASSED: u32 = 1 << 18;
const PLL_IS_READY: u32 = 1 << 25;
/// RCC_PLLCFGR: M = 4, N = 144, P = 2, from HSE. RCC_CFGR: PLL, APB1 / 4, APB2 / 2. FLASH_ACR: 4 wait states.
const PLL: (u32, u32) = (0x0043_7FFF, 4 | 144 << 6 | 1 << 22);
const BUSES: (u32, u32) = (0xFC0C, 0b10 << 2 | 0b101 << 10 | 0b100 << 13);
const WAIT_STATES: (u32, u32) = (0xF, 4);
/// The reference voltage in each supply: 1.18 to 1.24 V (STM32F446 datasheet, 6.3.24), as codes at 3.3 V.
const REFERENCE: (f64, f64) = (1464.0, 1540.0);
/// From switching HSE on to the clock of the PLL in ms: a crystal takes about 2, the PLL 0.3 at most.
const CLOCK_START: (f64, f64) = (0.01, 10.0);
/// Error of the clock in ppm: 50 of a crystal, and that of the adapter.
const CLOCK_ERROR: f64 = 100.0;
/// Number of words that are read at once.
const AT_ONCE: usize = 64;

pub(super) fn supply(bench: &mut Bench<'_>) -> Result<()> {
    let cpu = bench.word(chip::CPUID.0)?;
    bench.check(
        "CPUID",
        format!("{cpu:08X}h"),
        format!("{:08X}h", chip::CPUID.1),
        cpu == chip::CPUID.1,
        "Another chip is on the board",
    );
    let volts = supply_volts(bench)?;
    bench.check_range(
        "VDDA",
        volts,
        (3.1, 3.5),
        "V",
        "Measure 3V3 at CN6 pin 4. Check JP5 and the supply. A reading of 0 V: the program does not sample, see the step clock",
    );
    Ok(())
}

/// VDDA by the internal reference, in volts.
fn supply_volts(bench: &mut Bench<'_>) -> Result<f64> {
    let calibration = f64::from(bench.word(chip::REFERENCE_CALIBRATION)? >> 16);
    let reference = super::sensors::channel(bench, super::sensors::REFERENCE)?;
    Ok(if reference.mean > 0.0 { CALIBRATED_AT * calibration / reference.mean } else { 0.0 })
}

pub(super) fn identity(bench: &mut Bench<'_>) -> Result<()> {
    let expected = bench.chip;
    let device = bench.word(chip::IDCODE)? & 0xFFF;
    bench.check(
        "device in DBGMCU_IDCODE",
        format!("{device:03X}h"),
        format!("{:03X}h", expected.device),
        device == expected.device,
        "Another chip: choose it with --chip, and flash the images for it",
    );
    let size = bench.word(chip::FLASH_SIZE)? >> 16;
    bench.check(
        "size of the flash",
        format!("{size} KiB"),
        format!("{} KiB", expected.flash),
        size == expected.flash,
        "Another chip of the family: the images need this size",
    );
    let reference = bench.word(chip::REFERENCE_CALIBRATION)? >> 16;
    bench.check_range(
        "VREFIN_CAL",
        reference.into(),
        REFERENCE,
        "",
        "The chip is not calibrated: its temperature is not usable",
    );
    let temperature = bench.word(chip::TEMPERATURE_CALIBRATION)?;
    let (low, high) = (temperature & 0xFFFF, temperature >> 16);
    bench.check(
        "TS_CAL1 and TS_CAL2",
        format!("{low} and {high}"),
        "two codes, the second one higher",
        low < high && high < 4096,
        "The chip is not calibrated: its temperature is not usable",
    );
    option_bytes(bench)?;
    self_test(bench)
}

/// The node itself reads the same as the probe: a board without a probe can be asked over the bus.
fn self_test(bench: &mut Bench<'_>) -> Result<()> {
    for (what, number, address) in [
        ("DBGMCU_IDCODE", values::IDCODE, chip::IDCODE),
        ("RCC_PLLCFGR", values::RCC + 1, chip::RCC + 4),
        ("FLASH_ACR", values::FLASH_ACR, chip::FLASH_ACR),
        ("FLASH_OPTCR", values::FLASH_OPTCR, chip::FLASH_OPTCR),
        ("VREFIN_CAL", values::CALIBRATION, chip::REFERENCE_CALIBRATION),
    ] {
        let (seen, expected) = (bench.self_test(number)?, bench.word(address)?);
        bench.check(
            &format!("{what} over the bus (2005h)"),
            format!("{seen:08X}h"),
            format!("{expected:08X}h"),
            seen == expected,
            "The images are older than this tool: flash again",
        );
    }
    Ok(())
}

fn option_bytes(bench: &mut Bench<'_>) -> Result<()> {
    let options = programmer::protect::OptionBytes::from_register(bench.word(chip::FLASH_OPTCR)?);
    let is_open = options.read_out() == programmer::protect::ReadOut::Open && !options.is_proprietary();
    bench.check(
        "option bytes",
        options,
        "read-out open (level 0)",
        is_open,
        "A protected chip hides its flash from the probe: `cargo xtask protect --off --readout` erases it and opens it",
    );
    if !options.guards_supply() {
        bench.remark(
            "brown-out reset",
            "off",
            "level 3 in a product",
            "`cargo xtask protect --brown-out`: below 2.7 V the flash is not reliable",
        );
    }
    Ok(())
}

pub(super) fn flash(bench: &mut Bench<'_>) -> Result<()> {
    for part in bench.desk.programs().to_vec() {
        let differs = first_difference(bench, part.address, &part.bytes)?;
        let seen = differs.map_or("the same".to_owned(), |address| format!("differs at {address:#010x}"));
        bench.check(
            part.what,
            seen,
            "the same",
            differs.is_none(),
            "Flash again (cargo xtask flash). If it differs again at another place: the supply, or the probe's cable",
        );
    }
    Ok(())
}

/// The address of the first word that differs.
fn first_difference(bench: &mut Bench<'_>, start: u32, bytes: &[u8]) -> Result<Option<u32>> {
    let whole = bytes.as_chunks::<4>().0;
    for (chunk, address) in whole.chunks(AT_ONCE).zip((start..).step_by(4 * AT_ONCE)) {
        let found = bench.desk.words(address, chunk.len())?;
        let differs = chunk.iter().zip(&found).position(|(bytes, word)| u32::from_le_bytes(*bytes) != *word);
        if let Some(place) = differs {
            return Ok(Some(address + 4 * u32::try_from(place)?));
        }
    }
    Ok(None)
}

pub(super) fn clock(bench: &mut Bench<'_>) -> Result<()> {
    const SOURCE: &str = "NUCLEO: SB16 and SB50 closed, SB54 and SB55 open, and the ST-LINK supplied. Own board: the crystal, and the board file's clock source";
    let rcc = bench.desk.words(chip::RCC, 3)?;
    let (control, pll, buses) = (rcc[0], rcc[1], rcc[2]);
    let is_ready = control & (HSE_IS_READY | PLL_IS_READY) == HSE_IS_READY | PLL_IS_READY;
    bench.check(
        "oscillator and PLL (RCC_CR)",
        format!("{control:08X}h"),
        "HSERDY and PLLRDY",
        is_ready,
        SOURCE,
    );
    let is_bypassed = control & HSE_IS_BYPASSED != 0;
    let expected = bench.chip.bypass;
    bench.check(
        "clock instead of crystal (HSEBYP)",
        is_bypassed,
        expected,
        is_bypassed == expected,
        "The images are for another board",
    );
    for (what, seen, (mask, value)) in [
        ("PLL factors (RCC_PLLCFGR)", pll, PLL),
        ("source and bus dividers (RCC_CFGR)", buses, BUSES),
        ("wait states (FLASH_ACR)", bench.word(chip::FLASH_ACR)?, WAIT_STATES),
    ] {
        let is_good = seen & mask == value;
        bench.check(
            what,
            format!("{:08X}h", seen & mask),
            format!("{value:08X}h"),
            is_good,
            "Flash the images again",
        );
    }
    clock_wait(bench)?;
    let error = clock_error(bench)?;
    bench.check_range(
        "clock against that of the adapter, by heartbeats",
        error,
        (-CLOCK_ERROR, CLOCK_ERROR),
        "ppm",
        "A crystal with the wrong load capacitors, or an internal oscillator in its place",
    );
    Ok(())
}

/// The time of oscillator and PLL to start, measured by the program itself.
fn clock_wait(bench: &mut Bench<'_>) -> Result<()> {
    const WHAT: &str = "start of the clock (2005h)";
    if let Some(microseconds) = bench.start_test(WHAT, values::CLOCK_WAIT)? {
        bench.check_range(
            WHAT,
            f64::from(microseconds) / 1000.0,
            CLOCK_START,
            "ms",
            "A crystal that starts slowly: the load capacitors, or a crystal with a high ESR (AN2867)",
        );
    }
    Ok(())
}

/// How much too slow the clock of the node is, in ppm: from the first to the last of many heartbeats.
fn clock_error(bench: &mut Bench<'_>) -> Result<f64> {
    const PERIOD: u64 = 100;
    bench.set(0x1017, 0, &100_u16.to_le_bytes())?;
    let count = bench.effort.seconds * 1000 / PERIOD;
    let node = bench.node;
    let mut times = Vec::new();
    let network = bench.desk.network();
    network.forget();
    let end = network.now() + Duration::from_millis(bench.effort.seconds * 2000);
    while (times.len() as u64) <= count && network.now() < end {
        if let Some(received) = network.receive(end)?
            && Heartbeat::parse(&received.frame).is_some_and(|heartbeat| heartbeat.node == node)
        {
            times.push(received.at.0);
        }
    }
    anyhow::ensure!(times.len() as u64 > count, "only {} heartbeats came", times.len());
    let (first, last) = (times[0], times[times.len() - 1]);
    let expected = (times.len() as u64 - 1) * PERIOD * 1000;
    #[allow(clippy::cast_precision_loss, reason = "microseconds of minutes")]
    Ok(((last - first) as f64 / expected as f64 - 1.0) * 1e6)
}

pub(super) fn log(bench: &mut Bench<'_>) -> Result<()> {
    for number in 1..=bench.effort.times {
        bench.desk.reset()?;
        let lines = bench.desk.log(Duration::from_millis(1000))?;
        let is_there = lines.iter().any(|line| line.contains("reset by"));
        if !is_there || number == bench.effort.times {
            bench.check(
                &format!("log after reset {number}"),
                format!("{} lines", lines.len()),
                "the start of the node",
                is_there,
                "The log needs the same ELF file that was flashed, and probe-rs 0.25 or newer",
            );
        }
    }
    Ok(())
}
