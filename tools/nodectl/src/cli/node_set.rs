//! The nodes that a command is for.

use std::collections::BTreeSet;
use std::str::FromStr;

use canopen::NodeId;

use super::Failure;

/// One node, several nodes, or all nodes on the bus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NodeSet {
    /// All nodes on the bus.
    All,
    /// These nodes, at least one.
    These(BTreeSet<NodeId>),
}

impl NodeSet {
    /// The nodes by number; an error for all nodes, because there is no list of them.
    pub(super) fn list(&self) -> Result<Vec<NodeId>, Failure> {
        match self {
            NodeSet::All => Err(Failure::Usage("this command needs node-IDs".to_owned())),
            NodeSet::These(nodes) => Ok(nodes.iter().copied().collect()),
        }
    }

    /// The single node; an error for several nodes.
    pub(super) fn one(&self) -> Result<NodeId, Failure> {
        match self.list()?.as_slice() {
            [node] => Ok(*node),
            _ => Err(Failure::Usage("this command is for one node".to_owned())),
        }
    }
}

impl FromStr for NodeSet {
    type Err = String;

    fn from_str(text: &str) -> Result<NodeSet, String> {
        if text == "all" {
            return Ok(NodeSet::All);
        }
        let parts: Option<Vec<BTreeSet<NodeId>>> = text.split(',').map(range).collect();
        let nodes = parts.map(|parts| parts.into_iter().flatten().collect());
        nodes.map(NodeSet::These).ok_or_else(|| format!("{text:?} is no list of node-IDs, as 5 or 1,2,5-8"))
    }
}

fn range(text: &str) -> Option<BTreeSet<NodeId>> {
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    let id = |text: &str| NodeId::new(text.trim().parse().ok()?);
    let (first, last) = (id(first)?, id(last)?);
    (first <= last).then(|| (first.get()..=last.get()).filter_map(NodeId::new).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_and_ranges() {
        let list = |text: &str| -> Vec<u8> {
            text.parse::<NodeSet>().unwrap().list().unwrap().into_iter().map(NodeId::get).collect()
        };
        assert_eq!(list("5"), [5]);
        assert_eq!(list("1,2,5-8"), [1, 2, 5, 6, 7, 8]);
        assert_eq!(list("8, 1-3,2"), [1, 2, 3, 8]);
        assert_eq!("all".parse(), Ok(NodeSet::All));
        for text in ["", "0", "128", "1,", "3-1", "1-", "x", "1-2-3", "ALL"] {
            assert!(text.parse::<NodeSet>().is_err(), "{text}");
        }
    }
}
