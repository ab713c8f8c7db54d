//! The bring-up on an emulated board: the debug probe reads the emulated memory, the CAN adapter is on the emulated bus,
//! and the hands are the stimuli. [`faults`] has faults of hardware that the bring-up must name.

use std::path::Path;

use anyhow::Result;
use canbus::Time;
use clap::Parser as _;
use sim::cli::Options;
use sim::world::World;

mod adapter;
mod desk;
pub mod faults;
mod probe;

pub use adapter::{Adapter, Shared};
pub use desk::{EmulatedDesk, Mistake};
pub use probe::Probe;

/// The images of a development board in this directory, on one board with this personality.
///
/// # Errors
/// The images, the personality or the flags are wrong.
pub fn world(images: &Path, personality: &str, flags: &str) -> Result<World> {
    let [bootloader, firmware] =
        ["bootloader", "firmware"].map(|name| images.join(name).display().to_string());
    let fixed = [
        "sim",
        "--bootloader",
        &bootloader,
        "--firmware",
        &firmware,
        "--bitrate",
        "1000",
        "--node",
        &format!("1:{personality}"),
    ];
    let fixed = fixed.into_iter().chain(["--pressure", "const:250000"]);
    let options = Options::try_parse_from(fixed.chain(flags.split_whitespace()))?;
    let mut world = sim::setup::world(&options)?;
    world.run_until(Time::from_millis(2000));
    Ok(world)
}
