//! Buttons that are calls, and calls that are lamps.

use super::*;

/// A panel whose words have no structure.
fn panel() -> Node {
    let mut node = Node::new();
    node.write(0x2305, 0, 0x0C).unwrap();
    let words = [(1, 0x11), (2, 0x9988_7766_5544), (3, 0x12), (4, 0x13)];
    for (sub, word) in words {
        node.write(0x2320, sub, word).unwrap();
    }
    let words = [(1, 0x22), (2, 0x33), (3, 0x55), (4, 0x33)];
    for (sub, word) in words {
        node.write(0x2321, sub, word).unwrap();
    }
    node.sample();
    node
}

#[test]
fn a_button_is_a_word_and_a_word_is_a_lamp() {
    let mut node = panel();
    node.objects.begin_events(INPUTS, &mut node.image);
    assert_eq!([node.call(), node.call(), node.call()], [Some(0x11), Some(0x12), None], "as they are");
    // Each change is sent, in order, however late, and the last one stays in the object.
    for buttons in [[true, true], [true, true], [false, true], [false, false], [false, false]] {
        node.inputs.digital = buttons;
        node.sample();
    }
    for word in [0x9988_7766_5544, 0x13, 0x11, 0x12] {
        assert_eq!(node.call(), Some(word));
    }
    assert_eq!((node.call(), node.read(0x6010, 0)), (None, 0x12));
    for (word, lit) in [
        (0x33, [true, true]),
        (0x44, [true, true]),
        (0x22, [false, true]),
        (0x55, [false, false]),
        (0, [false, false]),
    ] {
        assert_eq!(node.output(word), lit, "{word:X}h");
    }
    node.write(0x2322, 2, 1).unwrap();
    assert_eq!(node.lit(), [false, true]);
    node.objects.received(2, &mut node.image);
    assert_eq!(node.lit(), [false, true], "another PDO brings no output");
}

/// Another client has switched the lamp off: a repeated output of the call controller lights it again.
#[test]
fn a_repeated_output_is_followed_too() {
    let mut node = panel();
    assert_eq!(node.output(0x33), [true, true]);
    node.write(0x2322, 1, 0).unwrap();
    assert_eq!(node.lit(), [false, true]);
    assert_eq!(node.output(0x33), [true, true]);
}

#[test]
fn a_button_that_is_not_used_says_nothing() {
    let mut node = Node::new();
    node.write(0x2305, 0, 4).unwrap();
    node.write(0x2320, 3, 0x12).unwrap();
    node.write(0x2320, 4, 0x13).unwrap();
    for (buttons, word) in [([true, false], None), ([true, true], Some(0x13)), ([false, true], None)] {
        node.inputs.digital = buttons;
        node.sample();
        assert_eq!(node.call(), word, "{buttons:?}");
    }
    node.write(0x6120, 2, 0).unwrap();
    node.inputs.digital = [false, false];
    node.sample();
    assert_eq!(node.call(), Some(0x12), "the end of a call that was told");
    for buttons in [[false, true], [false, false]] {
        node.inputs.digital = buttons;
        node.sample();
        assert_eq!(node.call(), None, "switched off by its parameter");
    }
}

/// A button that is switched off while it is pressed.
#[test]
fn a_sent_call_ends_with_its_button() {
    let mut node = Node::new();
    node.write(0x2305, 0, 4).unwrap();
    node.write(0x2320, 1, 0x12).unwrap();
    node.write(0x2320, 2, 0x13).unwrap();
    node.inputs.digital = [true, false];
    node.sample();
    assert_eq!(node.call(), Some(0x13));
    node.write(0x6120, 1, 0).unwrap();
    node.objects.written(&DICTIONARY.find(0x6120, 1).unwrap(), &mut node.image);
    assert_eq!((node.call(), node.call()), (Some(0x12), None));
}

/// Lit by lift 2 and put out by a multiplexed PDO: lift 2 no longer counts.
#[test]
fn a_lamp_switched_off_by_a_pdo_stays_off() {
    let mut node = Node::new();
    node.write(0x2305, 0, 8).unwrap();
    let word = |lift: i64, light: i64| 0x0405 | lift << 16 | 0xFF << 24 | 0x0F << 32 | light << 40;
    node.write(0x6200, 1, word(3, 0)).unwrap();
    assert_eq!(node.output(word(2, 1)), [true, false]);
    DICTIONARY.find(0x2322, 1).unwrap().field().set(&mut node.image, &[0]);
    assert_eq!(node.output(word(1, 1)), [true, false]);
    assert_eq!(node.output(word(1, 0)), [false, false]);
}

#[test]
fn a_lamp_of_two_doors_stays_lit_until_both_doors_are_answered() {
    let mut node = Node::new();
    node.write(0x2305, 0, 8).unwrap();
    // Car call 4 of lifts 1 and 2, doors 1 and 2.
    node.write(0x6200, 1, 0x00_03_00_03_04_05).unwrap();
    let output = |lifts: i64, doors: i64, on: i64| 0x0405 | lifts << 16 | doors << 32 | on << 40;
    for (lifts, doors, on, lit) in [
        (1, 1, 1, true),
        (1, 2, 0, true),
        (1, 1, 0, false),
        (1, 3, 1, true),
        (1, 2, 0, true),
        (2, 1, 0, true),
        (1, 1, 0, false),
        (3, 0xFF, 1, true),
        (1, 0xFF, 0, true),
        (2, 1, 0, true),
        (2, 2, 0, false),
    ] {
        assert_eq!(node.output(output(lifts, doors, on)), [lit, false], "lifts {lifts}, doors {doors}: {on}");
    }
}

/// A node as delivered, and one with virtual devices other than panels.
#[test]
fn a_node_that_is_no_panel_has_no_calls_and_no_lamps() {
    for devices in [0, 3] {
        let mut node = panel();
        node.write(0x2305, 0, devices).unwrap();
        node.objects.begin_events(INPUTS, &mut node.image);
        assert_eq!((node.call(), node.output(0x33)), (None, [false, false]));
    }
}

/// Hall call up of lift 1 at floor 3, door 1, with high priority.
const CALL: i64 = 0x00_01_03_01_01_04;

#[test]
fn an_input_with_the_public_structure_says_its_state_in_its_function_data() {
    let mut node = Node::new();
    node.write(0x2305, 0, 4).unwrap();
    node.write(0x6100, 1, CALL).unwrap();
    for is_pressed in [true, false] {
        node.inputs.digital = [is_pressed, false];
        node.sample();
        assert_eq!(node.call(), Some(0x00_01_03_01_01_04 | u64::from(is_pressed) << 40));
    }
    assert_eq!(node.read(0x2320, 2), 0x01_01_03_01_01_04);
}

/// Command 00h of the call controller, to lift 1.
#[test]
fn a_request_is_answered_by_the_inputs_that_are_meant() {
    let mut node = Node::new();
    node.write(0x2305, 0, 4).unwrap();
    node.write(0x6100, 1, CALL).unwrap();
    // Door open, in the car of lift 2.
    node.write(0x6100, 2, 0x00_01_00_02_09_0E).unwrap();
    for (command, told) in [
        (0x01_FF_FF_FF_00_00, [Some(0x01_03_01_01_04), Some(0x01_00_02_09_0E)]),
        (0x01_FF_FF_01_00_00, [Some(0x01_03_01_01_04), None]),
        (0x01_FF_FF_FF_01_00, [Some(0x01_03_01_01_04), None]),
        (0x01_FF_FF_FF_02_00, [Some(0x01_00_02_09_0E), None]),
        (0x01_FF_FF_FF_FF_00, [None, None]),
        (0, [None, None]),
    ] {
        node.output(command);
        assert_eq!([node.call(), node.call()], told, "{command:X}h");
    }
}

#[test]
fn a_lamp_answers_to_its_lifts_and_flashes() {
    let mut node = Node::new();
    node.write(0x2305, 0, 8).unwrap();
    // Car call 4 of lifts 1 and 2, door 1.
    node.write(0x6200, 1, 0x00_01_00_03_04_05).unwrap();
    let on = |lifts: i64, data: i64| 0x00_01_00_00_04_05 | lifts << 16 | data << 40;
    assert_eq!(node.output(on(1, 1)), [true, false]);
    assert_eq!(node.output(on(2, 1)), [true, false]);
    assert_eq!(node.output(on(1, 0)), [true, false], "lift 2 has still taken the call");
    assert_eq!(node.output(on(2, 0)), [false, false]);
    assert_eq!(node.output(on(4, 1)), [false, false], "another lift");
    // Flashing with a period of 500 ms.
    node.output(on(1, 0x37));
    assert_eq!(node.read(0x2322, 1), 0x13);
    let mut lit = 0;
    for _ in 0..5000 {
        node.sample();
        lit += u32::from(node.lit()[0]);
    }
    assert_eq!(lit, 2500);
    // One pulse has no timer here, so the lamp is lit.
    assert_eq!(node.output(on(1, 0x15)), [true, false]);
    assert_eq!(node.output(on(1, 0x14)), [false, false]);
    assert_eq!(node.read(0x2322, 1), Light::OFF.0.into());
}
