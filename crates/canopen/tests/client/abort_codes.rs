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
    assert!(Abort::ALL.windows(2).all(|pair| pair[0].code() < pair[1].code()));
    for abort in Abort::ALL {
        assert!(AbortCode::from(abort).meaning().is_some(), "{abort:?}");
    }
}

#[test]
fn two_codes_say_that_there_is_no_such_entry() {
    let absent = Abort::ALL.into_iter().filter(|&abort| AbortCode::from(abort).is_absent());
    assert_eq!(absent.collect::<Vec<_>>(), [Abort::NoObject, Abort::NoSubIndex]);
}

#[test]
fn some_codes_refuse_the_protocol_and_not_the_value() {
    let refuses_protocol = |code| AbortCode(code).is_protocol();
    assert!([0x0503_0000, 0x0504_0001, 0x0504_0002, 0x0504_0005].into_iter().all(refuses_protocol));
    let time_out = Abort::TimeOut.code();
    assert!(
        ![time_out, 0x0502_0000, 0x0601_0000, 0x0602_0000, 0x0800_0000].into_iter().any(refuses_protocol)
    );
}
