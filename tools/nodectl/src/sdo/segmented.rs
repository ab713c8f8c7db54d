//! Expedited and segmented transfers (CiA 301, 7.2.4.3.3 to 7.2.4.3.8).

use canopen::sdo::{Bytes, Initiate, Multiplexer, Request, Response, Segment};

use super::channel::Channel;
use super::{Cause, LARGEST};

/// Reads a value of any length.
pub(super) fn upload(channel: &mut Channel, at: Multiplexer) -> Result<Vec<u8>, Cause> {
    let first = channel.ask(Request::Upload(at), |response| begin(at, response))?;
    match first {
        Begin::Complete(bytes) => Ok(bytes),
        Begin::Segments(size) => upload_segments(channel, size),
    }
}

/// How a server begins an upload.
pub(super) enum Begin {
    /// With all of it.
    Complete(Vec<u8>),
    /// Segments follow, of this many bytes in all where the server says so.
    Segments(Option<u32>),
}

/// The beginning of the upload of this object.
pub(super) fn begin(at: Multiplexer, response: Response) -> Option<Begin> {
    match response {
        Response::Uploaded(of, bytes) if of == at => Some(Begin::Complete(bytes.as_slice().to_vec())),
        Response::UploadSegmented(of, size) if of == at => Some(Begin::Segments(size)),
        _ => None,
    }
}

/// Reads the segments after the beginning.
pub(super) fn upload_segments(channel: &mut Channel, size: Option<u32>) -> Result<Vec<u8>, Cause> {
    let mut value = Vec::new();
    for toggle in [false, true].into_iter().cycle() {
        let segment = channel.ask(Request::UploadSegment { toggle }, |response| match response {
            Response::UploadedSegment(segment) if segment.toggle == toggle => Some(segment),
            _ => None,
        })?;
        value.extend_from_slice(segment.data.as_slice());
        if segment.last || value.len() > LARGEST {
            break;
        }
    }
    complete(value, size)
}

/// The value, if it is as long as it was announced.
pub(super) fn complete(value: Vec<u8>, size: Option<u32>) -> Result<Vec<u8>, Cause> {
    let is_right = value.len() <= LARGEST && size.is_none_or(|size| value.len() == size as usize);
    if is_right { Ok(value) } else { Err(Cause::Unexpected) }
}

/// Writes a value of any length. `progress` is told the bytes that have arrived.
pub(super) fn download(
    channel: &mut Channel,
    at: Multiplexer,
    value: &[u8],
    progress: &mut dyn FnMut(usize),
) -> Result<(), Cause> {
    let downloaded = |response| (response == Response::Downloaded(at)).then_some(());
    if matches!(value.len(), 1..=4) {
        let initiate = Initiate::Expedited(Bytes::from_slice(value));
        return channel.ask(Request::Download(at, initiate), downloaded);
    }
    let size = u32::try_from(value.len()).ok();
    channel.ask(Request::Download(at, Initiate::Segmented(size)), downloaded)?;
    let mut toggle = false;
    let mut done = 0;
    for (data, last) in segments(value) {
        let segment = Segment { toggle, last, data: Bytes::from_slice(data) };
        channel.ask(Request::DownloadSegment(segment), |response| {
            (response == Response::DownloadedSegment { toggle }).then_some(())
        })?;
        toggle = !toggle;
        done += data.len();
        progress(done);
    }
    Ok(())
}

/// Pieces of seven bytes and whether they are the last. No bytes at all are one empty piece.
fn segments(value: &[u8]) -> impl Iterator<Item = (&[u8], bool)> {
    let count = value.len().div_ceil(7).max(1);
    let piece = move |number: usize| &value[7 * number..value.len().min(7 * (number + 1))];
    (0..count).map(move |number| (piece(number), number + 1 == count))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_of_seven_bytes() {
        let lengths = |len: usize| -> Vec<(usize, bool)> {
            let value = vec![0; len];
            segments(&value).map(|(data, last)| (data.len(), last)).collect()
        };
        assert_eq!(lengths(0), [(0, true)]);
        assert_eq!(lengths(7), [(7, true)]);
        assert_eq!(lengths(15), [(7, false), (7, false), (1, true)]);
    }
}
