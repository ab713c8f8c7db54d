//! The maximum number of nodes on one bus: found and numbered by LSS, started together, all sending.

use std::collections::BTreeMap;

use bsp::can::transmit_queue::TransmitQueue;
use canopen::lss::Identity;
use canopen::sdo::Multiplexer;
use canopen::{Duration, Frame, NodeId};
use host_tests::bench::raw;
use host_tests::lss::Master;
use host_tests::network::{Network, from_bus};
use host_tests::sdo::Client;
use host_tests::station::PressureNode;
use node::{Measurement, Personality, Protocol, StoreJob};
use profiles::product::{REVISION, VENDOR_ID};

const NODES: u8 = 127;
/// Event timer of TPDO 1, in ms: 127 frames of eight bytes take some 16 ms.
const PERIOD: u16 = 20;
const SECONDS: u64 = 2;

/// Serial numbers without a relation to the node-IDs.
fn serial_number(number: u8) -> u32 {
    u32::from(number).wrapping_mul(0x9E37_79B1)
}

fn pascal(number: u8) -> f64 {
    f64::from(number) * 5_000.0
}

fn unconfigured() -> Network<PressureNode> {
    let nodes = (1..=NODES)
        .map(|number| PressureNode::pressure(None, serial_number(number), raw(pascal(number), 298.15)));
    let mut network = Network::new(nodes);
    network.start();
    network.run(Duration::from_millis(5));
    assert_eq!(network.traffic().frames, 0, "a node without a node-ID is silent");
    network
}

/// Finds the nodes one by one; each boots with the next free node-ID. Returns the serial numbers in this order.
fn number_all(network: &mut Network<PressureNode>) -> Vec<u32> {
    let mut serial_numbers = vec![];
    while let Some(identity) = Master::new(network).fastscan() {
        let Identity { vendor, product, revision, serial } = identity;
        assert_eq!((vendor, product, revision), (VENDOR_ID, Personality::Pressure.product_code(), REVISION));
        serial_numbers.push(serial);
        let node_id = NodeId::new(u8::try_from(serial_numbers.len()).unwrap()).unwrap();
        assert!(Master::new(network).configure(node_id));
        let boot_up = network.await_id(0x700 + u16::from(node_id.get()), Duration::from_millis(5));
        assert_eq!(boot_up.unwrap().data(), [0]);
        hear_all(network);
    }
    serial_numbers
}

fn write(network: &mut Network<PressureNode>, node_id: u8, index: u16, sub: u8, bytes: &[u8]) {
    let mut link = network.server(node_id);
    assert_eq!(Client::new(&mut link).write(Multiplexer { index, sub }, bytes), Ok(()));
}

fn read_serial(network: &mut Network<PressureNode>, node_id: u8) -> u32 {
    let at = Multiplexer { index: 0x1018, sub: 4 };
    let bytes = Client::new(&mut network.server(node_id)).read(at).unwrap();
    u32::from_le_bytes(bytes.try_into().unwrap())
}

/// All frames that the master has received, by identifier.
fn hear_all(network: &mut Network<PressureNode>) -> BTreeMap<u16, Vec<Vec<u8>>> {
    let mut heard = BTreeMap::<u16, Vec<Vec<u8>>>::new();
    while let Some(stamped) = network.hear() {
        let frame = from_bus(&stamped.frame).unwrap();
        heard.entry(frame.id()).or_default().push(frame.data().to_vec());
    }
    heard
}

fn print_figures(network: &Network<PressureNode>, share: f64) {
    let (frames, seconds) = (network.traffic().frames, network.now().as_secs_f64());
    println!(
        "{NODES} nodes: {seconds:.3} s of virtual time, {frames} frames, {share:.1} % load when all send"
    );
    let protocol = size_of::<Protocol>();
    let [measurement, queue, job] =
        [size_of::<Measurement>(), size_of::<TransmitQueue>(), size_of::<StoreJob>()];
    let sum = protocol + measurement + queue + job;
    println!(
        "{sum} bytes a node: protocol {protocol}, measurement {measurement}, transmit queue {queue}, store {job}"
    );
}

#[test]
fn a_full_bus() {
    let mut network = unconfigured();
    let serial_numbers = number_all(&mut network);
    let mut expected: Vec<u32> = (1..=NODES).map(serial_number).collect();
    assert_eq!(serial_numbers.len(), expected.len());
    for (node_id, &serial) in (1..).zip(&serial_numbers) {
        assert_eq!(read_serial(&mut network, node_id), serial);
        write(&mut network, node_id, 0x1800, 5, &PERIOD.to_le_bytes());
    }

    hear_all(&mut network);
    let busy = network.busy();
    network.transmit(&Frame::new(0, &[1, 0]).unwrap());
    network.run(Duration(SECONDS * 1_000_000));
    print_figures(&network, (network.busy() - busy).as_secs_f64() / SECONDS as f64 * 100.0);
    let heard = hear_all(&mut network);

    let periods = SECONDS * 1000 / u64::from(PERIOD);
    for (node_id, serial) in (1..=u16::from(NODES)).zip(serial_numbers.iter()) {
        // The first TPDO is sent at the start; the last one may still wait for nodes with lower identifiers.
        let tpdos = &heard[&(0x180 + node_id)];
        assert!((periods..=periods + 1).contains(&(tpdos.len() as u64)), "{node_id}: {}", tpdos.len());
        let number = (1..=NODES).find(|&number| serial_number(number) == *serial).unwrap();
        let bar = f32::from_le_bytes(tpdos[0][..4].try_into().unwrap());
        assert!((f64::from(bar) - pascal(number) / 1.0e5).abs() < 1e-3, "{node_id}: {bar}");
        let heartbeats = &heard[&(0x700 + node_id)];
        assert!(SECONDS.abs_diff(heartbeats.len() as u64) <= 1, "their phase comes from the boot-up");
        // The first heartbeat may have waited for the bus when the start command came.
        assert!(heartbeats.iter().skip(1).all(|data| data == &[5]));
    }
    assert_eq!(heard.len(), 2 * usize::from(NODES), "nothing but TPDOs and heartbeats: no EMCY");
    assert_no_frame_is_lost(&network);
    let mut found = serial_numbers;
    found.sort_unstable();
    expected.sort_unstable();
    assert_eq!(found, expected);
}

/// Checks that every station has received every frame of the others, and that no frame was sent twice. Equal frames of
/// several nodes at the same instant (answers to the LSS master) are one frame on the bus.
fn assert_no_frame_is_lost(network: &Network<PressureNode>) {
    let traffic = network.traffic();
    assert_eq!(traffic.errors, 0);
    for station in &network.stations {
        assert_eq!(station.port.sent + station.port.received, traffic.frames);
    }
}
