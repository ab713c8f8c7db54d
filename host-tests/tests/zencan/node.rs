//! The pressure node: every object, NMT, heartbeat, PDO configuration, saving.

use canopen::NodeId;
use canopen::dictionary::{Access, DefaultValue, Object, Type};
use host_tests::bench::raw;
use host_tests::station::PressureNode;
use node::Personality;
use node::State;
use tokio::time::{Duration, sleep};
use zencan_client::common::CanId;
use zencan_client::common::nmt::NmtState;
use zencan_client::common::node_configuration::PdoConfig;
use zencan_client::common::node_id::ConfiguredNodeId;
use zencan_client::common::pdo::{PdoCommParameter, PdoMapping};
use zencan_client::{BusManager, RawAbortCode, SdoClient, SdoClientError};

use crate::bus::Port;

const ID: u8 = 0x21;
const SERIAL: u32 = 4711;

type Client = SdoClient<Port<PressureNode>, Port<PressureNode>>;

fn pressure_node() -> PressureNode {
    PressureNode::pressure(NodeId::new(ID), SERIAL, raw(250_000.0, 298.15))
}

fn node() -> (Port<PressureNode>, Client) {
    let port = Port::new([pressure_node()]);
    (port.clone(), SdoClient::new_std(ID, port.clone(), port))
}

fn manager() -> (Port<PressureNode>, BusManager<Port<PressureNode>>) {
    let port = Port::new([pressure_node()]);
    (port.clone(), BusManager::new(port.clone(), port))
}

fn state(port: &Port<PressureNode>) -> State {
    port.with(|network| network.stations[0].unit.protocol.state())
}

/// The default value of the table after start-up; `None` for a measured value or one from outside the table.
fn default(row: &Object) -> Option<Vec<u8>> {
    let is_given = matches!(row.index, 0x1009 | 0x100A | 0x1018 | 0x1F56 | 0x1F57);
    let is_live =
        matches!(row.index, 0x1001..=0x1003 | 0x2010 | 0x3000 | 0x6100 | 0x6130 | 0x6150 | 0x7130 | 0x9130);
    if (is_given || is_live) && row.sub > 0 || matches!(row.index, 0x1001 | 0x1002 | 0x1009 | 0x100A) {
        return None;
    }
    let mut bytes = match row.default {
        DefaultValue::Integer(value) => value.to_le_bytes().to_vec(),
        DefaultValue::Real(value) => value.to_le_bytes().to_vec(),
        DefaultValue::NodeId(base) => (base + u32::from(ID)).to_le_bytes().to_vec(),
        DefaultValue::Text(text) => return Some(text.into()),
        DefaultValue::None => return None,
    };
    bytes.truncate(usize::from(row.kind.size()));
    Some(bytes)
}

fn is_domain(row: &Object) -> bool {
    row.kind == Type::Domain
}

fn abort_code(error: SdoClientError) -> u32 {
    match error {
        SdoClientError::ServerAbort { abort_code: RawAbortCode::Valid(code), .. } => code as u32,
        SdoClientError::ServerAbort { abort_code: RawAbortCode::Unknown(code), .. } => code,
        other => panic!("{other}"),
    }
}

#[tokio::test(start_paused = true)]
async fn every_object_is_read_by_both_transfers() {
    let (_, mut client) = node();
    for row in Personality::Pressure.rows() {
        let value = client.upload(row.index, row.sub).await;
        match value {
            Ok(value) => {
                // The extreme values are those of the samples so far.
                let is_measured = matches!(row.index, 0x2211 | 0x2212);
                let is_default = default(row).is_none_or(|default| default == value);
                assert!(is_measured || is_default, "{row:X?}: {value:X?}");
                let is_text = matches!(row.kind, Type::VisibleString(_) | Type::Domain);
                assert!(is_text || value.len() == usize::from(row.kind.size()), "{row:X?}: {value:X?}");
                let is_live = matches!(row.index, 0x2211 | 0x2212 | 0x6100 | 0x6130 | 0x7130 | 0x9130);
                let again = client.block_upload(row.index, row.sub).await.unwrap();
                assert!(is_live || again == value, "{row:X?}: {again:X?}");
            }
            Err(error) => match abort_code(error) {
                0x0601_0001 => assert_eq!(row.access, Access::WriteOnly, "{row:X?}"),
                0x0800_0024 => assert!(row.index == 0x1003 && row.sub > 0 || is_domain(row), "{row:X?}"),
                code => panic!("{row:X?}: {code:X}"),
            },
        }
    }
}

#[tokio::test(start_paused = true)]
async fn every_object_is_written_as_its_access_says() {
    let (_, mut client) = node();
    for number in 0..2 {
        let config = client.read_tpdo_config(number).await.unwrap();
        client.set_tpdo_cob_id(number, config.comm.cob_id, false, false).await.unwrap();
        client.write_u8(0x1A00 + number as u16, 0, 0).await.unwrap();
    }
    client.download(0x2203, 0, b"cali").await.unwrap();
    for row in Personality::Pressure.rows().iter().filter(|row| row.access == Access::ReadWrite) {
        // 1010h, 1011h, 1F51h and 2204h take commands. A domain is empty until it is written.
        if matches!(row.index, 0x1010 | 0x1011 | 0x1F51) && row.sub > 0
            || row.index == 0x2204
            || is_domain(row)
        {
            continue;
        }
        let value = client.upload(row.index, row.sub).await.unwrap();
        client.download(row.index, row.sub, &value).await.unwrap_or_else(|error| panic!("{row:X?}: {error}"));
        client
            .block_download(row.index, row.sub, &value)
            .await
            .unwrap_or_else(|error| panic!("{row:X?}: {error}"));
    }
    for row in Personality::Pressure
        .rows()
        .iter()
        .filter(|row| matches!(row.access, Access::Const | Access::ReadOnly))
    {
        let refused = client.download(row.index, row.sub, &[0]).await.unwrap_err();
        assert_eq!(abort_code(refused), 0x0601_0002, "{row:X?}");
    }
}

#[tokio::test(start_paused = true)]
async fn the_transfer_buffer_takes_four_kib_by_both_transfers() {
    let (_, mut client) = node();
    let (first, second): (Vec<u8>, Vec<u8>) = (0..4096_u32).map(|i| ((i * 7) as u8, (i / 3) as u8)).unzip();
    client.download(0x2F00, 0, &first).await.unwrap();
    assert!(client.block_upload(0x2F00, 0).await.unwrap() == first);
    client.block_download(0x2F00, 0, &second).await.unwrap();
    assert!(client.upload(0x2F00, 0).await.unwrap() == second);
}

#[tokio::test(start_paused = true)]
async fn nmt_commands_change_the_state_in_the_heartbeat() {
    let (port, mut manager) = manager();
    for (number, expected) in [(1, NmtState::Operational), (2, NmtState::Stopped)] {
        if number == 1 {
            manager.nmt_start(ID).await;
        } else {
            manager.nmt_stop(0).await;
        }
        sleep(Duration::from_millis(1100)).await;
        let nodes = manager.node_list().await;
        assert_eq!(nodes.len(), 1);
        assert_eq!((nodes[0].node_id, nodes[0].nmt_state), (ID, Some(expected)));
    }
    manager.nmt_reset_comms(ID).await;
    sleep(Duration::from_millis(5)).await;
    assert_eq!(state(&port), State::PreOperational);
    manager.nmt_start(0).await;
    manager.nmt_reset_app(0).await;
    sleep(Duration::from_millis(5)).await;
    assert_eq!(state(&port), State::PreOperational);
}

#[tokio::test(start_paused = true)]
async fn a_scan_finds_the_node_and_its_identity() {
    let (_, mut manager) = manager();
    let nodes = manager.scan_nodes().await.unwrap();
    assert_eq!(nodes.len(), 1);
    let identity = nodes[0].identity.unwrap();
    assert_eq!((nodes[0].node_id, identity.serial), (ID, SERIAL));
    assert_eq!(nodes[0].device_name.as_deref(), Some("STM32F4 pressure transmitter"));
    assert_eq!(nodes[0].software_version.as_deref(), Some("0.1.0"));
    let pdos = manager.read_pdo_config(ConfiguredNodeId::new(ID).unwrap()).await.unwrap();
    assert_eq!((pdos.tpdos.len(), pdos.rpdos.len()), (8, 8));
    assert_eq!(pdos.tpdos[0].mappings.len(), 2);
    assert_eq!(pdos.tpdos[0].comm.cob_id, CanId::std(0x180 + u16::from(ID)));
}

#[tokio::test(start_paused = true)]
async fn a_remapped_tpdo_sends_the_new_content() {
    let (port, mut client) = node();
    let mapping = |index, sub, size| PdoMapping { index, sub, size };
    let config = PdoConfig {
        comm: PdoCommParameter {
            valid: true,
            rtr_disabled: false,
            cob_id: CanId::std(0x1C5),
            transmission_type: 1,
        },
        mappings: vec![mapping(0x6150, 1, 8), mapping(0x7130, 1, 16), mapping(0x9130, 2, 32)],
    };
    client.configure_tpdo(2, &config).await.unwrap();
    assert_eq!(client.read_tpdo_config(2).await.unwrap(), config);
    let pressure = client.read_i16(0x7130, 1).await.unwrap();
    let temperature = client.read_i32(0x9130, 2).await.unwrap();
    port.with(|network| {
        network.send(&canopen::Frame::new(0, &[1, ID]).unwrap());
        network.send(&canopen::Frame::new(0x80, &[]).unwrap());
        let frame = network.await_id(0x1C5, canopen::Duration::from_millis(5)).unwrap();
        let expected: Vec<u8> = [&[0][..], &pressure.to_le_bytes(), &temperature.to_le_bytes()].concat();
        assert_eq!(frame.data(), expected);
    });
}

#[tokio::test(start_paused = true)]
async fn saved_values_survive_a_reset() {
    let (port, mut client) = node();
    client.write_u32(0x4000, 1, 77).await.unwrap();
    client.write_u16(0x1017, 0, 250).await.unwrap();
    // The signature as a string: zencan's number for it has the wrong byte order (CiA 301, 7.5.2.13).
    client.download(0x1010, 1, b"save").await.unwrap();
    client.write_u32(0x4000, 1, 78).await.unwrap();
    port.with(|network| {
        network.transmit(&canopen::Frame::new(0, &[0x81, ID]).unwrap());
        network.run(canopen::Duration::from_millis(5));
    });
    assert_eq!(client.read_u32(0x4000, 1).await.unwrap(), 77);
    assert_eq!(client.read_u16(0x1017, 0).await.unwrap(), 250);
}
