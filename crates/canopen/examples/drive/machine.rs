//! The state machine of CiA 402: the controlword (6040h) changes the state, the statusword (6041h) shows it.

/// A state of the drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum State {
    #[default]
    SwitchOnDisabled,
    ReadyToSwitchOn,
    SwitchedOn,
    OperationEnabled,
    QuickStopActive,
    FaultReactionActive,
    Fault,
}

/// A command of the controlword.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Command {
    DisableVoltage,
    QuickStop,
    Shutdown,
    SwitchOn,
    EnableOperation,
}

impl Command {
    /// Bits 0 to 3: switch on, enable voltage, quick stop (low active), enable operation.
    const fn of(controlword: u16) -> Command {
        match controlword & 0xF {
            0b0110 | 0b1110 => Command::Shutdown,
            0b0111 => Command::SwitchOn,
            0b1111 => Command::EnableOperation,
            0b0010 | 0b0011 | 0b1010 | 0b1011 => Command::QuickStop,
            _ => Command::DisableVoltage,
        }
    }
}

impl State {
    /// The state after a controlword. `is_reset` is the rising edge of its bit 7.
    pub(crate) const fn after(self, controlword: u16, is_reset: bool) -> State {
        use State::{
            Fault, FaultReactionActive, OperationEnabled, QuickStopActive, ReadyToSwitchOn, SwitchOnDisabled,
            SwitchedOn,
        };
        match (self, Command::of(controlword)) {
            (Fault, _) if is_reset => SwitchOnDisabled,
            (Fault | FaultReactionActive, _) => self,
            (_, Command::DisableVoltage) | (ReadyToSwitchOn | SwitchedOn, Command::QuickStop) => {
                SwitchOnDisabled
            }
            (SwitchOnDisabled | SwitchedOn | OperationEnabled, Command::Shutdown) => ReadyToSwitchOn,
            (ReadyToSwitchOn | OperationEnabled, Command::SwitchOn) => SwitchedOn,
            // From Ready to switch on, by way of Switched on.
            (ReadyToSwitchOn | SwitchedOn | QuickStopActive, Command::EnableOperation) => OperationEnabled,
            (OperationEnabled, Command::QuickStop) => QuickStopActive,
            _ => self,
        }
    }

    /// The bits 0 to 3, 5 and 6 of the statusword, and bit 4: the power stage has voltage.
    pub(crate) const fn statusword(self) -> u16 {
        match self {
            State::SwitchOnDisabled => 0x40,
            State::ReadyToSwitchOn => 0x21,
            State::SwitchedOn => 0x33,
            State::OperationEnabled => 0x37,
            State::QuickStopActive => 0x17,
            State::FaultReactionActive => 0x1F,
            State::Fault => 0x08,
        }
    }

    /// Whether the drive controls the motor.
    pub(crate) const fn has_torque(self) -> bool {
        matches!(self, State::OperationEnabled | State::QuickStopActive | State::FaultReactionActive)
    }
}
