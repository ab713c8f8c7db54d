//! Tests of expedited and segmented transfers with the real node, on good and bad lines.

use canopen::Duration;
use canopen::client::sdo;
use nodectl::object::at;
use nodectl::sdo::{AbortCode, Cause};

use crate::pressure::Pressure;
use crate::wire::{Fate, Wire, client};

#[test]
fn values_of_every_length() {
    let mut network = Wire::new(Pressure::new(5)).network();
    let mut client = client(&mut network, 5);
    assert_eq!(client.upload(at(0x1000, 0)).unwrap(), [0x94, 0x01, 0x02, 0x00]);
    assert_eq!(client.upload(at(0x1001, 0)).unwrap(), [0]);
    assert_eq!(client.upload(at(0x1008, 0)).unwrap(), b"STM32F4 pressure transmitter");
    assert_eq!(client.block_upload(at(0x1008, 0)).unwrap(), b"STM32F4 pressure transmitter");
    assert_eq!(client.block_upload(at(0x1018, 4)).unwrap(), [0x78, 0x56, 0x34, 0x12]);
    client.download(at(0x1017, 0), &500_u16.to_le_bytes(), |_| ()).unwrap();
    assert_eq!(client.upload(at(0x1017, 0)).unwrap(), [0xF4, 0x01]);
    client.block_download(at(0x6124, 1), &1.5_f32.to_le_bytes(), |_| ()).unwrap();
    assert_eq!(client.upload(at(0x6124, 1)).unwrap(), 1.5_f32.to_le_bytes());
}

#[test]
fn a_refusal_names_node_object_and_reason() {
    let mut network = Wire::new(Pressure::new(5)).network();
    let mut client = client(&mut network, 5);
    let refused = [
        (at(0x1000, 0), "node 5, 1000h:0: 0601 0002h, attempt to write a read-only object"),
        (at(0x6001, 0), "node 5, 6001h:0: 0602 0000h, object does not exist"),
        (at(0x1018, 9), "node 5, 1018h:9: 0609 0011h, sub-index does not exist"),
        (at(0x1019, 0), "node 5, 1019h:0: 0607 0012h, too long for the data type"),
    ];
    for (object, message) in refused {
        assert_eq!(client.download(object, &[1, 0, 0, 0], |_| ()).unwrap_err().to_string(), message);
    }
    let error = client.download(at(0x1019, 0), &[250], |_| ()).unwrap_err();
    assert_eq!(error.abort(), Some(AbortCode(0x0609_0031)));
    let error = client.upload(at(0x6125, 1)).unwrap_err();
    assert_eq!(error.abort(), Some(AbortCode(0x0601_0001)));
}

#[test]
fn a_request_without_an_answer_times_out() {
    let mut network = Wire::new(Pressure::new(5)).network();
    // The first request to a bus waits until the bus has been listened to.
    network.pause(Duration::from_millis(30)).expect("a bus");
    let start = network.now();
    let error = client(&mut network, 6).upload(at(0x1000, 0)).unwrap_err();
    assert!(matches!(error.cause, Cause::Transfer(sdo::Error::NoAnswer)) && error.is_silence());
    assert_eq!(error.to_string(), "node 6, 1000h:0: no answer");
    // Two attempts of half a second each.
    let waited = network.now().0 - start.0;
    assert!((1_000_000..1_010_000).contains(&waited), "{waited}");
}

#[test]
fn one_lost_frame_in_any_place_does_no_harm() {
    for lost in 0..12 {
        let wire = Wire::new(Pressure::new(5));
        let mut network = wire.network();
        network.pause(Duration::from_millis(10)).unwrap();
        let mut count = 0;
        wire.disturb(move |frame| {
            let is_sdo = matches!(frame.id(), 0x585 | 0x605);
            count += usize::from(is_sdo);
            if is_sdo && count == lost + 1 { Fate::IsLost } else { Fate::Arrives }
        });
        let mut client = client(&mut network, 5);
        assert_eq!(client.upload(at(0x1008, 0)).unwrap(), b"STM32F4 pressure transmitter", "frame {lost}");
        assert_eq!(client.upload(at(0x1018, 4)).unwrap(), [0x78, 0x56, 0x34, 0x12], "frame {lost}");
    }
}

#[test]
fn a_broken_bus_is_reported_and_can_be_opened_again() {
    let wire = Wire::new(Pressure::new(5));
    let mut network = wire.network();
    wire.disturb(|frame| if frame.id() == 0x605 { Fate::BreaksTheBus } else { Fate::Arrives });
    let error = client(&mut network, 5).upload(at(0x1000, 0)).unwrap_err();
    assert_eq!(error.to_string(), "node 5, 1000h:0: the bus is lost: unplugged");
    assert!(error.is_silence());
    wire.disturb(|_| Fate::Arrives);
    assert!(client(&mut network, 5).upload(at(0x1000, 0)).is_err());
    network.reopen().unwrap();
    assert!(client(&mut network, 5).upload(at(0x1000, 0)).is_ok());
}

#[test]
fn frames_of_others_are_not_lost_to_a_transfer() {
    let mut network = Wire::new(Pressure::new(5)).network();
    client(&mut network, 5).upload(at(0x1000, 0)).unwrap();
    let until = network.now();
    let boot_up = network.receive(until).unwrap().expect("the boot-up message");
    assert_eq!((boot_up.frame.id(), boot_up.frame.data()), (0x705, &[0][..]));
}
