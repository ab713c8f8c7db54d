//! Tests that no text makes the reader panic.

use std::sync::LazyLock;

use canopen::NodeId;
use eds::{DEVICES, Edition, Eds, LookupError, address};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::string::string_regex;
use proptest::test_runner::RngSeed;

static SHEET: LazyLock<String> = LazyLock::new(|| DEVICES[0].sheet(&Edition::default()));

/// Every run draws the same cases.
fn repeatable() -> ProptestConfig {
    ProptestConfig { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() }
}

/// The start of a section without errors so far.
fn section() -> impl Strategy<Value = String> {
    let name = "DeviceInfo|[12][0-9a-fA-F]{3}|2000|2000sub[0-9a-f]{1,2}|2000(Name|Value)|[ -~]{0,8}";
    string_regex(name)
        .unwrap()
        .prop_map(|name| format!("[{name}]\nParameterName=A\nDataType=5\nAccessType=rw"))
}

/// A line that reaches deep into the reader, with any text as the value.
fn line() -> impl Strategy<Value = String> {
    let key = "(ObjectType|DataType|AccessType|DefaultValue|LowLimit|PDOMapping|CompactSubObj|SubNumber|[0-9]{1,3})";
    let value = r"([789]|rw|0x[0-9A-F]{1,4}|-?[0-9]{1,45}|\$NODEID( ?\+ ?0x[0-9a-f]{1,4})?|\PC{0,12})";
    string_regex(&format!(r"{key} ?= ?{value}|{key}={value}|\PC{{0,20}}")).unwrap()
}

proptest! {
    #![proptest_config(repeatable())]

    #[test]
    fn any_text_is_read_or_refused(text in "\\PC{0,200}|(\\PC|\n|\r|\\[|\\]|=|;){0,200}") {
        let _ = Eds::parse(&text);
        let _ = address(&text);
    }

    #[test]
    fn any_bytes_are_read_or_refused(bytes in vec(any::<u8>(), 0..200)) {
        let _ = Eds::from_bytes(&bytes);
    }

    #[test]
    fn any_lines_are_read_or_refused(lines in vec(prop_oneof![section(), line()], 0..12)) {
        let start = "[2000]\nParameterName=A\nDataType=5\nAccessType=rw\n";
        if let Ok(eds) = Eds::parse(&format!("{start}{}", lines.join("\n"))) {
            for entry in eds.entries() {
                let _ = entry.default.as_ref().map(|value| value.evaluate(NodeId::new(127).unwrap()));
                let found = eds.find(&eds.path(entry));
                prop_assert!(matches!(found, Ok(_) | Err(LookupError::Ambiguous { .. })), "{found:?}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, ..repeatable() })]

    /// A data sheet that lost a piece, as after a broken transfer.
    #[test]
    fn a_damaged_sheet_is_read_or_refused(start in 0_usize..60_000, length in 1_usize..200) {
        let mut sheet = SHEET.clone().into_bytes();
        let start = start.min(sheet.len());
        let end = (start + length).min(sheet.len());
        sheet.drain(start..end);
        let _ = Eds::from_bytes(&sheet);
    }
}
