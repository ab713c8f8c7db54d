//! SDO transfers with one server, followed frame by frame (CiA 301, 7.2.4.3).
//!
//! The server is judged. A client may do anything: after a request that does not fit, the server's frames are ignored
//! until the next initiate request.

use canopen::Instant;
use crc::{CRC_16_XMODEM, Crc};

use crate::{Findings, Key, Rule};

/// The data of a transfer that is kept.
const KEPT: usize = 1 << 20;
/// The time for an answer in us.
const TIME_OUT: u64 = 1_000_000;
/// The longest time in us between two segments of a block that are on their way. A server gives a client that pauses
/// longer.
const IN_A_ROW: u64 = 100_000;
/// How many segments a server may miss while it starts.
const LOST: u8 = 16;

/// The server's next frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Expect {
    /// None: the client has the turn, or there is no transfer.
    Nothing,
    /// The answer to an initiate request.
    Initiate,
    /// The answer to a segment with this toggle bit.
    Segment { toggle: bool, is_last: bool },
    /// Segments of a block upload.
    Segments,
    /// The acknowledge of a block.
    BlockAcknowledge,
    /// The confirmation of a block download.
    BlockEnd,
    /// Anything: the client has broken the protocol.
    Anything,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Expedited,
    Segmented,
    Block,
}

/// A transfer under way.
#[derive(Clone, Debug)]
struct Transfer {
    key: Key,
    is_download: bool,
    mode: Mode,
    data: Vec<u8>,
    size: Option<usize>,
    toggle: bool,
    /// Segments in a block, the segments of the present block, and whether the last of the transfer is among them.
    block_size: u8,
    block: Vec<[u8; 7]>,
    has_last: bool,
    /// The present block has begun before the server has acknowledged that nothing of the rest of the block before counts.
    is_early: bool,
    /// Whether both sides check a CRC, and the one that the client has sent.
    has_crc: bool,
    crc: u16,
    /// The client allows another protocol for a small object.
    may_switch: bool,
    /// The server has ended a block upload, and waits for the client's confirmation.
    is_read: bool,
}

/// The end of a transfer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Event {
    /// A client asks for the download of a value, which is known for an expedited transfer.
    Begins(Key, Option<Vec<u8>>),
    Read(Key, Vec<u8>),
    Written(Key, Vec<u8>),
    /// A download ended without effect.
    Aborted(Key, Vec<u8>),
}

/// The channel.
#[derive(Debug)]
pub(crate) struct Channel {
    transfer: Option<Transfer>,
    expect: Expect,
    /// When the server has got its turn.
    since: Instant,
    /// Answers to requests before that may still be on their way: the client did not wait for them.
    crossing: u16,
    stray: Option<Stray>,
}

/// The server has ended a block download within a block, of which further segments may still be on their way.
#[derive(Clone, Copy, Debug)]
struct Stray {
    /// The sequence number of the next segment.
    next: u8,
    /// Whether the end of the block may be answered: a reset has ended the transfer without an abort message.
    is_answered: bool,
}

impl Channel {
    pub(crate) fn new() -> Channel {
        Channel { transfer: None, expect: Expect::Anything, since: Instant(0), crossing: 0, stray: None }
    }

    /// The server has restarted: there is no transfer, but the client may still be sending a block.
    pub(crate) fn reset(&mut self) {
        self.give_up();
        *self = Channel { expect: Expect::Nothing, since: self.since, stray: self.stray, ..Channel::new() };
    }

    /// The sequence number of the next segment of a block download.
    fn next_segment(&self) -> Option<u8> {
        let transfer = self.transfer.as_ref().filter(|_| self.expect == Expect::Nothing)?;
        self.is_within_block_download().then_some(transfer.block.len() as u8 + 1)
    }

    /// The object whose request is without an answer since a second; `None` without such an object. A request is reported
    /// once.
    pub(crate) fn overdue(&self, now: Instant) -> Option<(Key, Instant)> {
        let is_waiting = !matches!(self.expect, Expect::Nothing | Expect::Anything);
        let transfer = self.transfer.as_ref().filter(|_| is_waiting)?;
        (now.0 > self.since.0.saturating_add(TIME_OUT)).then_some((transfer.key, self.since))
    }

    /// Whether the server has nothing to do.
    pub(crate) fn is_idle(&self) -> bool {
        self.expect == Expect::Nothing && self.transfer.is_none()
    }

    /// The time for an answer restarts.
    pub(crate) fn resume(&mut self, now: Instant) {
        self.since = now;
    }

    /// Expects nothing any more.
    pub(crate) fn give_up(&mut self) {
        let rest = self.next_segment().map(|next| Stray { next, is_answered: true });
        self.stray = rest.or(self.stray);
        self.expect = Expect::Anything;
    }

    /// A frame of a client.
    pub(crate) fn request(&mut self, data: &[u8], now: Instant) -> Option<Event> {
        let Ok(data) = <[u8; 8]>::try_from(data) else {
            self.expect = Expect::Anything;
            return None;
        };
        if self.expect == Expect::Nothing && now.0 > self.since.0.saturating_add(TIME_OUT) {
            self.crossing = 0;
        }
        if now.0 > self.since.0.saturating_add(IN_A_ROW) {
            self.stray = None;
        }
        self.since = now;
        if self.is_stray(data[0]) {
            return None;
        }
        if self.is_within_block_download() && data[0] != 0x80 {
            self.take_segment(data);
            return None;
        }
        match data[0] >> 5 {
            1 => self.begin(download(data)),
            2 => self.begin(Some(Transfer::new(key(data), false, Mode::Expedited))),
            5 if data[0] & 3 == 0 => self.begin(block_upload(data)),
            6 if data[0] & 1 == 0 => self.begin(Some(block_download(data))),
            4 => self.client_abort(),
            _ => {
                if !self.go_on(data) {
                    self.expect = Expect::Anything;
                }
                None
            }
        }
    }

    /// Whether a frame is a segment of a block that the server has ended. No answer to it is due.
    pub(crate) fn is_stray(&mut self, command: u8) -> bool {
        let sequence = command & 0x7F;
        let follows = |stray: &Stray| (stray.next..stray.next.saturating_add(LOST)).contains(&sequence);
        let Some(stray) = self.stray.take().filter(follows) else { return false };
        let is_end = command & 0x80 != 0 || sequence == 127;
        if is_end && stray.is_answered {
            self.crossing = self.crossing.saturating_add(1);
        }
        self.stray = (!is_end).then_some(Stray { next: sequence + 1, ..stray });
        true
    }

    fn is_within_block_download(&self) -> bool {
        self.expect == Expect::BlockAcknowledge
            || self.transfer.as_ref().is_some_and(|transfer| {
                transfer.is_download
                    && transfer.mode == Mode::Block
                    && transfer.block_size > 0
                    && !transfer.has_last
                    && self.expect == Expect::Nothing
            })
    }

    fn begin(&mut self, transfer: Option<Transfer>) -> Option<Event> {
        if self.expect != Expect::Nothing {
            self.crossing = self.crossing.saturating_add(1);
        }
        let Some(transfer) = transfer else {
            (self.transfer, self.expect) = (None, Expect::Anything);
            return None;
        };
        let value = (transfer.mode == Mode::Expedited).then(|| transfer.data.clone());
        let event = transfer.is_download.then_some(Event::Begins(transfer.key, value));
        (self.transfer, self.expect) = (Some(transfer), Expect::Initiate);
        event
    }

    fn client_abort(&mut self) -> Option<Event> {
        let is_crossing = self.expect != Expect::Nothing;
        if is_crossing {
            (self.crossing, self.expect) = (self.crossing.saturating_add(1), Expect::Anything);
        }
        // The answer may have been on its way: a download whose last frame was sent may have had its effect.
        let transfer = self.transfer.take()?;
        (transfer.is_download && !is_crossing).then_some(Event::Aborted(transfer.key, transfer.data))
    }

    /// A request within a transfer. Returns whether it fits.
    fn go_on(&mut self, data: [u8; 8]) -> bool {
        let Some(transfer) = self.transfer.as_mut().filter(|_| self.expect == Expect::Nothing) else {
            return false;
        };
        let toggle = data[0] & 0x10 != 0;
        self.expect = match (data[0] >> 5, transfer.is_download, transfer.mode) {
            (0, true, Mode::Segmented) if toggle == transfer.toggle => {
                let len = 7 - usize::from(data[0] >> 1 & 7);
                transfer.take(&data[1..=len]);
                transfer.toggle = !toggle;
                Expect::Segment { toggle, is_last: data[0] & 1 != 0 }
            }
            (3, false, Mode::Segmented) if toggle == transfer.toggle => {
                transfer.toggle = !toggle;
                Expect::Segment { toggle, is_last: false }
            }
            (6, true, Mode::Block) if transfer.has_last => {
                transfer.trim(data[0] >> 2 & 7);
                transfer.crc = u16::from_le_bytes([data[1], data[2]]);
                Expect::BlockEnd
            }
            (5, false, Mode::Block) => match data[0] & 3 {
                3 if transfer.block.is_empty() => Expect::Segments,
                2 if usize::from(data[1]) <= transfer.block.len() => {
                    let whole = usize::from(data[1]) == transfer.block.len();
                    transfer.acknowledge(data[1]);
                    transfer.block_size = data[2];
                    if whole && transfer.has_last {
                        Expect::BlockEnd
                    } else if (1..=127).contains(&data[2]) {
                        transfer.has_last = false;
                        Expect::Segments
                    } else {
                        return false;
                    }
                }
                // The end of the transfer: the server has nothing to add.
                1 if transfer.is_read => {
                    self.transfer = None;
                    return true;
                }
                _ => return false,
            },
            _ => return false,
        };
        true
    }

    /// A segment of a block download.
    fn take_segment(&mut self, data: [u8; 8]) {
        let Some(transfer) = &mut self.transfer else { return };
        let sequence = data[0] & 0x7F;
        transfer.is_early |=
            self.expect == Expect::BlockAcknowledge && transfer.block.is_empty() && sequence == 1;
        if usize::from(sequence) == transfer.block.len() + 1 {
            transfer.block.push([data[1], data[2], data[3], data[4], data[5], data[6], data[7]]);
            transfer.has_last = data[0] & 0x80 != 0;
        }
        if sequence >= transfer.block_size || data[0] & 0x80 != 0 {
            self.expect = Expect::BlockAcknowledge;
        }
    }

    /// A frame of the server.
    pub(crate) fn response(&mut self, data: &[u8], findings: &mut Findings) -> Option<Event> {
        let Ok(data) = <[u8; 8]>::try_from(data) else {
            findings.push((Rule::SdoProtocol, format!("a response of {} bytes", data.len())));
            return None;
        };
        if self.expect == Expect::Anything {
            return self.unclear(data);
        }
        if data[0] == 0x80 {
            return self.server_abort(data, findings);
        }
        match self.judge(data) {
            Ok(event) => event,
            Err(_) if self.was_crossing() => None,
            Err(text) => {
                findings.push((Rule::SdoProtocol, text));
                (self.transfer, self.expect) = (None, Expect::Anything);
                None
            }
        }
    }

    /// Whether the answer may be one to a request before; there is one fewer then.
    fn was_crossing(&mut self) -> bool {
        let was_crossing = self.crossing > 0;
        self.crossing = self.crossing.saturating_sub(1);
        was_crossing
    }

    /// A frame that cannot be judged. An abort or a final answer still ends what was begun.
    fn unclear(&mut self, data: [u8; 8]) -> Option<Event> {
        let is_abort = data[0] == 0x80;
        let transfer = self.transfer.take_if(|transfer| is_abort && transfer.key == key(data))?;
        transfer.is_download.then_some(Event::Aborted(transfer.key, transfer.data))
    }

    fn server_abort(&mut self, data: [u8; 8], findings: &mut Findings) -> Option<Event> {
        let Some(transfer) = self.transfer.take_if(|transfer| transfer.key == key(data)) else {
            if !self.was_crossing() {
                let (index, sub) = key(data);
                let text = format!("an abort for {index:04X}h:{sub}, which is not transferred");
                findings.push((Rule::SdoProtocol, text));
            }
            return None;
        };
        let within_block = transfer.mode == Mode::Block && self.expect == Expect::Nothing;
        let next = transfer.block.len() as u8 + 1;
        self.stray = (within_block && transfer.is_download).then_some(Stray { next, is_answered: false });
        self.expect = Expect::Nothing;
        transfer.is_download.then_some(Event::Aborted(transfer.key, transfer.data))
    }

    /// Judges a response that is no abort.
    fn judge(&mut self, data: [u8; 8]) -> Result<Option<Event>, String> {
        if self.is_within_block_download() {
            // A server may acknowledge what it has of a block when the client is silent.
            self.expect = Expect::BlockAcknowledge;
        }
        let Some(transfer) = &mut self.transfer else {
            return Err("a response without a request".to_owned());
        };
        let command = data[0];
        let done = match self.expect {
            Expect::Initiate => {
                let (answered, (index, sub)) = (key(data), transfer.key);
                if answered != transfer.key {
                    let text = format!("the answer names {:04X}h:{}", answered.0, answered.1);
                    return Err(format!("{text}, requested is {index:04X}h:{sub}"));
                }
                transfer.initiated(data)?
            }
            Expect::Segment { toggle, is_last } => {
                if (command & 0x10 != 0) != toggle {
                    return Err("the toggle bit of a segment is wrong".to_owned());
                }
                match (command >> 5, transfer.is_download) {
                    (1, true) => is_last,
                    (0, false) => {
                        transfer.take(&data[1..=7 - usize::from(command >> 1 & 7)]);
                        command & 1 != 0
                    }
                    _ => return Err(format!("the answer {command:02X}h to a segment")),
                }
            }
            Expect::Segments => {
                let sequence = usize::from(command & 0x7F);
                if sequence != transfer.block.len() + 1 || transfer.has_last {
                    let expected = transfer.block.len() + 1;
                    return Err(format!("segment {sequence} of a block, expected is {expected}"));
                }
                transfer.block.push([data[1], data[2], data[3], data[4], data[5], data[6], data[7]]);
                transfer.has_last = command & 0x80 != 0;
                if transfer.has_last || sequence >= transfer.block_size.into() {
                    self.expect = Expect::Nothing;
                }
                return Ok(None);
            }
            Expect::BlockAcknowledge => {
                let known = transfer.block.len();
                if command != 0xA2 || usize::from(data[1]) > known || !(1..=127).contains(&data[2]) {
                    return Err(format!("{:02X?} acknowledges a block of {known} segments", &data[..3]));
                }
                transfer.block_size = data[2];
                if std::mem::take(&mut transfer.is_early) && data[1] == 0 {
                    if !transfer.has_last && known < transfer.block_size.into() {
                        self.expect = Expect::Nothing;
                    }
                    return Ok(None);
                }
                let whole = usize::from(data[1]) == known;
                transfer.acknowledge(data[1]);
                transfer.has_last &= whole;
                false
            }
            Expect::BlockEnd => return self.block_end(data),
            Expect::Nothing | Expect::Anything => {
                return Err("a response without a request".to_owned());
            }
        };
        self.expect = Expect::Nothing;
        if done { self.finish().map(Some) } else { Ok(None) }
    }

    fn block_end(&mut self, data: [u8; 8]) -> Result<Option<Event>, String> {
        let Some(transfer) = &mut self.transfer else { return Ok(None) };
        if transfer.is_download {
            if data[0] != 0xA1 {
                return Err(format!("the answer {:02X}h to the end of a block transfer", data[0]));
            }
            if transfer.has_crc && transfer.is_whole() && crc(&transfer.data) != transfer.crc {
                return Err("a block download with a wrong CRC is accepted".to_owned());
            }
        } else {
            if data[0] & 0xE3 != 0xC1 {
                return Err(format!("{:02X}h ends a block upload", data[0]));
            }
            transfer.trim(data[0] >> 2 & 7);
            let sent = u16::from_le_bytes([data[1], data[2]]);
            if transfer.has_crc && transfer.is_whole() && crc(&transfer.data) != sent {
                return Err("the CRC of a block upload is wrong".to_owned());
            }
        }
        self.expect = Expect::Nothing;
        self.finish().map(Some)
    }

    fn finish(&mut self) -> Result<Event, String> {
        let Some(Transfer { key, data, size, is_download, mode, .. }) = self.transfer.take() else {
            return Err("a response without a request".to_owned());
        };
        if mode == Mode::Block && !is_download {
            self.transfer = Some(Transfer { is_read: true, ..Transfer::new(key, false, mode) });
        }
        if size.is_some_and(|size| size != data.len()) && data.len() < KEPT {
            let (index, sub) = key;
            let verb = if is_download { "accepted" } else { "sent" };
            let text = format!("{index:04X}h:{sub}: {} bytes are {verb}", data.len());
            return Err(format!("{text}, announced are {}", size.unwrap_or(0)));
        }
        Ok(if is_download { Event::Written(key, data) } else { Event::Read(key, data) })
    }
}

impl Transfer {
    fn new(key: Key, is_download: bool, mode: Mode) -> Transfer {
        Transfer {
            key,
            is_download,
            mode,
            data: Vec::new(),
            size: None,
            toggle: false,
            block_size: 0,
            block: Vec::new(),
            has_last: false,
            is_early: false,
            has_crc: false,
            crc: 0,
            may_switch: false,
            is_read: false,
        }
    }

    /// The answer to the initiate request. Returns whether the transfer is complete.
    fn initiated(&mut self, data: [u8; 8]) -> Result<bool, String> {
        let command = data[0];
        let wrong = || Err(format!("the answer {command:02X}h to an initiate request"));
        match (self.is_download, self.mode) {
            (true, Mode::Expedited | Mode::Segmented) => {
                if command != 0x60 {
                    return wrong();
                }
                Ok(self.mode == Mode::Expedited)
            }
            (true, Mode::Block) => {
                if command & 0xFB != 0xA0 || !(1..=127).contains(&data[4]) {
                    return wrong();
                }
                self.has_crc &= command & 4 != 0;
                self.block_size = data[4];
                Ok(false)
            }
            (false, Mode::Block) if command >> 5 == 6 => {
                if command & 1 != 0 {
                    return wrong();
                }
                self.has_crc &= command & 4 != 0;
                self.size = size(data, command & 2 != 0);
                Ok(false)
            }
            (false, mode) if command >> 5 == 2 && (mode != Mode::Block || self.may_switch) => {
                if command & 2 == 0 {
                    self.mode = Mode::Segmented;
                    self.size = size(data, command & 1 != 0);
                    return Ok(false);
                }
                let unused = if command & 1 != 0 { usize::from(command >> 2 & 3) } else { 0 };
                self.take(&data[4..8 - unused]);
                Ok(true)
            }
            _ => wrong(),
        }
    }

    fn take(&mut self, bytes: &[u8]) {
        let room = KEPT.saturating_sub(self.data.len());
        self.data.extend(bytes.iter().take(room));
    }

    fn acknowledge(&mut self, sequence: u8) {
        for segment in std::mem::take(&mut self.block).iter().take(sequence.into()) {
            self.take(segment);
        }
    }

    /// Removes the unused bytes of the last segment.
    fn trim(&mut self, unused: u8) {
        if self.is_whole() {
            self.data.truncate(self.data.len().saturating_sub(unused.into()));
        }
    }

    fn is_whole(&self) -> bool {
        self.data.len() < KEPT
    }
}

fn key(data: [u8; 8]) -> Key {
    (u16::from_le_bytes([data[1], data[2]]), data[3])
}

fn size(data: [u8; 8], is_indicated: bool) -> Option<usize> {
    is_indicated.then(|| u32::from_le_bytes([data[4], data[5], data[6], data[7]]) as usize)
}

fn download(data: [u8; 8]) -> Option<Transfer> {
    let (command, is_expedited) = (data[0], data[0] & 2 != 0);
    let mode = if is_expedited { Mode::Expedited } else { Mode::Segmented };
    let mut transfer = Transfer::new(key(data), true, mode);
    if is_expedited {
        let unused = if command & 1 != 0 { usize::from(command >> 2 & 3) } else { 0 };
        transfer.take(&data[4..8 - unused]);
    } else {
        transfer.size = size(data, command & 1 != 0);
    }
    Some(transfer)
}

fn block_download(data: [u8; 8]) -> Transfer {
    let mut transfer = Transfer::new(key(data), true, Mode::Block);
    transfer.size = size(data, data[0] & 2 != 0);
    transfer.has_crc = data[0] & 4 != 0;
    transfer
}

fn block_upload(data: [u8; 8]) -> Option<Transfer> {
    let mut transfer = Transfer::new(key(data), false, Mode::Block);
    transfer.block_size = data[4];
    transfer.has_crc = data[0] & 4 != 0;
    transfer.may_switch = data[5] > 0;
    (1..=127).contains(&data[4]).then_some(transfer)
}

fn crc(data: &[u8]) -> u16 {
    Crc::<u16>::new(&CRC_16_XMODEM).checksum(data)
}
