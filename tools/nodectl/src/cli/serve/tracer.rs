//! Decodes frames for the pages that show a trace.

use std::sync::Arc;

use canopen::{Frame, Instant, NodeId};
use serde::Serialize;

use crate::Catalogue;
use crate::text::hex_digits;
use crate::trace::{Decoder, Kind, Knowledge, Line, Shown, Transferred};
use crate::value::Value;

/// The number of rows between two events; further rows are only counted. A bus at 1 Mbit/s has 450 frames in this time.
const ROWS: usize = 1000;

/// A row in the form for an event.
pub(super) struct Row {
    pub(super) kind: Kind,
    pub(super) node: Option<NodeId>,
    pub(super) json: String,
}

/// The decoder, and the rows since the last event.
#[derive(Default)]
pub(super) struct Tracer {
    decoder: Decoder,
    pub(super) rows: Vec<Row>,
    /// The number of rows that were dropped.
    pub(super) lost: u64,
}

#[derive(Serialize)]
struct Shape<'l> {
    t: f64,
    id: u32,
    kind: Kind,
    node: Option<u8>,
    text: &'l str,
    data: String,
    sent: bool,
    values: Vec<Cell<'l>>,
    abort: Option<u32>,
}

#[derive(Serialize)]
struct Cell<'l> {
    index: u16,
    sub: u8,
    name: &'l str,
    value: Option<&'l Value>,
    unit: &'l str,
    meaning: Option<&'l str>,
}

impl Tracer {
    /// Takes the catalogue of a node. The decoder assumes default values until the trace shows others.
    pub(super) fn know(&mut self, node: NodeId, catalogue: &Arc<Catalogue>) {
        self.decoder.know(node, Knowledge::new(Arc::clone(catalogue)));
    }

    /// Takes the values that a survey has read from a node.
    pub(super) fn learn(&mut self, node: NodeId, knowledge: Knowledge) {
        self.decoder.know(node, knowledge);
    }

    /// Takes the value in a transfer, so that a later trace decodes with it.
    pub(super) fn hear(&mut self, node: NodeId, ended: &Transferred) {
        self.decoder.hear(node, ended);
    }

    /// Takes a frame from the bus, or one that this program has sent.
    pub(super) fn on_frame(&mut self, frame: &Frame, stamp: Instant, t: f64, sent: bool) {
        for line in self.decoder.on_frame(frame, stamp) {
            if self.rows.len() < ROWS {
                self.rows.push(row(&line, t, sent));
            } else {
                self.lost += 1;
            }
        }
    }

    /// The rows since the last call, and the number of dropped rows.
    pub(super) fn take(&mut self) -> (Vec<Row>, u64) {
        (std::mem::take(&mut self.rows), std::mem::take(&mut self.lost))
    }
}

fn row(line: &Line, t: f64, sent: bool) -> Row {
    let shape = Shape {
        t,
        id: line.id,
        kind: line.kind,
        node: line.node.map(NodeId::get),
        text: &line.text,
        data: hex_digits(&line.data, ""),
        sent,
        values: line.values.iter().map(Cell::of).collect(),
        abort: line.abort,
    };
    Row { kind: line.kind, node: line.node, json: serde_json::to_string(&shape).unwrap_or_default() }
}

impl Cell<'_> {
    fn of(shown: &Shown) -> Cell<'_> {
        Cell {
            index: shown.at.index,
            sub: shown.at.sub,
            name: &shown.name,
            value: shown.value.as_ref(),
            unit: &shown.unit,
            meaning: shown.meaning.as_deref(),
        }
    }
}
