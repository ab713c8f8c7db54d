//! Who this node is: what the parameter store and the chip say of it.

use bsp::bit_timing::BitTiming;
use bsp::reset_cause::ResetCause;
use bsp::{Sums, board, crash, factory, memory};
use node::{FactoryCalibration, NodeId, Personality, RawSample, Setup};
use storage::{DeviceRecord, Memory, Pages, View};

/// Where the device record has nothing to say: node-ID 1, 250 kbit/s, pressure.
const DEFAULT_NODE_ID: NodeId = match NodeId::new(1) {
    Some(id) => id,
    None => unreachable!(),
};
const DEFAULT_BIT_RATE: u16 = 250;

/// The node's set-up and the timing of its bit rate.
pub(crate) fn load() -> (Setup, BitTiming) {
    let record = device_record();
    let stored_rate = record.and_then(|record| BitTiming::of(record.bit_rate_kbit()));
    let timing = stored_rate.or_else(|| BitTiming::of(DEFAULT_BIT_RATE)).expect("a bit rate of CiA 301");
    let setup = Setup {
        personality: record.map_or(Personality::default(), |record| personality(record.personality())),
        node_id: record.and_then(|record| NodeId::new(record.node_id())).unwrap_or(DEFAULT_NODE_ID),
        bit_rate: timing.kbit(),
        serial_number: factory::serial_number(),
        hardware_version: board::NAME,
        software_version: env!("CARGO_PKG_VERSION"),
    };
    (setup, timing)
}

/// Says who starts, and why the last run ended; true when that was not meant to happen.
pub(crate) fn report_start(setup: &Setup, cause: ResetCause) -> bool {
    defmt::info!(
        "version {=str} on {=str}, serial {=u32:08x}, node {=u8} at {=u16} kbit/s, reset by {=str}",
        setup.software_version,
        setup.hardware_version,
        setup.serial_number,
        setup.node_id.get(),
        setup.bit_rate,
        cause.name()
    );
    let crash = crash::take();
    if let Some(crash) = &crash {
        crash::log(crash);
    }
    crash.is_some() || cause.is_unexpected()
}

/// What the maker of the chip measured.
pub(crate) fn calibration() -> FactoryCalibration {
    let words = factory::calibration();
    FactoryCalibration {
        ts_cal1: words.temperature_30,
        ts_cal2: words.temperature_110,
        vrefint_cal: words.reference,
    }
}

/// The front end's sums as the measurement takes them.
pub(crate) fn raw_sample(sums: Sums, factory: FactoryCalibration) -> RawSample {
    let [pressure, supply, temperature, vrefint] = sums.channels;
    RawSample { pressure, supply, temperature, vrefint, count: Sums::COUNT, factory }
}

fn device_record() -> Option<DeviceRecord> {
    let pages = Pages::new(0, memory::PARAMETER_PAGE);
    View::open(Memory(memory::parameters()), pages).and_then(|mut view| view.device()).ok().flatten()
}

fn personality(number: u8) -> Personality {
    match number {
        0 => Personality::Pressure,
        other => {
            defmt::warn!("this image has no personality {=u8}", other);
            Personality::default()
        }
    }
}
