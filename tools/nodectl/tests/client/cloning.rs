//! A configuration is moved to other boards: dump, apply, diff, for every parameter of every personality.

use std::collections::BTreeMap;

use canopen::dictionary::{Access, DefaultValue, Group, Mapping, Object, Type};
use canopen::sdo::Multiplexer;
use node::Personality;
use nodectl::object::at;

use crate::commands::{failed, printed, run};
use crate::pressure::Pressure;
use crate::wire::{Wire, client};

const PERSONALITIES: [Personality; 4] =
    [Personality::Pressure, Personality::Encoder, Personality::Combined, Personality::Lift];
const NODE_IDS: [u8; 3] = [1, 16, 127];
/// Stored, and yet no configuration: presets and the tare.
const ACTS: [u16; 4] = [0x6003, 0x6010, 0x6382, 0x6486];

/// The values of a node, by index and sub-index.
type Values = BTreeMap<(u16, u8), Vec<u8>>;

struct Board {
    wire: Wire<Pressure>,
    personality: Personality,
    id: u8,
}

impl Board {
    fn new(personality: Personality, id: u8) -> Board {
        Board { wire: Wire::new(Pressure::of(personality, id)), personality, id }
    }

    fn run(&self, line: &[&str]) -> String {
        printed(&self.wire, &[line, &["-n", &self.id.to_string()]].concat())
    }

    fn read(&self, at: Multiplexer) -> Vec<u8> {
        client(&mut self.wire.network(), self.id).upload(at).unwrap_or_default()
    }

    fn write(&self, at: Multiplexer, bytes: &[u8]) -> bool {
        client(&mut self.wire.network(), self.id).download(at, bytes, |_| ()).is_ok()
    }

    /// The table, not the data sheet: a parameter that the data sheet leaves out is noticed.
    fn parameters(&self) -> impl Iterator<Item = &'static Object> {
        let is_parameter = |row: &&Object| {
            let is_stored = matches!(row.group, Some(Group::Communication | Group::Application));
            is_stored && row.access == Access::ReadWrite && !ACTS.contains(&row.index)
        };
        self.personality.rows().iter().filter(is_parameter)
    }

    /// The stored values. COB-IDs are relative to the node-ID where they equal the pre-defined one.
    fn values(&self) -> Values {
        let value = |row: &Object| {
            let mut bytes = self.read(at(row.index, row.sub));
            if let (DefaultValue::NodeId(base), Ok(word)) = (row.default, <[u8; 4]>::try_from(&bytes[..])) {
                let (word, id) = (u32::from_le_bytes(word), u32::from(self.id));
                let follows = word & 0x7FF == (base & 0x7FF) + id;
                bytes = (if follows { word - id } else { word }).to_le_bytes().to_vec();
            }
            ((row.index, row.sub), bytes)
        };
        self.parameters().map(value).collect()
    }

    /// Gives every parameter another value, where one can be found that the node takes. Saves and restarts.
    fn change_everything(&self) {
        for row in self.parameters() {
            let place = at(row.index, row.sub);
            let now = self.read(place);
            candidates(row, self.id)
                .into_iter()
                .filter(|bytes| *bytes != now)
                .find(|bytes| self.write(place, bytes));
        }
        self.run(&["save"]);
        self.run(&["nmt", "reset"]);
    }
}

/// Values that a node may take for a parameter, in the order in which they are tried.
fn candidates(row: &Object, id: u8) -> Vec<Vec<u8>> {
    let default = match row.default {
        DefaultValue::Integer(value) => value,
        DefaultValue::NodeId(base) => i64::from(base) + i64::from(id),
        DefaultValue::Real(value) => {
            return [value + 1.5, 0.5, 2.0].map(|value| value.to_le_bytes().to_vec()).into();
        }
        DefaultValue::Text(_) | DefaultValue::None => return Vec::new(),
    };
    let size = usize::from(row.kind.size());
    let (low, high) = row.limits.unwrap_or((default, default));
    let cob_id = [default ^ 1 << 31, 0x8000_01FA, default ^ 1 << 30];
    let mapped = [0x0005_0008_i64];
    let watched = [i64::from(id % 127 + 1) << 16 | 700];
    let plain = [default + 1, default ^ 1, low, high, default - 1, 2, 8, 5];
    let first: &[i64] = match row.index {
        0x1400..=0x15FF | 0x1800..=0x19FF if row.sub == 1 => &cob_id,
        0x1014 => &[0x4000_0000],
        0x1600..=0x17FF | 0x1A00..=0x1BFF if row.sub > 0 => &mapped,
        0x1016 => &watched,
        0x6131 => &[0xFD4E_0000, 0x0005_0000],
        _ => &[],
    };
    let all = first.iter().chain(&plain).filter(|value| row.kind == Type::Integer32 || **value >= 0);
    all.map(|value| value.to_le_bytes()[..size.min(8)].to_vec()).collect()
}

fn path(name: &str) -> String {
    format!("{}/{name}.dcf", env!("CARGO_TARGET_TMPDIR"))
}

fn different(first: &Values, second: &Values) -> Vec<String> {
    let differs = |(key, value): &(&(u16, u8), &Vec<u8>)| second.get(*key) != Some(*value);
    let name = |((index, sub), value): (&(u16, u8), &Vec<u8>)| {
        format!("{index:04X}h:{sub} {value:X?} {:X?}", second.get(&(*index, *sub)))
    };
    first.iter().filter(differs).map(name).collect()
}

/// The share of the parameters that can be changed, in percent: mapped objects of PDOs that are on cannot, for example.
const CHANGED: usize = 60;

#[test]
fn every_parameter_survives_dump_and_apply_on_boards_of_every_node_id_and_the_way_back() {
    for (number, personality) in PERSONALITIES.into_iter().enumerate() {
        for id in NODE_IDS {
            let context = format!("{personality:?} {id}");
            let board = Board::new(personality, id);
            let (factory, configured) =
                (path(&format!("factory-{number}-{id}")), path(&format!("all-{number}-{id}")));
            let defaults = board.values();
            board.run(&["dump", &factory]);
            board.change_everything();
            let wanted = board.values();
            let changed = different(&wanted, &defaults).len();
            assert!(100 * changed >= CHANGED * wanted.len(), "{context}: {changed} of {}", wanted.len());
            board.run(&["dump", &configured]);
            for other in NODE_IDS {
                let fresh = Board::new(personality, other);
                let (code, text) = failed(&fresh.wire, &["diff", &configured, "-n", &other.to_string()]);
                assert_eq!((code, text), (8, format!("{changed} parameters differ")), "{context}");
                fresh.run(&["apply", &configured, "--save"]);
                fresh.run(&["nmt", "reset"]);
                assert_eq!(different(&wanted, &fresh.values()), [""; 0], "{context} to {other}");
                assert_eq!(fresh.run(&["diff", &configured]), "", "{context} to {other}");
            }
            // In the other direction.
            board.run(&["apply", &factory, "--save"]);
            board.run(&["nmt", "reset"]);
            assert_eq!(different(&defaults, &board.values()), [""; 0], "{context} back");
            assert_eq!(board.run(&["diff", &factory]), "", "{context} back");
        }
    }
}

#[test]
fn a_cob_id_that_follows_the_node_id_is_dumped_as_a_formula() {
    for personality in [Personality::Pressure, Personality::Encoder, Personality::Combined] {
        let (board, file) = (Board::new(personality, 1), path(&format!("following-{personality:?}")));
        let carried =
            board.personality.rows().iter().rfind(|row| row.mapping == Mapping::Tpdo).expect("a value");
        board.run(&["map", "tpdo", "2", &format!("{:04X}:{}", carried.index, carried.sub)]);
        board.run(&["write", "1400:1", "0x80000185"]);
        board.run(&["dump", "--all", &file]);
        let text = std::fs::read_to_string(&file).expect("a file");
        assert!(text.contains("ParameterValue=$NODEID+0x280\r\n"), "{personality:?}");
        assert!(
            text.contains("ParameterValue=0x80000185\r\n"),
            "{personality:?}: the COB-ID of another node stays"
        );
        let other = Board::new(personality, 2);
        other.run(&["apply", &file]);
        assert!(other.run(&["read", "1801:1"]).contains("(00000282h)"), "{personality:?}");
        assert!(other.run(&["read", "1400:1"]).contains("(80000185h)"), "{personality:?}");
        // A file of an earlier version, or of another tool, has numbers.
        std::fs::write(&file, text.replace("$NODEID+0x280", "0x00000281")).expect("a file");
        assert_eq!(other.run(&["diff", &file]), "", "{personality:?}");
        assert_eq!(board.run(&["diff", &file]), "", "{personality:?}");
    }
}

/// Commands and what makes the device act are in no file, and a file with values for them does not write them.
#[test]
fn commands_are_neither_dumped_nor_applied() {
    for personality in PERSONALITIES {
        let (board, file) = (Board::new(personality, 5), path(&format!("acts-{personality:?}")));
        board.run(&["dump", "--all", &file]);
        let text = std::fs::read_to_string(&file).expect("a file");
        let sheet = eds::Eds::parse(&text).expect("a sheet");
        let acting: Vec<_> = sheet
            .entries()
            .filter(|entry| entry.access.is_writable() && entry.flags.is_some_and(eds::Flags::refuse_write))
            .collect();
        for index in [0x1010, 0x1011, 0x1F51, 0x2000, 0x2002, 0x2003] {
            assert!(acting.iter().any(|entry| entry.index == index), "{personality:?}: {index:04X}h");
        }
        assert!(acting.iter().all(|entry| entry.value.is_none()), "{personality:?}");
        let index = format!("{:04X}", if personality == Personality::Lift { 0x6486 } else { 0x1010 });
        let flagged = text.replace(&format!("[{index}]"), &format!("[{index}]\r\nParameterValue=7"));
        std::fs::write(&file, flagged).expect("a file");
        let (lines, result) = run(&board.wire, &["apply", &file, "-n", "5"]);
        result.expect("applied");
        assert_eq!(lines, "node 5: has it already\n", "{personality:?}");
    }
}

/// A value that a node rejects is reported with the present value and the reason; all others are written.
#[test]
fn apply_reports_differences_with_their_reason() {
    for personality in PERSONALITIES {
        let (board, file) = (Board::new(personality, 5), path(&format!("refused-{personality:?}")));
        board.run(&["write", "1017", "777"]);
        board.run(&["dump", "--all", &file]);
        let text = std::fs::read_to_string(&file).expect("a file");
        // 1F80h takes 0 and 8, and 1029h:2 is written after it was refused.
        let (before, after) = text.split_once("[1F80]\r\n").expect("1F80h");
        let after = after.replacen("ParameterValue=0x00000000", "ParameterValue=0x00000003", 1);
        std::fs::write(&file, format!("{before}[1F80]\r\n{after}")).expect("a file");
        let fresh = Board::new(personality, 5);
        let (code, text) = failed(&fresh.wire, &["apply", &file, "-n", "5"]);
        let expected = "still different after it was written: 1F80h:0 is 0 instead of 3 (0609 0030h, invalid value for the parameter)";
        assert_eq!((code, text.as_str()), (1, expected), "{personality:?}");
        assert!(fresh.run(&["read", "1017"]).contains("= 777 ms"), "{personality:?}");
    }
}
