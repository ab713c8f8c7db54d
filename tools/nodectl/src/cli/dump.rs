//! `nodectl dump`, `nodectl diff` and `nodectl apply`: the configuration of a node as a file (CiA 306).

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use canopen::NodeId;
use canopen::sdo::Multiplexer;
use clap::Args;
use eds::{Commissioning, Eds, Reals};
use serde::{Serialize, Serializer};

use super::read::place;
use super::replacement::Replacement;
use super::session::loss;
use super::sheets::misfit;
use super::store::{Group, Order, sign};
use super::{Failure, Session};
use crate::configuration::{Configuration, Dcf, Difference, Write, is_unclear, node_of, plan};
use crate::object::{Place, at};
use crate::sdo::AbortCode;
use crate::text::{counted, note, visible};
use crate::value::Value;

/// Writes the configuration of a node to a file: a DCF with the values that differ from the defaults.
#[derive(Debug, Args)]
pub(super) struct Dump {
    /// The file; "-" for the standard output.
    #[arg(default_value = "-")]
    file: PathBuf,

    /// All parameters, also those with default values.
    #[arg(long)]
    all: bool,

    /// Write real numbers as their bits, for Lely's tools; python-canopen does not read these.
    #[arg(long)]
    bits: bool,
}

/// Compares two configurations: files (DCF or EDS), or the node itself.
#[derive(Debug, Args)]
pub(super) struct Diff {
    /// The first: a file.
    first: PathBuf,

    /// The second: a file; the node if it is left out.
    second: Option<PathBuf>,
}

/// Writes the configuration of a file to a node, PDOs in the order that CiA 301 asks for, and reads it back.
#[derive(Debug, Args)]
pub(super) struct Apply {
    /// The file: a DCF, or an EDS for the defaults.
    file: PathBuf,

    /// Show what would change, and write nothing.
    #[arg(long)]
    dry_run: bool,

    /// Make the node save the configuration.
    #[arg(long)]
    save: bool,

    /// Write also a file for another product or vendor, and one with missing parts or values that cannot be read.
    #[arg(long)]
    force: bool,
}

/// The number of times that values are written which are still different: some parameters change others.
const PASSES: usize = 3;

#[derive(Serialize)]
struct Changed {
    #[serde(rename = "object", serialize_with = "place")]
    at: Multiplexer,
    name: Option<String>,
    #[serde(serialize_with = "or_null")]
    first: Option<Value>,
    #[serde(serialize_with = "or_null")]
    second: Option<Value>,
}

#[derive(Serialize)]
struct Done {
    node: u8,
    changes: usize,
    saved: bool,
}

#[allow(clippy::ref_option, reason = "as serde calls it")]
fn or_null<S: Serializer>(value: &Option<Value>, serializer: S) -> Result<S::Ok, S::Error> {
    value.serialize(serializer)
}

impl Dump {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        let node = session.options.node.one()?;
        let sheet = session.sheet_of(node)?;
        note_unclear(&sheet);
        let values = session.configuration(node, &sheet)?;
        let commissioning = commissioning(session, node)?;
        let name = self.file.file_name().and_then(|name| name.to_str()).unwrap_or("-");
        let reals = if self.bits { Reals::Bits } else { Reals::Decimal };
        let dcf = values.to_dcf(&sheet, name, commissioning, self.all, reals);
        note_left_out(&sheet, &dcf);
        if self.file.as_os_str() == "-" {
            return Ok(session.output.write(dcf.text.as_bytes())?);
        }
        Replacement::write(&self.file, dcf.text.as_bytes())
    }
}

impl Diff {
    /// The comparison of two files needs no bus.
    pub(super) fn needs_a_bus(&self) -> bool {
        self.second.is_none()
    }

    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        let node = session.options.node.one()?;
        let sheet = super::session::sheet(&self.first)?;
        // COB-IDs that follow the node-ID are compared as if both configurations were of one node.
        let (node, second) = match &self.second {
            Some(path) => {
                let (other, node) = (super::session::sheet(path)?, node_of(&sheet).unwrap_or(node));
                (node, Configuration::of_sheet(&other, node))
            }
            None => {
                note_node_id(&sheet, node, "compared");
                note_unclear(&sheet);
                (node, session.configuration(node, &sheet)?)
            }
        };
        let first = Configuration::of_sheet(&sheet, node);
        let differences = first.differences(&second);
        let count = differences.len();
        print(session, &sheet, differences)?;
        if count == 0 { Ok(()) } else { Err(Failure::Different(count)) }
    }
}

impl Apply {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        let node = session.options.node.one()?;
        let sheet = super::session::sheet(&self.file)?;
        self.check(session, node, &sheet)?;
        note_node_id(&sheet, node, "written");
        note_unclear(&sheet);
        let wanted = Configuration::of_sheet(&sheet, node);
        if self.dry_run {
            let now = session.configuration(node, &sheet)?;
            return print(session, &sheet, now.changes(&wanted));
        }
        let changes = bring(session, node, &sheet, &wanted, |session| session.configuration(node, &sheet))?;
        if self.save {
            sign(session, node, Order::Save, Group::All)?;
        }
        session.print(&Done { node: node.get(), changes, saved: self.save })
    }

    /// Refuses a file with missing parts, and one for another product.
    fn check(&self, session: &mut Session, node: NodeId, sheet: &Eds) -> Result<(), Failure> {
        if self.force {
            return Ok(());
        }
        let refusal = match loss(sheet) {
            Some(words) => Some(words),
            None => mismatch(session, node, sheet)?,
        };
        refusal.map_or(Ok(()), |words| Err(Failure::file(&self.file, words)))
    }
}

fn print(session: &mut Session, sheet: &Eds, differences: Vec<Difference>) -> Result<(), Failure> {
    differences.into_iter().try_for_each(|Difference { at, first, second }| {
        let name = sheet.get(at.index, at.sub).map(|entry| sheet.path(entry));
        session.print(&Changed { at, name, first, second })
    })
}

/// The device that a configuration file is for.
pub(super) fn commissioning(session: &mut Session, node: NodeId) -> Result<Commissioning, Failure> {
    let serial = session.word(node, at(0x1018, 4))?.unwrap_or(0);
    Ok(Commissioning { node_id: node.get(), bit_rate: session.options.known_bit_rate(), serial })
}

/// Names the parameters whose values a file cannot have.
pub(super) fn note_left_out(sheet: &Eds, dcf: &Dcf) {
    for at in &dcf.left_out {
        let name = sheet.get(at.index, at.sub).map(|entry| sheet.path(entry)).unwrap_or_default();
        note(format_args!(
            "warning: {} {} is left out: a file cannot have an empty value, a line break, spaces at the ends or a \
             comment (\" ;\") in a text",
            Place(*at),
            visible(&name)
        ));
    }
}

/// Warns the user of a file of another node-ID.
fn note_node_id(sheet: &Eds, node: NodeId, done: &str) {
    if let Some(of_file) = node_of(sheet).filter(|of_file| *of_file != node) {
        let (of_file, node) = (of_file.get(), node.get());
        note(format_args!(
            "the file is of node {of_file}; COB-IDs that follow the node-ID are {done} for node {node}"
        ));
    }
}

/// Warns the user of a data sheet that does not mark its parameters.
fn note_unclear(sheet: &Eds) {
    let count = sheet.entries().filter(|entry| is_unclear(entry)).count();
    if count > 0 {
        let objects =
            counted(count, "object that an RPDO can write is", "objects that an RPDO can write are");
        note(format_args!(
            "{objects} left out: the data sheet does not say (ObjFlags) which are parameters and which process values"
        ));
    }
}

/// Why a file does not fit a node. A node would refuse the file of another product object by object, so nothing is
/// written then. A product code is unique only together with the vendor-ID.
pub(super) fn mismatch(session: &mut Session, node: NodeId, sheet: &Eds) -> Result<Option<String>, Failure> {
    let device = (session.word(node, at(0x1018, 1))?, session.word(node, at(0x1018, 2))?);
    let of_file = (sheet.device.vendor_number, sheet.device.product_number);
    let is_same = (device.0.unwrap_or(0), device.1.unwrap_or(0)) == of_file;
    Ok((!is_same).then(|| misfit(sheet, device)))
}

/// Writes the parameters that differ from the wanted ones, until `read` shows no difference. Returns the number of
/// parameters that differed.
pub(super) fn bring(
    session: &mut Session,
    node: NodeId,
    sheet: &Eds,
    wanted: &Configuration,
    mut read: impl FnMut(&mut Session) -> Result<Configuration, Failure>,
) -> Result<usize, Failure> {
    let mut refusals = BTreeMap::new();
    let mut now = read(session)?;
    let changes = now.changes(wanted).len();
    for _ in 0..PASSES {
        let steps = plan(&now, wanted);
        if steps.is_empty() {
            return Ok(changes);
        }
        refusals = write_all(session, node, sheet, &steps)?;
        now = read(session)?;
    }
    let differences = wanted.differences(&now);
    let left: Vec<String> = differences.iter().filter_map(|difference| left(difference, &refusals)).collect();
    if left.is_empty() { Ok(changes) } else { Err(Failure::NotApplied(left.join(", "))) }
}

/// The refusals of a node, by index and sub-index.
type Refusals = BTreeMap<(u16, u8), AbortCode>;

fn key(Multiplexer { index, sub }: Multiplexer) -> (u16, u8) {
    (index, sub)
}

/// A parameter that has another value than wanted, with the reason where the node has told one; `None` where no value is
/// wanted.
fn left(Difference { at, first, second }: &Difference, refusals: &Refusals) -> Option<String> {
    let wanted = first.as_ref()?;
    let is = second.as_ref().map_or("not there".to_owned(), Value::to_string);
    let why = refusals.get(&key(*at)).map(|code| format!(" ({code})")).unwrap_or_default();
    Some(visible(&format!("{} is {is} instead of {wanted}{why}", Place(*at))))
}

/// Writes parameters in their order. A refused one does not stop the others: it may be taken in the next pass.
fn write_all(session: &mut Session, node: NodeId, sheet: &Eds, steps: &[Write]) -> Result<Refusals, Failure> {
    let mut refusals = Refusals::new();
    for step in steps {
        let Some(entry) = sheet.get(step.at.index, step.at.sub) else { continue };
        let bytes = step.value.encode(entry.data_type);
        if let Err(error) = session.client(node).download(step.at, &bytes, |_| ()) {
            let code = error.abort().ok_or_else(|| session.named(error))?;
            refusals.insert(key(step.at), code);
        }
    }
    Ok(refusals)
}

/// `1017h:0 Producer heartbeat time: 1000 -> 500`
impl fmt::Display for Changed {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let text = |value: &Option<Value>| {
            let hex = match value {
                Some(Value::Integer(value)) if *value > 0xFFFF => format!(" ({value:08X}h)"),
                _ => String::new(),
            };
            value.as_ref().map_or("-".to_owned(), |value| visible(&value.to_string()) + &hex)
        };
        let name = self.name.as_deref().unwrap_or_default();
        write!(f, "{} {name}: {} -> {}", Place(self.at), text(&self.first), text(&self.second))
    }
}

impl fmt::Display for Done {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let saved = if self.saved { ", saved" } else { "" };
        match self.changes {
            0 => write!(f, "node {}: has it already{saved}", self.node),
            changes => {
                write!(f, "node {}: {}, read back{saved}", self.node, counted(changes, "change", "changes"))
            }
        }
    }
}
