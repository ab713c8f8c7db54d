//! Jobs: the nodes on the bus, their identities, and commands to them.

use std::sync::Arc;

use canopen::{Duration, NodeId};
use serde_json::{Value as Json, json};

use super::{Context, Job, Learned};
use crate::cli::Failure;
use crate::cli::nmt::Command;
use crate::cli::serve::nodes::Identity;
use crate::cli::sheets::{fits, misfit};
use crate::cli::store::{Group, Order, sign};
use crate::object::at;
use crate::{Catalogue, heartbeat, nmt};

/// How long to wait for answers after the last question.
const LISTEN: Duration = Duration::from_millis(200);
/// How long a node may take to show the effect of a command.
const EFFECT: Duration = Duration::from_millis(2000);

/// Asks all node-IDs for an answer.
pub(in crate::cli::serve) fn scan() -> Job {
    Job::of_services(|context| {
        let found = crate::scan::scan(&mut context.session.network, LISTEN)?;
        found.keys().for_each(|node| context.learned(*node, Learned::Present));
        let found: Vec<u8> = found.keys().map(|node| node.get()).collect();
        Ok(json!({ "found": found }))
    })
}

/// Asks a node for its identity.
pub(in crate::cli::serve) fn identify(node: NodeId) -> Job {
    Job::of_node(node, move |context| {
        context.session.begin();
        let (identity, catalogue) = identity(context, node)?;
        context.learned(node, Learned::Identity(identity, catalogue));
        Ok(Json::Null)
    })
}

fn identity(context: &mut Context, node: NodeId) -> Result<(Identity, Arc<Catalogue>), Failure> {
    let session = &mut context.session;
    let device_type = session.word(node, at(0x1000, 0))?;
    let mut words = [None; 4];
    for (word, sub) in words.iter_mut().zip(1..) {
        *word = session.word(node, at(0x1018, sub))?;
    }
    let mut text = |index| session.text(node, index);
    let (name, hardware, version) = (text(0x1008)?, text(0x1009)?, text(0x100A)?);
    let [vendor, product, revision, serial] = words;
    // The device may have been exchanged, so only the present answers count.
    let catalogue = Arc::new(session.catalogue_of(node, (vendor, product))?);
    let personality =
        vendor.zip(product).and_then(|(vendor, product)| Catalogue::device_name(vendor, product));
    let file = session.sheets()?.file();
    let note =
        file.filter(|sheet| !fits(sheet, (vendor, product))).map(|sheet| misfit(sheet, (vendor, product)));
    let identity = Identity {
        name,
        personality,
        data_sheet: catalogue.is_of_a_device(),
        device_type,
        vendor,
        product,
        revision,
        serial,
        version,
        hardware,
        note,
    };
    Ok((identity, catalogue))
}

/// Sends an NMT command, and waits for its effect if the command is for one node.
pub(super) fn nmt(node: Option<NodeId>, command: Command) -> Job {
    let (specifier, _) = command.meaning();
    let work = move |context: &mut Context| {
        let network = &mut context.session.network;
        let state = match node {
            Some(node) => nmt::change(network, specifier, node, EFFECT)?,
            None => {
                nmt::send(network, specifier, None)?;
                None
            }
        };
        Ok(json!({ "state": state.map(heartbeat::words) }))
    };
    match node {
        Some(node) => Job::of_node(node, work),
        None => Job::of_services(work),
    }
}

/// Lets the node save parameters, or restore the defaults.
pub(super) fn store(node: NodeId, order: Order, group: Group) -> Job {
    Job::of_node(node, move |context| {
        sign(&mut context.session, node, order, group)?;
        Ok(json!({}))
    })
}
