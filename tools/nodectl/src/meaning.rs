//! Numbers with a meaning: units, emergency error codes, status bits.

use canopen::emcy::Message;
use canopen::sdo::Multiplexer;

use crate::object::at;
use crate::unit::symbol;
use crate::update::{Event, Log};
use crate::value::Value;
use crate::{Catalogue, explain};

/// The meaning of a value in words; `None` where the number itself is the meaning.
#[must_use]
pub fn of(catalogue: &Catalogue, at: Multiplexer, value: &Value) -> Option<String> {
    if let Value::Real32(number) = value {
        return number.is_nan().then(|| "no valid value".to_owned());
    }
    if let (0x2006, Value::Bytes(log), true) = (at.index, value, catalogue.is_of_this_project()) {
        return update_log(log);
    }
    let Value::Integer(number) = value else { return None };
    let name = catalogue.name(at).unwrap_or_default().to_lowercase();
    if at.index == 0x1003 && at.sub > 0 {
        let [low, high, detail, _] = u32::try_from(*number).ok()?.to_le_bytes();
        let code = u16::from_le_bytes([low, high]);
        return Some(format!("{code:04X}h {}", listed_error(code, detail, catalogue)));
    }
    if (at.index, at.sub) == (0x2002, 1) && catalogue.is_of_this_project() {
        return trial(*number).map(str::to_owned);
    }
    if at.index == 0x1016 && at.sub > 0 {
        return monitored(u32::try_from(*number).ok()?);
    }
    if at.sub > 0 && name.contains("physical unit") {
        return Some(symbol(u32::try_from(*number).ok()?));
    }
    (at.sub > 0 && name.contains("ai status")).then(|| status(*number))
}

/// The events of the update log (2006h), the newest first; `None` without one.
fn update_log(log: &[u8]) -> Option<String> {
    let words =
        |event: Event| format!("{}, key generation {}: {}", event.version, event.generation, event.outcome);
    let events: Vec<String> = Log::from_bytes(log).events().map(words).collect();
    (!events.is_empty()).then(|| events.join("; "))
}

/// The state of the trial of a program (2002h:1).
fn trial(state: i128) -> Option<&'static str> {
    [
        "no trial",
        "on trial",
        "rolled back after three starts",
        "rolled back by a command, or not confirmed in time",
    ]
    .get(usize::try_from(state).ok()?)
    .copied()
}

/// An entry of the heartbeat consumer (1016h): the node and the time. Without one of both, the entry monitors no node.
fn monitored(entry: u32) -> Option<String> {
    let [low, high, node, reserved] = entry.to_le_bytes();
    let time = u16::from_le_bytes([low, high]);
    match (node, time, reserved) {
        (0, _, 0) | (_, 0, 0) => Some("off".to_owned()),
        (1..=127, _, 0) => Some(format!("node {node}, {time} ms")),
        _ => None,
    }
}

/// Status of an analogue input (CiA 404, 6150h).
fn status(bits: i128) -> String {
    let words: [(i128, &str); 4] = [
        (1, "not valid"),
        (2, "positive overload"),
        (4, "negative overload"),
        (8, "no temperature compensation"),
    ];
    let set: Vec<&str> = words.into_iter().filter(|(bit, _)| bits & bit != 0).map(|(_, word)| word).collect();
    if set.is_empty() { "valid".to_owned() } else { set.join(", ") }
}

/// Bits of the error register (1001h; CiA 301, 7.5.2.2).
const REGISTER: [&str; 8] =
    ["generic", "current", "voltage", "temperature", "communication", "profile", "reserved", "manufacturer"];

/// An emergency in words: code, error register, and the manufacturer's part. `is_own` is for a node of this project,
/// whose codes have names of their own.
#[must_use]
pub fn emergency(message: Message, is_own: bool) -> String {
    let Message { code, register, detail } = message;
    let bits = REGISTER.iter().enumerate().filter(|(bit, _)| register >> bit & 1 == 1);
    let bits: Vec<&str> = bits.map(|(_, name)| *name).collect();
    let bits = if bits.is_empty() { String::new() } else { format!(" ({})", bits.join(", ")) };
    let text =
        format!("{code:04X}h {}, error register {register:02X}h{bits}", error_name(code, detail[0], is_own));
    if detail == [0; 5] {
        return text;
    }
    let detail: Vec<String> = detail.iter().map(|byte| format!("{byte:02X}")).collect();
    format!("{text}, manufacturer {}", detail.join(" "))
}

/// Emergency error codes (CiA 301, table 26): codes with a name of their own, then the classes.
const CODES: [(u16, u16, &str); 31] = [
    (0x8110, 0xFFFF, "CAN overrun"),
    (0x8120, 0xFFFF, "error passive"),
    (0x8130, 0xFFFF, "heartbeat or life guarding error"),
    (0x8140, 0xFFFF, "recovered from bus-off"),
    (0x8150, 0xFFFF, "CAN-ID collision"),
    (0x8210, 0xFFFF, "PDO not processed because of its length"),
    (0x8220, 0xFFFF, "PDO length exceeded"),
    (0x8230, 0xFFFF, "MPDO not processed"),
    (0x8240, 0xFFFF, "unexpected SYNC data length"),
    (0x8250, 0xFFFF, "RPDO time-out"),
    (0x0000, 0xFF00, "no error"),
    (0x1000, 0xFF00, "generic error"),
    (0x2100, 0xFF00, "current at the input"),
    (0x2200, 0xFF00, "current inside the device"),
    (0x2300, 0xFF00, "current at the output"),
    (0x3100, 0xFF00, "mains voltage"),
    (0x3200, 0xFF00, "voltage inside the device"),
    (0x3300, 0xFF00, "output voltage"),
    (0x4100, 0xFF00, "ambient temperature"),
    (0x4200, 0xFF00, "device temperature"),
    (0x5000, 0xFF00, "device hardware"),
    (0x6100, 0xFF00, "internal software"),
    (0x6200, 0xFF00, "user software"),
    (0x6300, 0xFF00, "data set"),
    (0x7000, 0xFF00, "additional modules"),
    (0x8100, 0xFF00, "communication"),
    (0x8200, 0xFF00, "protocol error"),
    (0x8000, 0xF000, "monitoring"),
    (0x9000, 0xFF00, "external error"),
    (0xF000, 0xFF00, "additional functions"),
    (0xFF00, 0xFF00, "device specific"),
];

/// An error in words, by the emergency error code and the first byte of the error field: for a node of this project by its
/// own table, else by CiA 301.
#[must_use]
pub fn error_name(code: u16, detail: u8, is_own: bool) -> &'static str {
    let own = explain::emergency(code, detail).filter(|_| is_own);
    own.map_or_else(|| error_code(code), |row| row.name.as_str())
}

/// Objects of the sensors: the limits of the pressure sensor, the frame of the encoder.
const SENSORS: [(u16, &[u8]); 2] = [(0x2200, &[0]), (0x2103, &[1, 2])];

/// An error of the list 1003h in words. The list of a node of this project has no error field, so an error with several
/// causes has the names of all causes that are possible with the sensors in the data sheet.
#[must_use]
pub fn listed_error(code: u16, detail: u8, catalogue: &Catalogue) -> String {
    let is_own = catalogue.is_of_this_project();
    let sensors = SENSORS.iter().filter(|(index, _)| catalogue.entry(at(*index, 0)).is_some());
    let details = sensors.flat_map(|(_, details)| details.iter().copied());
    let has_several =
        explain::emergency(code, 1).map(|row| &row.name) != explain::emergency(code, 0).map(|row| &row.name);
    let mut names: Vec<&str> = Vec::new();
    if is_own && detail == 0 && has_several {
        names.extend(details.map(|detail| error_name(code, detail, true)));
    }
    if names.is_empty() { error_name(code, detail, is_own).to_owned() } else { names.join(", or ") }
}

/// An emergency error code in words (CiA 301).
#[must_use]
pub fn error_code(code: u16) -> &'static str {
    CODES.iter().find(|row| code & row.1 == row.0).map_or("not defined by CiA 301", |row| row.2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_in_words() {
        for (code, words) in [
            (0x0000, "no error"),
            (0x1000, "generic error"),
            (0x8130, "heartbeat or life guarding error"),
            (0x8199, "communication"),
            (0x6302, "data set"),
            (0x7ABC, "not defined by CiA 301"),
        ] {
            assert_eq!(error_code(code), words, "{code:04X}h");
        }
    }

    #[test]
    fn an_error_of_the_list_has_the_names_of_the_causes_that_the_device_can_have() {
        for (file, expected) in [
            ("pressure.eds", "sensor break"),
            ("encoder.eds", "encoder does not answer, or position of the encoder is wrong"),
            ("combined.eds", "sensor break, or encoder does not answer, or position of the encoder is wrong"),
            ("lift.eds", "sensor break, or encoder does not answer, or position of the encoder is wrong"),
        ] {
            let catalogue = Catalogue::of_file(file).expect("a data sheet");
            assert_eq!(listed_error(0x5006, 0, &catalogue), expected, "{file}");
            assert_eq!(listed_error(0x5006, 2, &catalogue), "position of the encoder is wrong");
            assert_eq!(listed_error(0x6300, 0, &catalogue), "stored calibration is damaged");
            assert_eq!(listed_error(0x8130, 0, &catalogue), "heartbeat of a watched node is missing");
            assert_eq!(listed_error(0x4711, 0, &catalogue), "not defined by CiA 301");
        }
        let unknown = Catalogue::unknown();
        assert_eq!(listed_error(0x5006, 0, &unknown), "device hardware");
    }

    #[test]
    fn values_of_a_pressure_transmitter_have_a_meaning() {
        let catalogue = Catalogue::of_file("pressure.eds").expect("a data sheet");
        let says = |index, sub, number| of(&catalogue, at(index, sub), &Value::Integer(number));
        assert_eq!(says(0x6131, 1, 0xFD4E_0000).as_deref(), Some("mbar"));
        assert_eq!(says(0x6150, 1, 0).as_deref(), Some("valid"));
        assert_eq!(says(0x6150, 1, 3).as_deref(), Some("not valid, positive overload"));
        assert_eq!(
            says(0x1003, 1, 0x0001_8130).as_deref(),
            Some("8130h heartbeat of a watched node is missing")
        );
        assert_eq!(says(0x2002, 1, 1).as_deref(), Some("on trial"));
        assert_eq!(says(0x2002, 1, 4), None);
        let log = |bytes: &[u8]| of(&catalogue, at(0x2006, 0), &Value::Bytes(bytes.to_vec()));
        assert_eq!(
            log(&[3, 1, 0, 0, 0, 2, 0, 1, 1, 0, 0, 0, 0, 2, 0, 1]).as_deref(),
            Some("0.2.0, key generation 1: confirmed by a command; 0.2.0, key generation 1: on trial")
        );
        assert_eq!(log(&[0; 128]), None);
        assert_eq!(says(0x1016, 1, 0x0005_03E8).as_deref(), Some("node 5, 1000 ms"));
        assert_eq!(says(0x1016, 1, 0x0005_0000).as_deref(), Some("off"));
        assert_eq!((says(0x1016, 0, 4), says(0x1016, 1, 0x00FF_03E8)), (None, None));
        assert_eq!(says(0x6131, 0, 2), None);
        assert_eq!(says(0x1017, 0, 1000), None);
        let nan = of(&catalogue, at(0x6130, 1), &Value::Real32(f32::NAN));
        assert_eq!(nan.as_deref(), Some("no valid value"));
    }
}
