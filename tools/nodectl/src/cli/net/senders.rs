//! The CAN-IDs with which the nodes of a bus are configured to send.

use std::collections::{BTreeMap, BTreeSet};

use canopen::{CobId, NodeId};

use super::finding::{Finding, What};
use super::{Failure, Session, catalogue};
use crate::net::{Plan, PlannedNode};
use crate::object::at;
use crate::pdo_parameters::walk;

/// The nodes that send with each CAN-ID.
#[derive(Default)]
pub(super) struct Senders(BTreeMap<u16, BTreeSet<NodeId>>);

impl Senders {
    /// Reads the CAN-IDs of the valid TPDOs of a node.
    pub(super) fn read(&mut self, session: &mut Session, planned: &PlannedNode) -> Result<(), Failure> {
        let (node, catalogue) = (planned.node, catalogue(session, planned)?);
        walk(&catalogue, 0x1800, |pdo| {
            let cob_id = session.word(node, at(pdo.communication, 1))?;
            let valid = cob_id.and_then(CobId::parse).filter(|cob_id| !cob_id.bit31);
            if let Some(valid) = valid {
                self.0.entry(valid.id.get()).or_default().insert(node);
            }
            Ok(cob_id.is_some())
        })
    }

    /// The CAN-IDs of several nodes, without those that the file itself gives to several nodes.
    pub(super) fn findings(self, plan: &Plan) -> Vec<Finding> {
        let planned: BTreeSet<u16> = plan.shared_can_ids().into_iter().map(|(id, _)| id).collect();
        let shared = self.0.into_iter().filter(|(id, nodes)| nodes.len() > 1 && !planned.contains(id));
        let finding = |(id, nodes): (u16, BTreeSet<NodeId>)| {
            let text = format!("TPDOs of nodes {} are sent with {id:03X}h", listed(nodes));
            Finding { node: None, what: What::CanId, text }
        };
        shared.map(finding).collect()
    }
}

/// `3, 4`
pub(super) fn listed(nodes: impl IntoIterator<Item = NodeId>) -> String {
    let nodes: Vec<String> = nodes.into_iter().map(|node| node.get().to_string()).collect();
    nodes.join(", ")
}
