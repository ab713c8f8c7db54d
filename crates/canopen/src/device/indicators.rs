//! The states of the indicators of CiA 303-3.

use super::{Definition, Device};
use crate::emcy::Fault;
use crate::indicators::{BusHealth, Indicators, Pattern};
use crate::nmt::State;

impl<D: Definition> Device<D> {
    /// RUN and ERROR (CiA 303-3). Of several errors, ERROR shows the worst one: bus-off, a missing RPDO, a missing SYNC, a
    /// missing heartbeat or guarding master, an error counter at 96, stored parameters that could not be loaded. Both
    /// flicker while the bit rate is detected and while an LSS master configures the device.
    #[must_use]
    pub fn indicators(&self, bus: BusHealth) -> Indicators {
        let is_flickering = bus == BusHealth::Searching || self.services.is_in_lss();
        let run = match self.inner.state {
            _ if is_flickering => Pattern::Flickering,
            State::Initialising => Pattern::Off,
            State::Stopped => Pattern::Flashes(1),
            State::PreOperational => Pattern::Blinking,
            State::Operational => Pattern::On,
        };
        let error = match bus {
            BusHealth::Off => Pattern::On,
            _ if is_flickering => Pattern::Flickering,
            _ => self.error_pattern(bus),
        };
        Indicators { run, error }
    }

    fn error_pattern(&self, bus: BusHealth) -> Pattern {
        let inner = &self.inner;
        if inner.misses_rpdo() {
            Pattern::Flashes(4)
        } else if inner.emcy.has(Fault::SyncMissing) {
            Pattern::Flashes(3)
        } else if inner.emcy.has(Fault::LifeGuard) || inner.watches.lost().next().is_some() {
            Pattern::Flashes(2)
        } else if bus == BusHealth::Warning {
            Pattern::Flashes(1)
        } else if inner.emcy.has_stored_data() {
            Pattern::Blinking
        } else {
            Pattern::Off
        }
    }
}
