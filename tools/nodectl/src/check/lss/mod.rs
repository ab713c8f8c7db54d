//! Checks of layer setting services (CiA 305). The device is selected by its identity, so that other slaves are not
//! affected.

mod configure;
mod select;

use super::Check;
use super::prelude::{Outcome, Stop, Subject, fail, skip};
use canopen::lss::{Identity, Part, Request, Response};

pub(super) const CHECKS: &[&[Check]] = &[select::CHECKS, configure::CHECKS];

/// The CAN-IDs of the services.
const REQUEST: u16 = 0x7E5;
const RESPONSE: u16 = 0x7E4;

/// The time-out for a slave's response. CiA 305 sets no shorter time.
const TIME: u64 = 500;

/// The identity of the device by SDO.
fn identity(s: &mut Subject<'_>) -> Outcome<Identity> {
    for sub in 1..=4 {
        s.need(0x1018, sub)?;
    }
    Ok(Identity {
        vendor: s.number(0x1018, 1)?,
        product: s.number(0x1018, 2)?,
        revision: s.number(0x1018, 3)?,
        serial: s.number(0x1018, 4)?,
    })
}

/// Sends a request. Returns the eight bytes of the response, if one has come.
fn ask(s: &mut Subject<'_>, request: [u8; 8]) -> Outcome<Option<Vec<u8>>> {
    let mark = s.mark();
    s.send(REQUEST, &request)?;
    Ok(s.next(mark, RESPONSE, TIME)?.map(|heard| heard.frame.data().to_vec()))
}

/// Switches all slaves back to the state Waiting.
fn release(s: &mut Subject<'_>) -> Outcome {
    s.send(REQUEST, &Request::SwitchGlobal { configuration: false }.encode())?;
    s.pass(20)
}

/// Selects a slave by an identity. Returns the response, if one has come.
fn select(s: &mut Subject<'_>, identity: Identity) -> Outcome<Option<Vec<u8>>> {
    release(s)?;
    let mark = s.mark();
    for part in Part::ALL {
        s.send(REQUEST, &Request::Select(part, identity.part(part)).encode())?;
    }
    Ok(s.next(mark, RESPONSE, TIME)?.map(|heard| heard.frame.data().to_vec()))
}

/// Selects the device, runs a function, and releases the device. Skipped where the device is no LSS slave.
fn selected(s: &mut Subject<'_>, does: impl FnOnce(&mut Subject<'_>) -> Outcome) -> Outcome {
    let identity = identity(s)?;
    let is_declared = s.sheet().is_ok_and(|sheet| sheet.device.lss);
    match select(s, identity)? {
        Some(_) => (),
        None if is_declared => {
            return Err(fail("the device is an LSS slave, as its data sheet says", "no answer"));
        }
        None => return Err(skip("the device is no LSS slave: nothing answers to its identity")),
    }
    // Requests of LSS are short, and the device may not stay selected or with another pending node-ID.
    s.sheltered(|s| {
        let done = does(s);
        release(s)?;
        done
    })
}

/// Sends a request and demands a response.
fn respond(s: &mut Subject<'_>, request: Request) -> Outcome<Response> {
    let answer = ask(s, request.encode())?;
    let parsed = answer.as_ref().and_then(|answer| Response::parse(answer.as_slice().try_into().ok()?));
    parsed.ok_or_else(|| fail(format!("a response of eight bytes to {request:?}"), format!("{answer:02X?}")))
}

/// Sends a request and demands that no response comes.
fn stays_silent(s: &mut Subject<'_>, request: &[u8]) -> Result<(), Stop> {
    let mark = s.mark();
    s.send(REQUEST, request)?;
    match s.next(mark, RESPONSE, TIME)? {
        None => Ok(()),
        Some(heard) => {
            Err(fail(format!("no response to {request:02X?}"), format!("{:02X?}", heard.frame.data())))
        }
    }
}
