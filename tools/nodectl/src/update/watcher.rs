//! The reports of an update while it runs.

use std::fmt;

use canopen::NodeId;

/// A receiver of the reports of an update.
pub trait Watcher {
    /// The update of a node has begun this step.
    fn step(&mut self, node: NodeId, step: Step);

    /// `done` of `total` bytes have arrived.
    fn progress(&mut self, node: NodeId, done: usize, total: usize);
}

/// A step of the update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Reading the identification of the running program.
    Identify,
    /// Stopping the program.
    Stop,
    /// Waiting while the flash is busy with a command of an earlier master.
    Busy,
    /// Clearing the program.
    Clear,
    /// Downloading the new program in blocks.
    Download,
    /// Downloading the new program in segments, which is slower, because the node does not accept blocks.
    DownloadSegments,
    /// The node checks the new program.
    Verify,
    /// Starting the new program.
    Start,
    /// The new program runs; ending its trial.
    Confirm,
    /// The node or the bus is lost.
    Lost,
    /// The node is back.
    Back,
    /// Frames of another client, or late ones, were in the way: the update continues in the state of the node.
    Disturbed,
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.pad(match self {
            Step::Identify => "identify",
            Step::Stop => "stop",
            Step::Busy => "wait for the flash",
            Step::Clear => "clear",
            Step::Download => "download in blocks",
            Step::DownloadSegments => "download in segments",
            Step::Verify => "verify",
            Step::Start => "start",
            Step::Confirm => "confirm",
            Step::Lost => "lost, waiting",
            Step::Back => "back",
            Step::Disturbed => "disturbed, trying again",
        })
    }
}
