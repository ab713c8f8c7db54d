//! A device that misbehaves in every way that its messages allow, with every command. Each command must end in time and
//! with little memory, and no control character of the device may reach the terminal.

use canopen::sdo::{
    BlockEnd, BlockSegment, BlockSize, Bytes, Initiate, Multiplexer, Request, Response, Segment,
};
use canopen::{Duration, Frame, Instant, Transmit};
use nodectl::bus::Station;

use crate::commands::run;
use crate::wire::Wire;

/// The misbehaviour of the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Manner {
    Silent,
    AbortsAll,
    AbortsWithUnknownCode,
    AbortsOther,
    AbortsLate,
    AnswersOther,
    AnswersUnknownCommand,
    AnswersShort,
    AnswersRemote,
    AnswersTwice,
    AnswersHundredfold,
    AnswersGarbage,
    AnswersZeros,
    AnswersAllOnes,
    AnswersWithControlCharacters,
    AnswersLate,
    AnswersEverySecondTime,
    ExpeditedWithoutSize,
    SegmentsWithoutData,
    SegmentsWithoutEnd,
    SegmentsOneByteEach,
    SegmentsBeyondTheSize,
    SegmentsBelowTheSize,
    SegmentsOfSixteenMegabytes,
    SegmentsOfFourGigabytes,
    SegmentsWithWrongToggle,
    SegmentsSlowly,
    DownloadNeverAcknowledged,
    DownloadAcknowledgedWithWrongToggle,
    BlocksWithWrongSequence,
    BlocksWithoutEnd,
    BlocksWithWrongCrc,
    BlocksThatStop,
    BlocksNeverAcknowledged,
    BlocksAcknowledgedBeyondTheirEnd,
    BlockSizeZero,
    BusyForEver,
    FloodsTheBus,
    BootsAgainAndAgain,
    LssAnswersAll,
    LssRefusesAll,
}

use Manner::*;

const MANNERS: [Manner; 41] = [
    Silent,
    AbortsAll,
    AbortsWithUnknownCode,
    AbortsOther,
    AbortsLate,
    AnswersOther,
    AnswersUnknownCommand,
    AnswersShort,
    AnswersRemote,
    AnswersTwice,
    AnswersHundredfold,
    AnswersGarbage,
    AnswersZeros,
    AnswersAllOnes,
    AnswersWithControlCharacters,
    AnswersLate,
    AnswersEverySecondTime,
    ExpeditedWithoutSize,
    SegmentsWithoutData,
    SegmentsWithoutEnd,
    SegmentsOneByteEach,
    SegmentsBeyondTheSize,
    SegmentsBelowTheSize,
    SegmentsOfSixteenMegabytes,
    SegmentsOfFourGigabytes,
    SegmentsWithWrongToggle,
    SegmentsSlowly,
    DownloadNeverAcknowledged,
    DownloadAcknowledgedWithWrongToggle,
    BlocksWithWrongSequence,
    BlocksWithoutEnd,
    BlocksWithWrongCrc,
    BlocksThatStop,
    BlocksNeverAcknowledged,
    BlocksAcknowledgedBeyondTheirEnd,
    BlockSizeZero,
    BusyForEver,
    FloodsTheBus,
    BootsAgainAndAgain,
    LssAnswersAll,
    LssRefusesAll,
];

/// The device. Its answers begin like the answers of a correct device.
struct Hostile {
    manner: Manner,
    late: Vec<(Instant, Frame)>,
    count: usize,
    next_noise: Instant,
}

impl Hostile {
    fn new(manner: Manner) -> Hostile {
        Hostile { manner, late: vec![], count: 0, next_noise: Instant(0) }
    }

    fn has_segments(&self) -> bool {
        matches!(
            self.manner,
            SegmentsWithoutData
                | SegmentsWithoutEnd
                | SegmentsOneByteEach
                | SegmentsBeyondTheSize
                | SegmentsBelowTheSize
                | SegmentsOfSixteenMegabytes
                | SegmentsOfFourGigabytes
                | SegmentsWithWrongToggle
                | SegmentsSlowly
                | AnswersWithControlCharacters
        )
    }

    fn begin_upload(&self, at: Multiplexer) -> Response {
        match self.manner {
            _ if !self.has_segments() => Response::Uploaded(at, Bytes::new([1, 0, 0, 0], 4)),
            SegmentsOfSixteenMegabytes => Response::UploadSegmented(at, Some(16 << 20)),
            SegmentsOfFourGigabytes => Response::UploadSegmented(at, Some(u32::MAX)),
            SegmentsBeyondTheSize => Response::UploadSegmented(at, Some(10)),
            SegmentsBelowTheSize => Response::UploadSegmented(at, Some(1000)),
            _ => Response::UploadSegmented(at, None),
        }
    }

    fn segment(&self, toggle: bool) -> Response {
        let (data, last) = match self.manner {
            SegmentsWithoutData => (Bytes::new([0; 7], 0), false),
            SegmentsOneByteEach | SegmentsSlowly => (Bytes::new([0x41; 7], 1), false),
            SegmentsBelowTheSize => (Bytes::new([0x41; 7], 7), true),
            AnswersWithControlCharacters => (Bytes::new(*b"\x1b[2J\r\n\x07", 7), true),
            _ => (Bytes::new([0x41; 7], 7), false),
        };
        Response::UploadedSegment(Segment {
            toggle: toggle ^ (self.manner == SegmentsWithWrongToggle),
            last,
            data,
        })
    }

    fn block(&self) -> Vec<[u8; 8]> {
        let segment = |number: u8, last| {
            let sequence = BlockSize::new(number).expect("1 to 127");
            BlockSegment { last, sequence, data: [0x41; 7] }.encode()
        };
        match self.manner {
            BlocksWithWrongSequence => (2..=127).map(|number| segment(number, false)).collect(),
            BlocksThatStop => vec![segment(1, false), segment(2, false)],
            BlocksWithoutEnd => (1..=127).map(|number| segment(number, false)).collect(),
            _ => vec![segment(1, true)],
        }
    }

    fn answers(&mut self, request: [u8; 8]) -> Vec<[u8; 8]> {
        let size = BlockSize::new(1).expect("1 to 127");
        let one = |response: Response| vec![response.encode()];
        let Some(parsed) = Request::parse(&request) else { return vec![] };
        match parsed {
            Request::Upload(at)
                if at == (Multiplexer { index: 0x1F57, sub: 1 }) && self.manner == BusyForEver =>
            {
                one(Response::Uploaded(at, Bytes::new([1, 0, 0, 0], 4)))
            }
            Request::Upload(at) => one(self.begin_upload(at)),
            Request::UploadSegment { toggle } => one(self.segment(toggle)),
            Request::Download(at, Initiate::Segmented(_)) => one(Response::Downloaded(at)),
            Request::Download(..) if self.manner == DownloadNeverAcknowledged => vec![],
            Request::Download(at, _) => one(Response::Downloaded(at)),
            Request::DownloadSegment(_) if self.manner == DownloadNeverAcknowledged => vec![],
            Request::DownloadSegment(segment) => {
                let toggle = segment.toggle ^ (self.manner == DownloadAcknowledgedWithWrongToggle);
                one(Response::DownloadedSegment { toggle })
            }
            Request::BlockDownload { at, .. } if self.manner == BlockSizeZero => {
                vec![[0xA4, at.index as u8, (at.index >> 8) as u8, at.sub, 0, 0, 0, 0]]
            }
            Request::BlockDownload { at, .. } => one(Response::BlockDownload(at, size)),
            Request::BlockDownloadEnd(_) => one(Response::BlockDownloaded),
            Request::BlockUpload { at, .. } => one(Response::BlockUpload { at, crc: true, size: None }),
            Request::BlockUploadStart => self.block(),
            Request::BlockAcknowledge { .. }
                if matches!(self.manner, BlocksWithoutEnd | BlocksWithWrongSequence) =>
            {
                self.block()
            }
            Request::BlockAcknowledge { .. } => {
                one(Response::BlockUploadEnd(BlockEnd { unused: 0, crc: 0x1234 }))
            }
            Request::Abort(..) | Request::BlockUploadEnded => vec![],
        }
    }

    /// Whether a request is a segment of a block download. Segments look like requests, and only the device can tell
    /// them apart.
    fn is_segment_of_block(request: [u8; 8]) -> bool {
        matches!(request[0], 0x01..=0x0F | 0x81..=0x9F)
    }

    fn sdo(&mut self, request: [u8; 8]) -> Vec<Frame> {
        let at = Multiplexer { index: u16::from_le_bytes([request[1], request[2]]), sub: request[3] };
        let frames = |answers: Vec<[u8; 8]>| -> Vec<Frame> {
            answers.iter().filter_map(|data| Frame::new(0x581, data)).collect()
        };
        if request[0] == 0x80 {
            return vec![];
        }
        if Hostile::is_segment_of_block(request) && matches!(self.manner, BlocksNeverAcknowledged) {
            return frames(vec![[0xA2, 0, 1, 0, 0, 0, 0, 0]]);
        }
        if Hostile::is_segment_of_block(request) && matches!(self.manner, BlocksAcknowledgedBeyondTheirEnd) {
            return frames(vec![[0xA2, 127, 127, 0, 0, 0, 0, 0]]);
        }
        self.count += 1;
        let good = self.answers(request);
        let noise = (self.count as u8).wrapping_mul(37);
        match self.manner {
            Silent => vec![],
            AbortsAll => frames(vec![Response::Abort(at, 0x0800_0000).encode()]),
            AbortsWithUnknownCode => frames(vec![Response::Abort(at, 0xDEAD_BEEF).encode()]),
            AbortsOther => {
                frames(vec![Response::Abort(Multiplexer { index: 1, sub: 1 }, 0x0602_0000).encode()])
            }
            AbortsLate => frames([good, vec![Response::Abort(at, 0x0504_0000).encode()]].concat()),
            AnswersOther => frames(vec![[0x43, 0x34, 0x12, 9, 1, 2, 3, 4]]),
            AnswersUnknownCommand => frames(vec![[0xFF; 8]]),
            AnswersShort => {
                Frame::new(0x581, &good.concat()[..3.min(good.concat().len())]).into_iter().collect()
            }
            AnswersRemote => Frame::remote(0x581, 8).into_iter().collect(),
            AnswersTwice => frames(good.iter().flat_map(|data| [*data, *data]).collect()),
            AnswersHundredfold => frames(good.iter().flat_map(|data| [*data; 100]).collect()),
            AnswersGarbage => frames(vec![[noise, noise ^ 0x55, 3, noise, 9, noise, 1, noise]]),
            AnswersZeros => frames(vec![[0; 8]]),
            AnswersAllOnes => {
                frames(vec![[0x43, request[1], request[2], request[3], 0xFF, 0xFF, 0xFF, 0xFF]])
            }
            AnswersEverySecondTime if self.count % 2 == 1 => vec![],
            ExpeditedWithoutSize => frames(vec![[0x42, request[1], request[2], request[3], 0xFF, 0, 0, 0]]),
            _ => frames(good),
        }
    }

    fn lss(&self, request: &Frame) -> Vec<Frame> {
        let code = request.data().first().copied().unwrap_or(0);
        let answer = match (self.manner, code) {
            (LssAnswersAll, 0x51) => [0x4F, 0, 0, 0, 0, 0, 0, 0],
            (LssAnswersAll, 0x43) => [0x44, 0, 0, 0, 0, 0, 0, 0],
            (LssAnswersAll, 0x4C) => [0x50, 0, 0, 0, 0, 0, 0, 0],
            (LssAnswersAll, code) => [code, 0, 0, 0, 0, 0, 0, 0],
            (LssRefusesAll, 0x51) => [0x4F, 0, 0, 0, 0, 0, 0, 0],
            (LssRefusesAll, 0x43) => [0x44, 0, 0, 0, 0, 0, 0, 0],
            (LssRefusesAll, code) => [code, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0, 0],
            _ => return vec![],
        };
        Frame::new(0x7E4, &answer).into_iter().collect()
    }
}

impl Station for Hostile {
    fn receive(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        let answers = match frame.id() {
            0x601 => frame.data().try_into().map(|request| self.sdo(request)).unwrap_or_default(),
            0x7E5 => self.lss(frame),
            _ => vec![],
        };
        let delay = match self.manner {
            AnswersLate => Duration::from_millis(1500),
            SegmentsSlowly => Duration::from_millis(900),
            _ => Duration(0),
        };
        self.late.extend(answers.into_iter().map(|frame| (now + delay, frame)));
        self.poll(now, out);
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        let (ready, late): (Vec<_>, Vec<_>) = self.late.drain(..).partition(|(at, _)| *at <= now);
        self.late = late;
        ready.into_iter().for_each(|(_, frame)| out.send(frame).expect("room"));
        let noise = match self.manner {
            FloodsTheBus => Some((Duration(500), Frame::new(0x181, &[0x1B; 8]))),
            BootsAgainAndAgain => Some((Duration::from_millis(20), Frame::new(0x701, &[0]))),
            _ => None,
        };
        if let Some((period, Some(frame))) = noise {
            while self.next_noise <= now {
                out.send(frame).expect("room");
                self.next_noise = self.next_noise.max(now) + period;
            }
        }
        let due = if noise.is_some() { self.next_noise } else { Instant::NEVER };
        self.late.iter().fold(due, |due, (at, _)| due.min(*at))
    }
}

/// The data sheet of a device with some hundred objects.
const SHEET: &str = "../../eds/pressure.eds";

/// Every command, and its time limit in seconds. An update waits for flashes and restarts.
fn commands<'f>(file: &'f str, dcf: &'f str) -> Vec<(Vec<&'f str>, u64)> {
    vec![
        (vec!["scan"], 25),
        (vec!["info"], 25),
        (vec!["read", "1008"], 45),
        (vec!["read", "1000", "1018:1", "--json"], 65),
        (vec!["read", "1008", "--block"], 45),
        (vec!["read", "1008", "--eds", SHEET], 25),
        (vec!["write", "1017", "5"], 45),
        (vec!["write", "2F00", "--type", "d", "--file", file], 45),
        (vec!["write", "2F00", "--type", "d", "--file", file, "--block"], 45),
        (vec!["save"], 45),
        (vec!["restore"], 45),
        (vec!["nmt", "start"], 45),
        (vec!["nmt", "stop"], 45),
        (vec!["nmt", "reset"], 25),
        (vec!["lss", "scan"], 120),
        (vec!["lss", "inquire"], 120),
        (vec!["lss", "set-id", "5"], 120),
        (vec!["lss", "set-id", "5", "--select", "1:2:3:4"], 60),
        (vec!["record", "--for", "3", "--start"], 60),
        (vec!["trace", "--for", "3"], 60),
        (vec!["map", "tpdo", "1", "6130:1", "--eds", SHEET], 120),
        (vec!["unmap", "tpdo", "1", "--eds", SHEET], 60),
        (vec!["list", "--eds", SHEET], 150),
        (vec!["dump", dcf, "--eds", SHEET], 150),
        (vec!["diff", SHEET, "--eds", SHEET], 150),
        (vec!["apply", SHEET, "--eds", SHEET, "--force"], 300),
        (vec!["update", "--raw", file, "--patience", "5"], 900),
    ]
}

#[test]
fn every_command_survives_every_manner() {
    let file = format!("{}/hostile.bin", env!("CARGO_TARGET_TMPDIR"));
    std::fs::write(&file, b"1.1.0\nnew").expect("a file");
    for manner in MANNERS {
        for (line, limit) in commands(&file, &format!("{file}.dcf")) {
            let wire = Wire::new(Hostile::new(manner));
            let before = wire.network().now();
            let (printed, result) = run(&wire, &line);
            let seconds = (wire.network().now().0 - before.0) / 1_000_000;
            let context = format!(
                "{manner:?}: {line:?} took {seconds} s: {:?}",
                result.map_err(|error| error.to_string())
            );
            assert!(seconds <= limit, "{context}");
            // A trace prints a line for each frame, here 2,000 a second.
            let most = if line.contains(&"trace") { 500_000 } else { 100_000 };
            assert!(printed.len() < most, "{context}, {} bytes", printed.len());
            assert!(printed.chars().all(|char| char == '\n' || !char.is_control()), "{context}: {printed:?}");
        }
    }
}

/// A single transfer ends within its time limit, to the second.
#[test]
fn one_transfer_costs_ten_seconds_at_most() {
    for manner in MANNERS {
        let wire = Wire::new(Hostile::new(manner));
        let mut network = wire.network();
        let node = canopen::NodeId::new(1).expect("a node-ID");
        for is_block in [false, true] {
            let before = network.now();
            let mut client = nodectl::sdo::Client::new(&mut network, node, nodectl::sdo::Options::default());
            let at = Multiplexer { index: 0x1008, sub: 0 };
            let value = if is_block { client.block_upload(at) } else { client.upload(at) };
            assert!(value.is_err() || value.is_ok_and(|value| value.len() <= 16 << 20), "{manner:?}");
            let micros = network.now().0 - before.0;
            assert!(micros <= 10_100_000, "{manner:?}: {micros}");
        }
    }
}
