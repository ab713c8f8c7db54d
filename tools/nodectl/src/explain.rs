//! Emergency error codes and SDO abort codes of the nodes of this project: meaning, cause and remedy.

use canopen::sdo::Abort;

/// An emergency error code of a node of this project.
#[derive(Debug)]
pub struct Emergency {
    /// The code.
    pub code: u16,
    /// The first byte of the error field, where it tells errors of one code apart.
    pub detail: Option<u8>,
    /// The name of the error.
    pub name: &'static str,
    /// What has happened.
    pub cause: &'static str,
    /// What to do.
    pub remedy: &'static str,
}

const fn row(
    code: u16,
    detail: Option<u8>,
    name: &'static str,
    cause: &'static str,
    remedy: &'static str,
) -> Emergency {
    Emergency { code, detail, name, cause, remedy }
}

/// All emergency error codes that a node of this project sends.
pub const EMERGENCIES: [Emergency; 31] = [
    row(0x0000, None, "no error", "The last error is gone.", "Nothing. 1003h has the errors that were sent."),
    row(
        0x2110,
        None,
        "encoder current too high",
        "An encoder draws more current than its supply delivers.",
        "Disconnect the encoder, check its cable for a short circuit.",
    ),
    row(
        0x3110,
        None,
        "encoder supply out of range",
        "The supply voltage of the encoders is too low or too high.",
        "Measure the supply at the encoder connector.",
    ),
    row(
        0x5003,
        None,
        "parameter memory failed",
        "The flash for parameters cannot be read or written. The node runs with default values and stores nothing.",
        "Switch the power off and on. If the error returns, replace the board.",
    ),
    row(
        0x5006,
        Some(0),
        "pressure sensor break",
        "The pressure input is open, or the sensor supplies no signal.",
        "Check the wires of the pressure sensor and its supply.",
    ),
    row(
        0x5006,
        Some(1),
        "encoder does not answer",
        "An encoder sends no signal or no valid SSI word.",
        "Check supply and wires of the encoder, and the SSI format (2105h).",
    ),
    row(
        0x5006,
        Some(2),
        "encoder position not valid",
        "The position may be wrong: movement without supply or battery, overspeed, a missing or displaced index.",
        "Move to a known position and write a preset (6003h); with an absolute encoder write 2109h or reset the node.",
    ),
    row(
        0x5100,
        None,
        "encoder memory damaged",
        "The memory of the position in the backup SRAM is damaged.",
        "Check the position, write a preset (6003h), check the backup battery.",
    ),
    row(
        0x6101,
        None,
        "unexpected reset",
        "The watchdog or a fault of the program has reset the node.",
        "Read the log with a debug probe; NMT reset node clears the error.",
    ),
    row(
        0x6102,
        None,
        "update rolled back",
        "A new program was not confirmed, was withdrawn, or did not start. The node runs the previous program.",
        "Read the reason with `nodectl info`; update again and confirm.",
    ),
    row(
        0x6300,
        Some(1),
        "calibration damaged, previous in use",
        "The last save of the calibration (2200h to 2202h) cannot be read.",
        "Compare 2200h to 2202h with the calibration certificate and save them (2204h).",
    ),
    row(
        0x6300,
        Some(2),
        "calibration damaged, defaults in use",
        "The calibration (2200h to 2202h) cannot be read.",
        "Write 2200h to 2202h again and save them (2204h). Until then the pressure is not that of this sensor.",
    ),
    row(
        0x6301,
        Some(1),
        "node settings damaged, previous in use",
        "The last save of node-ID, bit rate and personality cannot be read.",
        "Set and store node-ID and bit rate by LSS, the personality by 2000h.",
    ),
    row(
        0x6301,
        Some(2),
        "node settings damaged, defaults in use",
        "Node-ID, bit rate and personality cannot be read.",
        "Set and store node-ID and bit rate by LSS, the personality by 2000h.",
    ),
    row(
        0x6302,
        Some(1),
        "communication parameters damaged, previous in use",
        "The last save of 1000h to 1FFFh cannot be read.",
        "Apply the configuration again (`nodectl apply FILE --save`).",
    ),
    row(
        0x6302,
        Some(2),
        "communication parameters damaged, defaults in use",
        "The stored values of 1000h to 1FFFh cannot be read.",
        "Apply the configuration again (`nodectl apply FILE --save`).",
    ),
    row(
        0x6303,
        Some(1),
        "application parameters damaged, previous in use",
        "The last save of 2000h to 9FFFh cannot be read.",
        "Apply the configuration again (`nodectl apply FILE --save`).",
    ),
    row(
        0x6303,
        Some(2),
        "application parameters damaged, defaults in use",
        "The stored values of 2000h to 9FFFh cannot be read.",
        "Apply the configuration again (`nodectl apply FILE --save`).",
    ),
    row(
        0x8001,
        None,
        "temperature input out of range",
        "The temperature input is at an end of its range.",
        "Check thermistor and wires (2201h), or choose the sensor of the chip.",
    ),
    row(
        0x8002,
        None,
        "pressure input out of range",
        "The pressure input is at an end of its range.",
        "Check the sensor, its supply and the divider; the pressure may exceed the range.",
    ),
    row(
        0x8100,
        None,
        "SYNC missing",
        "No SYNC within the communication cycle period (1006h).",
        "Check the SYNC producer, or write 0 to 1006h.",
    ),
    row(
        0x8110,
        None,
        "CAN overrun",
        "A received frame was lost because the queue was full.",
        "Reduce the load of the bus, or space transfers to this node.",
    ),
    row(
        0x8120,
        None,
        "error passive",
        "The CAN controller has counted 128 errors.",
        "Check bit rate, termination (two times 120 ohm), wires, and that another node acknowledges.",
    ),
    row(
        0x8130,
        None,
        "heartbeat or life guarding error",
        "A monitored node is silent. The error field has the sub-index of 1016h.",
        "Check that node, or adapt 1016h.",
    ),
    row(
        0x8140,
        None,
        "recovered from bus-off",
        "The CAN controller was off the bus after 256 errors and is back.",
        "Check bit rate, termination and short circuits of the wires.",
    ),
    row(
        0x8210,
        None,
        "RPDO too short",
        "An RPDO has fewer bytes than its mapping. The error field has its number.",
        "Make the mapping of the sender and of 1600h + number - 1 equal.",
    ),
    row(
        0x8220,
        None,
        "RPDO too long",
        "An RPDO has more bytes than its mapping. The error field has its number.",
        "Make the mapping of the sender and of 1600h + number - 1 equal.",
    ),
    row(
        0x8230,
        None,
        "multiplexed PDO not processed",
        "A multiplexed PDO to this node names an object that does not exist, is not mappable, or rejects the value.",
        "Correct the object and the value in the sender.",
    ),
    row(
        0x8240,
        None,
        "SYNC length",
        "A SYNC has another length than 1019h requires.",
        "Set 1019h as in the SYNC producer: 0 without a counter, 2 to 240 with a counter.",
    ),
    row(
        0x8250,
        None,
        "RPDO time-out",
        "An RPDO has not arrived within its event timer (1400h:5). The error field has its number.",
        "Check the sender, or lengthen the event timer.",
    ),
    row(0x1000, None, "generic error", "An error without a code of its own.", "Read 3000h:1 and 3000h:3."),
];

/// The row of an emergency, by its code and the first byte of its error field.
#[must_use]
pub fn emergency(code: u16, detail: u8) -> Option<&'static Emergency> {
    let fits = |row: &&Emergency| row.code == code && row.detail.is_none_or(|own| own == detail);
    EMERGENCIES.iter().find(fits)
}

/// All rows of a code.
pub fn emergencies(code: u16) -> impl Iterator<Item = &'static Emergency> {
    EMERGENCIES.iter().filter(move |row| row.code == code)
}

/// What makes a node of this project abort a transfer with this code, and what to do.
#[must_use]
pub const fn abort(abort: Abort) -> (&'static str, &'static str) {
    match abort {
        Abort::Toggle => (
            "Two clients use one SDO channel, or a segment was lost.",
            "Let one client at a time use the channel.",
        ),
        Abort::TimeOut => ("The client was silent for a second within a transfer.", "Repeat the transfer."),
        Abort::Command => (
            "The request is no SDO request, or belongs to no transfer.",
            "Let one client at a time use the channel; check the master.",
        ),
        Abort::BlockSize => {
            ("The client asks for blocks of 0 or more than 127 segments.", "Set the block size to 1 to 127.")
        }
        Abort::Sequence => ("The client acknowledges a segment that was not sent.", "Repeat the transfer."),
        Abort::Crc => {
            ("The data was damaged, or client and node compute different checks.", "Repeat the transfer.")
        }
        Abort::OutOfMemory => {
            ("The data is longer than the buffer of the transfer.", "Send no more than the object has.")
        }
        Abort::Access => (
            "The object does not support the access now: a PDO that is valid, a mapping that is not empty, a lock that is closed.",
            "Set bit 31 of the COB-ID and sub-index 0 of the mapping to 0 first; open the lock.",
        ),
        Abort::WriteOnly => ("The object cannot be read.", "See the access in the data sheet."),
        Abort::ReadOnly => ("The object cannot be written.", "See the access in the data sheet."),
        Abort::NoObject => (
            "The personality of the node (2000h) has no such object.",
            "Read 1018h:2 and use its data sheet.",
        ),
        Abort::NotMappable => {
            ("The object cannot be mapped in this direction.", "See PDOMapping in the data sheet.")
        }
        Abort::PdoLength => ("The mapped objects have more than 64 bits.", "Use a second PDO."),
        Abort::Parameter => (
            "The value contradicts another parameter.",
            "Write the other parameter first: the order matters, as with the ends of a range.",
        ),
        Abort::Incompatible => ("The node cannot do this in its state.", "Read the status of the service."),
        Abort::Hardware => {
            ("The flash failed, or the supply is below 2.9 V.", "Check the supply; read 2001h:10.")
        }
        Abort::Length => ("The length does not match the data type.", "Use the data type of the data sheet."),
        Abort::TooLong => ("More bytes than the data type has.", "Use the data type of the data sheet."),
        Abort::TooShort => ("Fewer bytes than the data type has.", "Use the data type of the data sheet."),
        Abort::NoSubIndex => ("The object has no such sub-index.", "See the data sheet."),
        Abort::InvalidValue => (
            "The object does not accept the value.",
            "See the values of the object; `nodectl list OBJECT` has its range.",
        ),
        Abort::ValueTooHigh => {
            ("The value is above the upper limit.", "`nodectl list OBJECT` has the range.")
        }
        Abort::ValueTooLow => ("The value is below the lower limit.", "`nodectl list OBJECT` has the range."),
        Abort::LimitsReversed => ("The maximum would be below the minimum.", "Write the maximum first."),
        Abort::NoConnection => ("The SDO channel is not available.", "Use the default channel."),
        Abort::General => ("An error without a code of its own.", "Read the EMCY and 1003h."),
        Abort::NotStored => (
            "The signature is wrong (\"save\", \"load\", \"cali\"), or the data was not stored.",
            "Write the word of the object, as `nodectl write 1010:1 save`.",
        ),
        Abort::LocalControl => ("The device is under local control.", "Hand the control to the bus."),
        Abort::DeviceState => (
            "The state of the node forbids it: a save runs, the parameter memory is full, a program is on trial, a key is required, or the measured value is not valid.",
            "Read 2010h:1 (saves left), 2002h:1 (trial), 2003h:1 (key), 6150h (status). NMT Pre-operational makes room in the memory.",
        ),
        Abort::NoDictionary => ("The node has no object dictionary.", "Check the master."),
        Abort::NoData => ("There is no value, as in 1003h without an error.", "Nothing."),
        _ => ("The library knows a code that this table lacks.", "See CiA 301, table 22."),
    }
}

/// The reason of an abort code; `None` for a code that CiA 301 does not define.
#[must_use]
pub fn reason(code: u32) -> Option<Abort> {
    Abort::ALL.into_iter().find(|abort| abort.code() == code)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The faults of the library and of all profiles, as the table of the tests on the running node has them.
    const TABLE: &str = include_str!("../../../host-tests/tables/emcy.csv");

    #[test]
    fn every_emergency_that_a_node_sends_is_explained() {
        let mut rows = 0;
        for line in TABLE.lines().skip(1) {
            let cells: Vec<&str> = line.split(',').collect();
            let [code, _, _, _, _, fault, remark] = cells[..] else { panic!("{line}") };
            if fault.is_empty() && code != "0x0000" {
                continue;
            }
            let code = u16::from_str_radix(&code[2..], 16).unwrap();
            let detail =
                remark.rsplit_once("detail is ").and_then(|(_, detail)| detail.parse().ok()).unwrap_or(0);
            assert!(emergency(code, detail).is_some(), "{line}");
            rows += 1;
        }
        assert!(rows > 25, "{rows} rows");
    }

    #[test]
    fn every_row_is_found_by_its_code_and_detail() {
        for row in &EMERGENCIES {
            let found = emergency(row.code, row.detail.unwrap_or(0)).unwrap();
            assert_eq!(found.name, row.name);
        }
        assert!(emergency(0x5006, 9).is_none() && emergency(0x4711, 0).is_none());
    }

    #[test]
    fn every_abort_code_is_explained() {
        for reason in Abort::ALL {
            assert!(!abort(reason).0.contains("table lacks"), "{reason:?}");
            assert_eq!(super::reason(reason.code()), Some(reason));
        }
        assert_eq!(super::reason(0x1234_5678), None);
    }
}
