//! Texts of a vendor's device in a configuration file: a file has no quotes, so some texts cannot stand in it.

use canopen::NodeId;
use eds::{Commissioning, Eds, Reals};
use nodectl::configuration::Configuration;
use nodectl::object::at;
use nodectl::simulate::{Node, Table};

use crate::commands::{printed, run};
use crate::simulate::corpus;
use crate::wire::{Wire, client};

const NAME: canopen::sdo::Multiplexer = at(0x2F00, 0);

fn text() -> String {
    let text = std::fs::read_to_string(corpus("plain-encoder.eds")).expect("a data sheet");
    text + "\n[2F00]\nParameterName=Label\nDataType=9\nAccessType=rw\nDefaultValue=hello\n"
        + "\n[2F01]\nParameterName=Key\nDataType=0xA\nAccessType=rw\nDefaultValue=01 02\n"
}

/// A device of the data sheet with another default of its text.
fn device(label: &str) -> Wire<Node> {
    let node = NodeId::new(5);
    let text = text().replace("=hello", &format!("={label}"));
    Wire::new(Node::new(Table::new(&Eds::parse(&text).expect("a data sheet"), node).expect("a table"), node))
}

fn label(wire: &Wire<Node>) -> Vec<u8> {
    client(&mut wire.network(), 5).upload(NAME).expect("a text")
}

#[test]
fn a_text_is_cloned_or_left_alone() {
    let (sheet, file) = (path("texts.eds"), path("texts.dcf"));
    std::fs::write(&sheet, text()).expect("a file");
    for (value, is_cloned) in [
        ("plain text", true),
        ("a;b", true),
        ("a = b [c] \"d\"", true),
        ("a ; b", false),
        (" x ", false),
        (";abc", false),
        ("", false),
        ("two\nlines", false),
        ("two\r\n[2F01]", false),
        ("$NODEID+1", true),
        ("0x12", true),
    ] {
        let (from, to) = (device("hello"), device("other"));
        client(&mut from.network(), 5).download(NAME, value.as_bytes(), |_| ()).expect("a write");
        printed(&from, &["dump", &file, "-n", "5", "--eds", &sheet]);
        let (lines, result) = run(&to, &["apply", &file, "-n", "5"]);
        assert!(result.is_ok(), "{value:?}: {lines}{}", result.unwrap_err());
        let expected = if is_cloned { value } else { "other" };
        assert_eq!(String::from_utf8_lossy(&label(&to)), expected, "{value:?}");
        let code =
            run(&from, &["diff", &file, "-n", "5"]).1.map_or_else(|failure| failure.exit_code(), |()| 0);
        assert_eq!(
            code,
            if is_cloned { 0 } else { 8 },
            "{value:?}: the file has the value, or it is missing there"
        );
    }
}

/// The command reports these objects.
#[test]
fn the_values_that_a_file_cannot_have_are_named() {
    let sheet = Eds::parse(&text()).expect("a data sheet");
    let node = NodeId::new(5).expect("a node-ID");
    let read = |label: &'static [u8], key: &'static [u8]| {
        let bytes = move |at| match at {
            NAME => label.to_vec(),
            _ if at.index == 0x2F01 => key.to_vec(),
            _ => vec![0; 8],
        };
        Configuration::of_node(|at| Ok(bytes(at)), &sheet, |_, _| ()).expect("values")
    };
    for (label, key, left_out) in [
        (&b"hello"[..], &[1, 2][..], &[][..]),
        (b"padded\0\0", &[3], &[]),
        (b" x", &[3], &[0x2F00]),
        (b"", &[], &[0x2F00, 0x2F01]),
        // Latin-1.
        (b"caf\xE9", &[3], &[0x2F00]),
    ] {
        for all in [false, true] {
            let commissioning = Commissioning { node_id: 5, ..Commissioning::default() };
            let values = read(label, key);
            let dcf = values.to_dcf(&sheet, "a.dcf", commissioning, all, Reals::Decimal);
            let named: Vec<u16> = dcf.left_out.iter().map(|at| at.index).collect();
            assert_eq!(named, left_out, "{label:?}");
            let file = Configuration::of_sheet(&Eds::parse(&dcf.text).expect("a file"), node);
            for key in [0x2F00, 0x2F01] {
                let expected = values.values.get(&(key, 0)).filter(|_| !left_out.contains(&key));
                assert_eq!(file.values.get(&(key, 0)), expected, "{key:04X}h");
            }
        }
    }
}

fn path(name: &str) -> String {
    format!("{}/{name}", env!("CARGO_TARGET_TMPDIR"))
}
