//! Jobs: the dictionary of a node, its values, and changes.

use canopen::NodeId;
use canopen::sdo::Multiplexer;
use eds::{Entry, Value as Formula};
use serde_json::{Value as Json, json};

use super::{Context, Job};
use crate::cli::Failure;
use crate::configuration::is_parameter;
use crate::object::Place;
use crate::quantity::Quantity;
use crate::text::hex_digits;
use crate::value::{Value, guess};
use crate::{Catalogue, meaning};

/// The number of values that are reported together while all values are read.
const PART: usize = 20;

/// All entries of the data sheet.
pub(super) fn dictionary(node: NodeId) -> Job {
    Job::of_node(node, move |context| {
        let catalogue = context.catalogue(node)?;
        let data_sheet = catalogue.is_of_a_device();
        let entries: Vec<Json> = catalogue.entries().map(|entry| shape(&catalogue, entry, node)).collect();
        Ok(json!({ "data_sheet": data_sheet, "entries": entries }))
    })
}

fn shape(catalogue: &Catalogue, entry: &Entry, node: NodeId) -> Json {
    let at = crate::object::at(entry.index, entry.sub);
    let value = |formula: &Option<eds::Formula>| {
        formula.as_ref().map(|formula| match formula.evaluate(node) {
            // An integer that does not fit `i64` is sent as text, because not every reader of JSON accepts it.
            Formula::Integer(value) => {
                i64::try_from(value).map_or_else(|_| value.to_string().into(), Json::from)
            }
            Formula::Real(value) => json!(value),
            Formula::Text(text) => text.into(),
        })
    };
    let access = match (entry.access.is_readable(), entry.access.is_writable()) {
        (true, true) => "rw",
        (false, _) => "wo",
        _ if entry.access == eds::Access::Const => "const",
        _ => "ro",
    };
    json!({
        "index": entry.index, "sub": entry.sub, "name": entry.name, "path": catalogue.name(at),
        "type": entry.data_type.to_string(), "access": access,
        "low": value(&entry.low), "high": value(&entry.high), "default": value(&entry.default),
        "unit": entry.unit, "tpdo": entry.is_tpdo_mappable(), "rpdo": entry.is_rpdo_mappable(),
        "parameter": is_parameter(entry),
    })
}

/// Reads some objects. An object that cannot be read does not stop the reading of the others.
pub(super) fn read(node: NodeId, objects: Vec<Multiplexer>) -> Job {
    Job::of_node(node, move |context| {
        let catalogue = context.catalogue(node)?;
        let mut values = Vec::new();
        for at in objects {
            context.session.begin();
            values.push(reading(context, node, &catalogue, at)?);
        }
        Ok(json!({ "values": values }))
    })
}

/// Reads all readable objects.
pub(super) fn values(node: NodeId) -> Job {
    Job::of_node(node, move |context| {
        let catalogue = context.catalogue(node)?;
        let is_wanted =
            |entry: &&Entry| entry.access.is_readable() && entry.data_type != eds::DataType::DOMAIN;
        let objects: Vec<Multiplexer> = catalogue
            .entries()
            .filter(is_wanted)
            .map(|entry| crate::object::at(entry.index, entry.sub))
            .collect();
        context.session.begin_all();
        for (number, part) in objects.chunks(PART).enumerate() {
            let values: Result<Vec<Json>, Failure> =
                part.iter().map(|at| reading(context, node, &catalogue, *at)).collect();
            let done = number * PART + part.len();
            context.progress(json!({ "done": done, "all": objects.len(), "values": values? }));
        }
        Ok(json!({ "read": objects.len() }))
    })
}

/// The value of an object, or the reason why the node refuses the read.
fn reading(
    context: &mut Context,
    node: NodeId,
    catalogue: &Catalogue,
    at: Multiplexer,
) -> Result<Json, Failure> {
    let session = &mut context.session;
    let bytes = match session.client(node).upload(at) {
        Ok(bytes) => bytes,
        Err(error) => {
            let abort = error.abort().map(|code| code.0);
            let failure = session.named(error);
            return match abort {
                Some(abort) => Ok(json!({
                    "index": at.index, "sub": at.sub, "error": failure.to_string(), "abort": abort
                })),
                None => Err(failure),
            };
        }
    };
    let quantity = quantity(context, node, catalogue, at)?;
    Ok(value(catalogue, at, &bytes, &quantity))
}

fn quantity(
    context: &mut Context,
    node: NodeId,
    catalogue: &Catalogue,
    at: Multiplexer,
) -> Result<Quantity, Failure> {
    let quantity = Quantity::of(&mut context.session.client(node), catalogue, at);
    quantity.map_err(|error| context.session.named(error))
}

fn value(catalogue: &Catalogue, at: Multiplexer, bytes: &[u8], quantity: &Quantity) -> Json {
    let raw = Value::decode(bytes, catalogue.data_type(at).unwrap_or_else(|| guess(bytes)));
    let meaning = meaning::of(catalogue, at, &raw);
    let value = quantity.apply(raw);
    json!({
        "index": at.index, "sub": at.sub, "value": value, "text": value.to_string(), "unit": quantity.unit,
        "meaning": meaning, "raw": hex_digits(bytes, ""),
    })
}

/// Writes an object. A value that violates the type or the limits is not sent.
pub(super) fn write(node: NodeId, at: Multiplexer, value: &Json) -> Result<Job, String> {
    let text = match value {
        Json::String(text) => text.clone(),
        Json::Number(number) => number.to_string(),
        Json::Bool(value) => value.to_string(),
        _ => return Err(format!("{}: a value is a text or a number", Place(at))),
    };
    Ok(Job::of_node(node, move |context| {
        let catalogue = context.catalogue(node)?;
        context.session.begin();
        let quantity = quantity(context, node, &catalogue, at)?;
        let bytes = encode(&catalogue, node, at, &text, &quantity)?;
        let session = &mut context.session;
        let written = session.client(node).download(at, &bytes, |_| ());
        written.map_err(|error| session.named(error))?;
        if catalogue.entry(at).is_some_and(|entry| !entry.access.is_readable()) {
            return Ok(json!({ "index": at.index, "sub": at.sub }));
        }
        reading(context, node, &catalogue, at)
    }))
}

fn encode(
    catalogue: &Catalogue,
    node: NodeId,
    at: Multiplexer,
    text: &str,
    quantity: &Quantity,
) -> Result<Vec<u8>, Failure> {
    let refuse = |words: String| Failure::Usage(format!("{}: {words}", Place(at)));
    let data_type = catalogue.data_type(at).ok_or_else(|| Failure::Usage(catalogue.missing(at)))?;
    let value = catalogue.word(at, text).map_or_else(|| quantity.parse(text, data_type), Ok);
    let value = value.map_err(|error| refuse(format!("{error}{}", catalogue.words(at))))?;
    if !catalogue.allows(at, node, &value) {
        let range = catalogue.range(at, node).unwrap_or_default();
        return Err(refuse(format!("{value} is out of range; it takes {range}")));
    }
    Ok(value.encode(data_type))
}
