//! Checks of the mapping and its procedure (CiA 301, 7.5.2.36 and 7.5.2.38).

use eds::Entry;

use super::super::prelude::*;
use super::super::subject::{Pdo, mapped, size};

pub(super) const CHECKS: &[Check] = &[
    Check::new(
        "PDO-60",
        "RPDO mappings point to existing objects of the right length",
        "CiA 301, 7.5.2.36",
        default_mapping::<RPDO>,
    ),
    Check::new(
        "PDO-61",
        "TPDO mappings point to existing objects of the right length",
        "CiA 301, 7.5.2.38",
        default_mapping::<TPDO>,
    ),
    Check::new("PDO-62", "A TPDO is mapped in five steps", "CiA 301, 7.5.2.38", procedure::<TPDO>),
    Check::new("PDO-63", "An RPDO is mapped in five steps", "CiA 301, 7.5.2.36", procedure::<RPDO>),
    Check::new(
        "PDO-64",
        "A mapping entry is locked while sub-index 0 is not 0",
        "CiA 301, 7.5.2.38",
        entry_locked,
    ),
    Check::new("PDO-65", "The mapping is locked while the PDO is valid", "CiA 301, 7.5.2.38", valid_locked),
    Check::new("PDO-66", "More objects than there are places are refused", "CiA 301, 7.5.2.38", too_many),
    Check::new("PDO-67", "More than eight bytes are refused", "CiA 301, table 22", too_long),
    Check::new("PDO-68", "An RPDO maps an output", "CiA 301, 7.4.5", maps::<RPDO>),
    Check::new("PDO-69", "An RPDO refuses an input", "CiA 301, 7.4.5", refuses_direction::<RPDO>),
    Check::new(
        "PDO-70",
        "An RPDO refuses what is not mappable",
        "CiA 301, table 22",
        refuses_unmappable::<RPDO>,
    ),
    Check::new("PDO-71", "A TPDO maps an input", "CiA 301, 7.4.5", maps::<TPDO>),
    Check::new("PDO-72", "A TPDO refuses an output", "CiA 301, 7.4.5", refuses_direction::<TPDO>),
    Check::new(
        "PDO-73",
        "A TPDO refuses what is not mappable",
        "CiA 301, table 22",
        refuses_unmappable::<TPDO>,
    ),
    Check::new("PDO-74", "An RPDO maps a dummy object", "CiA 301, 7.4.8", dummy),
    Check::new("PDO-75", "An absent object is refused", "CiA 301, table 22", absent),
    Check::new("PDO-76", "A wrong length is refused", "CiA 301, table 22", wrong_length),
    Check::new("PDO-77", "A TPDO is as long as its mapping", "CiA 301, 7.5.2.38", length),
    Check::new(
        "PDO-78",
        "Reset communication brings the mapping back",
        "CiA 301, 7.3.2.2.1",
        mapping_returns,
    )
    .resets(),
];

fn default_mapping<const FIRST: u16>(s: &mut Subject<'_>) -> Outcome {
    let sheet = s.sheet()?;
    let pdos = s.pdos(FIRST)?;
    for index in &pdos {
        let mut total = 0;
        for (at, bits) in s.mapping(*index)? {
            total += u32::from(bits);
            let place = format!("{:04X}h:{} in {index:04X}h", at.index, at.sub);
            if at.index < 0x20 {
                continue;
            }
            let entry = sheet.get(at.index, at.sub);
            let entry = entry.ok_or_else(|| fail(format!("{place} is in the data sheet"), "it is not"))?;
            let is_allowed = if FIRST == TPDO { entry.is_tpdo_mappable() } else { entry.is_rpdo_mappable() };
            ensure(is_allowed, format!("{place} can be mapped"), "the data sheet says no")?;
            let expected = mapped(entry) & 0xFF;
            // A BOOLEAN takes one bit, or eight bits in devices that map whole bytes.
            ensure(
                expected == u32::from(bits) || bits == 1,
                format!("{expected} bits of {place}"),
                format!("{bits}"),
            )?;
        }
        ensure(total <= 64, format!("at most 64 bits in {index:04X}h"), format!("{total}"))?;
    }
    if pdos.is_empty() { Err(skip("the device has no such PDO")) } else { Ok(()) }
}

/// A PDO that is off and has no mapped objects.
fn empty(s: &mut Subject<'_>, first: u16) -> Outcome<Pdo> {
    let pdo = s.pdo(first)?;
    s.empty(pdo)?;
    Ok(pdo)
}

fn procedure<const FIRST: u16>(s: &mut Subject<'_>) -> Outcome {
    let entry = s.mappable(FIRST == TPDO)?;
    let pdo = empty(s, FIRST)?;
    s.set(pdo.mapping(), 1, mapped(&entry))?;
    s.set(pdo.mapping(), 0, 1)?;
    s.switch_on(pdo)?;
    s.holds(pdo.mapping(), 1, mapped(&entry))?;
    s.holds(pdo.mapping(), 0, 1)
}

/// Abort codes for a locked object: CiA 301 names no code.
const LOCKED: [u32; 7] = [
    abort::VALUE,
    abort::STATE,
    abort::LOCAL,
    abort::ACCESS,
    abort::PARAMETER,
    abort::GENERAL,
    abort::READ_ONLY,
];

fn mapped_one(s: &mut Subject<'_>) -> Outcome<(Pdo, Entry)> {
    let entry = s.mappable(true)?;
    let pdo = empty(s, TPDO)?;
    s.set(pdo.mapping(), 1, mapped(&entry))?;
    s.set(pdo.mapping(), 0, 1)?;
    Ok((pdo, entry))
}

/// Another object than this one, or the same object where there is no other.
fn another(s: &Subject<'_>, entry: &Entry) -> u32 {
    let is_other = |other: &Entry| {
        other.is_tpdo_mappable()
            && other.index >= 0x2000
            && mapped(other) != mapped(entry)
            && size(other).is_some()
    };
    s.entry("second object for a TPDO", is_other).map_or(mapped(entry), |other| mapped(&other))
}

fn entry_locked(s: &mut Subject<'_>) -> Outcome {
    let (pdo, entry) = mapped_one(s)?;
    let other = another(s, &entry);
    s.refuses(pdo.mapping(), 1, other, &LOCKED)
}

fn valid_locked(s: &mut Subject<'_>) -> Outcome {
    let (pdo, _) = mapped_one(s)?;
    s.switch_on(pdo)?;
    s.refuses(pdo.mapping(), 0, 0, &LOCKED)
}

fn too_many(s: &mut Subject<'_>) -> Outcome {
    let pdo = empty(s, TPDO)?;
    s.refuses(pdo.mapping(), 0, 65, &[abort::PDO_LENGTH, abort::VALUE, abort::TOO_HIGH])
}

fn too_long(s: &mut Subject<'_>) -> Outcome {
    let is_long = |entry: &Entry| {
        entry.is_tpdo_mappable() && entry.index >= 0x2000 && matches!(size(entry), Some(2..=8))
    };
    let entry = s.entry("object for a TPDO of two or more bytes", is_long)?;
    let pdo = empty(s, TPDO)?;
    let places = u8::try_from(8 / size(&entry).unwrap_or(8) + 1).unwrap_or(5);
    for sub in 1..=places {
        s.need(pdo.mapping(), sub)?;
        match s.change(pdo.mapping(), sub, &mapped(&entry).to_le_bytes())? {
            Ok(()) => (),
            Err(Refusal(abort::PDO_LENGTH)) => return Ok(()),
            Err(refusal) => return Err(fail("abort 0604 0042h, or the entry is taken", refusal)),
        }
    }
    s.refuses(pdo.mapping(), 0, places.into(), &[abort::PDO_LENGTH])
}

fn maps<const FIRST: u16>(s: &mut Subject<'_>) -> Outcome {
    let is_transmit = FIRST == TPDO;
    let name = if is_transmit { "input (ro, rwr)" } else { "output (wo, rww)" };
    let entry = s.entry(name, |entry| {
        let fits = if is_transmit { !entry.access.is_writable() } else { entry.is_rpdo_mappable() };
        fits && entry.mappable && entry.index >= 0x2000 && matches!(size(entry), Some(1..=8))
    })?;
    let pdo = empty(s, FIRST)?;
    s.set(pdo.mapping(), 1, mapped(&entry))?;
    s.set(pdo.mapping(), 0, 1)
}

/// Maps an object that the device must refuse, either at the entry or at the number of entries.
fn refuses_mapping(s: &mut Subject<'_>, pdo: Pdo, value: u32, codes: &[u32]) -> Outcome {
    match s.change(pdo.mapping(), 1, &value.to_le_bytes())? {
        Ok(()) => s.refuses(pdo.mapping(), 0, 1, codes),
        Err(Refusal(code)) if codes.contains(&code) => Ok(()),
        Err(refusal) => Err(fail(format!("an abort of the mapping of {value:08X}h"), refusal)),
    }
}

fn refuses_direction<const FIRST: u16>(s: &mut Subject<'_>) -> Outcome {
    let is_transmit = FIRST == TPDO;
    let name = if is_transmit { "output (wo, rww)" } else { "input (ro, rwr)" };
    let entry = s.entry(name, |entry| {
        let (into_tpdo, into_rpdo) = (entry.is_tpdo_mappable(), entry.is_rpdo_mappable());
        let is_of_the_other = if is_transmit { into_rpdo && !into_tpdo } else { into_tpdo && !into_rpdo };
        is_of_the_other && entry.index >= 0x2000 && matches!(size(entry), Some(1..=8))
    })?;
    let pdo = empty(s, FIRST)?;
    refuses_mapping(s, pdo, mapped(&entry), &[abort::NOT_MAPPABLE])
}

fn refuses_unmappable<const FIRST: u16>(s: &mut Subject<'_>) -> Outcome {
    let pdo = empty(s, FIRST)?;
    refuses_mapping(s, pdo, 0x1018_0120, &[abort::NOT_MAPPABLE])
}

fn dummy(s: &mut Subject<'_>) -> Outcome {
    let pdo = empty(s, RPDO)?;
    // UNSIGNED8 fills the place of a byte.
    match s.change(pdo.mapping(), 1, &0x0005_0008_u32.to_le_bytes())? {
        Ok(()) => s.set(pdo.mapping(), 0, 1),
        Err(refusal) => Err(skip(format!("the device has no dummy objects: {refusal}"))),
    }
}

fn absent(s: &mut Subject<'_>) -> Outcome {
    let pdo = empty(s, TPDO)?;
    refuses_mapping(s, pdo, 0x0FFF_0008, &[abort::NO_OBJECT, abort::NOT_MAPPABLE])
}

fn wrong_length(s: &mut Subject<'_>) -> Outcome {
    let is_long = |entry: &Entry| {
        entry.is_tpdo_mappable() && entry.index >= 0x2000 && matches!(size(entry), Some(2..=8))
    };
    let entry = s.entry("object for a TPDO of two or more bytes", is_long)?;
    let pdo = empty(s, TPDO)?;
    let codes = [
        abort::NOT_MAPPABLE,
        abort::PDO_LENGTH,
        abort::LENGTH,
        abort::TOO_LONG,
        abort::TOO_SHORT,
        abort::VALUE,
    ];
    refuses_mapping(s, pdo, mapped(&entry) + 8, &codes)
}

fn length(s: &mut Subject<'_>) -> Outcome {
    let pdo = s.tpdo(254, 50)?;
    let bits: u32 = s.mapping(pdo.index)?.iter().map(|(_, bits)| u32::from(*bits)).sum();
    s.switch_on(pdo)?;
    s.enter(State::Operational)?;
    let mark = s.mark();
    let frame = s.next(mark, pdo.id(), 500)?.ok_or_else(|| fail("a TPDO", "none in 500 ms"))?;
    let expected = usize::try_from(bits.div_ceil(8)).unwrap_or(8);
    ensure(frame.frame.len() == expected, format!("{expected} bytes"), format!("{}", frame.frame.len()))
}

fn mapping_returns(s: &mut Subject<'_>) -> Outcome {
    s.reset(Command::ResetCommunication)?;
    let index = *s.pdos(TPDO)?.first().ok_or_else(|| skip("the device has no TPDO"))?;
    let before = s.mapping(index)?;
    let pdo = s.pdo(TPDO)?;
    s.empty(pdo)?;
    s.reset(Command::ResetCommunication)?;
    let after = s.mapping(index)?;
    ensure(before == after, format!("{before:?}"), format!("{after:?}"))
}
