//! Checks of the services that switch the state, inquire and identify.

use canopen::lss::{Bound, Identity, Part, Request, Response};

use super::super::prelude::*;
use super::{identity, release, respond, select, selected, stays_silent};

pub(super) const CHECKS: &[Check] = &[
    Check::new("LSS-01", "Selecting by identity is answered by 44h", "CiA 305, 3.9.2", answers),
    Check::new("LSS-02", "Another vendor-ID selects nobody", "CiA 305, 3.9.2", another::<0>),
    Check::new("LSS-03", "Another product code selects nobody", "CiA 305, 3.9.2", another::<1>),
    Check::new("LSS-04", "Another revision number selects nobody", "CiA 305, 3.9.2", another::<2>),
    Check::new("LSS-05", "Another serial number selects nobody", "CiA 305, 3.9.2", another::<3>),
    Check::new("LSS-06", "LSS tells the vendor-ID of 1018h", "CiA 305, 3.11.1", tells::<0>),
    Check::new("LSS-07", "LSS tells the product code of 1018h", "CiA 305, 3.11.1", tells::<1>),
    Check::new("LSS-08", "LSS tells the revision number of 1018h", "CiA 305, 3.11.1", tells::<2>),
    Check::new("LSS-09", "LSS tells the serial number of 1018h", "CiA 305, 3.11.1", tells::<3>),
    Check::new("LSS-10", "LSS tells the node-ID", "CiA 305, 3.11.2", node_id),
    Check::new("LSS-11", "In the state waiting nothing is told", "CiA 305, 3.7", waiting),
    Check::new("LSS-12", "A slave in the range is identified", "CiA 305, 3.12.1", in_range::<true>)
        .recommended(),
    Check::new("LSS-13", "A slave out of the range is not", "CiA 305, 3.12.1", in_range::<false>),
    Check::new("LSS-14", "A slave with a node-ID is not told as unconfigured", "CiA 305, 3.12.2", configured),
    Check::new("LSS-15", "Unused bytes of a response are 0", "CiA 305, 3.9.2", reserved),
];

fn answers(s: &mut Subject<'_>) -> Outcome {
    selected(s, |s| {
        let identity = identity(s)?;
        let answer = select(s, identity)?.unwrap_or_default();
        ensure(
            answer.first() == Some(&0x44) && answer.len() == 8,
            "eight bytes from 44h on",
            format!("{answer:02X?}"),
        )
    })
}

/// The identity with another value in one part.
fn other_identity(identity: Identity, part: usize) -> Identity {
    match part {
        0 => Identity { vendor: identity.vendor ^ 1, ..identity },
        1 => Identity { product: identity.product ^ 1, ..identity },
        2 => Identity { revision: identity.revision ^ 1, ..identity },
        _ => Identity { serial: identity.serial ^ 1, ..identity },
    }
}

fn another<const PART: usize>(s: &mut Subject<'_>) -> Outcome {
    selected(s, |s| {
        let identity = other_identity(identity(s)?, PART);
        let answer = select(s, identity)?;
        ensure(answer.is_none(), "no answer", format!("{answer:02X?}"))
    })
}

fn tells<const PART: usize>(s: &mut Subject<'_>) -> Outcome {
    selected(s, |s| {
        let part = Part::ALL[PART];
        let expected = Response::Identity(part, identity(s)?.part(part));
        let seen = respond(s, Request::Inquire(part))?;
        ensure(seen == expected, format!("{expected:X?}"), format!("{seen:X?}"))
    })
}

fn node_id(s: &mut Subject<'_>) -> Outcome {
    selected(s, |s| {
        let expected = Response::NodeIdIs(s.node().get());
        let seen = respond(s, Request::InquireNodeId)?;
        ensure(seen == expected, format!("{expected:?}"), format!("{seen:?}"))
    })
}

fn waiting(s: &mut Subject<'_>) -> Outcome {
    selected(s, release)?;
    stays_silent(s, &Request::InquireNodeId.encode())?;
    stays_silent(s, &Request::Inquire(Part::ALL[0]).encode())
}

fn in_range<const IS_IN: bool>(s: &mut Subject<'_>) -> Outcome {
    selected(s, |_| Ok(()))?;
    let own = identity(s)?;
    let (low, high) = if IS_IN { (own.serial, own.serial) } else { (own.serial ^ 1, own.serial ^ 1) };
    let bounds = [
        (Bound::Vendor, own.vendor),
        (Bound::Product, own.product),
        (Bound::RevisionLow, own.revision),
        (Bound::RevisionHigh, own.revision),
        (Bound::SerialLow, low),
    ];
    for (bound, value) in bounds {
        s.send(super::REQUEST, &Request::Identify(bound, value).encode())?;
    }
    let last = Request::Identify(Bound::SerialHigh, high).encode();
    if !IS_IN {
        return stays_silent(s, &last);
    }
    let answer = super::ask(s, last)?.unwrap_or_default();
    ensure(answer.first() == Some(&0x4F), "4Fh", format!("{answer:02X?}"))
}

fn configured(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    selected(s, |_| Ok(()))?;
    stays_silent(s, &Request::IdentifyUnconfigured.encode())
}

fn reserved(s: &mut Subject<'_>) -> Outcome {
    selected(s, |s| {
        let answer = super::ask(s, Request::InquireNodeId.encode())?.unwrap_or_default();
        ensure(
            answer.len() == 8 && answer[2..] == [0; 6],
            "six bytes of 0 at the end",
            format!("{answer:02X?}"),
        )
    })
}
