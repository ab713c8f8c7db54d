//! Configuration of the node, from the parameter store and from the chip.

use core::mem::MaybeUninit;

use bsp::boards::BOARD;
use bsp::chip::{crash, factory, memory, retained};
use bsp::flash::update_layout::LAYOUT;
use bsp::power::reset_cause::ResetCause;
use bsp::start::board;
use bsp::{ParameterFlash, Sums};
use node::{
    BitRate, EraseBudget, Fault, Identity, MemoryState, NodeId, ParameterMemory, Parameters, Personality,
    Protocol, Setup, StoredPositionRecord,
};
use profiles::board::{ChipThermometer, POSITION_RECORD_WORDS, RawSample};
use storage::{DeviceRecord, Error, Pages, View};
use update::{Authorisation, Trial};

use crate::bit_rate::Rate;

/// Without a stored value: node-ID 1, pressure, the bit rate of the bus.
const DEFAULT_NODE_ID: Option<NodeId> = NodeId::new(1);
const DEFAULT_BIT_RATE: BitRate = BitRate::AUTO;
const PAGES: Pages = Pages::new(0, memory::PARAMETER_PAGE);

/// The node with its stored data.
pub(crate) struct Loaded {
    pub(crate) protocol: &'static mut Protocol,
    /// Parameters of the measurement.
    pub(crate) parameters: Parameters,
    pub(crate) setup: Setup,
    /// The stored bit rate, if one is stored.
    pub(crate) rate: Rate,
    /// The fault of the device record, if there is one.
    pub(crate) boot_data: Option<&'static Fault>,
    /// The prepared parameter memory; `None` if nothing can be stored.
    pub(crate) memory: Option<ParameterMemory<ParameterFlash>>,
    /// The stored record about the retained state.
    pub(crate) position_record: Option<[u32; POSITION_RECORD_WORDS]>,
}

/// Makes the protocol in its place, with its stored data. Without a working store, the node runs with its defaults.
pub(crate) fn load(flash: ParameterFlash, place: &'static mut MaybeUninit<Protocol>) -> Loaded {
    let mut view = match View::open(flash, PAGES) {
        Ok(view) => view,
        Err(error) => {
            defmt::error!("the parameter store cannot be read: {=str}", reason(&error));
            let setup = setup(None);
            let protocol = make(place, &setup);
            let parameters = protocol.load_defaults();
            protocol.show_memory(MemoryState::BROKEN);
            let rate = Rate::Missing;
            return Loaded {
                protocol,
                parameters,
                setup,
                rate,
                boot_data: None,
                memory: None,
                position_record: None,
            };
        }
    };
    let Identity { record, fault } = Identity::read(&mut view);
    let setup = setup(record);
    let rate = record.map_or(Rate::Missing, |_| Rate::of(setup.bit_rate));
    let protocol = make(place, &setup);
    let parameters = protocol.load(&mut view);
    let position_record = StoredPositionRecord::read(&mut view);
    let mut memory = prepare(view);
    if let Some(memory) = &mut memory {
        let records = &mut memory.store().flash().trial();
        protocol.set_trial(Trial::read(records, &LAYOUT));
    }
    protocol.show_memory(memory.as_ref().map_or(MemoryState::BROKEN, ParameterMemory::state));
    Loaded { protocol, parameters, setup, rate, boot_data: fault, memory, position_record }
}

/// Not inlined, so that the stack on which the value is made is free again for reading the flash.
#[inline(never)]
fn make(place: &'static mut MaybeUninit<Protocol>, setup: &Setup) -> &'static mut Protocol {
    let protocol = place.write(Protocol::new(setup));
    protocol.set_authorisation(Authorisation::new(retained::authorisation(), false));
    protocol
}

/// May erase pages, which stops the core for half a second, so it is called before the node joins the bus.
fn prepare(view: View<ParameterFlash>) -> Option<ParameterMemory<ParameterFlash>> {
    ParameterMemory::prepare(view, EraseBudget::new(retained::erase_budget()))
        .inspect(|memory| retained::set_erase_budget(memory.budget().word()))
        .inspect_err(|error| defmt::error!("nothing can be stored: {=str}", reason(error)))
        .ok()
}

fn reason<E>(error: &Error<E>) -> &'static str {
    match error {
        Error::Flash(_) => "the flash controller has signalled an error",
        Error::Corrupt => "the flash does not hold what was written",
        _ => "its pages do not fit the flash",
    }
}

fn setup(record: Option<DeviceRecord>) -> Setup {
    let stored_rate = record.and_then(|record| BitRate::from_kbit(record.bit_rate_kbit()));
    Setup {
        personality: record.map_or(Personality::default(), |record| personality(record.personality())),
        node_id: record.map_or(DEFAULT_NODE_ID, |record| NodeId::new(record.node_id())),
        bit_rate: stored_rate.unwrap_or(DEFAULT_BIT_RATE),
        serial_number: factory::serial_number(),
        program_id: memory::program_id(),
        hardware_version: BOARD.name,
        software_version: env!("CARGO_PKG_VERSION"),
    }
}

fn personality(number: u8) -> Personality {
    Personality::numbered(number).unwrap_or_else(|| {
        defmt::warn!("this image has no personality {=u8}", number);
        Personality::default()
    })
}

/// Logs the start and the cause of the last reset. Returns true if the reset was unexpected.
pub(crate) fn report_start(setup: &Setup, cause: ResetCause) -> bool {
    defmt::info!(
        "version {=str} on {=str}, serial {=u32:08x}, reset by {=str}",
        setup.software_version,
        setup.hardware_version,
        setup.serial_number,
        cause.name()
    );
    if retained::is_development() {
        defmt::warn!("development bootloader: it accepts unsigned applications");
    }
    match setup.node_id {
        Some(node_id) => defmt::info!("node {=u8}", node_id.get()),
        None => defmt::info!("no node-ID: waiting for LSS"),
    }
    defmt::info!("brown-out reset below {=u16} mV", board::brown_out_level());
    let tries = retained::clock_tries();
    if tries > 0 {
        defmt::warn!("the clock on OSC_IN was late: {=u16} resets without it", tries);
        retained::set_clock_tries(0);
    }
    let crash = crash::take();
    if let Some(crash) = &crash {
        crash::log(crash);
    }
    crash.is_some() || cause.is_unexpected()
}

/// The temperature sensor in the chip, with the manufacturer's calibration.
pub(crate) fn thermometer() -> ChipThermometer {
    let (offset, slope) = factory::calibration().line();
    ChipThermometer { offset, slope }
}

/// Converts the sums of the front end for the measurement.
pub(crate) fn raw_sample(sums: &Sums) -> RawSample {
    let [pressure, supply, thermistor, temperature, reference] = sums.channels;
    RawSample { pressure, supply, temperature, reference, thermistor, count: Sums::COUNT }
}
