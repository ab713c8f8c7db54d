//! LSS: three nodes without a node-ID are found and numbered, store the node-ID, and boot.

use host_tests::bench::raw;
use host_tests::station::PressureNode;
use host_tests::watch::expects;
use monitor::Rule;
use node::Personality;
use profiles::product::{REVISION, VENDOR_ID};
use tokio::time::{Duration, sleep};
use zencan_client::common::NodeId;
use zencan_client::common::lss::{LssIdentity, LssState};
use zencan_client::{BusManager, LssMaster};

use crate::bus::Port;

const SERIAL_NUMBERS: [u32; 3] = [0x8000_0001, 0x0000_1234, 0xDEAD_BEEF];

fn nodes() -> Port<PressureNode> {
    Port::new(SERIAL_NUMBERS.map(|serial| PressureNode::pressure(None, serial, raw(0.0, 298.15))))
}

fn identity(serial: u32) -> LssIdentity {
    LssIdentity::new(VENDOR_ID, Personality::Pressure.product_code(), REVISION, serial)
}

#[tokio::test(start_paused = true)]
async fn fastscan_finds_all_of_them_and_each_boots_with_its_number() {
    let port = nodes();
    let mut manager = BusManager::new(port.clone(), port);
    let found = manager.lss_fastscan(Duration::from_millis(5)).await;
    let mut serial_numbers: Vec<u32> = found.iter().map(|identity| identity.serial).collect();
    serial_numbers.sort_unstable();
    let mut expected = SERIAL_NUMBERS;
    expected.sort_unstable();
    assert_eq!(serial_numbers, expected);
    for (number, device) in (1..).zip(found) {
        assert_eq!((device.vendor_id, device.product_code, device.revision), {
            let LssIdentity { vendor_id, product_code, revision, .. } = identity(device.serial);
            (vendor_id, product_code, revision)
        });
        manager.lss_activate(device).await.unwrap();
        manager.lss_set_node_id(NodeId::new(number).unwrap()).await.unwrap();
        manager.lss_store_config().await.unwrap();
        manager.lss_set_global_mode(LssState::Waiting).await;
        sleep(Duration::from_millis(5)).await;
        let serial = manager.sdo_client(number).read_u32(0x1018, 4).await.unwrap();
        assert_eq!(serial, device.serial);
    }
    assert!(manager.lss_fastscan(Duration::from_millis(5)).await.is_empty());
    let node_ids: Vec<u8> = manager.node_list().await.iter().map(|node| node.node_id).collect();
    assert_eq!(node_ids, [1, 2, 3]);
}

#[tokio::test(start_paused = true)]
async fn a_node_is_configured_by_its_identity() {
    // Two nodes have the node-ID 99: the first keeps it though its bit timing is refused.
    let _two = expects([Rule::CanId]);
    let port = nodes();
    let mut master = LssMaster::new(port.clone(), port);
    let node_id = NodeId::new(99).unwrap();
    // Index 5 of the table is reserved.
    assert!(master.configure_by_identity(identity(SERIAL_NUMBERS[2]), node_id, 0, 5).await.is_err());
    master.configure_by_identity(identity(SERIAL_NUMBERS[1]), node_id, 0, 3).await.unwrap();
    assert!(master.configure_by_identity(identity(1), node_id, 0, 3).await.is_err());
}
