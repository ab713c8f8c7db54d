//! socketcand: messages between angle brackets over TCP, after doc/protocol.md of <https://github.com/linux-can/socketcand>.
//!
//! A client sends `< send 123 2 DE AD >` or `< sendrtr 123 2 >`, a server reports `< frame 123 1.000000 DEAD >` or
//! `< rtr 123 1.000000 2 >`. Messages are written with their brackets and read as words between them.

use embedded_can::{Frame, Id};

use crate::{digits, stamp};

/// Up to three digits are a base identifier, eight an extended one, whatever its value.
#[must_use]
pub fn id(text: &str) -> Option<Id> {
    match text.len() {
        1..=3 => digits::base_id(text),
        8 => digits::extended_id(text),
        _ => None,
    }
}

/// The message with which a client sends a frame.
#[must_use]
pub fn send<F: Frame>(frame: &F) -> String {
    let (id, len) = (digits::of_id(frame.id()), frame.dlc());
    match digits::of_data(frame, " ") {
        _ if frame.is_remote_frame() => format!("< sendrtr {id} {len} >"),
        data if data.is_empty() => format!("< send {id} {len} >"),
        data => format!("< send {id} {len} {data} >"),
    }
}

/// The frame that a client sends, from the words of its message.
#[must_use]
pub fn sent<F: Frame>(words: &[&str]) -> Option<F> {
    match words {
        ["send", id, len, bytes @ ..] => {
            let bytes: Option<Vec<u8>> = bytes.iter().map(|byte| byte_of(byte)).collect();
            let bytes = bytes?;
            if usize::from(byte_of(len)?) != bytes.len() {
                return None;
            }
            F::new(self::id(id)?, &bytes)
        }
        ["sendrtr", id, len] => remote(id, len),
        _ => None,
    }
}

/// How the bytes of a reported frame are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bytes {
    /// In raw mode: `DEAD`.
    Together,
    /// In broadcast-manager mode: `DE AD`.
    Apart,
}

/// The message with which a server reports a frame of this instant, in microseconds. Without bytes there are two spaces before the bracket.
#[must_use]
pub fn report<F: Frame>(frame: &F, micros: u64, bytes: Bytes) -> String {
    let (id, at) = (digits::of_id(frame.id()), stamp::text(micros));
    if frame.is_remote_frame() {
        return format!("< rtr {id} {at} {} >", frame.dlc());
    }
    let separator = if bytes == Bytes::Together { "" } else { " " };
    format!("< frame {id} {at} {} >", digits::of_data(frame, separator))
}

/// The frame that a server reports and its instant in microseconds, from the words of the message.
#[must_use]
pub fn reported<F: Frame>(words: &[&str]) -> Option<(F, u64)> {
    match words {
        ["frame", id, at, bytes @ ..] => {
            Some((digits::data_frame(self::id(id)?, &bytes.concat())?, stamp::parse(at)?))
        }
        ["rtr", id, at, len] => Some((remote(id, len)?, stamp::parse(at)?)),
        _ => None,
    }
}

fn remote<F: Frame>(id: &str, len: &str) -> Option<F> {
    F::new_remote(self::id(id)?, byte_of(len)?.into())
}

fn byte_of(text: &str) -> Option<u8> {
    u8::try_from(digits::number(text)?).ok()
}

#[cfg(test)]
mod tests {
    use embedded_can::StandardId;
    use proptest::prelude::*;

    use super::*;

    type Any = canbus::Frame;

    fn words(message: &str) -> Vec<&str> {
        message.trim_matches(['<', '>']).split_ascii_whitespace().collect()
    }

    fn base(id: u16, bytes: &[u8]) -> Any {
        Frame::new(StandardId::new(id).unwrap(), bytes).unwrap()
    }

    #[test]
    fn messages_of_a_client() {
        assert_eq!(send(&base(0x601, &[0x40, 0, 0x10])), "< send 601 3 40 00 10 >");
        assert_eq!(send(&base(0x80, &[])), "< send 080 0 >");
        // Digits may be left out, as python-can does.
        assert_eq!(sent(&words("< send 1 2 4 a >")), Some(base(1, &[4, 10])));
    }

    #[test]
    fn messages_of_a_server() {
        let frame = base(0x123, &[0xDE, 0xAD]);
        assert_eq!(report(&frame, 1_000_002, Bytes::Together), "< frame 123 1.000002 DEAD >");
        assert_eq!(report(&frame, 1_000_002, Bytes::Apart), "< frame 123 1.000002 DE AD >");
        assert_eq!(report(&base(0x80, &[]), 0, Bytes::Together), "< frame 080 0.000000  >");
        let remote: Any = Frame::new_remote(StandardId::new(0x701).unwrap(), 8).unwrap();
        assert_eq!(report(&remote, 0, Bytes::Apart), "< rtr 701 0.000000 8 >");
    }

    #[test]
    fn lines_forbidden_to_clients() {
        for message in [
            "send 123 8",
            "send 800 0",
            "send 1234 0",
            "send 123 1 100",
            "send 1 1 +1",
            "send +1 0",
            "send 1 + 1",
            "send 1 9 1 2 3 4 5 6 7 8 9",
            "sendrtr 1 9",
            "sendrtr 1",
            "frame 123 1.0 01",
        ] {
            assert_eq!(sent::<Any>(&words(message)), None, "{message}");
        }
    }

    #[test]
    fn an_extended_frame_is_none_where_there_are_base_frames_only() {
        let message = words("frame 00000123 1.0 01");
        assert!(reported::<Any>(&message).is_some());
        assert_eq!(reported::<canopen::Frame>(&message), None);
        assert_eq!(sent::<canopen::Frame>(&words("sendrtr 00000123 1")), None);
    }

    proptest! {
        #[test]
        fn every_frame_goes_through_unchanged(frame in crate::tests::any_frame(), micros: u64) {
            prop_assert_eq!(sent(&words(&send(&frame))), Some(frame));
            for bytes in [Bytes::Together, Bytes::Apart] {
                prop_assert_eq!(reported(&words(&report(&frame, micros, bytes))), Some((frame, micros)));
            }
        }

        #[test]
        fn any_words_are_read_or_refused(text in "(send|sendrtr|frame|rtr) [ -~]{0,40}") {
            let _ = (sent::<Any>(&words(&text)), reported::<Any>(&words(&text)));
        }
    }
}
