//! `nodectl net dump`: the file of the present bus.

use std::fmt::{self, Write as _};
use std::path::Path;

use canopen::NodeId;
use eds::Reals;
use serde::Serialize;

use super::super::dump::{commissioning, note_left_out};
use super::super::replacement::{Replacement, check_is_file};
use super::check::{date, is_there};
use super::{Failure, LISTEN, Session};
use crate::object::at;
use crate::scan::scan;
use crate::text::counted;

#[derive(Serialize)]
struct Done {
    file: String,
    nodes: usize,
    configurations: usize,
}

pub(super) fn run(session: &mut Session, file: &Path) -> Result<(), Failure> {
    check_is_file(file)?;
    session.has_many_nodes = true;
    let found = scan(&mut session.network, LISTEN)?;
    let nodes: Vec<NodeId> = found.keys().copied().filter(|node| is_there(&found, *node)).collect();
    let mut text = "start: all\nnodes:\n".to_owned();
    let mut configurations = 0;
    for node in &nodes {
        configurations += usize::from(add(session, *node, file, &mut text)?);
    }
    Replacement::write(file, text.as_bytes())?;
    session.print(&Done { file: file.display().to_string(), nodes: nodes.len(), configurations })
}

/// Adds a node. Returns whether it has a configuration file.
fn add(session: &mut Session, node: NodeId, file: &Path, text: &mut String) -> Result<bool, Failure> {
    session.begin_all();
    let (catalogue, id) = (session.catalogue(node)?, node.get());
    // Writing to a string cannot fail.
    let _ = writeln!(text, "  - node: {id}");
    let mut line = |key: &str, value: String| {
        let _ = writeln!(text, "    {key}: {value}");
    };
    let mut identity = Vec::new();
    for (key, place) in [
        ("device_type", at(0x1000, 0)),
        ("vendor", at(0x1018, 1)),
        ("product", at(0x1018, 2)),
        ("revision", at(0x1018, 3)),
        ("serial", at(0x1018, 4)),
    ] {
        identity.extend(session.word(node, place)?.map(|value| format!("{key}: 0x{value:X}")));
    }
    for (key, index) in [("name", 0x1008), ("hardware", 0x1009), ("software", 0x100A)] {
        if let Some(value) = session.text(node, index)?.filter(|value| !value.is_empty()) {
            line(key, serde_json::Value::from(value).to_string());
        }
    }
    line("identity", format!("{{ {} }}", identity.join(", ")));
    if let Some(date) = date(session, node)?.filter(|date| date.days != 0) {
        line("date", date.to_string());
    }
    if let Some(time) = session.optional(node, at(0x1017, 0))?.and_then(|bytes| bytes.try_into().ok()) {
        line("heartbeat", u16::from_le_bytes(time).to_string());
    }
    if !catalogue.is_of_a_device() {
        return Ok(false);
    }
    let sheet = catalogue.sheet();
    let values = session.configuration(node, sheet)?;
    let commissioning = commissioning(session, node)?;
    let stem = file.file_stem().and_then(|stem| stem.to_str()).unwrap_or("net");
    let name = format!("{stem}-node{id}.dcf");
    let dcf = values.to_dcf(sheet, &name, commissioning, false, Reals::Decimal);
    note_left_out(sheet, &dcf);
    Replacement::write(&file.with_file_name(&name), dcf.text.as_bytes())?;
    line("configuration", serde_json::Value::from(name).to_string());
    Ok(true)
}

impl fmt::Display for Done {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let nodes = counted(self.nodes, "node", "nodes");
        write!(f, "{}: {nodes}, {} with a configuration file", self.file, self.configurations)
    }
}
