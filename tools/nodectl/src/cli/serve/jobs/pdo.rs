//! Jobs: the PDOs of a node, and changes of their mapping.

use std::sync::Arc;

use canopen::NodeId;
use canopen::pdo::MappedObject;
use canopen::sdo::Multiplexer;
use serde_json::{Value as Json, json};

use super::{Context, Job, Learned};
use crate::Catalogue;
use crate::acquisition;
use crate::cli::Failure;
use crate::cli::map::{self, Direction, Mapped, OFF, Pdo};
use crate::cli::serve::live::Survey;
use crate::cli::serve::request::Mapping;
use crate::object::at;
use crate::pdo_parameters::walk;
use crate::trace::Knowledge;

/// Surveys the TPDOs of a node. The answer has the signals.
pub(in crate::cli::serve) fn survey(node: NodeId) -> Job {
    Job::of_node(node, move |context| {
        let catalogue = context.catalogue(node)?;
        context.session.begin_all();
        let session = &mut context.session;
        let knowledge = Knowledge::ask(&mut session.client(node), Arc::clone(&catalogue));
        let knowledge = knowledge.map_err(|error| session.named(error))?;
        let found = acquisition::survey(&mut session.client(node), &catalogue, &[]);
        let (tpdos, signals) = found.map_err(|error| session.named(error))?;
        let survey = Survey { tpdos, signals, knowledge };
        let signals = survey.describe(node);
        context.learned(node, Learned::Survey(survey));
        Ok(json!({ "signals": signals }))
    })
}

/// Reads the followed objects that no TPDO brings, and before them the objects that their units depend on.
pub(in crate::cli::serve) fn poll(node: NodeId, units: Vec<Multiplexer>, objects: Vec<Multiplexer>) -> Job {
    Job::of_node(node, move |context| {
        context.session.begin();
        for at in units {
            match context.session.client(node).upload(at) {
                Ok(bytes) => context.learned(node, Learned::Number(at, Some(bytes))),
                Err(error) if error.abort().is_some() => context.learned(node, Learned::Number(at, None)),
                Err(error) => return Err(context.session.named(error)),
            }
        }
        for at in objects {
            match context.session.client(node).upload(at) {
                Ok(bytes) => context.learned(node, Learned::Reading(at, bytes)),
                Err(error) if error.abort().is_some() => {}
                Err(error) => return Err(context.session.named(error)),
            }
        }
        Ok(Json::Null)
    })
}

/// Reads all PDOs.
pub(super) fn pdos(node: NodeId) -> Job {
    Job::of_node(node, move |context| {
        let catalogue = context.catalogue(node)?;
        context.session.begin_all();
        let mut found = Vec::new();
        for (first, direction) in [(0x1800, Direction::Tpdo), (0x1400, Direction::Rpdo)] {
            walk(&catalogue, first, |parameters| {
                let shape = shape(context, node, &catalogue, direction, parameters.number + 1)?;
                let exists = shape.is_some();
                found.extend(shape);
                Ok::<_, Failure>(exists)
            })?;
        }
        Ok(json!({ "pdos": found }))
    })
}

/// A PDO in the form for pages; `None` where the node has no PDO of this number.
fn shape(
    context: &mut Context,
    node: NodeId,
    catalogue: &Catalogue,
    direction: Direction,
    number: u16,
) -> Result<Option<Json>, Failure> {
    let pdo = Pdo::new(node, direction, number);
    let session = &mut context.session;
    if session.word(node, at(pdo.communication, 1))?.is_none() {
        return Ok(None);
    }
    let Mapped { cob_id, entries, transmission } = pdo.mapped(session)?;
    let mut time = |sub| {
        let bytes = session.optional(node, at(pdo.communication, sub))?;
        Ok::<_, Failure>(bytes.and_then(|bytes| bytes.try_into().ok()).map(u16::from_le_bytes))
    };
    let (inhibit, event) = (time(3)?, time(5)?);
    let mapped: Vec<MappedObject> = entries.into_iter().map(MappedObject::parse).collect();
    let bits: u32 = mapped.iter().map(|object| u32::from(object.bits)).sum();
    let objects: Vec<Json> = mapped
        .iter()
        .map(|object| {
            let name = catalogue.name(at(object.index, object.sub));
            json!({ "index": object.index, "sub": object.sub, "bits": object.bits, "name": name })
        })
        .collect();
    Ok(Some(json!({
        "direction": direction, "number": number, "cob_id": cob_id & 0x7FF, "on": cob_id & OFF == 0,
        "transmission": transmission, "inhibit": inhibit, "event": event, "bits": bits, "objects": objects,
    })))
}

/// Changes the mapping and the transmission of a PDO.
pub(super) fn map(node: NodeId, mapping: Mapping) -> Job {
    Job::of_node(node, move |context| {
        let catalogue = context.catalogue(node)?;
        context.session.begin_all();
        let pdo = Pdo::new(node, mapping.direction, mapping.number);
        if mapping.objects.is_empty() {
            pdo.clear(&mut context.session)?;
        } else {
            remap(context, &pdo, &catalogue, &mapping)?;
        }
        let shape = shape(context, node, &catalogue, mapping.direction, mapping.number)?;
        Ok(shape.unwrap_or(Json::Null))
    })
}

fn remap(context: &mut Context, pdo: &Pdo, catalogue: &Catalogue, mapping: &Mapping) -> Result<(), Failure> {
    // Look up all objects before any change, so that an error leaves the PDO unchanged.
    let objects = mapping.objects.iter().map(|object| Multiplexer::from(*object));
    let entries: Result<Vec<u32>, String> =
        objects.map(|object| map::slot(catalogue, mapping.direction, object)).collect();
    let entries = entries.map_err(Failure::Usage)?;
    map::fitting_bits(&entries)?;
    let session = &mut context.session;
    let before = pdo.mapped(session)?;
    let cob_id = match mapping.cob_id {
        Some(id) if (0x001..0x800).contains(&id) => before.cob_id & !0x7FF | u32::from(id),
        Some(id) => return Err(Failure::Usage(format!("{id:X}h is no CAN-ID of 11 bits"))),
        None => before.cob_id,
    };
    let transmission = mapping.transmission.or(before.transmission);
    let wanted = Mapped { cob_id: cob_id & !OFF, entries, transmission };
    let time = |sub, time: Option<u16>| time.map(|time| (sub, time.to_le_bytes().to_vec()));
    let times: Vec<_> = [time(3, mapping.inhibit), time(5, mapping.event)].into_iter().flatten().collect();
    pdo.set_times(&mut context.session, &before, &times)?;
    pdo.remap(&mut context.session, &before, &wanted)
}
