//! The modules that touch hardware.

pub mod application;
mod backup;
pub mod board;
pub mod can;
mod clock_tree;
mod confinement;
pub mod crash;
mod digital;
mod encoder;
mod errata;
pub mod factory;
mod fault;
pub mod flash;
mod front_end;
mod gpio;
mod idle_pins;
pub mod led;
pub mod loader;
pub mod memory;
mod parameter_flash;
mod program_flash;
mod receive;
pub mod retained;
mod sampling;
pub mod self_test;
mod ssi;
#[cfg(feature = "development")]
mod start_tests;
mod stream;
mod time_base;
mod transmit;
mod trial_flash;
mod watchdog;

pub use backup::BackupMemory;
pub use board::Board;
pub use digital::{Buttons, Lamps};
pub use encoder::Counted;
pub use errata::{TaskEnd, sleep};
pub use front_end::{FrontEnd, Reading};
pub use parameter_flash::ParameterFlash;
pub use program_flash::ProgramFlash;
pub use receive::{Frames, ReceiveQueue, Received, Receiver};
pub use sampling::Sums;
pub use ssi::Ssi;
pub use stm32f4xx_hal::pac;
pub use time_base::{Alarm, Clock, Ring, TimeInterrupt};
pub use transmit::Transmitter;
pub use trial_flash::TrialFlash;
pub use watchdog::{StartUpWatchdog, Watchdog};

// The logger of every image.
use defmt_rtt as _;
