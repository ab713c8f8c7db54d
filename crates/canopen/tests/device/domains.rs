//! Domains in parts, in both directions, with begin, end and abort.

use canopen::client::sdo::{BlockDownload, BlockUpload, Buffer, Download, Error, Options, Upload};
use canopen::client::{Service, Step};
use canopen::dictionary::{Access, Dictionary, Object, Type};
use canopen::nmt::Command;
use canopen::sdo::{Abort, BlockSize, Multiplexer, Request};
use canopen::{Application, Device, Frame, Instant, NodeId, Part, objects};

use crate::exchange;
use crate::types::Sent;

const ID: u8 = 5;
const LOG: Multiplexer = Multiplexer { index: 0x2000, sub: 0 };
const WHOLE: Multiplexer = Multiplexer { index: 0x2001, sub: 0 };
const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register()],
    objects::identity(0, 1, 1),
    [
        Object::new(0x2000, 0, "", Type::Domain, Access::ReadWrite),
        Object::new(0x2001, 0, "", Type::Domain, Access::ReadOnly),
        Object::new(0x2002, 0, "", Type::Domain, Access::WriteOnly),
    ],
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

/// The byte of the content at an offset.
fn byte(offset: usize) -> u8 {
    (offset * 7 + offset / 256) as u8
}

fn content(len: usize) -> Vec<u8> {
    (0..len).map(byte).collect()
}

#[derive(Clone, Debug, PartialEq)]
enum Call {
    Begin,
    Part(usize, usize),
    End(bool),
    Download,
    Downloaded(usize),
    Aborted,
}

/// A domain that is not in memory.
#[derive(Default)]
struct Tape {
    len: usize,
    calls: Vec<Call>,
    /// The offset that cannot be read, or written.
    broken: Option<usize>,
    refuses_end: bool,
    is_empty: bool,
    /// The parts of downloads: offset and length.
    parts: Vec<(usize, usize)>,
}

impl Application for Tape {
    const DOMAIN_PARTS: bool = true;

    fn begin_upload(&mut self, at: Multiplexer) -> Result<Option<usize>, Abort> {
        if at == WHOLE {
            return Ok(None);
        }
        self.calls.push(Call::Begin);
        Ok(Some(self.len))
    }

    fn upload_part(&mut self, _: Multiplexer, offset: usize, part: &mut [u8]) -> Result<(), Abort> {
        self.calls.push(Call::Part(offset, part.len()));
        if self.broken.is_some_and(|broken| (offset..offset + part.len()).contains(&broken)) {
            return Err(Abort::Hardware);
        }
        part.iter_mut().zip(offset..).for_each(|(to, offset)| *to = byte(offset));
        Ok(())
    }

    fn end_upload(&mut self, _: Multiplexer, is_complete: bool) {
        self.calls.push(Call::End(is_complete));
    }

    fn read_domain(&self, _: Multiplexer) -> Result<&[u8], Abort> {
        Ok(if self.is_empty { b"" } else { b"a domain as one slice" })
    }

    fn write_domain(&mut self, _: Multiplexer, part: Part<'_>) -> Result<(), Abort> {
        match part {
            Part::Begin(_) => self.calls.push(Call::Download),
            Part::Data(offset, _) if self.broken == Some(offset) => return Err(Abort::Hardware),
            Part::End(_) if self.refuses_end => return Err(Abort::DeviceState),
            Part::End(len) => self.calls.push(Call::Downloaded(len)),
            Part::Data(offset, bytes) => self.parts.push((offset, bytes.len())),
        }
        Ok(())
    }

    fn download_aborted(&mut self, _: Multiplexer) {
        self.calls.push(Call::Aborted);
    }
}

type Node = canopen::device!(Tape, ROWS);

fn node(len: usize) -> Node {
    let tape = Tape { len, ..Tape::default() };
    let mut node = Device::new(&DICTIONARY, NodeId::new(ID), tape);
    let _ = node.start(Instant(0), &mut Sent::default());
    node
}

fn calls(node: &mut Node) -> Vec<Call> {
    core::mem::take(&mut node.application_mut().calls)
}

fn ask(node: &mut Node, request: Request) -> Vec<[u8; 8]> {
    let mut sent = Sent::default();
    let _ = node.on_service_frame(&Frame::new(0x605, &request.encode()).unwrap(), Instant(1), &mut sent);
    sent.0.iter().map(|frame| frame.data().try_into().unwrap()).collect()
}

const OPTIONS: Options = Options {
    timeout: canopen::Duration::from_millis(100),
    limit: canopen::Duration::from_millis(5000),
    retries: 0,
    block_size: BlockSize::MAX,
};

/// Runs a transfer. `loses` drops an answer, by its number from 0.
fn run<S: Service<Output = Result<(), Error>>>(
    node: &mut Node,
    service: &mut S,
    mut loses: impl FnMut(usize) -> bool,
) -> Result<(), u32> {
    let (mut now, mut number) = (Instant(1), 0);
    loop {
        let mut sent = Sent::default();
        match service.next(now) {
            Step::Send(request) => {
                let _ = node.on_frame(&request, now, &mut sent);
            }
            Step::Wait(until) => {
                let due = node.poll(now, &mut sent).due();
                assert!(due > now, "what is due does not stay due");
                now = until.min(due);
            }
            Step::Done(Err(Error::Abort(code))) => return Err(code.0),
            Step::Done(result) => return result.map_err(|error| panic!("{error}")),
        }
        for answer in sent.0 {
            if !loses(number) {
                let _ = service.on_frame(&answer, now);
            }
            number += 1;
        }
    }
}

fn upload(node: &mut Node, at: Multiplexer) -> Result<Vec<u8>, u32> {
    let mut memory = [0; 4000];
    let mut upload = Upload::new(NodeId::new(ID).unwrap(), at, Buffer::new(&mut memory), OPTIONS);
    run(node, &mut upload, |_| false)?;
    Ok(upload.into_sink().as_slice().to_vec())
}

fn block_upload(node: &mut Node, loses: impl FnMut(usize) -> bool) -> Result<Vec<u8>, u32> {
    block_upload_of(node, LOG, loses)
}

fn block_upload_of(
    node: &mut Node,
    at: Multiplexer,
    loses: impl FnMut(usize) -> bool,
) -> Result<Vec<u8>, u32> {
    let mut memory = [0; 4000];
    let mut upload = BlockUpload::new(NodeId::new(ID).unwrap(), at, Buffer::new(&mut memory), OPTIONS);
    run(node, &mut upload, loses)?;
    Ok(upload.into_sink().as_slice().to_vec())
}

const LENGTHS: [usize; 14] = [0, 1, 4, 5, 7, 8, 111, 112, 113, 119, 224, 889, 890, 3000];

#[test]
fn an_upload_in_segments_reads_each_part_once() {
    for len in LENGTHS {
        let mut node = node(len);
        assert_eq!(upload(&mut node, LOG), Ok(content(len)), "{len} bytes");
        let parts: Vec<_> =
            (0..len.max(1)).step_by(112).map(|at| Call::Part(at, (len - at).min(112))).collect();
        let expected = [vec![Call::Begin], parts, vec![Call::End(true)]].concat();
        assert_eq!(calls(&mut node), expected, "{len} bytes");
    }
}

#[test]
fn an_upload_in_blocks_reads_each_part_once() {
    for len in LENGTHS {
        let mut node = node(len);
        assert_eq!(block_upload(&mut node, |_| false), Ok(content(len)), "{len} bytes");
        let calls = calls(&mut node);
        assert_eq!((calls.first(), calls.last()), (Some(&Call::Begin), Some(&Call::End(true))));
        let read: usize = calls.iter().map(|call| if let Call::Part(_, len) = call { *len } else { 0 }).sum();
        // A block ends after 889 bytes, within the eighth part, which the next block needs again.
        assert!(read >= len && read <= len + 112 * (len / 889), "{len} bytes: {calls:?}");
    }
}

/// A lost segment is sent again, and the CRC, which the client checks, counts it once.
#[test]
fn a_repeated_block_is_read_again() {
    for lost in [1, 2, 17, 18, 100, 127, 128, 200] {
        let mut node = node(3000);
        assert_eq!(block_upload(&mut node, |number| number == lost), Ok(content(3000)), "answer {lost}");
        assert_eq!(calls(&mut node).last(), Some(&Call::End(true)));
    }
}

#[test]
fn a_domain_without_a_length_is_one_slice() {
    let mut node = node(9);
    assert_eq!(upload(&mut node, WHOLE).unwrap(), b"a domain as one slice");
    assert_eq!(calls(&mut node), []);
    let write_only = Multiplexer { index: 0x2002, sub: 0 };
    assert_eq!(upload(&mut node, write_only), Err(Abort::WriteOnly.code()));
    assert_eq!(calls(&mut node), []);
}

#[test]
fn an_unreadable_part_aborts_the_upload() {
    for (len, broken) in [(3, 1), (200, 0), (200, 150)] {
        let mut node = node(len);
        node.application_mut().broken = Some(broken);
        assert_eq!(upload(&mut node, LOG), Err(Abort::Hardware.code()));
        assert_eq!(calls(&mut node).last(), Some(&Call::End(false)), "{len} {broken}");
        assert_eq!(block_upload(&mut node, |_| false), Err(Abort::Hardware.code()));
        let calls = calls(&mut node);
        assert_eq!(calls.last(), Some(&Call::End(false)), "{len} {broken}");
        assert_eq!(calls.iter().filter(|call| matches!(call, Call::End(_))).count(), 1);
    }
}

/// The ends of a transfer that is not complete.
const ENDS: [fn(&mut Node); 6] = [
    |node| drop(ask(node, Request::Abort(LOG, 0x0800_0000))),
    |node| drop(ask(node, Request::Upload(Multiplexer { index: 0x1000, sub: 0 }))),
    // A request of another kind of transfer.
    |node| assert_eq!(ask(node, Request::BlockUploadEnded)[0][0], 0x80),
    |node| {
        let _ = node.nmt(Command::Stop, Instant(2), &mut Sent::default());
    },
    |node| {
        let _ = node.nmt(Command::ResetCommunication, Instant(2), &mut Sent::default());
    },
    |node| {
        let mut sent = Sent::default();
        let _ = node.poll(Instant(1_000_001), &mut sent);
        assert_eq!(sent.0[0].data(), Request::Abort(LOG, 0x0504_0000).encode());
    },
];

#[test]
fn every_end_of_an_upload_is_reported_once() {
    let begins: [fn(&mut Node); 2] = [
        |node| assert_eq!(ask(node, Request::Upload(LOG))[0][0], 0x41),
        |node| {
            let begin = Request::BlockUpload { at: LOG, crc: true, block_size: 5, threshold: 0 };
            assert_eq!(ask(node, begin)[0][0], 0xC6);
        },
    ];
    for begin in begins {
        for (number, end) in ENDS.into_iter().enumerate() {
            let mut node = node(200);
            begin(&mut node);
            assert_eq!(calls(&mut node), [Call::Begin]);
            end(&mut node);
            assert_eq!(calls(&mut node), [Call::End(false)], "{number}");
            let _ = node.poll(Instant(9_000_000), &mut Sent::default());
            assert_eq!(calls(&mut node), [], "{number}");
        }
    }
}

#[test]
fn every_end_of_a_download_is_reported_once() {
    let begins: [fn(&mut Node); 2] = [
        |node| {
            let initiate = canopen::sdo::Initiate::Segmented(Some(200));
            assert_eq!(ask(node, Request::Download(LOG, initiate))[0][0], 0x60);
        },
        |node| {
            let begin = Request::BlockDownload { at: LOG, crc: true, size: Some(200) };
            assert_eq!(ask(node, begin)[0][0], 0xA4);
        },
    ];
    for (kind, begin) in begins.into_iter().enumerate() {
        for (number, end) in ENDS.into_iter().enumerate() {
            // Within a block, a request is a segment.
            if kind == 1 && matches!(number, 1 | 2) {
                continue;
            }
            let mut node = node(0);
            begin(&mut node);
            assert_eq!(calls(&mut node), [Call::Download]);
            end(&mut node);
            assert_eq!(calls(&mut node), [Call::Aborted], "{kind} {number}");
            let _ = node.poll(Instant(9_000_000), &mut Sent::default());
            assert_eq!(calls(&mut node), [], "{kind} {number}");
        }
    }
}

#[test]
fn a_complete_download_has_no_abort() {
    let id = NodeId::new(ID).unwrap();
    for len in LENGTHS {
        let (mut node, data) = (node(0), content(len));
        assert_eq!(run(&mut node, &mut Download::new(id, LOG, &data, OPTIONS), |_| false), Ok(()));
        assert_eq!(calls(&mut node), [Call::Download, Call::Downloaded(len)], "{len} bytes");
        assert_eq!(run(&mut node, &mut BlockDownload::new(id, LOG, &data, OPTIONS), |_| false), Ok(()));
        assert_eq!(calls(&mut node), [Call::Download, Call::Downloaded(len)], "{len} bytes in blocks");
    }
}

#[test]
fn a_download_refused_by_the_application_is_aborted() {
    let id = NodeId::new(ID).unwrap();
    for len in [3, 50, 200] {
        let (mut node, data) = (node(0), content(len));
        node.application_mut().refuses_end = true;
        let refused = Err(Abort::DeviceState.code());
        assert_eq!(run(&mut node, &mut Download::new(id, LOG, &data, OPTIONS), |_| false), refused);
        assert_eq!(calls(&mut node), [Call::Download, Call::Aborted], "{len} bytes");
        node.application_mut().broken = Some(0);
        let refused = Err(Abort::Hardware.code());
        assert_eq!(run(&mut node, &mut BlockDownload::new(id, LOG, &data, OPTIONS), |_| false), refused);
        assert_eq!(calls(&mut node), [Call::Download, Call::Aborted], "{len} bytes in blocks");
    }
}

/// Threshold 0 forbids the change to segments (CiA 301, 7.2.4.3.13).
#[test]
fn an_empty_domain_is_read_as_no_byte_by_the_requested_protocol() {
    for at in [LOG, WHOLE] {
        let mut node = node(0);
        node.application_mut().is_empty = true;
        assert_eq!(upload(&mut node, at), Ok(vec![]), "{at:?}");
        for threshold in [0, 5] {
            let begin = Request::BlockUpload { at, crc: true, block_size: 5, threshold };
            assert_eq!(ask(&mut node, begin)[0][0], if threshold == 0 { 0xC6 } else { 0x41 }, "{at:?}");
        }
        assert_eq!(block_upload_of(&mut node, at, |_| false), Ok(vec![]), "{at:?}");
    }
}

/// Domains in parts, of which the application serves reading as one slice.
struct Slice;

impl Application for Slice {
    const DOMAIN_PARTS: bool = true;

    fn read_domain(&self, _: Multiplexer) -> Result<&[u8], Abort> {
        Ok(b"a slice")
    }
}

/// Domains in parts, of which the application gives the length alone.
struct Length;

impl Application for Length {
    const DOMAIN_PARTS: bool = true;

    fn begin_upload(&mut self, _: Multiplexer) -> Result<Option<usize>, Abort> {
        Ok(Some(3))
    }
}

/// The device refuses a transfer that the application does not serve, and never answers with zeros.
#[test]
fn a_domain_that_the_application_does_not_serve_is_refused() {
    fn of<D: canopen::Definition>(mut node: Device<D>) -> (Result<Vec<u8>, u32>, Result<(), u32>) {
        let _ = node.start(Instant(0), &mut Sent::default());
        let mut answer = |request: Frame| {
            let mut sent = Sent::default();
            let _ = node.on_service_frame(&request, Instant(1), &mut sent);
            sent.0
        };
        (exchange::read(ID, LOG, &mut answer), exchange::write(ID, LOG, &[1, 2, 3], &mut answer))
    }
    let slice: canopen::device!(Slice, ROWS) = Device::new(&DICTIONARY, NodeId::new(ID), Slice);
    let length: canopen::device!(Length, ROWS) = Device::new(&DICTIONARY, NodeId::new(ID), Length);
    let nothing: canopen::device!((), ROWS) = Device::new(&DICTIONARY, NodeId::new(ID), ());
    let refused = Abort::Access.code();
    assert_eq!(of(slice), (Ok(b"a slice".to_vec()), Err(refused)));
    assert_eq!(of(length), (Err(refused), Err(refused)));
    assert_eq!(of(nothing), (Err(refused), Err(refused)));
}

#[test]
fn a_domain_without_a_length_is_one_slice_in_blocks_too() {
    let mut node = node(9);
    assert_eq!(block_upload_of(&mut node, WHOLE, |_| false).unwrap(), b"a domain as one slice");
    let name = Multiplexer { index: 0x1018, sub: 2 };
    assert_eq!(block_upload_of(&mut node, name, |_| false).unwrap(), [1, 0, 0, 0]);
    assert_eq!(calls(&mut node), []);
}

/// The server acknowledges a block after a pause, and its buffer keeps the data.
#[test]
fn a_pause_within_a_block_does_not_divide_a_part() {
    for segments in [3, 15] {
        let (mut node, mut sent) = (node(0), Sent::default());
        ask(&mut node, Request::BlockDownload { at: LOG, crc: false, size: None });
        for (block, now, segments) in [(1, 1, 1..=segments), (2, 300_001, 1..=17)] {
            let _ = node.poll(Instant(now), &mut sent);
            for sequence in segments {
                let segment = Frame::new(0x605, &[sequence, block, 2, 3, 4, 5, 6, 7]).unwrap();
                let _ = node.on_service_frame(&segment, Instant(now), &mut sent);
            }
        }
        assert_eq!(node.application().parts, [(0, 112)], "{segments} segments before the pause");
    }
}
