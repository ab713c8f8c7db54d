//! Long transfers of every kind, with several lengths.

use host_tests::domain::{DOMAIN, DomainDevice, ID, TEXT, WORD};
use zencan_client::{RawAbortCode, SdoClient, SdoClientError};

use crate::bus::Port;

type Client = SdoClient<Port<DomainDevice>, Port<DomainDevice>>;

fn device() -> (Port<DomainDevice>, Client) {
    let port = Port::new([DomainDevice::new()]);
    (port.clone(), SdoClient::new_std(ID, port.clone(), port))
}

fn data(len: usize) -> Vec<u8> {
    (0..len).map(|i| (i * 7 + i / 251) as u8).collect()
}

#[tokio::test(start_paused = true)]
async fn segments_carry_data_of_any_length() {
    let (port, mut client) = device();
    for len in [1, 4, 5, 7, 8, 13, 14, 15, 889, 890, 4096] {
        client.download(DOMAIN.index, DOMAIN.sub, &data(len)).await.unwrap();
        assert!(port.with(|network| network.stations[0].unit.content() == data(len)));
        assert!(client.upload(DOMAIN.index, DOMAIN.sub).await.unwrap() == data(len));
    }
}

#[tokio::test(start_paused = true)]
async fn blocks_carry_data_of_any_length() {
    let (port, mut client) = device();
    for len in [1, 4, 6, 7, 8, 14, 888, 889, 890, 1778, 4096] {
        client.block_download(DOMAIN.index, DOMAIN.sub, &data(len)).await.unwrap();
        assert!(port.with(|network| network.stations[0].unit.content() == data(len)));
        assert!(client.block_upload(DOMAIN.index, DOMAIN.sub).await.unwrap() == data(len));
    }
}

#[tokio::test(start_paused = true)]
async fn values_of_the_image_go_by_every_transfer() {
    let (_, mut client) = device();
    client.download(TEXT.index, TEXT.sub, b"in segments").await.unwrap();
    assert_eq!(client.read_visible_string(TEXT.index, TEXT.sub).await.unwrap(), "in segments");
    client.block_download(TEXT.index, TEXT.sub, b"in blocks").await.unwrap();
    assert_eq!(client.block_upload(TEXT.index, TEXT.sub).await.unwrap(), b"in blocks");
    client.write_u32(WORD.index, WORD.sub, 0x1234_5678).await.unwrap();
    assert_eq!(client.read_u32(WORD.index, WORD.sub).await.unwrap(), 0x1234_5678);
    client.block_download(WORD.index, WORD.sub, &[1, 2, 3, 4]).await.unwrap();
    assert_eq!(client.read_u32(WORD.index, WORD.sub).await.unwrap(), 0x0403_0201);
}

#[tokio::test(start_paused = true)]
async fn a_download_that_is_too_long_is_refused_and_the_server_is_free_again() {
    let (_, mut client) = device();
    let code = |error| match error {
        SdoClientError::ServerAbort { abort_code: RawAbortCode::Valid(code), .. } => code as u32,
        other => panic!("{other}"),
    };
    for len in [61, 1000] {
        let refused = client.download(TEXT.index, TEXT.sub, &data(len)).await.unwrap_err();
        assert_eq!(code(refused), 0x0607_0012);
        let refused = client.block_download(TEXT.index, TEXT.sub, &data(len)).await.unwrap_err();
        assert_eq!(code(refused), 0x0607_0012);
        assert_eq!(client.read_u32(WORD.index, WORD.sub).await.unwrap(), 0);
    }
}
