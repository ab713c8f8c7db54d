//! Access to the objects of the device by SDO, with and without an expected refusal.

use canopen::Duration;
use canopen::client::sdo::Error;
use canopen::sdo::{Multiplexer, Request};

use super::Subject;
use super::verdict::{Outcome, ensure, fail, skip};
use crate::object::{Place, at};
use crate::sdo::{Cause, Client, Options};

/// The abort codes of CiA 301, table 22, that the checks expect.
pub(in crate::check) mod abort {
    pub(in crate::check) const TOGGLE: u32 = 0x0503_0000;
    pub(in crate::check) const COMMAND: u32 = 0x0504_0001;
    pub(in crate::check) const BLOCK_SIZE: u32 = 0x0504_0002;
    pub(in crate::check) const SEQUENCE: u32 = 0x0504_0003;
    pub(in crate::check) const CRC: u32 = 0x0504_0004;
    pub(in crate::check) const ACCESS: u32 = 0x0601_0000;
    pub(in crate::check) const WRITE_ONLY: u32 = 0x0601_0001;
    pub(in crate::check) const READ_ONLY: u32 = 0x0601_0002;
    pub(in crate::check) const NO_OBJECT: u32 = 0x0602_0000;
    pub(in crate::check) const NOT_MAPPABLE: u32 = 0x0604_0041;
    pub(in crate::check) const PDO_LENGTH: u32 = 0x0604_0042;
    pub(in crate::check) const PARAMETER: u32 = 0x0604_0043;
    pub(in crate::check) const LENGTH: u32 = 0x0607_0010;
    pub(in crate::check) const TOO_LONG: u32 = 0x0607_0012;
    pub(in crate::check) const TOO_SHORT: u32 = 0x0607_0013;
    pub(in crate::check) const NO_SUB_INDEX: u32 = 0x0609_0011;
    pub(in crate::check) const VALUE: u32 = 0x0609_0030;
    pub(in crate::check) const TOO_HIGH: u32 = 0x0609_0031;
    pub(in crate::check) const TOO_LOW: u32 = 0x0609_0032;
    pub(in crate::check) const GENERAL: u32 = 0x0800_0000;
    pub(in crate::check) const NOT_STORED: u32 = 0x0800_0020;
    pub(in crate::check) const LOCAL: u32 = 0x0800_0021;
    pub(in crate::check) const STATE: u32 = 0x0800_0022;
    pub(in crate::check) const NO_DATA: u32 = 0x0800_0024;
}

/// The abort code of a transfer that the device has refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::check) struct Refusal(pub(in crate::check) u32);

impl std::fmt::Display for Refusal {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "abort {:04X} {:04X}h", self.0 >> 16, self.0 & 0xFFFF)
    }
}

/// The texts of several abort codes.
pub(super) fn any_of(codes: &[u32]) -> String {
    let codes: Vec<String> = codes.iter().map(|code| Refusal(*code).to_string()).collect();
    codes.join(" or ")
}

/// The result of a transfer as a text.
pub(super) fn result(result: std::result::Result<Vec<u8>, Refusal>) -> String {
    match result {
        Ok(bytes) if bytes.is_empty() => "done".to_owned(),
        Ok(bytes) => format!("the value {bytes:02X?}"),
        Err(refusal) => refusal.to_string(),
    }
}

impl Subject<'_> {
    /// Sends eight bytes to the SDO server. Returns the answer, if one comes in time.
    pub(in crate::check) fn ask(&mut self, request: [u8; 8]) -> Outcome<Option<[u8; 8]>> {
        let time = self.setup.timeout.0 / 1000;
        self.ask_within(request, time)
    }

    /// Sends eight bytes to the SDO server. Returns the answer, if one comes within `ms` milliseconds.
    pub(in crate::check) fn ask_within(&mut self, request: [u8; 8], ms: u64) -> Outcome<Option<[u8; 8]>> {
        let mark = self.mark();
        self.send(0x600 + self.id(), &request)?;
        let Some(answer) = self.next(mark, 0x580 + self.id(), ms)? else { return Ok(None) };
        let data = answer.frame.data();
        let whole = data.try_into();
        whole.map(Some).map_err(|_| fail("an answer of eight bytes", format!("{} bytes", data.len())))
    }

    /// Sends a request and demands an answer.
    pub(in crate::check) fn answer(&mut self, request: [u8; 8]) -> Outcome<[u8; 8]> {
        let expected = format!("an answer to the request {request:02X?}");
        self.ask(request)?.ok_or_else(|| fail(expected, "none in time"))
    }

    /// Sends a request and demands an abort with one of these codes.
    pub(in crate::check) fn aborts(&mut self, request: [u8; 8], codes: &[u32]) -> Outcome {
        let answer = self.answer(request)?;
        let code = u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]]);
        let expected = format!("{} to the request {request:02X?}", any_of(codes));
        ensure(answer[0] == 0x80 && codes.contains(&code), expected, format!("the answer {answer:02X?}"))
    }

    fn client(&mut self) -> Client<'_> {
        let options = Options {
            timeout: self.setup.timeout,
            limit: Duration::from_millis(30_000),
            retries: 0,
            ..Options::default()
        };
        Client::new(self.network, self.setup.node, options)
    }

    /// Reads an object. Returns its bytes, or the abort code of the device.
    pub(in crate::check) fn try_read(
        &mut self,
        index: u16,
        sub: u8,
    ) -> Outcome<std::result::Result<Vec<u8>, Refusal>> {
        self.go_on()?;
        let result = self.client().upload(at(index, sub));
        judged(result, "a correct upload")
    }

    /// Writes an object without noting its former value. Returns the abort code if the device refuses.
    pub(in crate::check) fn try_write(
        &mut self,
        index: u16,
        sub: u8,
        value: &[u8],
    ) -> Outcome<std::result::Result<(), Refusal>> {
        let result = self.client().download(at(index, sub), value, |_| ());
        judged(result, "a correct download")
    }

    /// Reads an object in blocks. Returns its bytes, or the abort code of the device.
    pub(in crate::check) fn try_block_read(
        &mut self,
        index: u16,
        sub: u8,
    ) -> Outcome<std::result::Result<Vec<u8>, Refusal>> {
        let result = self.client().block_upload(at(index, sub));
        judged(result, "a correct block upload")
    }

    /// Writes an object in blocks. Returns the abort code if the device refuses.
    pub(in crate::check) fn try_block_write(
        &mut self,
        index: u16,
        sub: u8,
        value: &[u8],
    ) -> Outcome<std::result::Result<(), Refusal>> {
        let result = self.client().block_download(at(index, sub), value, |_| ());
        judged(result, "a correct block download")
    }

    /// The bytes of an object that must be readable.
    pub(in crate::check) fn read(&mut self, index: u16, sub: u8) -> Outcome<Vec<u8>> {
        let place = Place(at(index, sub));
        self.try_read(index, sub)?.map_err(|refusal| fail(format!("{place} can be read"), refusal))
    }

    /// The value of an object as an unsigned number of up to four bytes.
    pub(in crate::check) fn number(&mut self, index: u16, sub: u8) -> Outcome<u32> {
        let bytes = self.read(index, sub)?;
        let mut word = [0; 4];
        let Some(place) = word.get_mut(..bytes.len()) else {
            return Err(fail(
                format!("{} is a number", Place(at(index, sub))),
                format!("{} bytes", bytes.len()),
            ));
        };
        place.copy_from_slice(&bytes);
        Ok(u32::from_le_bytes(word))
    }

    /// The number of an optional object; `None` where the device does not have the object.
    pub(in crate::check) fn optional(&mut self, index: u16, sub: u8) -> Outcome<Option<u32>> {
        match self.try_read(index, sub)? {
            Ok(_) => self.number(index, sub).map(Some),
            Err(_) => Ok(None),
        }
    }

    /// Skips the check where the device does not have an object.
    pub(in crate::check) fn need(&mut self, index: u16, sub: u8) -> Outcome {
        match self.try_read(index, sub)? {
            Err(Refusal(abort::NO_OBJECT | abort::NO_SUB_INDEX)) => {
                Err(skip(format!("the device has no {}", Place(at(index, sub)))))
            }
            _ => Ok(()),
        }
    }

    /// Skips the check where the device does not have the object, or does not let us write it.
    pub(in crate::check) fn need_writable(&mut self, index: u16, sub: u8) -> Outcome {
        self.need(index, sub)?;
        let value = self.read(index, sub)?;
        match self.try_write(index, sub, &value)? {
            Err(Refusal(abort::READ_ONLY)) => {
                Err(skip(format!("{} cannot be written", Place(at(index, sub)))))
            }
            _ => Ok(()),
        }
    }

    /// Writes an object and demands success. The former value is written back after the check.
    pub(in crate::check) fn write(&mut self, index: u16, sub: u8, value: &[u8]) -> Outcome {
        let place = Place(at(index, sub));
        let expected = format!("{place} takes {value:02X?}");
        self.change(index, sub, value)?.map_err(|refusal| fail(expected, refusal))
    }

    /// Notes a value that is written back after the check.
    pub(in crate::check) fn remember(&mut self, at: Multiplexer, before: Vec<u8>) {
        self.written.push((at, before));
    }

    /// Writes an object, which the device may refuse. The former value is written back after the check.
    pub(in crate::check) fn change(
        &mut self,
        index: u16,
        sub: u8,
        value: &[u8],
    ) -> Outcome<std::result::Result<(), Refusal>> {
        if let Ok(before) = self.try_read(index, sub)? {
            self.written.push((at(index, sub), before));
        }
        self.try_write(index, sub, value)
    }

    /// A number as the bytes of an object, in the length of the object.
    fn sized(&mut self, index: u16, sub: u8, value: u32) -> Outcome<Vec<u8>> {
        let size = self.read(index, sub)?.len().min(4);
        Ok(value.to_le_bytes()[..size].to_vec())
    }

    /// Writes a number and demands success.
    pub(in crate::check) fn set(&mut self, index: u16, sub: u8, value: u32) -> Outcome {
        let bytes = self.sized(index, sub, value)?;
        self.write(index, sub, &bytes)
    }

    /// Writes a number. Skips the check where the device does not support the number.
    pub(in crate::check) fn set_if_supported(&mut self, index: u16, sub: u8, value: u32) -> Outcome {
        let bytes = self.sized(index, sub, value)?;
        let place = Place(at(index, sub));
        let refused = |refusal| skip(format!("the device does not support {value:X}h in {place}: {refusal}"));
        self.change(index, sub, &bytes)?.map_err(refused)
    }

    /// Demands that an object has this number.
    pub(in crate::check) fn holds(&mut self, index: u16, sub: u8, value: u32) -> Outcome {
        let seen = self.number(index, sub)?;
        ensure(seen == value, format!("{} holds {value:X}h", Place(at(index, sub))), format!("{seen:X}h"))
    }

    /// Writes a number and demands a refusal with one of these codes.
    pub(in crate::check) fn refuses(&mut self, index: u16, sub: u8, value: u32, codes: &[u32]) -> Outcome {
        let bytes = self.sized(index, sub, value)?;
        self.refuses_bytes(index, sub, &bytes, codes)
    }

    /// Writes bytes and demands a refusal with one of these codes.
    pub(in crate::check) fn refuses_bytes(
        &mut self,
        index: u16,
        sub: u8,
        value: &[u8],
        codes: &[u32],
    ) -> Outcome {
        let written = self.change(index, sub, value)?;
        let place = Place(at(index, sub));
        let expected = format!("{} for the write of {value:02X?} to {place}", any_of(codes));
        match written {
            Err(Refusal(code)) if codes.contains(&code) => Ok(()),
            written => Err(fail(expected, result(written.map(|()| Vec::new())))),
        }
    }

    /// Reads an object and demands a refusal with one of these codes.
    pub(in crate::check) fn hides(&mut self, index: u16, sub: u8, codes: &[u32]) -> Outcome {
        let read = self.try_read(index, sub)?;
        let expected = format!("{} for the upload of {}", any_of(codes), Place(at(index, sub)));
        match read {
            Err(Refusal(code)) if codes.contains(&code) => Ok(()),
            read => Err(fail(expected, result(read))),
        }
    }

    /// Whether the device still serves SDO.
    pub(in crate::check) fn is_served(&mut self) -> Outcome<bool> {
        let answer = self.ask_within(Request::Upload(at(0x1000, 0)).encode(), 300)?;
        Ok(answer.is_some_and(|answer| answer[0] >> 5 == 2))
    }

    /// Demands that the device still serves SDO.
    pub(in crate::check) fn serves(&mut self, after: &str) -> Outcome {
        let is_served = self.is_served()?;
        ensure(is_served, format!("1000h can be read after {after}"), "no answer")
    }
}

/// Returns a refusal as a result. Any other error of the transfer is a deviation from the protocol.
fn judged<T>(
    result: std::result::Result<T, crate::sdo::Error>,
    expected: &str,
) -> Outcome<std::result::Result<T, Refusal>> {
    match result {
        Ok(value) => Ok(Ok(value)),
        Err(error) => match error.cause {
            Cause::Transfer(Error::Abort(code)) => Ok(Err(Refusal(code.0))),
            Cause::Busy => Err(skip("another client uses the SDO server of the device")),
            Cause::Transfer(cause) => Err(fail(format!("{expected} of {}", Place(error.at)), cause)),
            Cause::Bus(error) => Err(error.into()),
        },
    }
}
