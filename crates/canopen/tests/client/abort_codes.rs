//! Texts of abort codes.

use canopen::client::sdo::AbortCode;
use canopen::sdo::Abort;

#[test]
fn a_code_in_words() {
    assert_eq!(AbortCode(0x0609_0030).to_string(), "0609 0030h, invalid value for the parameter");
    assert_eq!(AbortCode(0x1234_5678).to_string(), "1234 5678h, a code that CiA 301 does not define");
}

#[test]
fn every_code_of_our_server_has_words() {
    for abort in [
        Abort::Toggle,
        Abort::TimeOut,
        Abort::Command,
        Abort::BlockSize,
        Abort::Sequence,
        Abort::Crc,
        Abort::Access,
        Abort::WriteOnly,
        Abort::ReadOnly,
        Abort::NoObject,
        Abort::NotMappable,
        Abort::PdoLength,
        Abort::Parameter,
        Abort::Hardware,
        Abort::Length,
        Abort::TooLong,
        Abort::TooShort,
        Abort::NoSubIndex,
        Abort::InvalidValue,
        Abort::ValueTooHigh,
        Abort::ValueTooLow,
        Abort::General,
        Abort::NotStored,
        Abort::DeviceState,
        Abort::NoData,
    ] {
        assert!(AbortCode::from(abort).meaning().is_some(), "{abort:?}");
    }
}
