//! Checks of expedited transfers, and of the abort codes that clients depend on.

use canopen::sdo::{Request, Response};
use eds::{Class, Entry};

use super::super::prelude::*;
use super::super::subject::size;
use crate::configuration::is_parameter;
use crate::object::at;

pub(super) const CHECKS: &[Check] = &[
    Check::new("SDO-01", "1000h is uploaded in one frame", "CiA 301, 7.2.4.3.5", upload),
    Check::new("SDO-02", "A writable entry is read and written back", "CiA 301, 7.2.4.3.2", write_back),
    Check::new("SDO-03", "A write to 1000h is refused: read-only", "CiA 301, table 22", read_only),
    Check::new("SDO-04", "An upload of a write-only entry is refused", "CiA 301, table 22", write_only),
    Check::new("SDO-05", "An upload of an absent sub-index is refused", "CiA 301, table 22", absent_sub_read),
    Check::new(
        "SDO-06",
        "A download to an absent sub-index is refused",
        "CiA 301, table 22",
        absent_sub_write,
    ),
    Check::new("SDO-07", "An upload of an absent object is refused", "CiA 301, table 22", absent_object_read),
    Check::new(
        "SDO-08",
        "A download to an absent object is refused",
        "CiA 301, table 22",
        absent_object_write,
    ),
    Check::new("SDO-09", "An unknown command specifier is refused", "CiA 301, table 22", unknown_command),
    Check::new("SDO-10", "Too many bytes for a number are refused", "CiA 301, table 22", too_long),
    Check::new("SDO-11", "Too few bytes for a number are refused", "CiA 301, table 22", too_short),
    Check::new("SDO-12", "A value above the range is refused", "CiA 301, table 22", too_high),
    Check::new("SDO-13", "A value below the range is refused", "CiA 301, table 22", too_low),
    Check::new("SDO-14", "The response names the object that was read", "CiA 301, 7.2.4.3.6", names_read),
    Check::new(
        "SDO-15",
        "The response names the object that was written",
        "CiA 301, 7.2.4.3.3",
        names_written,
    ),
    Check::new("SDO-16", "An abort names the object", "CiA 301, 7.2.4.3.17", names_refused),
    Check::new("SDO-17", "An abort of the client gets no answer", "CiA 301, 7.2.4.3.17", abort_is_silent),
    Check::new(
        "SDO-18",
        "An upload in one frame tells its size",
        "CiA 301, 7.2.4.3.6",
        response_has_its_size,
    )
    .recommended(),
    Check::new("SDO-19", "Reserved bytes of a response are 0", "CiA 301, 7.2.4.3.3", reserved),
    Check::new(
        "SDO-20",
        "A download whose size is not told is taken",
        "CiA 301, 7.2.4.3.3",
        unsized_download,
    ),
    Check::new("SDO-21", "A request gets one answer", "CiA 301, 7.2.4.2", one_answer),
    Check::new("SDO-22", "The answer comes within 100 ms", "CiA 301, 7.2.4", soon).recommended(),
    Check::new("SDO-23", "A refused write changes nothing", "CiA 301, 7.2.4.2", refused_changes_nothing),
    Check::new("SDO-24", "What was written is read", "CiA 301, 7.2.4.2", written_value_reads_back),
];

fn upload(s: &mut Subject<'_>) -> Outcome {
    let bytes = s.read(0x1000, 0)?;
    ensure(bytes.len() == 4, "four bytes in 1000h", format!("{bytes:02X?}"))?;
    let answer = s.answer(Request::Upload(at(0x1000, 0)).encode())?;
    ensure(answer[0] & 0xE2 == 0x42, "an expedited response", format!("{answer:02X?}"))
}

/// A parameter of four bytes that accepts its own value at any time.
fn plain(s: &mut Subject<'_>) -> Outcome<(u16, u8)> {
    let entries = s.entries(|entry| {
        let is_guarded = matches!(entry.index, 0x1005..=0x1007 | 0x1014 | 0x1016 | 0x1200..=0x1FFF);
        let is_word = matches!(entry.data_type.class(), Class::Unsigned(32) | Class::Signed(32));
        is_word && is_parameter(entry) && !is_guarded
    })?;
    for entry in entries {
        let Ok(value) = s.try_read(entry.index, entry.sub)? else { continue };
        if s.try_write(entry.index, entry.sub, &value)?.is_ok() {
            return Ok((entry.index, entry.sub));
        }
    }
    Err(skip("the data sheet has no plain parameter of four bytes"))
}

fn write_back(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    let value = s.read(0x1017, 0)?;
    s.write(0x1017, 0, &value)?;
    let again = s.read(0x1017, 0)?;
    ensure(again == value, format!("{value:02X?} in 1017h"), format!("{again:02X?}"))
}

fn read_only(s: &mut Subject<'_>) -> Outcome {
    s.refuses(0x1000, 0, 0, &[abort::READ_ONLY])
}

fn write_only(s: &mut Subject<'_>) -> Outcome {
    let entry = s.entry("write-only entry", |entry| !entry.access.is_readable())?;
    s.hides(entry.index, entry.sub, &[abort::WRITE_ONLY])
}

fn absent_sub_read(s: &mut Subject<'_>) -> Outcome {
    s.hides(0x1018, 5, &[abort::NO_SUB_INDEX])
}

fn absent_sub_write(s: &mut Subject<'_>) -> Outcome {
    s.aborts([0x23, 0x18, 0x10, 5, 0, 0, 0, 0], &[abort::NO_SUB_INDEX])
}

/// Reads 0FFFh, an index that CiA 301 reserves and that no device has.
fn absent_object_read(s: &mut Subject<'_>) -> Outcome {
    s.hides(0x0FFF, 0, &[abort::NO_OBJECT])
}

fn absent_object_write(s: &mut Subject<'_>) -> Outcome {
    s.aborts([0x23, 0xFF, 0x0F, 0, 0, 0, 0, 0], &[abort::NO_OBJECT])
}

fn unknown_command(s: &mut Subject<'_>) -> Outcome {
    s.aborts([0xE0, 0x00, 0x10, 0, 0, 0, 0, 0], &[abort::COMMAND])
}

fn too_long(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    s.refuses_bytes(0x1017, 0, &[0, 0, 0, 0], &[abort::TOO_LONG, abort::LENGTH])
}

fn too_short(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    s.refuses_bytes(0x1017, 0, &[0], &[abort::TOO_SHORT, abort::LENGTH])
}

fn too_high(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1019, 0)?;
    s.refuses(0x1019, 0, 241, &[abort::TOO_HIGH, abort::VALUE])
}

fn too_low(s: &mut Subject<'_>) -> Outcome {
    let is_wanted = |entry: &Entry| {
        let is_small = matches!(entry.data_type.class(), Class::Signed(8 | 16 | 32));
        is_small && entry.low.is_some() && is_parameter(entry)
    };
    let entry = s.entry("signed parameter with a lower limit", is_wanted)?;
    let bytes = 1_u32 << (size(&entry).unwrap_or(1) * 8 - 1);
    s.refuses(entry.index, entry.sub, bytes, &[abort::TOO_LOW, abort::VALUE])
}

fn names_read(s: &mut Subject<'_>) -> Outcome {
    let answer = s.answer(Request::Upload(at(0x1018, 1)).encode())?;
    ensure(answer[1..4] == [0x18, 0x10, 1], "1018h:1 in bytes 1 to 3", format!("{answer:02X?}"))
}

fn names_written(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    let value = s.read(0x1017, 0)?;
    let [low, high] =
        value[..].try_into().map_err(|_| fail("two bytes in 1017h", format!("{value:02X?}")))?;
    let answer = s.answer([0x2B, 0x17, 0x10, 0, low, high, 0, 0])?;
    ensure(answer[..4] == [0x60, 0x17, 0x10, 0], "60h and 1017h:0", format!("{answer:02X?}"))
}

fn names_refused(s: &mut Subject<'_>) -> Outcome {
    let answer = s.answer([0x23, 0x18, 0x10, 1, 0, 0, 0, 0])?;
    ensure(answer[..4] == [0x80, 0x18, 0x10, 1], "80h and 1018h:1", format!("{answer:02X?}"))
}

fn abort_is_silent(s: &mut Subject<'_>) -> Outcome {
    let answer = s.ask_within([0x80, 0x00, 0x10, 0, 0, 0, 0, 8], 300)?;
    ensure(answer.is_none(), "no answer", format!("{:02X?}", answer.unwrap_or_default()))
}

fn response_has_its_size(s: &mut Subject<'_>) -> Outcome {
    let answer = s.answer(Request::Upload(at(0x1000, 0)).encode())?;
    ensure(answer[0] == 0x43, "43h: four bytes, and their number is told", format!("{answer:02X?}"))
}

fn reserved(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    let value = s.read(0x1017, 0)?;
    let [low, high] =
        value[..].try_into().map_err(|_| fail("two bytes in 1017h", format!("{value:02X?}")))?;
    let answer = s.answer([0x2B, 0x17, 0x10, 0, low, high, 0, 0])?;
    ensure(answer[4..] == [0; 4], "four bytes of 0 at the end", format!("{answer:02X?}"))
}

fn unsized_download(s: &mut Subject<'_>) -> Outcome {
    let (index, sub) = plain(s)?;
    let value = s.number(index, sub)?;
    let [low, high] = index.to_le_bytes();
    let [a, b, c, d] = value.to_le_bytes();
    let answer = s.answer([0x22, low, high, sub, a, b, c, d])?;
    ensure(answer[0] == 0x60, "60h", format!("{answer:02X?}"))?;
    s.holds(index, sub, value)
}

fn one_answer(s: &mut Subject<'_>) -> Outcome {
    let (mark, id) = (s.mark(), 0x580 + s.id());
    s.answer(Request::Upload(at(0x1000, 0)).encode())?;
    s.pass(100)?;
    let answers = s.heard(mark, id).len();
    ensure(answers == 1, "one answer", format!("{answers}"))
}

fn soon(s: &mut Subject<'_>) -> Outcome {
    let answer = s.ask_within(Request::Upload(at(0x1000, 0)).encode(), 100)?;
    ensure(answer.is_some(), "an answer within 100 ms", "none")
}

fn refused_changes_nothing(s: &mut Subject<'_>) -> Outcome {
    let before = s.number(0x1000, 0)?;
    s.change(0x1000, 0, &[1, 2, 3, 4])?.err();
    s.holds(0x1000, 0, before)?;
    if s.try_read(0x1017, 0)?.is_ok() {
        let before = s.number(0x1017, 0)?;
        s.change(0x1017, 0, &[7, 7, 7, 7])?.err();
        s.holds(0x1017, 0, before)?;
    }
    Ok(())
}

fn written_value_reads_back(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    for value in [5000, 0, 1234] {
        s.set(0x1017, 0, value)?;
        match s.respond(Request::Upload(at(0x1017, 0)))? {
            Response::Uploaded(_, bytes) if bytes.as_slice().starts_with(&value.to_le_bytes()[..2]) => (),
            other => return Err(fail(format!("{value} in 1017h"), format!("{other:X?}"))),
        }
    }
    Ok(())
}
