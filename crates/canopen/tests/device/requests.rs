//! Choices of an application for requests of SDO clients: a value at the moment of its upload, and short requests.

use canopen::dictionary::{Access, Dictionary, Entry, Field, Object, Type};
use canopen::sdo::{Abort, Multiplexer};
use canopen::{Application, Device, Frame, Instant, NodeId, objects};

use crate::exchange;
use crate::types::Sent;

const ID: u8 = 5;
const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0)],
    objects::identity(0, 1, 1),
    [
        Object::new(0x2000, 0, "Uploads", Type::Unsigned32, Access::ReadOnly),
        Object::new(0x2001, 0, "Long", Type::OctetString(12), Access::ReadOnly),
        Object::new(0x2002, 0, "Locked", Type::Unsigned8, Access::ReadOnly),
    ],
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);
const UPLOADS: Field = DICTIONARY.field(0x2000, 0);
const LONG: Field = DICTIONARY.field(0x2001, 0);

/// Counts the uploads; `SHORT`: takes short requests.
#[derive(Default)]
struct Counter<const SHORT: bool>(u32);

impl<const SHORT: bool> Application for Counter<SHORT> {
    const SHORT_REQUESTS: bool = SHORT;

    fn read(&mut self, entry: &Entry, image: &mut [u8]) -> Result<(), Abort> {
        match entry.index() {
            0x2000 => {
                self.0 += 1;
                UPLOADS.set_u32(image, self.0);
            }
            0x2001 => {
                self.0 += 1;
                LONG.set(image, &[self.0.to_le_bytes()[0]; 12]);
            }
            0x2002 => return Err(Abort::LocalControl),
            _ => (),
        }
        Ok(())
    }
}

type Node<const SHORT: bool> = canopen::device!(Counter<SHORT>, ROWS);

macro_rules! node {
    ($short:literal) => {{
        let mut node: canopen::device!(Counter<$short>, ROWS) =
            Device::new(&DICTIONARY, NodeId::new(ID), Counter::default());
        let _ = node.start(Instant(0), &mut Sent::default());
        node
    }};
}

fn read(node: &mut Node<false>, index: u16) -> Result<Vec<u8>, u32> {
    exchange::read(ID, Multiplexer { index, sub: 0 }, |request| {
        let mut sent = Sent::default();
        let _ = node.on_service_frame(&request, Instant(1), &mut sent);
        sent.0
    })
}

#[test]
fn the_application_sets_a_value_once_for_each_upload() {
    let mut node = node!(false);
    assert_eq!(read(&mut node, 0x2000), Ok(vec![1, 0, 0, 0]));
    assert_eq!(read(&mut node, 0x2000), Ok(vec![2, 0, 0, 0]));
    assert_eq!(read(&mut node, 0x2001), Ok(vec![3; 12]), "in several frames, and set once");
    assert_eq!(read(&mut node, 0x2002), Err(0x0800_0021), "local control");
    assert_eq!(node.application().0, 3);
}

fn answers(on_frame: impl Fn(&Frame, &mut Sent), lengths: impl Iterator<Item = usize>) -> Vec<usize> {
    lengths
        .map(|len| {
            let mut sent = Sent::default();
            let request = [0x40, 0x00, 0x10, 0, 0, 0, 0, 0];
            on_frame(&Frame::new(0x600 + u16::from(ID), &request[..len]).unwrap(), &mut sent);
            sent.0.iter().filter(|frame| frame.data()[..4] == [0x43, 0x00, 0x10, 0]).count()
        })
        .collect()
}

#[test]
fn a_short_request_is_taken_if_the_application_wants_it() {
    let strict = std::cell::RefCell::new(node!(false));
    let lax = std::cell::RefCell::new(node!(true));
    let of_strict = |frame: &Frame, sent: &mut Sent| {
        let _ = strict.borrow_mut().on_frame(frame, Instant(1), sent);
    };
    let of_lax = |frame: &Frame, sent: &mut Sent| {
        let _ = lax.borrow_mut().on_frame(frame, Instant(1), sent);
    };
    let of_lax_services = |frame: &Frame, sent: &mut Sent| {
        let _ = lax.borrow_mut().on_service_frame(frame, Instant(1), sent);
    };
    assert_eq!(answers(of_strict, 3..=8), [0, 0, 0, 0, 0, 1]);
    assert_eq!(answers(of_lax, 3..=8), [1; 6]);
    assert_eq!(answers(of_lax_services, 3..=8), [1; 6]);
    assert_eq!(answers(of_lax, 0..=0), [0], "an empty frame is no request");
    for other in [0x601 + u16::from(ID), 0x200, 0x580 + u16::from(ID)] {
        let mut sent = Sent::default();
        of_lax(&Frame::new(other, &[0x40, 0x00, 0x10]).unwrap(), &mut sent);
        assert_eq!(sent.0, [], "{other:X}h is no request to this node");
    }
}

#[test]
fn an_empty_frame_and_a_remote_frame_are_no_requests() {
    let mut node = node!(true);
    let id = 0x600 + u16::from(ID);
    let remote = (0..=8).map(|len| Frame::remote(id, len).unwrap());
    for frame in remote.chain(Frame::new(id, &[])) {
        let mut sent = Sent::default();
        let _ = node.on_frame(&frame, Instant(1), &mut sent);
        assert_eq!(sent.0, [], "{frame:?}");
    }
}
