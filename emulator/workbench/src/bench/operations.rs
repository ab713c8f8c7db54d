//! The measured operations, each with the number that CANopenNode has published.

use anyhow::{Result, ensure};
use canopen::sdo::Multiplexer;

use crate::bench::client::Client;
use crate::bench::program::Program;

/// One row of the table.
pub(crate) struct Operation {
    pub(crate) name: &'static str,
    /// Published for CANopenNode 9b8beed on a Cortex-M4, with -Os and with -O2.
    pub(crate) published: [Option<u64>; 2],
    /// Brings the node into the state that the operation needs; not counted.
    prepare: fn(&mut Client) -> Result<()>,
    run: fn(&mut Client) -> Result<()>,
}

const fn operation(name: &'static str, published: [u64; 2], run: fn(&mut Client) -> Result<()>) -> Operation {
    let [small, fast] = published;
    Operation { name, published: [Some(small), Some(fast)], prepare: |_| Ok(()), run }
}

/// One block of 127 segments.
const BLOCK: usize = 889;
/// The abort code for an object that does not exist.
const NO_OBJECT: u32 = 0x0602_0000;

const IDENTITY: Multiplexer = Multiplexer { index: 0x1018, sub: 1 };
const PARAMETER: Multiplexer = Multiplexer { index: 0x2002, sub: 0 };
const TEXT: Multiplexer = Multiplexer { index: 0x2003, sub: 0 };
const HANDLED: Multiplexer = Multiplexer { index: 0x2005, sub: 0 };
const DOMAIN: Multiplexer = Multiplexer { index: 0x2004, sub: 1 };

/// All operations, in the order of the table.
pub(crate) const OPERATIONS: [Operation; 14] = [
    operation("idle, one pass", [359, 343], |client| nothing(client, 0)),
    operation("idle 1 ms tick", [364, 336], |client| nothing(client, 1000)),
    operation("frame with an identifier that is not ours", [197, 148], |client| {
        ensure!(client.foreign()?.is_empty(), "an answer to a frame of somebody else's");
        Ok(())
    }),
    operation("SDO upload of 1000h", [875, 832], |client| {
        reads(client, Multiplexer { index: 0x1000, sub: 0 }, Ok(vec![0; 4]))
    }),
    operation("SDO upload of 1018h:1", [859, 816], |client| reads(client, IDENTITY, Ok(vec![0x1A, 0, 0, 0]))),
    operation("SDO upload, no such object", [710, 659], |client| {
        reads(client, Multiplexer { index: 0x2222, sub: 0 }, Err(NO_OBJECT))
    }),
    operation("SDO download INTEGER32", [807, 771], |client| client.write(PARAMETER, &[1, 2, 3, 4])),
    Operation {
        published: [None, None],
        ..operation("SDO download, handled by the application", [0, 0], |client| {
            client.write(HANDLED, &[1, 2, 3, 4])
        })
    },
    operation("segmented upload, 32 bytes", [4321, 4076], |client| {
        reads(client, TEXT, Ok(b"thirty-two characters, no more..".to_vec()))
    }),
    Operation {
        prepare: |client| set_synchronous(client, 1),
        published: [Some(633), None],
        ..operation("SYNC to 1 TPDO", [0, 0], |client| sync(client, 1))
    },
    Operation {
        prepare: |client| set_synchronous(client, 4),
        ..operation("SYNC to 4 TPDO", [1344, 1265], |client| sync(client, 4))
    },
    operation("RPDO to the dictionary", [614, 578], |client| {
        ensure!(client.rpdo([1, 0, 0, 0, 2, 0, 0, 0])?.is_empty(), "an answer to an RPDO");
        Ok(())
    }),
    operation("block download 889 bytes with CRC", [36_242, 33_109], |client| {
        client.write_block(DOMAIN, &content())
    }),
    Operation {
        prepare: |client| client.write_block(DOMAIN, &content()),
        ..operation("block upload 889 bytes with CRC", [75_317, 73_147], |client| {
            ensure!(client.read_block(DOMAIN)? == content(), "wrong data");
            Ok(())
        })
    },
];

impl Operation {
    /// Instructions of the second run: the first run may have to set something up.
    pub(crate) fn measure(&self, client: &mut Client) -> Result<u64> {
        (self.prepare)(client)?;
        (self.run)(client)?;
        client.take_spent();
        client.take_profile();
        (self.run)(client)?;
        Ok(client.take_spent())
    }
}

/// A node that is Operational.
pub(crate) fn operational(program: Program) -> Result<Client> {
    let mut client = Client::new(program);
    client.pass(0)?;
    client.nmt(0x01)?;
    client.pass(0)?;
    Ok(client)
}

fn nothing(client: &mut Client, later: u64) -> Result<()> {
    let frames = client.pass(later)?;
    ensure!(frames.is_empty(), "an idle node has sent {frames:?}");
    Ok(())
}

fn reads(client: &mut Client, at: Multiplexer, expected: Result<Vec<u8>, u32>) -> Result<()> {
    let read = client.read(at)?;
    ensure!(read == expected, "{at:?} reads {read:?}");
    Ok(())
}

/// Gives the first `count` TPDOs transmission type 1 and makes the others event-driven. Four TPDOs are valid in any
/// case.
fn set_synchronous(client: &mut Client, count: u16) -> Result<()> {
    client.nmt(0x80)?;
    for number in 0..4 {
        let kind = if number < count { 1 } else { 254 };
        client.write(Multiplexer { index: 0x1800 | number, sub: 2 }, &[kind])?;
    }
    client.nmt(0x01)?;
    client.pass(0)?;
    Ok(())
}

fn sync(client: &mut Client, count: usize) -> Result<()> {
    let frames = client.sync()?;
    let is_whole = frames.len() == count && frames.iter().all(|frame| frame.len() == 8);
    ensure!(is_whole, "{frames:?} is not {count} TPDOs");
    Ok(())
}

fn content() -> Vec<u8> {
    (0..BLOCK).map(|i| (i * 7 + i / 251) as u8).collect()
}
