//! Checks of configuring node-ID and bit rate, without storing them.

use canopen::lss::{Request, Response};

use super::super::prelude::*;
use super::{respond, selected, stays_silent};

pub(super) const CHECKS: &[Check] = &[
    Check::new("LSS-20", "Node-ID 0 is refused", "CiA 305, 3.10.1", node_id::<0, 1>),
    Check::new("LSS-21", "Node-ID 128 is refused", "CiA 305, 3.10.1", node_id::<128, 1>),
    Check::new("LSS-22", "The own node-ID is taken", "CiA 305, 3.10.1", own_node_id),
    Check::new("LSS-23", "Node-ID 254 is refused", "CiA 305, 3.10.1", node_id::<254, 1>),
    Check::new("LSS-24", "A bit rate that no table has is refused", "CiA 305, 3.10.2", bit_timing::<0, 200>),
    Check::new("LSS-25", "A table that nobody has is refused", "CiA 305, 3.10.2", bit_timing::<100, 0>),
    Check::new("LSS-26", "The reserved bit rate is refused", "CiA 305, 3.10.2", bit_timing::<0, 5>),
    Check::new("LSS-27", "An unknown service is not answered", "CiA 305, 3.8", unknown),
    Check::new("LSS-28", "A request of seven bytes is not answered", "CiA 305, 3.8", short).recommended(),
    Check::new("LSS-29", "A device that LSS has selected still serves SDO", "CiA 305, 3.7", serves)
        .recommended(),
];

fn node_id<const ID: u8, const CODE: u8>(s: &mut Subject<'_>) -> Outcome {
    selected(s, |s| {
        let seen = respond(s, Request::NodeId(ID));
        // Sets the pending node-ID back to the one of the device.
        let own = s.node().get();
        respond(s, Request::NodeId(own))?;
        let seen = seen?;
        ensure(seen == Response::NodeId(CODE), format!("error code {CODE}"), format!("{seen:?}"))
    })
}

fn own_node_id(s: &mut Subject<'_>) -> Outcome {
    selected(s, |s| {
        let own = s.node().get();
        let seen = respond(s, Request::NodeId(own))?;
        ensure(seen == Response::NodeId(0), "error code 0", format!("{seen:?}"))
    })
}

fn bit_timing<const TABLE: u8, const INDEX: u8>(s: &mut Subject<'_>) -> Outcome {
    selected(s, |s| {
        let seen = respond(s, Request::BitTiming { table: TABLE, index: INDEX })?;
        let is_refused = matches!(seen, Response::BitTiming(1 | 0xFF));
        ensure(is_refused, "error code 1", format!("{seen:?}"))
    })
}

fn unknown(s: &mut Subject<'_>) -> Outcome {
    selected(s, |s| stays_silent(s, &[0x3A, 0, 0, 0, 0, 0, 0, 0]))
}

fn short(s: &mut Subject<'_>) -> Outcome {
    selected(s, |s| stays_silent(s, &[0x5E, 0, 0, 0, 0, 0, 0]))
}

fn serves(s: &mut Subject<'_>) -> Outcome {
    selected(s, |s| s.serves("its selection by LSS"))
}
