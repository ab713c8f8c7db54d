//! Tests with data sheets of vendors.

use canopen::NodeId;
use eds::{
    Access, Commissioning, DEVICES, DataType, Eds, Entry, Error, Formula, ObjectType, Problem, Reals, Value,
};

/// A sheet with all deviations that the reader accepts.
const ODD: &str = "\u{FEFF}; a comment\r
[deviceinfo]\r
VendorNumber = 0x0000abcd ; lower case, spaces, a comment behind\r
ProductName=Drive ; 3 # 4\r
BaudRate_125=0x1\r
BaudRate_250=0\r
not a key\r
\r
[1000]\r
PARAMETERNAME=Device type\r
DataType=0x7\r
AccessType=RO\r
DefaultValue=0x000f0191\r
\r
[0005]\r
ParameterName=A data type\r
\r
[1800SUB1]\r
ParameterName=COB-ID\r
DataType=7\r
AccessType=rw\r
DefaultValue=0x180+$NodeID\r
\r
[ 1800 ]\r
ParameterName=TPDO\r
SubNumber=2\r
\r
[1003]\r
ParameterName=Error field\r
ObjectType=0x8\r
DataType=0x0007\r
AccessType=ro\r
PDOMapping=0\r
DefaultValue=7\r
CompactSubObj=3\r
[1003Name]\r
NrOfEntries=1\r
2=Second error\r
[1003Value]\r
NrOfEntries=2\r
3=$NODEID + 0x10\r
9=1\r
\r
[1f50]\r
ParameterName=Program\r
ObjectType=2\r
AccessType=wo\r
\r
[2000]\r
ParameterName=Offset\r
DataType=0x2\r
AccessType=rww\r
PDOMapping=1\r
LowLimit=0x80\r
HighLimit=\r
DefaultValue=0xFF\r
";

fn get(eds: &Eds, index: u16, sub: u8) -> &Entry {
    eds.get(index, sub).unwrap_or_else(|| panic!("{index:04X}h:{sub}"))
}

fn integer(value: i128) -> Option<Formula> {
    Some(Formula::Constant(Value::Integer(value)))
}

#[test]
fn odd_spelling_is_read() {
    let eds = Eds::parse(ODD).unwrap();
    assert_eq!((eds.device.vendor_number, &eds.device.product_name[..]), (0xABCD, "Drive"));
    assert_eq!(eds.device.bit_rates.iter().collect::<Vec<_>>(), [&125]);
    assert_eq!(eds.objects.keys().collect::<Vec<_>>(), [&0x1000, &0x1003, &0x1800, &0x1F50, &0x2000]);
    assert_eq!(get(&eds, 0x1000, 0).default, integer(0xF_0191));
    assert_eq!(get(&eds, 0x1000, 0).access, Access::ReadOnly);
    assert_eq!(get(&eds, 0x1800, 1).default, Some(Formula::NodeId(0x180)));
    assert_eq!(eds.objects[&0x1800].object_type, ObjectType::Record);
    assert_eq!(get(&eds, 0x1F50, 0).data_type, DataType::DOMAIN);
}

#[test]
fn limits_are_in_the_type_of_the_object() {
    let eds = Eds::parse(ODD).unwrap();
    let entry = get(&eds, 0x2000, 0);
    assert_eq!((&entry.default, &entry.low, &entry.high), (&integer(-1), &integer(-128), &None));
    assert!(entry.is_rpdo_mappable() && !entry.is_tpdo_mappable());
}

#[test]
fn compact_storage_is_unfolded() {
    let eds = Eds::parse(ODD).unwrap();
    let names: Vec<_> = eds.objects[&0x1003].entries.values().map(|entry| &entry.name[..]).collect();
    assert_eq!(names, ["NrOfObjects", "Error field1", "Second error", "Error field3"]);
    let defaults: Vec<_> = (0..=3).map(|sub| get(&eds, 0x1003, sub).default.clone()).collect();
    assert_eq!(defaults, [integer(3), integer(7), integer(7), Some(Formula::NodeId(0x10))]);
    assert_eq!(get(&eds, 0x1003, 0).data_type, DataType::UNSIGNED8);
    assert_eq!(get(&eds, 0x1003, 3).sub, 3);
}

#[test]
fn characters_may_be_latin_1() {
    let eds = Eds::from_bytes(b"[DeviceInfo]\r\nVendorName=M\xFCller\r\n").unwrap();
    assert_eq!(eds.device.vendor_name, "Müller");
    assert_eq!(Eds::from_bytes("[DeviceInfo]\nVendorName=Müller".as_bytes()).unwrap(), eds);
}

#[test]
fn an_empty_file_has_no_objects() {
    assert_eq!(Eds::parse("").unwrap(), Eds::default());
}

/// The first warning about an object of these lines, which is read nevertheless.
fn object(lines: &str) -> Error {
    let eds = Eds::parse(&format!("[DeviceInfo]\nVendorNumber=1\n[2001]\n{lines}")).unwrap();
    assert!(eds.objects.contains_key(&0x2001));
    eds.warnings[0].clone()
}

#[test]
fn an_error_names_its_line() {
    let error = object("ParameterName=X\nDataType=0xZZ\nAccessType=rw\n");
    assert_eq!((&error.section[..], error.key, error.line), ("2001", "DataType", Some(5)));
    let text = "line 5: [2001] DataType: \"0xZZ\" is not a number of at most 16 bits";
    assert_eq!(error.to_string(), text);
}

#[test]
fn missing_keys_are_named_with_the_line_of_their_section() {
    let error = object("ParameterName=X\nDataType=5\n");
    assert_eq!(error.to_string(), "line 3: [2001] AccessType: is missing");
    assert_eq!(error.problem, Problem::Missing);
}

#[test]
fn values_are_checked_against_their_type() {
    let error = object("ParameterName=X\nDataType=5\nAccessType=rw\nDefaultValue=256\n");
    assert_eq!(
        error.to_string(),
        "line 7: [2001] DefaultValue: \"256\" is not a value of UNSIGNED8, 0 to 255, and is not read"
    );
    let error = object("ParameterName=X\nDataType=5\nAccessType=wr\n");
    assert!(error.to_string().ends_with("\"wr\" is not one of ro, wo, rw, rwr, rww and const"), "{error}");
    let error = object("ParameterName=X\nObjectType=4\nDataType=5\nAccessType=rw\n");
    assert_eq!((error.key, error.line), ("ObjectType", Some(5)));
}

#[test]
fn a_compact_value_is_checked_in_its_own_section() {
    let lines = "ParameterName=X\nDataType=5\nAccessType=rw\nCompactSubObj=2\n[2001Value]\n1=300\n";
    let error = object(lines);
    assert_eq!(
        error.to_string(),
        "line 8: [2001value]: \"300\" is not a value of UNSIGNED8, 0 to 255, and is not read"
    );
}

#[test]
fn a_sub_index_without_its_object_is_read_with_a_warning() {
    let eds = Eds::parse("[2002sub1]\nParameterName=X\nDataType=5\nAccessType=rw").unwrap();
    assert_eq!(eds.warnings[0].to_string(), "line 1: [2002sub1]: the object has no section of its own");
    assert_eq!((&eds.objects[&0x2002].name[..], &get(&eds, 0x2002, 1).name[..]), ("2002h", "X"));
}

/// Each mistake of a vendor, the value that is read nevertheless, and that one warning names its line.
#[test]
fn a_mistake_of_a_vendor_is_a_warning_and_the_rest_is_read() {
    let cases = [
        ("DataType=8", "DefaultValue=0.0f", Some(Formula::Constant(Value::Real(0.0)))),
        ("DataType=8", "DefaultValue=1.5 // bar", Some(Formula::Constant(Value::Real(1.5)))),
        ("DataType=7", "DefaultValue=12UL", integer(12)),
        ("DataType=0x15", "DefaultValue=0x7FLL", integer(127)),
        ("DataType=5", "DefaultValue=3 # three", integer(3)),
        ("DataType=1", "DefaultValue=3", integer(1)),
        ("DataType=7", "DefaultValue=$MY_NODE_ID", None),
        ("DataType=5", "DefaultValue=none", None),
        ("DataType=5", "DefaultValue=256", None),
    ];
    for (data_type, line, value) in cases {
        let text = format!(
            "[2001]\nParameterName=X\n{data_type}\nAccessType=rw\n{line}\n[2002]\nParameterName=Y\nDataType=5\nAccessType=ro"
        );
        let eds = Eds::parse(&text).unwrap();
        assert_eq!(get(&eds, 0x2001, 0).default, value, "{line}");
        assert_eq!(eds.warnings.iter().map(|warning| warning.line).collect::<Vec<_>>(), [Some(5)], "{line}");
        assert_eq!(get(&eds, 0x2002, 0).name, "Y");
    }
}

/// A configuration with such an entry would write the default, which its author did not ask for.
#[test]
fn an_entry_whose_value_cannot_be_read_has_no_value() {
    for (line, value) in [("7x0", None), ("70000", None), ("-5", None), ("", integer(5))] {
        let text = format!(
            "[2001]\nParameterName=X\nDataType=6\nAccessType=rw\nDefaultValue=5\nParameterValue={line}"
        );
        let eds = Eds::parse(&text).unwrap();
        let entry = get(&eds, 0x2001, 0);
        assert_eq!(entry.value.clone().or(entry.default.clone()), value, "{line}");
        let words = format!(
            "line 6: [2001] ParameterValue: \"{line}\" is not a value of UNSIGNED16, 0 to 65535, and is not read"
        );
        let warnings: Vec<String> = eds.warnings.iter().map(ToString::to_string).collect();
        assert_eq!(warnings, value.map_or(vec![words], |_| Vec::new()));
        assert!(eds.warnings.iter().all(eds::Error::is_loss));
    }
}

/// A configuration file that is cut off anywhere has a warning of a missing part. The last key is not written to a node.
#[test]
fn a_truncated_file_has_a_gap() {
    let mut sheet = DEVICES[0].eds().clone();
    sheet.commissioning = Some(Commissioning::default());
    let text = sheet.to_dcf("a.dcf", Reals::Decimal);
    assert_eq!(Eds::parse(&text).unwrap().warnings, []);
    let first = text.find("\nSupportedObjects").unwrap() + 2;
    let (section, end) = (text.rfind("\r\n[").unwrap(), text.rfind("PDOMapping=").unwrap());
    for end in (first..section).step_by(997).chain(section..end) {
        let is_refused =
            Eds::parse(&text[..end]).map_or(true, |cut| cut.warnings.iter().any(eds::Error::is_loss));
        assert!(is_refused, "{}", &text[end.saturating_sub(80)..end]);
    }
    let cut = Eds::parse(text.split("[1018]").next().unwrap()).unwrap();
    let words: Vec<String> = cut.warnings.iter().map(ToString::to_string).collect();
    assert!(words.iter().any(|words| words.ends_with("1018h is listed and has no section")), "{words:?}");
}

#[test]
fn a_missing_key_is_replaced_with_a_warning() {
    let cases = [
        ("DataType=5\nAccessType=rw", "2001h", DataType(5), Access::ReadWrite),
        ("ParameterName=X\nAccessType=rw", "X", DataType::DOMAIN, Access::ReadWrite),
        ("ParameterName=X\nDataType=5", "X", DataType(5), Access::ReadOnly),
        ("ParameterName=X\nDataType=5\nAccessType=R", "X", DataType(5), Access::ReadOnly),
        ("ParameterName=X\nDataType=5\nAccessType=W", "X", DataType(5), Access::WriteOnly),
    ];
    for (lines, name, data_type, access) in cases {
        let eds = Eds::parse(&format!("[2001]\n{lines}")).unwrap();
        let entry = get(&eds, 0x2001, 0);
        assert_eq!((&entry.name[..], entry.data_type, entry.access), (name, data_type, access), "{lines}");
        assert_eq!(eds.warnings.len(), 1, "{lines}: {:?}", eds.warnings);
    }
}

#[test]
fn a_text_that_is_no_ini_file_is_refused() {
    let error = Eds::parse("[2000\nParameterName=X").unwrap_err();
    assert!(matches!(error.problem, Problem::Syntax(_)));
    assert!(error.to_string().contains("line 1"), "{error}");
}

#[test]
fn a_default_is_evaluated_for_a_node() {
    let eds = Eds::parse(ODD).unwrap();
    let formula = get(&eds, 0x1800, 1).default.clone().unwrap();
    for id in [1, 127] {
        let node_id = NodeId::new(id).unwrap();
        assert_eq!(formula.evaluate(node_id), Value::Integer(0x180 + i128::from(id)));
    }
}
