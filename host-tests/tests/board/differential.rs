//! The node in this process and the image on the emulated board get the same frames one by one, and must send the same
//! frames.

use std::collections::BTreeMap;

use canbus::{Stamped, Time};
use canopen::dictionary::{Access, Mapping, Object, Rule};
use canopen::{Duration, Frame, NodeId};
use fastrand::Rng;
use host_tests::bench;
use host_tests::network::{Network, from_bus};
use host_tests::station::PressureNode;
use sim::world::World;

use crate::support::{LSS_REQUEST, LSS_RESPONSE, Master, SDO_REQUEST, SDO_RESPONSE, SECOND, SYNC, world};

/// Node-ID of both nodes.
const ID: u8 = 1;
const ERROR_CONTROL: u16 = 0x701;
const EMCY: u16 = 0x081;
/// The compared frames. PDOs are left out: they carry measured values, and the two sensors differ in the last bits.
const COMPARED: [u16; 4] = [EMCY, SDO_RESPONSE, ERROR_CONTROL, LSS_RESPONSE];
/// Number of frames in a script.
const FRAMES: usize = 400;
/// Time between two frames, and after a reset, in ms.
const PAUSE: u64 = 4;
const RESET_PAUSE: u64 = 1000;

/// A frame, and the wait after it in ms.
type Line = (Frame, u64);

/// The sent frames of each identifier, in order. Of error control only the boot-up messages count: a heartbeat depends
/// on time, and the two nodes take different times to start.
type Said = BTreeMap<u16, Vec<Vec<u8>>>;

/// Whether the object has the same value in both nodes, and a write keeps it so.
fn is_comparable(row: &Object) -> bool {
    let is_measured = row.index >= 0x2000 && row.access == Access::ReadOnly && row.mapping != Mapping::No;
    // Excluded: names and versions of the image, its identification, the room in its memory, the
    // measured value that is taken as zero, and 2F00h, which a reset of the chip empties.
    let is_own =
        matches!(row.index, 0x1008..=0x100A | 0x1F56 | 0x2010 | 0x2F00) || row.access == Access::WriteOnly;
    let is_stored = matches!(
        row.rule(),
        Rule::Store | Rule::Restore | Rule::StoreCalibration | Rule::Setting | Rule::ProgramControl
    );
    !is_measured && !is_own && !is_stored
}

fn script(seed: u64) -> Vec<Line> {
    let mut rng = Rng::with_seed(seed);
    let rows: Vec<&Object> =
        node::Personality::Pressure.rows().iter().filter(|row| is_comparable(row)).collect();
    std::iter::repeat_with(|| line(&mut rng, &rows)).take(FRAMES).collect()
}

fn line(rng: &mut Rng, rows: &[&Object]) -> Line {
    let row = rows[rng.usize(..rows.len())];
    let value = rng.u32(..) >> rng.choice([0, 16, 24, 31]).unwrap_or_default();
    match rng.u8(..20) {
        0 => nmt(rng.choice([0x01, 0x02, 0x80]).unwrap_or_default(), PAUSE),
        1 => nmt(rng.choice([0x81, 0x82]).unwrap_or_default(), RESET_PAUSE),
        2 => (frame(SYNC, &[]), PAUSE),
        3 => (
            frame(
                LSS_REQUEST,
                &[rng.choice([0x04, 0x5A, 0x5E, 0x4C, 0x46]).unwrap_or_default(), 0, 0, 0, 0, 0, 0, 0],
            ),
            PAUSE,
        ),
        4 => (frame(SDO_REQUEST, &rng.u64(..).to_le_bytes()), PAUSE),
        5..12 => (sdo(0x40, row, 0), PAUSE),
        _ => (sdo(0x23 | (4 - row.kind.size().clamp(1, 4)) << 2, row, value), PAUSE),
    }
}

fn frame(id: u16, bytes: &[u8]) -> Frame {
    Frame::new(id, bytes).expect("a frame")
}

fn nmt(command: u8, pause: u64) -> Line {
    (frame(0, &[command, ID]), pause)
}

fn sdo(command: u8, row: &Object, value: u32) -> Frame {
    let [low, high] = row.index.to_le_bytes();
    let [a, b, c, d] = value.to_le_bytes();
    frame(SDO_REQUEST, &[command, low, high, row.sub, a, b, c, d])
}

fn note(said: &mut Said, heard: Stamped) {
    let Some(frame) = from_bus(&heard.frame).filter(|frame| COMPARED.contains(&frame.id())) else { return };
    if frame.id() != ERROR_CONTROL || frame.data() == [0] {
        said.entry(frame.id()).or_default().push(frame.data().to_vec());
    }
}

fn said_on_the_board(world: &mut World, master: &Master, script: &[Line]) -> Said {
    let mut said = Said::new();
    for (frame, pause) in script {
        master.send(world, frame.id(), frame.data());
        world.run_until(world.now() + Time::from_millis(*pause));
        while let Some(heard) = world.port(master.port).receive() {
            note(&mut said, heard);
        }
    }
    said
}

fn said_in_this_process(serial_number: u32, script: &[Line]) -> Said {
    let raw = bench::raw(100_000.0, 298.15);
    let mut network =
        Network::new([PressureNode::pressure(NodeId::new(ID), serial_number, raw)]).without_reads();
    network.start();
    network.run(Duration::from_millis(1000));
    while network.hear().is_some() {}
    let mut said = Said::new();
    for (frame, pause) in script {
        network.send(frame);
        network.run(Duration::from_millis(*pause));
        while let Some(heard) = network.hear() {
            note(&mut said, heard);
        }
    }
    said
}

#[test]
fn the_image_transmits_the_same_as_the_node_in_this_process() {
    let mut compared = 0;
    for seed in 0..4 {
        let mut world = world("--bitrate 1000 --pressure const:100000 --temperature const:298.15");
        world.run_until(SECOND);
        let master = Master::join(&mut world);
        let answer = master.ask(&mut world, ID, &[0x40, 0x18, 0x10, 4, 0, 0, 0, 0]);
        let serial_number = u32::from_le_bytes(answer[4..].try_into().unwrap());
        let script = script(seed);
        let board = said_on_the_board(&mut world, &master, &script);
        let process = said_in_this_process(serial_number, &script);
        for id in COMPARED {
            let [board, process] = [&board, &process].map(|said| said.get(&id).cloned().unwrap_or_default());
            let differs = board.iter().zip(&process).position(|(a, b)| a != b);
            let lengths = (board.len(), process.len());
            assert!(
                differs.is_none() && lengths.0 == lengths.1,
                "seed {seed}, {id:03X}h, {lengths:?} frames, the first that differs: {:02X?}",
                differs.map(|at| (at, &board[at], &process[at]))
            );
            compared += board.len();
        }
    }
    println!("{compared} frames are the same");
    assert!(compared > 1000, "{compared}");
}
