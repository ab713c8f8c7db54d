//! `nodectl map --dbc`: the TPDOs of nodes as a DBC file, for tools that do not know CANopen.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;

use canopen::NodeId;
use eds::Class;

use super::replacement::Replacement;
use super::{Failure, Session};
use crate::Catalogue;
use crate::object::at;
use crate::tpdo::{self, Tpdo};

/// The longest name of a message or a signal.
const LONGEST: usize = 32;

/// The lines of messages with their signals, and the lines of the types of signals.
#[derive(Default)]
struct Lines {
    messages: String,
    kinds: String,
    /// The CAN-ID and the name of each message.
    names: Vec<(u16, String)>,
}

/// Writes the configured TPDOs of these nodes. A node that does not answer or refuses is left out, and is an
/// error at the end. Without any node nothing is written.
pub(super) fn write(session: &mut Session, nodes: &[NodeId], file: &Path) -> Result<(), Failure> {
    let (mut all, mut names, mut failures) = (Lines::default(), Vec::new(), Vec::new());
    for node in nodes {
        match read(session, *node) {
            Ok(lines) => {
                all.names.extend(lines.names);
                all.messages += &lines.messages;
                all.kinds += &lines.kinds;
                names.push(format!("Node{}", node.get()));
            }
            Err(failure @ Failure::Sdo(_)) if nodes.len() > 1 => {
                session.tell(&failure)?;
                failures.push(failure);
            }
            Err(failure) => return Err(failure),
        }
    }
    if let Some(words) = shared(&all.names) {
        return Err(Failure::file(file, words));
    }
    if !names.is_empty() {
        save(session, &names, &all, file)?;
    }
    match failures.first() {
        None => Ok(()),
        Some(first) => {
            let (missing, exit_code) = (failures.len(), first.exit_code());
            Err(Failure::LeftOut { missing, all: nodes.len(), exit_code })
        }
    }
}

/// Two messages with one CAN-ID, in words. A DBC file has one message for each, as the bus has one sender.
fn shared(names: &[(u16, String)]) -> Option<String> {
    let mut senders = BTreeMap::new();
    names.iter().find_map(|(id, name)| {
        let other = senders.insert(id, name)?;
        Some(format!("nothing was written: {other} and {name} have one CAN-ID, {id:03X}h"))
    })
}

fn save(session: &mut Session, names: &[String], lines: &Lines, file: &Path) -> Result<(), Failure> {
    let Lines { messages, kinds, .. } = lines;
    let text = format!("VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: {}\n{messages}\n{kinds}", names.join(" "));
    if file.as_os_str() == "-" {
        return Ok(session.output.write(text.as_bytes())?);
    }
    Replacement::write(file, text.as_bytes())
}

fn read(session: &mut Session, node: NodeId) -> Result<Lines, Failure> {
    session.begin_all();
    let catalogue = session.catalogue(node)?;
    let found = tpdo::read(&mut session.client(node), &catalogue);
    let found = found.map_err(|error| session.named(error))?;
    let mut lines = Lines::default();
    // A multiplexed PDO maps nothing: each of its frames names its object.
    for tpdo in found.iter().filter(|tpdo| !tpdo.mapping.is_empty()) {
        message(session, node, &catalogue, tpdo, &mut lines)?;
    }
    Ok(lines)
}

fn message(
    session: &mut Session,
    node: NodeId,
    catalogue: &Catalogue,
    tpdo: &Tpdo,
    Lines { messages, kinds, names: message_names }: &mut Lines,
) -> Result<(), Failure> {
    let bits: usize = tpdo.mapping.iter().map(|mapped| usize::from(mapped.bits)).sum();
    let (id, node_id) = (tpdo.id, node.get());
    let message = format!("Node{node_id}_TPDO{}", tpdo.number);
    // Writing to a string cannot fail.
    let _ = writeln!(messages, "\nBO_ {id} {message}: {} Node{node_id}", bits.div_ceil(8));
    message_names.push((id, message));
    let (mut start, mut names) = (0, BTreeSet::new());
    for mapped in &tpdo.mapping {
        let place = at(mapped.index, mapped.sub);
        let class = catalogue.data_type(place).map_or(Class::Unsigned(mapped.bits), eds::DataType::class);
        // A value that is no number is in no signal.
        if !matches!(class, Class::Text | Class::Bytes) {
            let name = unique(&name(catalogue, mapped.index, mapped.sub), &mut names);
            let sign = if matches!(class, Class::Unsigned(_)) { '+' } else { '-' };
            let (factor, unit) = scale(session, node, catalogue, place, class)?;
            let _ = writeln!(
                messages,
                " SG_ {name} : {start}|{}@1{sign} ({factor},0) [0|0] \"{unit}\" Vector__XXX",
                mapped.bits
            );
            match class {
                Class::Real(32) => drop(writeln!(kinds, "SIG_VALTYPE_ {id} {name} : 1;")),
                Class::Real(_) => drop(writeln!(kinds, "SIG_VALTYPE_ {id} {name} : 2;")),
                _ => (),
            }
        }
        start += usize::from(mapped.bits);
    }
    Ok(())
}

/// The factor and the unit of a value, as `read` shows it.
fn scale(
    session: &mut Session,
    node: NodeId,
    catalogue: &Catalogue,
    place: canopen::sdo::Multiplexer,
    class: Class,
) -> Result<(String, String), Failure> {
    let quantity = crate::quantity::Quantity::of(&mut session.client(node), catalogue, place);
    let quantity = quantity.map_err(|error| session.named(error))?;
    let one = quantity.apply(crate::value::Value::Integer(1));
    let factor = if matches!(class, Class::Real(_)) { "1".to_owned() } else { one.to_string() };
    Ok((factor, quantity.unit.replace('"', "'")))
}

/// The name of an object as a name of DBC: letters, digits and underlines, not a digit first.
fn name(catalogue: &Catalogue, index: u16, sub: u8) -> String {
    let words = catalogue.sheet().get(index, sub).map(|entry| entry.name.clone()).unwrap_or_default();
    let letters: String =
        words.chars().map(|letter| if letter.is_ascii_alphanumeric() { letter } else { '_' }).collect();
    let letters = letters.trim_matches('_');
    match letters.chars().next() {
        Some(first) if first.is_ascii_alphabetic() => letters.chars().take(LONGEST).collect(),
        _ => format!("O{index:04X}_{sub:02X}"),
    }
}

fn unique(name: &str, names: &mut BTreeSet<String>) -> String {
    let with = |number: usize| match number {
        1 => name.to_owned(),
        number => format!("{}_{number}", name.chars().take(LONGEST - 4).collect::<String>()),
    };
    let free = (1..=usize::from(u8::MAX)).map(with).find(|name| !names.contains(name)).unwrap_or_default();
    names.insert(free.clone());
    free
}
