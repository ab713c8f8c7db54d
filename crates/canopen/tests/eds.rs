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

/// Every object that the library has rows for.
const ALL: &[Object] = canopen::rows!(
    [
        objects::device_type(0x0003_0191),
        objects::error_register(),
        objects::time_stamp(),
        objects::device_name("I/O module"),
        objects::hardware_version("1.0"),
        objects::software_version("2.1"),
        objects::heartbeat_producer(1000),
        objects::start_up(),
    ],
    objects::error_field::<3>(),
    objects::sync_producer(10_000),
    objects::node_guarding(),
    objects::emergency(),
    objects::store_parameters(),
    objects::restore_parameters(),
    objects::heartbeat_consumer::<4>(),
    objects::emcy_consumer::<4>(),
    objects::identity(7, 0x2B, 0x0001_0002),
    objects::error_behaviour(2),
    objects::scanner_list::<3>(),
    objects::dispatching_list::<3>(),
    objects::default_sdo_server(),
    objects::sdo_server(2),
    objects::sdo_client(1),
    objects::rpdo(1, &[OUTPUT, OUTPUT]),
    objects::multiplexed(objects::rpdo(512, &[])),
    objects::tpdo(1, &[INPUT]),
    objects::without_remote(objects::tpdo(4, &[INPUT, INPUT])),
    objects::multiplexed(objects::tpdo(5, &[])),
    objects::program_data(),
    objects::program_control(),
    objects::program_identification(),
    objects::flash_status(),
    [INPUT, OUTPUT],
);
const INPUT: Object =
    Object::new(0x6401, 0, "Input", Type::Integer16, Access::ReadOnly).mappable(Mapping::Tpdo);
const OUTPUT: Object = Object::new(0x6411, 0, "Output", Type::Unsigned32, Access::ReadWrite)
    .mappable(Mapping::Rpdo)
    .limits(0, 1000);

/// `tests/all_objects.eds` was compared with CiA 301 by hand. `UPDATE_TABLE=1` writes it.
#[test]
fn the_objects_of_the_library_have_the_types_and_defaults_of_cia_301() {
    let mut sheet = String::new();
    write(ALL, &DeviceInfo::new("Example", "I/O module"), &mut sheet).unwrap();
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all_objects.eds");
    if std::env::var_os("UPDATE_TABLE").is_some() {
        std::fs::write(path, &sheet).unwrap();
    }
    let expected = std::fs::read_to_string(path).unwrap();
    let differences = sheet.lines().zip(expected.lines()).find(|(own, expected)| own != expected);
    assert_eq!((differences, sheet.len()), (None, expected.len()));
}

/// CiA 301 has the special numbers of mapped objects 254 and 255.
#[test]
fn a_multiplexed_pdo_is_one_whose_number_of_objects_says_so() {
    let has_group_messaging = |row: Object| {
        let mut sheet = String::new();
        write(&[row], &DeviceInfo::new("Example", "I/O module"), &mut sheet).unwrap();
        sheet.lines().any(|line| line == "GroupMessaging=1")
    };
    for index in [0x1600, 0x17FF, 0x1A00, 0x1BFF] {
        let count = |used| Object::new(index, 0, "", Type::Unsigned8, Access::ReadWrite).value(used);
        assert!(has_group_messaging(count(254)) && has_group_messaging(count(255)), "{index:04X}h");
        assert!(!has_group_messaging(count(8)) && !has_group_messaging(count(0)), "{index:04X}h");
        assert!(
            !has_group_messaging(Object::new(index, 1, "", Type::Unsigned32, Access::ReadWrite).value(254)),
            "{index:04X}h:1"
        );
    }
    for index in [0x15FF, 0x1800, 0x19FF, 0x1C00] {
        let other = Object::new(index, 0, "", Type::Unsigned8, Access::ReadWrite).value(255);
        assert!(!has_group_messaging(other), "{index:04X}h");
    }
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

/// A multiplexed PDO maps nothing: sub-index 0 is the only entry of its mapping parameter.
#[test]
fn a_mapping_parameter_of_one_entry_is_a_record() {
    let mapping = Object::new(0x1A01, 0, "Mapping", Type::Unsigned8, Access::Const).value(0xFF);
    let mut sheet = String::new();
    write(&[mapping], &DeviceInfo::new("Example", "I/O module"), &mut sheet).unwrap();
    let expected = "[1A01]\r\nParameterName=Mapping\r\nObjectType=0x9\r\nSubNumber=1\r\n\r\n[1A01sub0]\r\n";
    assert!(sheet.contains(expected), "{sheet}");
}
