//! The means of a step: the debug probe, the CAN adapter, the files that were flashed, and the hands of the user.

use std::fmt;

use anyhow::Result;
use canopen::Duration;
use nodectl::Network;
use nodectl::update::Image;
use programmer::flash::Part;

/// A board on a desk.
pub trait Desk {
    /// Reads words through the debug probe while the program runs.
    ///
    /// # Errors
    /// The probe does not read them.
    fn words(&mut self, address: u32, count: usize) -> Result<Vec<u32>>;

    /// Writes a word through the debug probe.
    ///
    /// # Errors
    /// The probe does not write it.
    fn write(&mut self, address: u32, value: u32) -> Result<()>;

    /// Resets the chip through the debug probe.
    ///
    /// # Errors
    /// The probe does not reset it.
    fn reset(&mut self) -> Result<()>;

    /// Attaches to the log for a time. Unread lines since the last reset come first.
    ///
    /// # Errors
    /// The probe does not attach.
    fn log(&mut self, span: Duration) -> Result<Vec<String>>;

    /// The bus.
    fn network(&mut self) -> &mut Network;

    /// Opens the CAN adapter at another bit rate.
    ///
    /// # Errors
    /// The adapter does not open.
    fn set_bit_rate(&mut self, kbit: u16) -> Result<()>;

    /// Has the user do something, and waits for the end. `false`: the user has skipped it.
    ///
    /// # Errors
    /// No operator is there.
    fn by_hand(&mut self, action: Action) -> Result<bool>;

    /// The content written to the flash.
    fn programs(&self) -> &[Part];

    /// The signed image of the application.
    fn image(&self) -> &Image;
}

/// Something that only hands can do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// The supply is off for this number of seconds.
    PowerCycle {
        /// The time without supply.
        seconds: f64,
    },
    /// The receive pin of the chip is tied to ground for this number of seconds.
    HoldReceive {
        /// The time.
        seconds: u32,
    },
    /// CAN_H and CAN_L are connected for five seconds.
    ShortBus,
    /// The pressure input has this part of the reference voltage, in percent.
    Input {
        /// 0: ground. 100: 3.3 V.
        percent: u32,
    },
    /// The pressure input is connected to its transducer again.
    Transducer,
    /// The shaft of the encoder makes one revolution forwards.
    Turn,
}

impl fmt::Display for Action {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Action::PowerCycle { seconds } => {
                write!(f, "Take the supply away for {seconds} s (USB and 5 V), and put it back")
            }
            Action::HoldReceive { seconds } => {
                write!(f, "Tie PB8 (CAN RX) to ground for {seconds} s, and release it")
            }
            Action::ShortBus => write!(f, "Connect CAN_H and CAN_L for 5 s, and release them"),
            Action::Input { percent: 0 } => write!(f, "Connect PA0 (pressure) to ground"),
            Action::Input { percent } => write!(f, "Connect PA0 (pressure) to {percent} % of 3.3 V"),
            Action::Transducer => write!(f, "Connect PA0 to the transducer again"),
            Action::Turn => write!(f, "Turn the shaft by one revolution forwards"),
        }
    }
}
