//! Checks of a table of rows at compile time. The code at run time relies on them. A panic here is a compile error.

use super::check_pdos::{check_pdo_row, of_first_and_last};
use super::compile::{effective_limits, find};
use super::fail::{fail, require};
use super::{Access, DefaultValue, Group, Mapping, Object, Rule, Type};
use crate::sdo::BUFFER;

/// Checks a table: the rows are sorted, no entry occurs twice, every default has the type of its entry and is within
/// its limits, every object has sub-index 0, the attributes of a row fit together, every entry of CiA 301 keeps its
/// service, and the default of every PDO can be sent or received.
///
/// # Panics
/// During compilation, when a row is wrong. The message begins with index and sub-index of the row.
#[allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]
pub const fn check(rows: &[Object]) {
    assert!(!rows.is_empty(), "the table has no rows");
    let (mut i, mut size) = (0, 0);
    while i < rows.len() {
        let row = &rows[i];
        size += row.stored_size();
        require!(size <= u16::MAX as usize, row, "the values of the table take more than 65535 bytes");
        if i > 0 {
            require!(rows[i - 1].key() != row.key(), row, "the row is there twice");
            require!(rows[i - 1].key() < row.key(), row, "the rows are not sorted by index and sub-index");
        }
        let has_sub_0 = row.sub == 0 || (i > 0 && rows[i - 1].index == row.index);
        require!(has_sub_0, row, "the object has no sub-index 0");
        check_row(row);
        let is_more = row.index > 0x1201 && row.index < 0x1280;
        let follows = !is_more || row.sub > 0 || (i > 0 && rows[i - 1].index + 1 == row.index);
        require!(follows, row, "further SDO servers begin at 1201h and have no gap");
        let is_next = row.index != 0x1016 || row.sub == 0 || rows[i - 1].sub + 1 == row.sub;
        require!(is_next, row, "the heartbeats to monitor have no gap");
        i += 1;
    }
    // The order of the rows is checked by now: they are found by a binary search.
    i = 0;
    while i < rows.len() {
        check_event_timer(rows, &rows[i]);
        check_group(rows, &rows[i]);
        check_pdo_row(rows, i);
        i += 1;
    }
}

#[allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]
const fn check_event_timer(rows: &[Object], row: &Object) {
    let Rule::EventTimerOf(number) = row.rule else { return };
    let Some(timer) = find(rows, 0x1800 | number as u16, 5) else {
        fail(row.index, row.sub, "the TPDO has no event timer (sub-index 5)")
    };
    let is_writable = matches!(rows[timer].access, Access::ReadWrite);
    require!(
        is_writable,
        &rows[timer],
        "the event timer is read-only, but has another name that can be written",
    );
    let has_limits = rows[timer].limits.is_some() || row.limits.is_some();
    require!(!has_limits, row, "an event timer with two names has no limits");
}

/// A value in a group of the product is stored by a sub-index of 1010h.
const fn check_group(rows: &[Object], row: &Object) {
    let Some(group) = row.group else { return };
    let is_stored = !group.is_own() || find(rows, 0x1010, group.sub()).is_some();
    require!(is_stored, row, "1010h has no sub-index for the storage group");
}

const fn check_row(row: &Object) {
    require!(row.sub < u8::MAX, row, "an object has at most 255 entries, 0 to 254");
    require!(row.index != 0x1016 || row.sub <= 127, row, "at most 127 heartbeats are monitored");
    require!(row.index != 0x1028 || row.sub <= 127, row, "the sub-index is a node-ID, 1 to 127");
    check_rule(row);
    check_limits(row);
    check_default(row);
    check_mapping(row);
    check_can_id(row);
    let is_relative = matches!(row.default, DefaultValue::NodeId(_));
    let is_communication = matches!(row.group, Some(Group::Communication));
    let follows = !is_relative || is_communication || row.group.is_none() && row.index < 0x2000;
    require!(follows, row, "a default with the node-ID belongs to the communication parameters");
    let is_group = !matches!(row.rule, Rule::Store | Rule::Restore) || row.sub <= 8;
    require!(is_group, row, "storage groups of a product have the sub-indexes 4 to 8");
    // A read-only value can be stored too, such as the offset that the device computes from a preset.
    let lasts = matches!(row.access, Access::ReadWrite | Access::ReadOnly);
    require!(row.group.is_none() || lasts, row, "a constant or a command cannot be stored");
    let has_value = row.stored_size() > 0;
    require!(row.group.is_none() || has_value, row, "an entry without a value in the image cannot be stored");
}

/// The default of a COB-ID is one that a client could write. Those of PDOs have a check of their own.
const fn check_can_id(row: &Object) {
    if !matches!(row.rule, Rule::SyncCobId | Rule::SyncProducer | Rule::TimeCobId | Rule::EmcyCobId) {
        return;
    }
    let (Some(first), Some(last)) = of_first_and_last(row.default) else {
        fail(row.index, row.sub, "the COB-ID has a CAN-ID of more than 11 bits");
    };
    let is_off = matches!(row.rule, Rule::EmcyCobId) && first.bit31;
    let is_free = is_off || !first.id.is_restricted() && !last.id.is_restricted();
    require!(is_free, row, "the CAN-ID is reserved for another service");
    let is_producer = matches!(row.rule, Rule::SyncCobId) && first.bit30;
    require!(
        !is_producer,
        row,
        "the rows are those of a consumer of SYNC, and the default makes it a producer"
    );
}

const fn check_default(row: &Object) {
    match (row.default, row.kind) {
        (DefaultValue::Integer(value), kind) if !matches!(kind, Type::Real64) => {
            require!(row.kind.range().is_some(), row, "the default is an integer, the entry is not");
            let (low, high) = effective_limits(row);
            require!(low <= value && value <= high, row, "the default is out of range");
        }
        (DefaultValue::Real(value), Type::Real32) => {
            require!(value.is_finite(), row, "the default is infinite or not a number");
        }
        (DefaultValue::Text(text), Type::VisibleString(capacity)) => {
            require!(capacity as usize <= BUFFER, row, "the string is longer than an SDO transfer can be");
            require!(text.is_ascii(), row, "the default is not ASCII");
            require!(text.len() <= capacity as usize, row, "the default is longer than the string");
        }
        (DefaultValue::None, Type::OctetString(capacity)) => {
            require!(capacity as usize <= BUFFER, row, "the string is longer than an SDO transfer can be");
        }
        (DefaultValue::NodeId(_), Type::Unsigned32)
        | (DefaultValue::Integer(_), Type::Real64)
        | (DefaultValue::None, Type::Domain) => (),
        _ => fail(row.index, row.sub, "the default is of another type than the entry"),
    }
}

const fn check_mapping(row: &Object) {
    if matches!(row.mapping, Mapping::No) {
        return;
    }
    let fits = row.kind.size() >= 1 && row.kind.size() <= 8;
    require!(fits, row, "a mappable object has one to eight bytes");
    require!(row.stored_size() > 0, row, "a mappable object has a value in the image");
    let is_sent = row.mapping.allows_tpdo();
    require!(!is_sent || row.access.is_readable(), row, "a TPDO cannot carry a write-only object");
    let is_received = row.mapping.allows_rpdo();
    require!(!is_received || row.access.is_writable(), row, "an RPDO cannot write a read-only object");
    let takes_values = matches!(row.rule, Rule::Plain | Rule::Application);
    require!(!is_received || takes_values, row, "an RPDO cannot write an object with a service");
}

/// The rule of a row is that of its index, so an entry of CiA 301 keeps its service.
const fn check_rule(row: &Object) {
    let own = Rule::of(row.index, row.sub);
    let is_chosen = match own {
        Rule::Plain => matches!(
            row.rule,
            Rule::Application | Rule::Setting | Rule::StoreCalibration | Rule::EventTimerOf(_)
        ),
        Rule::PdoCobId => matches!(row.rule, Rule::PdoPredefined),
        Rule::SyncCobId => matches!(row.rule, Rule::SyncProducer),
        // A bootloader controls the program itself.
        Rule::ProgramControl => matches!(row.rule, Rule::Application),
        _ => false,
    };
    let fits = is_chosen || own.code() == row.rule.code();
    require!(
        fits,
        row,
        "the entry would lose its service: no handled(), setting() and the like for this index",
    );
    if let Some(size) = row.rule.size() {
        require!(row.kind.size() == size, row, "the service of the entry needs a type of another size");
    }
    let is_time = matches!(row.kind, Type::Unsigned16) && row.group.is_none();
    let is_timer = matches!(row.rule, Rule::EventTimerOf(_));
    require!(!is_timer || is_time, row, "another name of an event timer is an UNSIGNED16 without a group");
}

const fn check_limits(row: &Object) {
    if let Some((low, high)) = row.limits {
        let Some((min, max)) = row.kind.range() else {
            fail(row.index, row.sub, "only an integer has limits");
        };
        require!(low <= high, row, "the lower limit is above the upper one");
        require!(min <= low && high <= max, row, "the limits are wider than the type");
        require!(row.kind.size() <= 4, row, "an integer of more than 32 bits has no limits");
    }
}
