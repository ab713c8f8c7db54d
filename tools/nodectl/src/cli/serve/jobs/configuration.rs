//! The configuration of a node as a file, and back.

use canopen::NodeId;
use canopen::sdo::Multiplexer;
use eds::{Commissioning, Eds};
use serde_json::{Value as Json, json};

use super::{Context, Job};
use crate::cli::Failure;
use crate::cli::dump::{PASSES, write_all};
use crate::cli::serve::request::Apply;
use crate::configuration::{Configuration, plan};
use crate::object::{Place, at};

/// The data sheet of a node, and its configuration.
fn read(context: &mut Context, node: NodeId) -> Result<(Eds, Configuration), Failure> {
    context.catalogue(node)?;
    let sheet = context.session.sheet_of(node)?;
    let values = values(context, node, &sheet)?;
    Ok((sheet, values))
}

fn values(context: &mut Context, node: NodeId, sheet: &Eds) -> Result<Configuration, Failure> {
    context.session.begin_all();
    let counter = context.counter();
    let session = &mut context.session;
    let values = Configuration::of_node(|at| session.client(node).upload(at), sheet, counter);
    values.map_err(|error| context.session.named(error))
}

fn path(sheet: &Eds, at: Multiplexer) -> Option<String> {
    sheet.get(at.index, at.sub).map(|entry| sheet.path(entry))
}

/// What differs from the defaults of the data sheet.
pub(super) fn differences(node: NodeId) -> Job {
    Job::of_node(node, move |context| {
        let (sheet, values) = read(context, node)?;
        let differences = values.differences(&Configuration::of_sheet(&sheet, node));
        // A default that the sheet does not tell is none that a value could differ from.
        let differing =
            differences.iter().filter(|difference| difference.first.is_some() && difference.second.is_some());
        let rows: Vec<Json> = differing
            .map(|difference| {
                let at = difference.at;
                json!({
                    "index": at.index, "sub": at.sub, "path": path(&sheet, at),
                    "value": difference.first, "default": difference.second,
                })
            })
            .collect();
        Ok(json!({ "differences": rows }))
    })
}

/// The configuration as a DCF.
pub(super) fn dcf(node: NodeId, all: bool) -> Job {
    Job::of_node(node, move |context| {
        let (sheet, values) = read(context, node)?;
        let mut file = values.to_sheet(&sheet, node, all);
        let serial = context.session.word(node, at(0x1018, 4))?.unwrap_or(0);
        let bit_rate = context.session.options.bit_rate;
        file.commissioning = Some(Commissioning { node_id: node.get(), bit_rate, serial });
        let name = format!("node{}.dcf", node.get());
        let text = file.to_dcf(&name);
        Ok(json!({ "name": name, "text": text }))
    })
}

/// Brings the node to the configuration of a file, and reads it back.
pub(super) fn apply(node: NodeId, text: &str, how: Apply) -> Result<Job, String> {
    let sheet = Eds::from_bytes(text.as_bytes()).map_err(|error| error.to_string())?;
    if sheet.objects.is_empty() {
        return Err("it is no data sheet: there is no object in it".to_owned());
    }
    Ok(Job::of_node(node, move |context| {
        check(context, node, &sheet, how.force)?;
        let wanted = Configuration::of_sheet(&sheet, node);
        let (mut now, mut done) = (values(context, node, &sheet)?, Vec::new());
        for _ in 0..PASSES {
            let steps = plan(&sheet, &now, &wanted);
            done.extend(steps.iter().map(|step| {
                let Multiplexer { index, sub } = step.at;
                json!({ "index": index, "sub": sub, "path": path(&sheet, step.at), "value": step.value })
            }));
            if steps.is_empty() || how.dry_run {
                break;
            }
            write_all(&mut context.session, node, &sheet, &steps)?;
            now = values(context, node, &sheet)?;
        }
        let left: Vec<String> =
            plan(&sheet, &now, &wanted).iter().map(|step| Place(step.at).to_string()).collect();
        if !how.dry_run && !left.is_empty() {
            return Err(Failure::NotApplied(left.join(", ")));
        }
        let saved = how.save && !how.dry_run;
        if saved {
            let session = &mut context.session;
            let written = session.client(node).download(at(0x1010, 1), b"save", |_| ());
            written.map_err(|error| session.named(error))?;
        }
        let writes = if how.dry_run { 0 } else { done.len() };
        Ok(json!({ "steps": done, "writes": writes, "saved": saved }))
    }))
}

/// A file for another product would be refused object by object; better nothing is changed.
fn check(context: &mut Context, node: NodeId, sheet: &Eds, force: bool) -> Result<(), Failure> {
    let device = context.session.word(node, at(0x1018, 2))?.unwrap_or(0);
    let product = sheet.device.product_number;
    if device == product || force {
        return Ok(());
    }
    let words = format!("the file is for product {product:08X}h, and the node is product {device:08X}h");
    Err(Failure::Usage(words))
}
