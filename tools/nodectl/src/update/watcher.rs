//! What an update tells while it goes on.

use std::fmt;

use canopen::NodeId;

/// Who wants to know.
pub trait Watcher {
    /// A node is at this step.
    fn step(&mut self, node: NodeId, step: Step);

    /// So many bytes of all have arrived.
    fn progress(&mut self, node: NodeId, done: usize, total: usize);
}

/// A step of the update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// The running program is asked what it is.
    Identify,
    /// It is stopped.
    Stop,
    /// The flash is busy with what an earlier master has begun.
    Busy,
    /// It is cleared.
    Clear,
    /// The new one is on its way.
    Download,
    /// The same, by the slower transfer: the node does not take blocks.
    DownloadSegments,
    /// The node checks it.
    Verify,
    /// It is started.
    Start,
    /// It runs, and its trial is ended.
    Confirm,
    /// The node or the bus is gone.
    Lost,
    /// It is there again.
    Back,
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
        })
    }
}
