//! Tests of the look-up by a text that a person types.

use eds::{DEVICES, Eds, LookupError, address};

fn found(eds: &Eds, query: &str) -> (u16, u8) {
    let entry = eds.find(query).unwrap_or_else(|error| panic!("{query}: {error}"));
    (entry.index, entry.sub)
}

#[test]
fn addresses_are_found_in_every_spelling() {
    let eds = DEVICES[0].eds();
    for query in ["1018:1", "0x1018:1", "1018h:1", "1018sub1", "0x1018sub1", "0X1018:0x1", " 1018:01 "] {
        assert_eq!(found(eds, query), (0x1018, 1), "{query}");
    }
    for query in ["1018", "0x1018", "1018h"] {
        assert_eq!(found(eds, query), (0x1018, 0), "{query}");
    }
    assert_eq!(found(eds, "1003:10"), (0x1003, 10));
    assert_eq!(found(eds, "1003subA"), (0x1003, 10));
}

#[test]
fn names_are_found_in_any_case() {
    let eds = DEVICES[0].eds();
    assert_eq!(found(eds, "error REGISTER"), (0x1001, 0));
    assert_eq!(found(eds, "Identity/Vendor-ID"), (0x1018, 1));
    assert_eq!(found(eds, "vendor-id"), (0x1018, 1));
    assert_eq!(found(eds, "identity"), (0x1018, 0));
    assert_eq!(found(eds, "Non-volatile user storage/User word 16"), (0x4000, 16));
}

#[test]
fn the_path_of_every_entry_finds_it() {
    for device in &DEVICES {
        let eds = device.eds();
        for entry in eds.entries() {
            assert_eq!(found(eds, &eds.path(entry)), (entry.index, entry.sub));
        }
    }
}

#[test]
fn an_unknown_name_lists_similar_names() {
    let eds = DEVICES[0].eds();
    let error = eds.find("vendor").unwrap_err();
    assert_eq!(
        error.to_string(),
        "the data sheet has no object called \"vendor\" (it has Identity/Vendor-ID)"
    );
    let error = eds.find("flux").unwrap_err();
    assert_eq!(error.to_string(), "the data sheet has no object called \"flux\"");
    assert_eq!(eds.find("5FFF:1").unwrap_err().to_string(), "the data sheet has no object 5FFFh:1");
    assert!(matches!(eds.find("1018:9"), Err(LookupError::Address(at)) if (at.index, at.sub) == (0x1018, 9)));
}

#[test]
fn a_wrong_address_is_reported_with_an_example() {
    let eds = DEVICES[0].eds();
    for (text, example) in
        [("61300120h", "6130h:1"), ("0x61300120", "6130h:1"), ("1018.1", "1018h:1"), ("101", "1018h:1")]
    {
        let words = format!(
            "\"{text}\" is no address: an address is four hexadecimal digits and a sub-index up to 255, such as {example}"
        );
        assert_eq!(eds.find(text).unwrap_err().to_string(), words);
    }
}

#[test]
fn a_name_of_several_entries_is_ambiguous() {
    let error = DEVICES[0].eds().find("transmission type").unwrap_err();
    let LookupError::Ambiguous { candidates, .. } = &error else { panic!("{error}") };
    assert_eq!(candidates[0], "1400h:2 RPDO 1 communication parameter/Transmission type");
}

#[test]
fn words_are_found_in_any_order() {
    let eds = DEVICES[0].eds();
    assert_eq!(found(eds, "heartbeat producer"), (0x1017, 0));
    assert_eq!(found(eds, "time heartbeat producer"), (0x1017, 0));
    assert_eq!(found(eds, "event timer TPDO 2"), (0x1801, 5));
    assert!(
        matches!(eds.find("event timer"), Err(LookupError::Ambiguous { candidates, .. }) if candidates.len() == 16)
    );
}

#[test]
fn near_misses_are_suggested_nearest_first() {
    let similar = |query: &str| match DEVICES[0].eds().find(query).unwrap_err() {
        LookupError::Name { similar, .. } => similar,
        other => panic!("{other}"),
    };
    assert_eq!(similar("heartbet")[0], "Producer heartbeat time");
    assert_eq!(similar("heartbeat")[0], "Producer heartbeat time");
    assert_eq!(similar("Error registr")[0], "Error register");
    assert_eq!(similar("vendor-jd")[0], "Identity/Vendor-ID");
    assert_eq!(similar("completely else"), [""; 0]);
}

#[test]
fn a_text_that_is_no_address_is_refused() {
    for text in [
        "",
        "101",
        "10181",
        "1018:",
        "1018sub",
        "1018:256",
        "1018:-1",
        "1018:+1",
        "+018",
        "1018 1",
        "g018",
        "ä018",
        "€",
        "1018:0x100",
    ] {
        assert_eq!(address(text), None, "{text}");
    }
}
