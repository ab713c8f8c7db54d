//! Events of the protocol for changes of the bus state.

use bsp::can::bus_state::BusState;
use node::BusEvent;

/// The event for a change, if there is one; also written to the log.
pub(crate) fn event_of(before: BusState, after: BusState) -> Option<BusEvent> {
    match (before, after) {
        (_, BusState::Off) => {
            defmt::error!("bus-off");
            Some(BusEvent::BusOff)
        }
        (_, BusState::Passive) => {
            defmt::warn!("error passive");
            Some(BusEvent::Passive)
        }
        (BusState::Passive | BusState::Off, _) => {
            defmt::info!("error active again");
            Some(BusEvent::Recovered)
        }
        (_, BusState::Warning) => {
            defmt::warn!("an error counter reached 96");
            Some(BusEvent::Warning)
        }
        (_, BusState::Active) => None,
    }
}
