//! What is said of a run at its end, for people and, as JSON, for scripts.

use std::fmt;

use serde::Serialize;

use crate::host_time::HostTime;
use crate::personality::Personality;
use crate::traffic::Heard;

/// A whole run.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Seconds since power-on.
    pub virtual_seconds: f64,
    /// Seconds that the host took.
    pub host_seconds: f64,
    /// What they went to, where that was measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub host_time: Option<HostTime>,
    /// The bus.
    pub bus: BusSummary,
    /// The boards, in the order of the command line.
    pub nodes: Vec<NodeSummary>,
}

/// The bus.
#[derive(Clone, Debug, Serialize)]
pub struct BusSummary {
    /// In kbit/s.
    pub bit_rate: u16,
    /// Frames that were sent and acknowledged.
    pub frames: u64,
    /// Frames that were destroyed by an error.
    pub errors: u64,
    /// Share of the time in which it was not idle, 0 to 1.
    pub load: f64,
    /// Frames that clients of the gateway were too slow to take.
    pub lost_by_clients: u64,
}

/// One board.
#[derive(Clone, Debug, Serialize)]
pub struct NodeSummary {
    /// Its node-ID.
    pub id: u8,
    /// What it is.
    pub personality: Personality,
    /// What the bus tells of it.
    #[serde(flatten)]
    pub heard: Heard,
    /// The 1 kHz measurement.
    pub sampling: Sampling,
    /// Frames for this node.
    pub receiving: Receiving,
    /// What the core has done.
    pub cpu: Cpu,
    /// What the image takes.
    pub memory: Memory,
    /// Rules of the chip that the program has broken, each once, with the place in its source.
    pub broken_rules: Vec<String>,
    /// Faults and resets after power-on, each with its time.
    pub incidents: Vec<String>,
    /// Accesses to registers that the chip model does not have.
    pub unmodelled: Vec<String>,
}

/// The 1 kHz measurement.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Sampling {
    /// Starts of the sampling task.
    pub samples: u64,
    /// Samples in a second, from the first to the last.
    pub rate: f64,
    /// Largest distance of a start from the millisecond at which it was due, in microseconds.
    pub worst_jitter: f64,
    /// Instructions of one sample, on average.
    pub instructions: f64,
}

/// Frames that have passed the acceptance filters.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Receiving {
    /// All of them.
    pub frames: u64,
    /// Those that were lost because a FIFO was full.
    pub lost: u64,
    /// Instructions of the receive interrupts for one frame, on average.
    pub instructions: f64,
}

/// What the core has done.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Cpu {
    /// Instructions since power-on.
    pub instructions: u64,
    /// Share of the time in which it did not sleep, 0 to 1.
    pub load: f64,
}

/// What the image takes, in bytes.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Memory {
    /// Flash of the firmware.
    pub flash: u32,
    /// Flash of the bootloader.
    pub bootloader_flash: u32,
    /// RAM without the stack.
    pub ram: u32,
    /// The deepest stack that was seen.
    pub stack: u32,
}

impl Summary {
    /// Whether a program has broken a rule of its chip: then the run has failed.
    pub fn has_broken_rules(&self) -> bool {
        self.nodes.iter().any(|node| !node.broken_rules.is_empty())
    }

    /// Virtual seconds in a host second.
    pub fn ratio(&self) -> f64 {
        if self.host_seconds > 0.0 { self.virtual_seconds / self.host_seconds } else { 0.0 }
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (span, host) = (self.virtual_seconds, self.host_seconds);
        writeln!(f, "{span:.3} s of virtual time in {host:.3} s ({:.2} x real time)", self.ratio())?;
        if let Some(host_time) = &self.host_time {
            writeln!(f, "  of it {host_time}")?;
        }
        write!(f, "{}", self.bus)?;
        self.nodes.iter().try_for_each(|node| write!(f, "{node}"))
    }
}

impl fmt::Display for BusSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let BusSummary { bit_rate, frames, errors, load, lost_by_clients } = self;
        writeln!(f, "bus: {bit_rate} kbit/s, {frames} frames, {errors} errors, load {:.1} %", load * 100.0)?;
        if *lost_by_clients > 0 {
            writeln!(f, "  {lost_by_clients} frames were lost by clients that read too slowly")?;
        }
        Ok(())
    }
}

impl fmt::Display for NodeSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let NodeSummary { id, personality, heard, sampling, receiving, cpu, memory, .. } = self;
        writeln!(f, "node {id} ({personality}): {}", heard.state)?;
        writeln!(
            f,
            "  sent: {} boot-up, {} heartbeats, {} TPDOs, {} EMCY; SDO frames: {}",
            heard.boot_ups, heard.heartbeats, heard.tpdos, heard.emcys, heard.sdo_frames
        )?;
        writeln!(
            f,
            "  sampling: {} samples, {:.3} a second, worst start jitter {:.2} us, {:.0} instructions a sample",
            sampling.samples, sampling.rate, sampling.worst_jitter, sampling.instructions
        )?;
        writeln!(
            f,
            "  receiving: {} frames, {} lost, {:.0} instructions a frame",
            receiving.frames, receiving.lost, receiving.instructions
        )?;
        writeln!(f, "  CPU: load {:.2} %, {} instructions", cpu.load * 100.0, cpu.instructions)?;
        writeln!(
            f,
            "  memory: flash {} B (bootloader {} B), RAM {} B, deepest stack {} B",
            memory.flash, memory.bootloader_flash, memory.ram, memory.stack
        )?;
        self.broken_rules.iter().try_for_each(|rule| writeln!(f, "  rule broken: {rule}"))?;
        self.incidents.iter().try_for_each(|incident| writeln!(f, "  {incident}"))?;
        self.unmodelled.iter().try_for_each(|access| writeln!(f, "  unmodelled register: {access}"))
    }
}
