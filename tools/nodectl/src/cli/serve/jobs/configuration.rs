//! Jobs: the configuration of a node as a file, and writing a file to a node.

use canopen::NodeId;
use canopen::sdo::Multiplexer;
use eds::{Eds, Reals};
use serde_json::{Value as Json, json};

use super::{Context, Job};
use crate::cli::dump::{bring, commissioning, mismatch};
use crate::cli::serve::request::Apply;
use crate::cli::session::loss;
use crate::cli::store::{Group, Order, sign};
use crate::cli::{Failure, Session};
use crate::configuration::{Configuration, Difference};
use crate::object::Place;

/// Reads the data sheet and the configuration of a node.
fn read(context: &mut Context, node: NodeId) -> Result<(Eds, Configuration), Failure> {
    context.catalogue(node)?;
    let sheet = context.session.sheet_of(node)?;
    let values = values(context, node, &sheet)?;
    Ok((sheet, values))
}

fn values(context: &mut Context, node: NodeId, sheet: &Eds) -> Result<Configuration, Failure> {
    let counter = context.counter();
    context.session.configuration_with(node, sheet, counter)
}

fn path(sheet: &Eds, at: Multiplexer) -> Option<String> {
    sheet.get(at.index, at.sub).map(|entry| sheet.path(entry))
}

/// The parameters that differ from the defaults of the data sheet.
pub(super) fn differences(node: NodeId) -> Job {
    Job::of_node(node, move |context| {
        let (sheet, values) = read(context, node)?;
        let differences = values.differences(&Configuration::of_sheet(&sheet, node));
        // A parameter without a default in the data sheet cannot differ.
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
        let commissioning = commissioning(&mut context.session, node)?;
        let name = format!("node{}.dcf", node.get());
        let dcf = values.to_dcf(&sheet, &name, commissioning, all, Reals::Decimal);
        let left_out: Vec<String> = dcf.left_out.iter().map(|at| Place(*at).to_string()).collect();
        Ok(json!({ "name": name, "text": dcf.text, "left_out": left_out }))
    })
}

/// Writes the configuration of a file to the node, and reads it back.
pub(super) fn apply(node: NodeId, text: &str, how: Apply) -> Result<Job, String> {
    let sheet = Eds::from_bytes(text.as_bytes()).map_err(|error| error.to_string())?;
    if sheet.objects.is_empty() {
        return Err("it is no data sheet: there is no object in it".to_owned());
    }
    if let Some(words) = loss(&sheet).filter(|_| !how.force) {
        return Err(words);
    }
    Ok(Job::of_node(node, move |context| {
        let mismatch = mismatch(&mut context.session, node, &sheet)?;
        if let Some(words) = mismatch.filter(|_| !how.force) {
            return Err(Failure::Usage(words));
        }
        let wanted = Configuration::of_sheet(&sheet, node);
        if how.dry_run {
            let changes = values(context, node, &sheet)?.changes(&wanted);
            let rows: Vec<Json> = changes
                .into_iter()
                .map(|Difference { at, first, second }| {
                    json!({
                        "index": at.index, "sub": at.sub, "path": path(&sheet, at),
                        "present": first, "value": second,
                    })
                })
                .collect();
            let warnings: Vec<String> = sheet.warnings.iter().map(ToString::to_string).collect();
            return Ok(json!({ "changes": rows, "warnings": warnings }));
        }
        let mut counter = context.counter();
        let read = |session: &mut Session| session.configuration_with(node, &sheet, &mut counter);
        let changed = bring(&mut context.session, node, &sheet, &wanted, read)?;
        if how.save {
            sign(&mut context.session, node, Order::Save, Group::All)?;
        }
        Ok(json!({ "changed": changed, "saved": how.save }))
    }))
}
