//! `nodectl info`

use std::fmt;

use canopen::{Duration, NodeId};
use clap::Args;
use serde::Serialize;

use super::output::hex;
use super::{Failure, Session};
use crate::Catalogue;
use crate::heartbeat;
use crate::meaning;
use crate::object::at;
use crate::text::visible;
use crate::update::{Event, Log, Program, Status};

/// Time added to the heartbeat period when waiting for a heartbeat.
const MARGIN: Duration = Duration::from_millis(200);
/// 1000h of a bootloader: "BOOT".
const BOOT: u32 = 0x424F_4F54;

/// Shows nodes: identity, versions, state, errors, program.
#[derive(Debug, Args)]
pub(super) struct Info {}

#[derive(Serialize)]
struct Report {
    node: u8,
    device_type: Option<u32>,
    name: Option<String>,
    hardware_version: Option<String>,
    software_version: Option<String>,
    vendor: Option<u32>,
    product: Option<u32>,
    revision: Option<u32>,
    serial: Option<u32>,
    heartbeat_ms: Option<u32>,
    state: Option<&'static str>,
    error_register: Option<u32>,
    errors: Vec<u32>,
    program: Option<ProgramReport>,
    /// The errors in words.
    #[serde(skip)]
    error_names: Vec<String>,
}

/// The program of a node that can be updated (CiA 302-3).
#[derive(Serialize)]
struct ProgramReport {
    running: bool,
    identification: Option<u32>,
    status: Option<String>,
    trial: Option<&'static str>,
    security_counter: Option<u32>,
    key_generation: Option<u32>,
    downloaded: Option<u32>,
    kept: Option<u32>,
    sector_erases: Option<u32>,
    clears_allowed: Option<u32>,
    log: Vec<LogEntry>,
}

/// An event of an update (2006h), the newest first.
#[derive(Serialize)]
struct LogEntry {
    version: String,
    key_generation: u8,
    event: String,
}

impl Info {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        for node in session.options.node.list()? {
            session.begin();
            let report = report(session, node)?;
            session.print(&report)?;
        }
        Ok(())
    }
}

fn report(session: &mut Session, node: NodeId) -> Result<Report, Failure> {
    let heartbeat_ms = number(session, node, 0x1017, 0)?;
    let errors = errors(session, node)?;
    let catalogue = session.catalogue(node)?;
    Ok(Report {
        node: node.get(),
        device_type: number(session, node, 0x1000, 0)?,
        name: session.text(node, 0x1008)?,
        hardware_version: session.text(node, 0x1009)?,
        software_version: session.text(node, 0x100A)?,
        vendor: number(session, node, 0x1018, 1)?,
        product: number(session, node, 0x1018, 2)?,
        revision: number(session, node, 0x1018, 3)?,
        serial: number(session, node, 0x1018, 4)?,
        heartbeat_ms,
        state: state(session, node, heartbeat_ms)?,
        error_register: number(session, node, 0x1001, 0)?,
        error_names: errors.iter().map(|&error| error_text(error, &catalogue)).collect(),
        errors,
        program: program(session, node)?,
    })
}

/// The state in the next heartbeat; `None` where no heartbeat comes.
fn state(session: &mut Session, node: NodeId, period: Option<u32>) -> Result<Option<&'static str>, Failure> {
    let Some(period) = period.filter(|&period| period > 0) else { return Ok(None) };
    // The period comes from the node and may be too long. So the wait is limited to the time of a transfer.
    let period = Duration::from_millis(period.into()).min(session.options.sdo().limit);
    let time = Duration(period.0 + MARGIN.0);
    Ok(heartbeat::wait(&mut session.network, node, time)?.map(heartbeat::words))
}

fn errors(session: &mut Session, node: NodeId) -> Result<Vec<u32>, Failure> {
    let count = number(session, node, 0x1003, 0)?.and_then(|count| u8::try_from(count).ok()).unwrap_or(0);
    let mut errors = Vec::new();
    for sub in 1..=count {
        errors.extend(number(session, node, 0x1003, sub)?);
    }
    Ok(errors)
}

/// An error of the list in words. CiA 301, 7.5.2.4: the low half is the error code, the high half is the manufacturer's.
fn error_text(error: u32, catalogue: &Catalogue) -> String {
    let [low, high, detail, _] = error.to_le_bytes();
    let code = u16::from_le_bytes([low, high]);
    format!("{code:04X}h {}, {:04X}h", meaning::listed_error(code, detail, catalogue), error >> 16)
}

fn program(session: &mut Session, node: NodeId) -> Result<Option<ProgramReport>, Failure> {
    if session.optional(node, at(0x1F51, 1))?.is_none() {
        return Ok(None);
    }
    let options = session.options.sdo();
    // Devices of others have other objects at these places.
    let is_ours = session.catalogue(node)?.is_of_this_project();
    let mut own = |index, sub| if is_ours { number(session, node, index, sub) } else { Ok(None) };
    let trial = own(0x2002, 1)?.and_then(trial);
    let mut fact = |sub| own(0x2004, sub);
    let (security_counter, key_generation, downloaded, kept) = (fact(2)?, fact(3)?, fact(4)?, fact(5)?);
    let (sector_erases, clears_allowed) = (fact(6)?, fact(7)?);
    let log = if is_ours { session.optional(node, at(0x2006, 0))?.unwrap_or_default() } else { Vec::new() };
    let mut program = Program::new(&mut session.network, node, options);
    Ok(Some(ProgramReport {
        trial,
        security_counter,
        key_generation,
        downloaded: downloaded.filter(|&id| id != 0),
        kept: kept.filter(|&id| id != 0),
        sector_erases,
        clears_allowed,
        log: log_entries(&log),
        running: program.is_running()?,
        identification: program.identification()?,
        status: program.status()?.as_ref().map(Status::to_string),
    }))
}

/// The state of the trial in words (2002h:1 of a node of this project).
fn trial(state: u32) -> Option<&'static str> {
    Some(match state {
        0 => "none",
        1 => {
            "the program is on trial: `nodectl confirm` keeps it, `nodectl rollback` restores the kept program"
        }
        2 => "the downloaded program was rolled back after three starts",
        3 => "the downloaded program was rolled back: it was withdrawn, or not confirmed in time",
        _ => return None,
    })
}

fn log_entries(log: &[u8]) -> Vec<LogEntry> {
    let entry = |event: Event| LogEntry {
        version: event.version.to_string(),
        key_generation: event.generation,
        event: event.outcome.to_string(),
    };
    Log::from_bytes(log).events().map(entry).collect()
}

fn number(session: &mut Session, node: NodeId, index: u16, sub: u8) -> Result<Option<u32>, Failure> {
    let bytes = session.optional(node, at(index, sub))?;
    Ok(bytes.map(|bytes| bytes.iter().take(4).rev().fold(0, |value, &byte| value << 8 | u32::from(byte))))
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let or_dash = |text: &Option<String>| visible(text.as_deref().unwrap_or("-"));
        let is_boot = self.device_type == Some(BOOT);
        write!(f, "node {}: {}", self.node, or_dash(&self.name))?;
        let note = if is_boot { " (bootloader)" } else { "" };
        write!(f, "\n  device type       {}{note}", hex(self.device_type))?;
        write!(f, "\n  hardware version  {}", or_dash(&self.hardware_version))?;
        write!(f, "\n  software version  {}", or_dash(&self.software_version))?;
        write!(f, "\n  vendor            {}", hex(self.vendor))?;
        write!(f, "\n  product           {}", hex(self.product))?;
        write!(f, "\n  revision          {}", hex(self.revision))?;
        write!(f, "\n  serial number     {}", hex(self.serial))?;
        write!(f, "\n  state             {}", self.state.unwrap_or("- (no heartbeat)"))?;
        let register = self.error_register.map_or_else(|| "-".to_owned(), |value| format!("{value:02X}h"));
        write!(f, "\n  error register    {register}")?;
        for text in &self.error_names {
            write!(f, "\n  error             {text}")?;
        }
        self.program.iter().try_for_each(|program| write!(f, "\n  program           {program}"))
    }
}

impl fmt::Display for ProgramReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let state = if self.running { "running" } else { "stopped" };
        write!(f, "{state}, identification {}", hex(self.identification))?;
        self.status.iter().try_for_each(|status| write!(f, ", flash {status}"))?;
        self.trial.iter().try_for_each(|trial| write!(f, "\n  trial             {trial}"))?;
        if let Some(counter) = self.security_counter {
            write!(f, "\n  security counter  {counter}")?;
        }
        if let Some(generation) = self.key_generation {
            write!(f, "\n  key generation    {generation}")?;
        }
        for (name, id) in [("downloaded", self.downloaded), ("kept", self.kept)] {
            id.iter().try_for_each(|_| write!(f, "\n  {name:<18}{}", hex(id)))?;
        }
        if let Some(erases) = self.sector_erases {
            write!(f, "\n  sector erases     {erases}")?;
        }
        if let Some(clears) = self.clears_allowed {
            write!(f, "\n  clears allowed    {clears}")?;
        }
        self.log.iter().try_for_each(|LogEntry { version, event, key_generation }| {
            write!(f, "\n  update log        {version}, key generation {key_generation}: {event}")
        })
    }
}
