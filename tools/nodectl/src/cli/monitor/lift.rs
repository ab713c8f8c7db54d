//! `nodectl monitor --lift`: a line for each value in a pre-defined PDO of a lift, from any node.

use std::fmt;

use canopen::sdo::Multiplexer;
use canopen::{Duration, Instant};
use serde::Serialize;

use super::SILENCE;
use crate::cli::read::place;
use crate::cli::record::seconds_between;
use crate::cli::{Failure, Session};
use crate::lift::{Lift, Reading};
use crate::text::note;
use crate::value::Value;

/// The time-out of one wait for a frame; then the next wait begins.
const PATIENCE: Duration = Duration::from_millis(1000);

/// A value as a line of the output.
#[derive(Serialize)]
struct Line {
    time: f64,
    can_id: u16,
    pdo: &'static str,
    /// The producer; `null` where it does not follow from the CAN-ID.
    producer: Option<u8>,
    #[serde(rename = "object", serialize_with = "place")]
    at: Multiplexer,
    name: String,
    value: Value,
}

/// Prints `count` values.
pub(super) fn print_lines(session: &mut Session, count: usize) -> Result<(), Failure> {
    let (lift, mut start, mut left) = (Lift::default(), None, count);
    let (begin, mut hinted) = (session.network.now(), false);
    while left > 0 {
        let until = session.network.now() + PATIENCE;
        let received = session.network.receive(until)?;
        let is_silent = start.is_none() && session.network.now() >= begin + SILENCE;
        if is_silent && !std::mem::replace(&mut hinted, true) {
            note("waiting for the pre-defined PDOs of a lift (CiA 417)");
        }
        let Some(received) = received else { continue };
        for reading in lift.readings(&received.frame).into_iter().take(left) {
            let start = *start.get_or_insert(received.at);
            session.print(&line(received.frame.id(), reading, start, received.at))?;
            left -= 1;
        }
    }
    Ok(())
}

fn line(can_id: u16, reading: Reading, start: Instant, now: Instant) -> Line {
    let Reading { pdo, producer, at, name, value } = reading;
    Line { time: seconds_between(start, now), can_id, pdo, producer, at, name, value }
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Line { time, can_id, pdo, producer, at, name, value } = self;
        write!(f, "{time:10.6} {can_id:03X}h {pdo}")?;
        if let Some(producer) = producer {
            write!(f, " of node {producer}")?;
        }
        // An unknown object has no name: print its address.
        match name.as_str() {
            "" => write!(f, ": {:04X}h:{} = {value}", at.index, at.sub),
            name => write!(f, ": {name} = {value}"),
        }
    }
}
