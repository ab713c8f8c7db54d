//! The table of the 290 pre-defined PDOs of CiA 417-3-1, tables/lift417.csv, in the corrected reading.

use crate::tables::Row;

const TABLE: &str = include_str!("../tables/lift417.csv");

/// A PDO of the table.
#[derive(Clone, Debug)]
pub struct Pdo {
    /// Whether the PDO is a TPDO.
    pub is_produced: bool,
    /// The number of the PDO.
    pub number: u16,
    /// Index of the communication parameter.
    pub communication: u16,
    /// Index of the mapping parameter.
    pub mapping: u16,
    /// CAN-ID; with `is_relative` the node-ID is added.
    pub base: u32,
    /// Whether the CAN-ID depends on the node-ID.
    pub is_relative: bool,
    /// Index, sub-index and bits of the mapped objects; none for a multiplexed PDO.
    pub objects: Vec<(u16, u8, u8)>,
}

impl Pdo {
    /// The CAN-ID of the PDO in a node.
    #[must_use]
    pub fn cob_id(&self, node_id: u8) -> u32 {
        self.base + if self.is_relative { node_id.into() } else { 0 }
    }

    /// The entries of the mapping parameter.
    #[must_use]
    pub fn entries(&self) -> Vec<u32> {
        let entry = |&(index, sub, bits): &(u16, u8, u8)| {
            u32::from(index) << 16 | u32::from(sub) << 8 | u32::from(bits)
        };
        self.objects.iter().map(entry).collect()
    }

    /// The number of mapped objects; 255 for a multiplexed PDO.
    #[must_use]
    pub fn count(&self) -> u8 {
        if self.objects.is_empty() { 0xFF } else { u8::try_from(self.objects.len()).expect("at most 64") }
    }

    /// The default flags of the COB-ID. TPDOs forbid remote frames, except for the multiplexed PDO. A PDO with the same
    /// CAN-ID in all nodes is off until the node is configured as the virtual device that sends it.
    #[must_use]
    pub fn flags(&self) -> u32 {
        match (self.is_produced, self.number) {
            (false, _) | (true, 2) => 0,
            (true, 258 | 263 | 264 | 385 | 386) => 0xC000_0000,
            (true, _) => 0x4000_0000,
        }
    }

    /// Whether a node in personality lift has the PDO: the node's units produce these TPDOs and consume these RPDOs.
    #[must_use]
    pub fn is_of_the_node(&self) -> bool {
        match self.is_produced {
            true => matches!(self.number, 2 | 130 | 258 | 263 | 264 | 385 | 386),
            false => matches!(self.number, 2..=8 | 257),
        }
    }
}

/// The PDO objects of the node: only flags, type and times are writable.
pub fn rows() -> impl Iterator<Item = Row> {
    pdos().filter(Pdo::is_of_the_node).flat_map(|pdo| [communication(&pdo), mapping(&pdo)].concat())
}

fn communication(pdo: &Pdo) -> Vec<Row> {
    let row = |sub, name, kind, access, default| Row {
        index: pdo.communication,
        sub,
        name,
        kind,
        access,
        default,
        mapping: "no",
    };
    let has_sync_start = pdo.is_produced && pdo.number != 2;
    let highest = if has_sync_start { "6" } else { "5" };
    let mut rows = vec![
        row(0, name(pdo, "communication"), "UNSIGNED8", "ro", highest),
        row(1, "COB-ID", "UNSIGNED32", "rw", cob_id(pdo)),
        row(2, "Transmission type", "UNSIGNED8", "rw", "255"),
        row(5, "Event timer", "UNSIGNED16", "rw", "0"),
    ];
    rows.extend(pdo.is_produced.then(|| row(3, "Inhibit time", "UNSIGNED16", "rw", "0")));
    rows.extend(has_sync_start.then(|| row(6, "SYNC start value", "UNSIGNED8", "rw", "0")));
    rows
}

fn cob_id(pdo: &Pdo) -> &'static str {
    let relative = if pdo.is_relative { "$NODEID+" } else { "" };
    format!("{relative}{:#X}", pdo.base | pdo.flags()).leak()
}

fn mapping(pdo: &Pdo) -> Vec<Row> {
    let row = |sub, name, kind, default: String| Row {
        index: pdo.mapping,
        sub,
        name,
        kind,
        access: "const",
        default: default.leak(),
        mapping: "no",
    };
    let entries = (1..).zip(pdo.entries());
    let mapped = entries.map(|(sub, entry)| row(sub, "Mapped object", "UNSIGNED32", format!("{entry:#X}")));
    let count = row(0, name(pdo, "mapping"), "UNSIGNED8", pdo.count().to_string());
    std::iter::once(count).chain(mapped).collect()
}

fn name(pdo: &Pdo, what: &str) -> &'static str {
    let direction = if pdo.is_produced { "TPDO" } else { "RPDO" };
    format!("{direction} {} {what} parameter", pdo.number).leak()
}

/// All PDOs of the table.
pub fn pdos() -> impl Iterator<Item = Pdo> {
    TABLE.lines().skip(1).map(parse)
}

fn parse(line: &str) -> Pdo {
    let cells: Vec<&str> = line.split(',').collect();
    let [direction, number, communication, mapping, cob_id, kind, inhibit, timer, objects] = cells[..] else {
        panic!("{line}")
    };
    assert_eq!([kind, inhibit, timer], ["0xFF", "0", "0"], "every pre-defined PDO has type FFh and no times");
    let base = cob_id.strip_suffix("+node-id");
    Pdo {
        is_produced: direction == "TPDO",
        number: number.parse().expect("a number"),
        communication: index(communication),
        mapping: index(mapping),
        base: hex(base.unwrap_or(cob_id)),
        is_relative: base.is_some(),
        objects: if objects == "multiplexed" { vec![] } else { objects.split(';').map(object).collect() },
    }
}

fn hex(text: &str) -> u32 {
    u32::from_str_radix(text.trim_start_matches("0x"), 16).expect("hexadecimal digits")
}

fn index(text: &str) -> u16 {
    hex(text).try_into().expect("an index")
}

fn object(text: &str) -> (u16, u8, u8) {
    let [index, sub, bits] = text.split(':').map(hex).collect::<Vec<_>>()[..] else { panic!("{text}") };
    (
        index.try_into().expect("an index"),
        sub.try_into().expect("a sub-index"),
        bits.try_into().expect("bits"),
    )
}
