//! The seeded breaches: each changes the clean trace in one place.

use canopen::Instant;
use monitor::{Incident, Rule};

use crate::trace::{Event, Trace};

/// A breach.
pub(crate) struct Seeded {
    pub(crate) name: &'static str,
    pub(crate) rule: Rule,
    /// Whether the frames without their senders show it.
    pub(crate) shows_in_log: bool,
    pub(crate) seed: fn(&mut Trace),
}

/// A breach that frames show.
const fn shown(name: &'static str, rule: Rule, seed: fn(&mut Trace)) -> Seeded {
    Seeded { name, rule, shows_in_log: true, seed }
}

/// A breach that needs the sender of a frame, or what the bus does not show.
const fn hidden(name: &'static str, rule: Rule, seed: fn(&mut Trace)) -> Seeded {
    Seeded { name, rule, shows_in_log: false, seed }
}

const RESPONSE: u16 = 0x585;
/// A time in Operational between two SYNCs, and one in Pre-operational after the last restart.
const BETWEEN: u64 = 333_000;
const LATE: u64 = 1_600_000;

fn any(_: &[u8]) -> bool {
    true
}

/// Replaces one byte of the first frame that fits.
fn set(trace: &mut Trace, id: u16, command: u8, place: usize, value: u8) {
    trace.edit(
        20_000,
        id,
        |data| data[0] == command,
        |data| {
            let mut data = data.to_vec();
            data[place] = value;
            Some(data)
        },
    );
}

pub(crate) fn all() -> Vec<Seeded> {
    let mut all = values();
    all.extend(states());
    all.extend(protocol());
    all.extend(process_data());
    all.extend(nodes());
    all
}

fn values() -> Vec<Seeded> {
    vec![
        shown("an aborted download is in force", Rule::AbortActed, |trace| {
            trace.at(LATE).read(0x6003, 0, &[7, 0, 0, 0]);
            trace.refused(0x6003, 0, &[9, 0, 0, 0]);
            trace.read(0x6003, 0, &[9, 0, 0, 0]);
        }),
        shown("an aborted download spoils the value", Rule::AbortActed, |trace| {
            trace.at(LATE).write(0x6003, 0, &[7, 0, 0, 0]);
            trace.read(0x6003, 0, &[7, 0, 0, 0]);
            trace.refused(0x6003, 0, &[9, 0, 0, 0]);
            trace.read(0x6003, 0, &[0, 0, 0, 0]);
        }),
        hidden("an aborted download is in force, as read without the bus", Rule::AbortActed, |trace| {
            trace.at(LATE).refused(0x6003, 0, &[9, 0, 0, 0]);
            let value = vec![9, 0, 0, 0];
            trace.events.push(Event::Value(Instant(LATE + 10_000), 0, (0x6003, 0), value));
        }),
        shown("an accepted value does not read back", Rule::ReadBack, |trace| {
            trace.at(LATE).write(0x6006, 0, &[7, 0, 0, 0]);
            trace.read(0x6006, 0, &[6, 0, 0, 0]);
        }),
        shown("an accepted heartbeat time does not read back", Rule::ReadBack, |trace| {
            trace.at(LATE).write(0x1029, 1, &[1]);
            trace.read(0x1029, 1, &[0]);
        }),
        shown("a saved value is lost", Rule::SaveLost, |trace| {
            trace.edit(
                1_100_000,
                RESPONSE,
                |data| data[1..4] == [0x03, 0x60, 0],
                |_| Some(vec![0x43, 0x03, 0x60, 0, 0, 0, 0, 0]),
            );
        }),
        shown("a saved communication parameter is lost", Rule::SaveLost, |trace| {
            trace.edit(
                1_100_000,
                RESPONSE,
                |data| data[1..4] == [0x17, 0x10, 0],
                |_| Some(vec![0x4B, 0x17, 0x10, 0, 99, 0, 0, 0]),
            );
        }),
        shown("a restored value is not the default", Rule::RestoreLost, |trace| {
            trace.edit(
                1_400_000,
                RESPONSE,
                |data| data[1..4] == [0x03, 0x60, 0],
                |_| Some(vec![0x43, 0x03, 0x60, 0, 0xD2, 4, 0, 0]),
            );
        }),
        shown("1001h has an error that no EMCY has", Rule::Emcy, |trace| {
            trace.at(LATE).read(0x1001, 0, &[1]);
        }),
        shown("1001h has no error after an EMCY", Rule::Emcy, |trace| {
            trace.edit(
                510_000,
                RESPONSE,
                |data| data[1..4] == [0x01, 0x10, 0],
                |_| Some(vec![0x4F, 0x01, 0x10, 0, 0, 0, 0, 0]),
            );
        }),
        shown("1003h lists an error that no EMCY has", Rule::Emcy, |trace| {
            trace.at(LATE).read(0x1003, 0, &[1]);
        }),
        shown("1003h lists another error than the EMCY", Rule::Emcy, |trace| {
            trace.edit(
                510_000,
                RESPONSE,
                |data| data[1..4] == [0x03, 0x10, 1],
                |_| Some(vec![0x43, 0x03, 0x10, 1, 0x30, 0x81, 0, 0]),
            );
        }),
        shown("an EMCY without the generic bit", Rule::Emcy, |trace| {
            trace.node(LATE, 0, 0x085, &[0x00, 0x10, 0, 0, 0, 0, 0, 0]);
        }),
        shown("an EMCY of seven bytes", Rule::Emcy, |trace| {
            trace.node(LATE, 0, 0x085, &[0x00, 0x10, 1, 0, 0, 0, 0]);
        }),
    ]
}

fn states() -> Vec<Seeded> {
    vec![
        shown("a node becomes Operational by itself", Rule::NmtState, |trace| {
            trace.edit(1_550_000, 0x705, any, |_| Some(vec![5]));
        }),
        shown("a node stops without EMCY", Rule::NmtState, |trace| {
            trace.edit(600_000, 0x705, any, |_| Some(vec![4]));
        }),
        shown("a node becomes Pre-operational before its EMCY", Rule::NmtState, |trace| {
            trace.edit(500_000, 0x085, any, |_| None);
            trace.node(507_000, 0, 0x085, &[0x06, 0x50, 1, 0, 0, 0, 0, 0]);
        }),
        shown("a node leaves Stopped by itself", Rule::NmtState, |trace| {
            trace.edit(800_000, 0x705, any, |_| Some(vec![127]));
        }),
        shown("a heartbeat with a reserved state", Rule::NmtState, |trace| {
            trace.edit(1_650_000, 0x705, any, |_| Some(vec![6]));
        }),
        shown("a heartbeat of two bytes", Rule::NmtState, |trace| {
            trace.edit(1_650_000, 0x705, any, |_| Some(vec![127, 0]));
        }),
        shown("an SDO response in Stopped", Rule::NmtState, |trace| {
            trace.at(830_000).read(0x6003, 0, &[0xD2, 4, 0, 0]);
        }),
        shown("a TPDO in Pre-operational", Rule::NmtState, |trace| {
            trace.node(LATE, 0, 0x285, &[0]);
        }),
        shown("a device error that changes nothing", Rule::ErrorBehaviour, |trace| {
            trace.node(410_000, 1, 0x086, &[0x06, 0x50, 1, 0, 0, 0, 0, 0]);
        }),
        shown("a communication error that does not stop the node", Rule::ErrorBehaviour, |trace| {
            trace.at(LATE).write(0x1029, 1, &[2]);
            trace.node(LATE + 10_000, 0, 0x085, &[0x30, 0x81, 17, 0, 0, 0, 0, 0]);
            trace.node(1_850_000, 0, 0x705, &[127]);
            trace.node(1_950_000, 0, 0x705, &[127]);
        }),
        shown("a heartbeat is missing on an idle bus", Rule::HeartbeatLate, |trace| {
            trace.edit(150_000, 0x705, any, |_| None);
        }),
        shown("heartbeats are slower than 1017h", Rule::HeartbeatLate, |trace| {
            trace.at(LATE).write(0x1017, 0, &[10, 0]);
        }),
        hidden("a node that starves its own heartbeat", Rule::HeartbeatLate, |trace| {
            trace.events.push(Event::Value(Instant(300_000), 1, (0x1800, 2), vec![255]));
            trace.remove(380_000..1_900_000, 0x706);
            for n in 0..1500 {
                trace.node(406_500 + n * 500, 1, 0x186, &[1, 2, 3, 4]);
            }
        }),
    ]
}

fn protocol() -> Vec<Seeded> {
    vec![
        shown("a request without an answer", Rule::SdoSilent, |trace| {
            trace.remove(20_500..22_000, RESPONSE);
            trace.remove(21_500..260_000, 0x605);
            trace.remove(21_500..800_000, RESPONSE);
            trace.remove(500_000..800_000, 0x605);
            trace.remove(900_000..1_900_000, 0x000);
            trace.remove(620_000..700_000, 0x000);
            trace.remove(640_000..1_900_000, 0x705);
            for at in (705..1705).step_by(100) {
                trace.node(at * 1000 + 250, 0, 0x705, &[127]);
            }
            trace.remove(1_000_000..1_900_000, 0x605);
            trace.remove(1_000_000..1_900_000, RESPONSE);
        }),
        shown("a node keeps its bit rate and leaves a request without an answer", Rule::SdoSilent, |trace| {
            trace.activate_bit_timing(1_800_000, 100);
            for at in (1850..=3350).step_by(100) {
                trace.node(at * 1000 + 250, 0, 0x705, &[127]);
            }
            trace.at(2_060_000).ask(&[0x40, 0x03, 0x60, 0, 0, 0, 0, 0], &[]);
        }),
        shown("the answer names another object", Rule::SdoProtocol, |trace| {
            set(trace, RESPONSE, 0x4B, 1, 0x18);
        }),
        shown("the answer has a wrong command", Rule::SdoProtocol, |trace| {
            set(trace, RESPONSE, 0x4B, 0, 0x60);
        }),
        shown("a response of seven bytes", Rule::SdoProtocol, |trace| {
            trace.edit(20_000, RESPONSE, any, |data| Some(data[..7].to_vec()));
        }),
        shown("a response without a request", Rule::SdoProtocol, |trace| {
            trace.node(LATE, 0, RESPONSE, &[0x4B, 0x17, 0x10, 0, 100, 0, 0, 0]);
        }),
        shown("an abort for an object that is not transferred", Rule::SdoProtocol, |trace| {
            trace.node(LATE, 0, RESPONSE, &[0x80, 0x17, 0x10, 0, 0, 0, 4, 5]);
        }),
        shown("the toggle bit of a download does not alternate", Rule::SdoProtocol, |trace| {
            set(trace, RESPONSE, 0x30, 0, 0x20);
        }),
        shown("the toggle bit of an upload does not alternate", Rule::SdoProtocol, |trace| {
            set(trace, RESPONSE, 0x19, 0, 0x09);
        }),
        shown("an upload is shorter than announced", Rule::SdoProtocol, |trace| {
            set(trace, RESPONSE, 0x41, 4, 11);
        }),
        shown("a download that is too short is accepted", Rule::SdoProtocol, |trace| {
            set(trace, 0x605, 0x21, 4, 11);
        }),
        shown("a block acknowledges segments that were not sent", Rule::SdoProtocol, |trace| {
            set(trace, RESPONSE, 0xA2, 1, 3);
        }),
        shown("a block size of 0", Rule::SdoProtocol, |trace| {
            set(trace, RESPONSE, 0xA4, 4, 0);
        }),
        shown("a wrong CRC is accepted", Rule::SdoProtocol, |trace| {
            trace.edit(
                20_000,
                0x605,
                |data| data[0] == 0xD1,
                |data| Some([&[data[0], !data[1]], &data[2..]].concat()),
            );
        }),
        shown("the CRC of an upload is wrong", Rule::SdoProtocol, |trace| {
            set(trace, RESPONSE, 0xD1, 1, 0);
        }),
        shown("a segment of an aborted block is taken for a request", Rule::SdoProtocol, |trace| {
            trace.at(LATE).refused_block(&[0x4F, 1, 0x10, 0, 0, 0, 0, 0]);
        }),
        shown("a segment of a block is left out", Rule::SdoProtocol, |trace| {
            set(trace, RESPONSE, 0x82, 0, 0x83);
        }),
        shown("a block upload is shorter than announced", Rule::SdoProtocol, |trace| {
            set(trace, RESPONSE, 0xC6, 4, 11);
        }),
    ]
}

fn process_data() -> Vec<Seeded> {
    vec![
        shown("a TPDO within its inhibit time", Rule::Inhibit, |trace| {
            trace.node(345_000, 0, 0x285, &[1]);
        }),
        shown("a TPDO within its inhibit time after a change of its type", Rule::Inhibit, |trace| {
            trace.at(393_000).write(0x1801, 2, &[254]);
            trace.node(395_000, 0, 0x285, &[0]);
        }),
        shown("an EMCY within its inhibit time", Rule::Inhibit, |trace| {
            trace.at(1_500_000).write(0x1015, 0, &[0xE8, 3]);
            trace.node(LATE, 0, 0x085, &[0x00, 0x10, 1, 0, 0, 0, 0, 0]);
            trace.node(LATE + 50_000, 0, 0x085, &[0; 8]);
        }),
        shown("a synchronous TPDO without SYNC", Rule::Sync, |trace| {
            trace.node(BETWEEN, 0, 0x185, &[0; 4]);
        }),
        shown("a synchronous TPDO with every SYNC and not every third", Rule::Sync, |trace| {
            trace.at(300_000).write(0x1800, 2, &[3]);
        }),
        shown("a synchronous TPDO after the synchronous window", Rule::Sync, |trace| {
            trace.edit(350_000, 0x185, any, |_| None);
            trace.node(372_000, 0, 0x185, &[1, 2, 3, 2]);
        }),
        shown("a TPDO of another length than its mapping", Rule::PdoLength, |trace| {
            trace.edit(BETWEEN, 0x185, any, |data| Some(data[..3].to_vec()));
        }),
    ]
}

fn nodes() -> Vec<Seeded> {
    vec![
        shown("a TPDO between reset and boot-up", Rule::BeforeBootUp, |trace| {
            trace.node(910_000, 0, 0x285, &[0]);
        }),
        shown("a heartbeat between reset and boot-up", Rule::BeforeBootUp, |trace| {
            trace.node(940_000, 0, 0x705, &[127]);
        }),
        hidden("a frame before the boot-up at power-on", Rule::BeforeBootUp, |trace| {
            trace.node(4_000, 0, 0x185, &[0; 4]);
        }),
        hidden("the CAN-ID of another node", Rule::CanId, |trace| {
            trace.node(BETWEEN, 1, 0x285, &[0]);
        }),
        hidden("a CAN-ID that no node has", Rule::CanId, |trace| {
            trace.node(BETWEEN, 0, 0x4FF, &[0]);
        }),
        hidden("two nodes are given one CAN-ID", Rule::CanId, |trace| {
            trace.events.push(Event::Value(
                Instant(300_000),
                1,
                (0x1801, 1),
                0x285_u32.to_le_bytes().to_vec(),
            ));
            trace.node(395_000, 1, 0x285, &[0]);
        }),
        shown("a boot-up without a command", Rule::UnexpectedReset, |trace| {
            trace.node(LATE, 0, 0x705, &[0]);
        }),
        hidden("a watchdog resets the chip", Rule::UnexpectedReset, |trace| {
            trace.events.push(Event::Incident(Instant(LATE), 0, Incident::ChipReset));
        }),
        hidden("a deadline in the past", Rule::Deadline, |trace| {
            trace.events.push(Event::Deadline(Instant(LATE), 0, Instant(LATE - 1)));
        }),
        hidden("a deadline at the present", Rule::Deadline, |trace| {
            trace.events.push(Event::Deadline(Instant(LATE), 0, Instant(LATE)));
        }),
    ]
}
