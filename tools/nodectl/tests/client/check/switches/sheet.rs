//! Faults of the data sheet.

use eds::{Access, DataType, Formula, Value};

use super::{Switch, misprint};

fn number(value: i128) -> Option<Formula> {
    Some(Formula::Constant(Value::Integer(value)))
}

pub(super) fn switches() -> Vec<Switch> {
    vec![
        misprint("has no 1001h in its data sheet", &["EDS-01"], |sheet| {
            sheet.objects.remove(&0x1001);
        }),
        misprint("has a sub-index 0 of 16 bits in its data sheet", &["EDS-02"], |sheet| {
            entry(sheet, 0x1018, 0).data_type = DataType(6);
        }),
        misprint("has a default out of its limits", &["EDS-03"], |sheet| {
            entry(sheet, 0x2001, 0).default = number(9);
        }),
        misprint("has limits the wrong way round", &["EDS-04"], |sheet| {
            let entry = entry(sheet, 0x2001, 0);
            (entry.low, entry.high) = (number(5), number(-5));
        }),
        misprint("has a heartbeat time of 32 bits in its data sheet", &["EDS-05"], |sheet| {
            entry(sheet, 0x1017, 0).data_type = DataType(7);
        }),
        misprint("has a writable 1000h in its data sheet", &["EDS-06"], |sheet| {
            entry(sheet, 0x1000, 0).access = Access::ReadWrite;
        }),
        misprint("counts an RPDO too many", &["EDS-07"], |sheet| sheet.device.rpdos += 1),
        misprint("names no bit rate", &["EDS-08"], |sheet| sheet.device.bit_rates.clear()),
        misprint("has a TPDO without a mapping object", &["EDS-09"], |sheet| {
            sheet.objects.remove(&0x1A00);
        }),
        misprint("has the vendor-ID of another", &["EDS-10"], |sheet| sheet.device.vendor_number += 1),
        misprint("has the product code of another", &["EDS-11"], |sheet| sheet.device.product_number += 1),
        misprint("has an older data sheet", &["EDS-12"], |sheet| sheet.device.revision_number -= 1),
        misprint("does not declare 1020h", &["DIC-13"], |sheet| {
            sheet.objects.remove(&0x1020);
        }),
        misprint("declares an input that no PDO can carry as its value", &["P404-02"], |sheet| {
            entry(sheet, 0x6130, 1).mappable = false;
        }),
        misprint("declares a position that no PDO can carry", &["P406-03"], |sheet| {
            entry(sheet, 0x6004, 0).mappable = false;
            entry(sheet, 0x6020, 1).mappable = false;
        }),
        misprint("is a lift device without a PDO", &["P417-05"], |sheet| {
            sheet.objects.retain(|index, _| !matches!(index, 0x1400..=0x1BFF));
        }),
    ]
}

fn entry(sheet: &mut eds::Eds, index: u16, sub: u8) -> &mut eds::Entry {
    sheet.objects.get_mut(&index).and_then(|object| object.entries.get_mut(&sub)).expect("an entry")
}
