//! slcan: the line protocol of the LAWICEL CAN232 and CANUSB adapters ("CANUSB Manual", version 1.0, chapter 3).
//!
//! A frame is the same line in both directions, except for the time stamp that an adapter may append. Every line ends with a
//! carriage return, which is not part of what is read and written here.

use embedded_can::Frame;

use crate::digits;

/// Bit rates of S0 to S8 in kbit/s.
pub const BIT_RATES: [u16; 9] = [10, 20, 50, 100, 125, 250, 500, 800, 1000];

/// The bit rate of the digit behind an `S`, in kbit/s.
#[must_use]
pub fn bit_rate(digit: &str) -> Option<u16> {
    let index = digits::number(digit).filter(|_| digit.len() == 1)?;
    BIT_RATES.get(index as usize).copied()
}

/// The frame of a line, and what follows the frame: the time stamp of an adapter. Behind a command nothing may follow.
#[must_use]
pub fn frame<F: Frame>(line: &str) -> Option<(F, &str)> {
    let (kind, rest) = line.split_at_checked(1)?;
    let (id, rest) = match kind {
        "t" | "r" => rest.split_at_checked(3).and_then(|(id, rest)| Some((digits::base_id(id)?, rest)))?,
        "T" | "R" => {
            rest.split_at_checked(8).and_then(|(id, rest)| Some((digits::extended_id(id)?, rest)))?
        }
        _ => return None,
    };
    let (len, rest) = rest.split_at_checked(1)?;
    let len = digits::number(len)? as usize;
    if matches!(kind, "r" | "R") {
        return Some((F::new_remote(id, len)?, rest));
    }
    let (pairs, rest) = rest.split_at_checked(2 * len)?;
    Some((digits::data_frame(id, pairs)?, rest))
}

/// The line of a frame.
#[must_use]
pub fn line<F: Frame>(frame: &F) -> String {
    let kind = match (frame.is_extended(), frame.is_remote_frame()) {
        (false, false) => 't',
        (false, true) => 'r',
        (true, false) => 'T',
        (true, true) => 'R',
    };
    let (id, data) = (digits::of_id(frame.id()), digits::of_data(frame, ""));
    format!("{kind}{id}{:X}{data}", frame.dlc())
}

#[cfg(test)]
mod tests {
    use embedded_can::{ExtendedId, StandardId};
    use proptest::prelude::*;

    use super::*;

    type Any = canbus::Frame;

    #[test]
    fn frames_of_every_kind() {
        let (base, extended) = (StandardId::new(0x123).unwrap(), ExtendedId::new(0x1234_5678).unwrap());
        let expected: [(&str, Option<Any>); 4] = [
            ("t1232ABCD", Frame::new(base, &[0xAB, 0xCD])),
            ("T123456780", Frame::new(extended, &[])),
            ("r1238", Frame::new_remote(base, 8)),
            ("R123456781", Frame::new_remote(extended, 1)),
        ];
        for (text, expected) in expected {
            let expected = expected.unwrap();
            assert_eq!(line(&expected), text);
            assert_eq!(frame(text), Some((expected, "")));
            assert_eq!(frame(&format!("{text}1234")), Some((expected, "1234")));
        }
    }

    #[test]
    fn texts_that_are_no_frames_are_rejected() {
        for text in [
            "",
            "t",
            "t12",
            "t123",
            "t1231",
            "t12310",
            "t1239",
            "t8000",
            "t+120",
            "t1231+1",
            "t1231 1",
            "r1239",
            "T200000000",
            "T1230",
            "q1230",
            "\u{e9}t1230",
            "t\u{e9}1230",
            "t1231\u{e9}",
        ] {
            assert_eq!(frame::<Any>(text), None, "{text:?}");
        }
    }

    #[test]
    fn an_extended_frame_is_none_where_there_are_base_frames_only() {
        assert_eq!(frame::<canopen::Frame>("T000001230"), None);
        assert_eq!(frame::<canopen::Frame>("R000001230"), None);
    }

    #[test]
    fn bit_rates_have_one_digit() {
        assert_eq!((bit_rate("0"), bit_rate("8")), (Some(10), Some(1000)));
        for digit in ["", "9", "08", "+8", "x"] {
            assert_eq!(bit_rate(digit), None, "{digit:?}");
        }
    }

    proptest! {
        #[test]
        fn every_frame_goes_through_unchanged(any in crate::tests::any_frame()) {
            let text = line(&any);
            prop_assert_eq!(frame(&text), Some((any, "")));
        }

        #[test]
        fn any_line_is_read_or_refused(text in "\\PC{0,40}") {
            let _ = frame::<Any>(&text);
        }
    }
}
