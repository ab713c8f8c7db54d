//! Names and object types in the data sheet (CiA 306).

use canopen::dictionary::{Access, Mapping, Object, Type};
use canopen::eds::{DeviceInfo, write};
use canopen::objects;

const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(401), objects::error_register()],
    objects::error_field::<3>(),
    objects::identity(7, 1, 0x0001_0000),
    [
        Object::new(0x2000, 0, "Log", Type::Domain, Access::ReadWrite),
        Object::highest(0x2001, 2, "Mixed"),
        Object::new(0x2001, 1, "Gain", Type::Real32, Access::ReadWrite).real(1.5),
        Object::new(0x2001, 2, "Offset", Type::Integer16, Access::ReadWrite).value(-3).limits(-5, 5),
        Object::highest(0x6000, 2, "Inputs"),
        Object::new(0x6000, 1, "Input", Type::Unsigned8, Access::ReadOnly).mappable(Mapping::Tpdo),
        Object::new(0x6000, 2, "Input", Type::Unsigned8, Access::ReadOnly).mappable(Mapping::Tpdo),
    ],
);

/// The lines of a section.
fn section(name: &str) -> Vec<String> {
    let mut sheet = String::new();
    write(ROWS, &DeviceInfo::new("Example", "I/O module"), &mut sheet).unwrap();
    let mut lines = sheet.lines().skip_while(|line| *line != format!("[{name}]")).skip(1);
    lines.by_ref().take_while(|line| !line.is_empty()).map(str::to_owned).collect()
}

#[test]
fn an_object_is_a_variable_a_domain_an_array_or_a_record() {
    for (name, kind) in [
        ("1000", "ObjectType=0x7"),
        ("2000", "ObjectType=0x2"),
        ("6000", "ObjectType=0x8"),
        ("1003", "ObjectType=0x8"),
        ("2001", "ObjectType=0x9"),
        // All entries are UNSIGNED32, but CiA 301 defines a record.
        ("1018", "ObjectType=0x9"),
        ("2001sub1", "ObjectType=0x7"),
    ] {
        assert!(section(name).iter().any(|line| line == kind), "{name}: {:?}", section(name));
    }
}

#[test]
fn every_entry_has_its_own_name() {
    for (name, expected) in [
        ("1000", "Device type"),
        ("1018", "Identity"),
        ("1018sub0", "Highest sub-index supported"),
        ("1003sub0", "Number of entries"),
        ("1018sub2", "Product code"),
        ("2001sub1", "Gain"),
        ("6000sub1", "Input 1"),
        ("6000sub2", "Input 2"),
    ] {
        assert_eq!(section(name)[0], format!("ParameterName={expected}"), "{name}");
    }
}

#[test]
fn an_entry_has_type_default_limits_and_mapping() {
    let entry = section("2001sub2");
    for line in
        ["DataType=0x0003", "AccessType=rw", "DefaultValue=-3", "LowLimit=-5", "HighLimit=5", "PDOMapping=0"]
    {
        assert!(entry.iter().any(|own| own == line), "{line}: {entry:?}");
    }
    assert!(section("6000sub1").iter().any(|line| line == "PDOMapping=1"));
    assert!(section("2001sub1").iter().any(|line| line == "DefaultValue=1.5"));
}

#[test]
fn keys_without_a_row_are_the_vendors() {
    let mut info = DeviceInfo::new("Example", "I/O module");
    let edition = Some(("11-25-2026", "12:00AM"));
    (info.file_name, info.file_revision, info.created, info.modified) = ("io.eds", 3, edition, edition);
    (info.bit_rates, info.has_lss) = (&[125, 250], false);
    let mut sheet = String::new();
    write(ROWS, &info, &mut sheet).unwrap();
    for line in [
        "FileName=io.eds",
        "FileRevision=3",
        "CreationDate=11-25-2026",
        "ModificationTime=12:00AM",
        "BaudRate_125=1",
        "BaudRate_250=1",
        "BaudRate_500=0",
        "BaudRate_1000=0",
        "LSS_Supported=0",
    ] {
        assert!(sheet.lines().any(|own| own == line), "{line}: {sheet}");
    }
    assert!(!section("FileInfo").iter().any(|line| line.contains("Date")), "no date, no entry");
    assert!(section("DeviceInfo").contains(&"BaudRate_1000=1".to_owned()));
}
