//! The summary at the end of a run, as text and, for scripts, as JSON.

use std::fmt;

use serde::Serialize;

use crate::host_time::HostTime;
use crate::personality::Personality;
use crate::traffic::Heard;

/// The summary of a run.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Seconds since power-on.
    pub virtual_seconds: f64,
    /// Seconds of the host's time.
    pub host_seconds: f64,
    /// The host's time by kind of work, if measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub host_time: Option<HostTime>,
    /// The bus.
    pub bus: BusSummary,
    /// The boards, in the order of the command line.
    pub nodes: Vec<NodeSummary>,
}

/// The summary of the bus.
#[derive(Clone, Debug, Serialize)]
pub struct BusSummary {
    /// The bit rate in kbit/s.
    pub bit_rate: u16,
    /// Number of frames sent and acknowledged.
    pub frames: u64,
    /// Number of frames destroyed by an error.
    pub errors: u64,
    /// Share of time in which the bus was busy, 0 to 1.
    pub load: f64,
    /// Number of frames lost because clients of the gateway were too slow.
    pub lost_by_clients: u64,
}

/// The summary of one board.
#[derive(Clone, Debug, Serialize)]
pub struct NodeSummary {
    /// The node-ID.
    pub id: u8,
    /// The personality.
    pub personality: Personality,
    /// The state observed on the bus.
    #[serde(flatten)]
    pub heard: Heard,
    /// Seconds of the host's time for this board, if measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub host_seconds: Option<f64>,
    /// The 1 kHz measurement.
    pub sampling: Sampling,
    /// The received frames.
    pub receiving: Receiving,
    /// The activity of the core.
    pub cpu: Cpu,
    /// The memory of the images.
    pub memory: Memory,
    /// Rules of the chip that the program has broken, each once, with the place in the program's source.
    pub broken_rules: Vec<String>,
    /// Faults and resets after power-on, each with its time.
    pub incidents: Vec<String>,
    /// Accesses to registers that the chip model lacks.
    pub unmodelled: Vec<String>,
}

/// Figures of the 1 kHz measurement.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Sampling {
    /// Number of samples: starts of the sampling task.
    pub samples: u64,
    /// Samples per second while the application runs.
    pub rate: f64,
    /// Largest deviation of the time between two starts from a millisecond, in microseconds. A restart of the application is left out.
    pub worst_jitter: f64,
    /// Average instructions of one sample.
    pub instructions: f64,
}

/// Figures of frames that have passed the acceptance filters.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Receiving {
    /// Number of all these frames.
    pub frames: u64,
    /// Number of frames lost because a FIFO was full.
    pub lost: u64,
    /// Average instructions of the receive interrupts for one frame.
    pub instructions: f64,
}

/// Figures of the core.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Cpu {
    /// Instructions since power-on.
    pub instructions: u64,
    /// Share of time in which the core was awake, 0 to 1.
    pub load: f64,
}

/// Memory of the images, in bytes.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Memory {
    /// Flash of the firmware.
    pub flash: u32,
    /// Flash of the bootloader.
    pub bootloader_flash: u32,
    /// RAM without the stack.
    pub ram: u32,
    /// The deepest observed stack.
    pub stack: u32,
}

impl Summary {
    /// Whether a program has broken a rule of its chip, which means that the run has failed.
    pub fn has_broken_rules(&self) -> bool {
        self.nodes.iter().any(|node| !node.broken_rules.is_empty())
    }

    /// Virtual seconds per second of the host.
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
        if let Some(seconds) = self.host_seconds {
            writeln!(f, "  host: {seconds:.3} s")?;
        }
        self.broken_rules.iter().try_for_each(|rule| writeln!(f, "  rule broken: {rule}"))?;
        self.incidents.iter().try_for_each(|incident| writeln!(f, "  {incident}"))?;
        self.unmodelled.iter().try_for_each(|access| writeln!(f, "  unmodelled register: {access}"))
    }
}
