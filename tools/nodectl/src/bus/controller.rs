//! The state of the adapter's CAN controller, as far as the adapter reports it.

use serde::Serialize;

/// The classes of an error frame of Linux (`linux/can/error.h`).
const CONTROLLER: u32 = 0x004;
const PROTOCOL: u32 = 0x008;
const ACKNOWLEDGE: u32 = 0x020;
const BUS_OFF: u32 = 0x040;
const BUS_ERROR: u32 = 0x080;
const RESTARTED: u32 = 0x100;
const COUNTERS: u32 = 0x200;

/// The fault confinement state of a controller (ISO 11898-1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// Both error counters are below 96.
    ErrorActive,
    /// An error counter has reached 96.
    ErrorWarning,
    /// An error counter has reached 128.
    ErrorPassive,
    /// The transmit error counter has reached 256: the controller does not take part in the bus.
    BusOff,
}

/// The report of an adapter about its controller. A value is `None` where the adapter does not report it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Controller {
    /// The state of the controller.
    pub state: Option<State>,
    /// The number of error frames since the bus was opened.
    pub error_frames: Option<u64>,
    /// The transmit error counter (TEC).
    pub transmit_errors: Option<u8>,
    /// The receive error counter (REC).
    pub receive_errors: Option<u8>,
}

impl Controller {
    /// Takes an error frame of Linux. `data` is empty where only the class is known.
    pub(super) fn on_error_frame(&mut self, class: u32, data: &[u8]) {
        let is_on_the_bus = class & (PROTOCOL | ACKNOWLEDGE | BUS_ERROR) != 0;
        self.error_frames = Some(self.error_frames.unwrap_or(0) + u64::from(is_on_the_bus));
        if let &[_, problem, .., transmit, receive] = data
            && class & (COUNTERS | CONTROLLER) != 0
        {
            (self.transmit_errors, self.receive_errors) = (Some(transmit), Some(receive));
            self.state = problem_state(problem).filter(|_| class & CONTROLLER != 0).or(self.state);
        }
        match class {
            _ if class & BUS_OFF != 0 => self.state = Some(State::BusOff),
            _ if class & RESTARTED != 0 => self.state = Some(State::ErrorActive),
            _ => (),
        }
    }

    /// Takes the status flags of an slcan adapter (command `F`).
    pub(super) fn on_flags(&mut self, flags: u8) {
        self.error_frames = Some(self.error_frames.unwrap_or(0) + u64::from(flags & 0x80 != 0));
        self.state = Some(match flags {
            _ if flags & 0x20 != 0 => State::ErrorPassive,
            _ if flags & 0x04 != 0 => State::ErrorWarning,
            _ => State::ErrorActive,
        });
    }
}

/// The state in the second byte of an error frame; `None` for problems that change no state.
fn problem_state(problem: u8) -> Option<State> {
    match problem {
        _ if problem & 0x30 != 0 => Some(State::ErrorPassive),
        _ if problem & 0x0C != 0 => Some(State::ErrorWarning),
        _ if problem & 0x40 != 0 => Some(State::ErrorActive),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_frames_of_linux_are_counted_and_change_the_state() {
        let mut controller = Controller { error_frames: Some(0), ..Controller::default() };
        controller.on_error_frame(PROTOCOL | BUS_ERROR, &[0; 8]);
        controller.on_error_frame(ACKNOWLEDGE, &[0; 8]);
        assert_eq!((controller.error_frames, controller.state), (Some(2), None));
        controller.on_error_frame(CONTROLLER, &[0, 0x08, 0, 0, 0, 0, 97, 3]);
        assert_eq!(controller.state, Some(State::ErrorWarning));
        assert_eq!((controller.transmit_errors, controller.receive_errors), (Some(97), Some(3)));
        controller.on_error_frame(CONTROLLER | COUNTERS, &[0, 0x20, 0, 0, 0, 0, 128, 0]);
        assert_eq!(controller.state, Some(State::ErrorPassive));
        controller.on_error_frame(BUS_OFF, &[]);
        assert_eq!(controller.state, Some(State::BusOff));
        controller.on_error_frame(RESTARTED, &[]);
        assert_eq!((controller.state, controller.error_frames), (Some(State::ErrorActive), Some(2)));
        controller.on_error_frame(CONTROLLER, &[0, 0x01, 0, 0, 0, 0, 0, 0]);
        assert_eq!(controller.state, Some(State::ErrorActive), "an overflow is no state");
    }

    #[test]
    fn status_flags_of_slcan_have_the_state_and_bus_errors() {
        let mut controller = Controller::default();
        controller.on_flags(0);
        assert_eq!((controller.state, controller.error_frames), (Some(State::ErrorActive), Some(0)));
        controller.on_flags(0x84);
        assert_eq!((controller.state, controller.error_frames), (Some(State::ErrorWarning), Some(1)));
        controller.on_flags(0x24);
        assert_eq!((controller.state, controller.transmit_errors), (Some(State::ErrorPassive), None));
    }
}
