//! The control of the monitor: it accepts a clean trace, and notices each seeded breach by its name.

mod breaches;
mod trace;

use canopen::{Frame, Instant};
use monitor::{Incident, Monitor, Rule, Sender};

use trace::{Event, NODE, Trace, sheet};

/// Feeds a trace with all that a test knows.
fn judged(trace: &Trace) -> Monitor {
    let mut monitor = Monitor::new();
    monitor.set_bit_rate(250_000);
    for participant in 0..2 {
        monitor.set_sheet(participant, sheet(), true);
    }
    for event in trace.in_order() {
        match event {
            Event::Frame(at, sender, frame) => monitor.frame(*at, frame, *sender),
            Event::Incident(at, participant, incident) => monitor.incident(*at, *participant, *incident),
            Event::Deadline(at, participant, next) => monitor.deadline(*at, *participant, *next),
            Event::Value(at, participant, key, bytes) => monitor.value(*at, *participant, *key, bytes),
        }
    }
    monitor.end();
    monitor
}

/// Feeds the frames only, as a log file does.
fn logged(trace: &Trace) -> Monitor {
    let mut monitor = Monitor::new();
    for node in [NODE, NODE + 1] {
        monitor.set_sheet_of_node(node, sheet(), true);
    }
    for event in trace.in_order() {
        if let Event::Frame(at, _, frame) = event {
            monitor.frame(*at, frame, Sender::Unknown);
        }
    }
    monitor.end();
    monitor
}

fn text(monitor: &Monitor) -> String {
    monitor.breaches().iter().map(|breach| format!("{breach}\n")).collect()
}

#[test]
fn a_clean_trace_passes() {
    let trace = Trace::clean();
    let [known, log] = [judged(&trace), logged(&trace)];
    assert_eq!((text(&known), text(&log)), (String::new(), String::new()));
    assert_eq!(known.nodes().collect::<Vec<_>>(), [NODE, NODE + 1]);
    assert!(known.frames() > 120, "{}", known.frames());
}

/// A server aborts a refused block after the pause of its client. The next request has the number of the next segment.
#[test]
fn a_request_after_a_pause_is_no_segment() {
    let mut trace = Trace::clean();
    trace.at(1_510_000).refused_block_with_a_pause();
    assert_eq!(text(&judged(&trace)), "");
}

#[test]
fn a_block_that_begins_before_the_acknowledge_of_the_rest_counts() {
    let mut trace = Trace::clean();
    trace.at(1_510_000).blocks_that_cross();
    assert_eq!(text(&judged(&trace)), "");
}

/// An EMCY has a higher priority than the answer to the request that ends its inhibit time.
#[test]
fn a_node_acts_by_a_new_value_before_its_answer() {
    let mut trace = Trace::clean();
    trace.at(1_500_500).write(0x1015, 0, &10_000_u16.to_le_bytes());
    trace.node(1_510_000, 0, 0x085, &[0x06, 0x50, 1, 0, 0, 0, 0, 0]);
    trace.at(1_619_000).ask(&[0x2B, 0x15, 0x10, 0, 0, 0, 0, 0], &[]);
    trace.node(1_620_000, 0, 0x085, &[0; 8]);
    trace.at(1_620_000).answer(&[0x60, 0x15, 0x10, 0, 0, 0, 0, 0]);
    assert_eq!(text(&judged(&trace)), "");
    let mut trace = Trace::clean();
    trace.at(1_500_500).write(0x1015, 0, &10_000_u16.to_le_bytes());
    trace.node(1_510_000, 0, 0x085, &[0x06, 0x50, 1, 0, 0, 0, 0, 0]);
    trace.node(1_619_000, 0, 0x085, &[0; 8]);
    trace.at(1_619_500).ask(&[0x2B, 0x15, 0x10, 0, 0, 0, 0, 0], &[0x60, 0x15, 0x10, 0, 0, 0, 0, 0]);
    let monitor = judged(&trace);
    assert_eq!(monitor.breaches()[0].rule, Rule::Inhibit, "{}", text(&monitor));
}

/// The nodes change their bit rate: those that follow are gone from this bus, and a request to them has no answer.
#[test]
fn a_request_while_the_bit_rate_changes_needs_no_answer() {
    for (request, last) in
        [(1_799_000, None), (1_801_000, None), (1_801_000, Some(1_810_250)), (2_300_000, None)]
    {
        let mut trace = Trace::clean();
        trace.activate_bit_timing(1_800_000, 100);
        trace.at(request).ask(&[0x40, 0x03, 0x60, 0, 0, 0, 0, 0], &[]);
        if let Some(at) = last {
            // The frame was in a mailbox before the command.
            trace.node(at, 0, 0x705, &[127]);
        }
        trace.client(3_400_000, 0x080, &[]);
        assert_eq!(text(&judged(&trace)), "", "request at {request} us, last frame {last:?}");
    }
}

#[test]
fn every_seeded_breach_is_noticed_by_name() {
    let all = breaches::all();
    assert!(all.len() >= 40, "{} breaches", all.len());
    let mut missed = Vec::new();
    for breach in &all {
        let mut trace = Trace::clean();
        (breach.seed)(&mut trace);
        let monitor = judged(&trace);
        let rules: Vec<Rule> = monitor.breaches().iter().map(|breach| breach.rule).collect();
        if rules.first() != Some(&breach.rule) {
            missed.push(format!("{}: {} expected, {rules:?}\n{}", breach.name, breach.rule, text(&monitor)));
        }
    }
    assert!(missed.is_empty(), "{} of {} missed:\n{}", missed.len(), all.len(), missed.join("\n"));
    for rule in Rule::ALL {
        assert!(all.iter().any(|breach| breach.rule == rule), "{rule} has no seeded breach");
    }
}

#[test]
fn breaches_that_frames_show_are_noticed_in_a_log() {
    let mut missed = Vec::new();
    for breach in breaches::all().into_iter().filter(|breach| breach.shows_in_log) {
        let mut trace = Trace::clean();
        (breach.seed)(&mut trace);
        let monitor = logged(&trace);
        if !monitor.breaches().iter().any(|found| found.rule == breach.rule) {
            missed.push(format!("{}: {} expected\n{}", breach.name, breach.rule, text(&monitor)));
        }
    }
    assert!(missed.is_empty(), "missed:\n{}", missed.join("\n"));
}

#[test]
fn a_breach_shows_its_frames_and_its_clause() {
    let mut monitor = Monitor::new();
    for (at, data) in [(0, 0), (10_000, 127), (20_000, 4)] {
        monitor.frame(Instant(at), &Frame::new(0x705, &[data]).unwrap(), Sender::Unknown);
    }
    let text = monitor.breaches()[0].to_string();
    assert!(text.starts_with("0.020000 node 5: nmt-state: "), "{text}");
    assert!(text.contains("CiA 301, 7.3.2"), "{text}");
    assert!(text.ends_with("0.000000 705h 00\n    0.010000 705h 7F\n    0.020000 705h 04"), "{text}");
}

#[test]
fn rules_have_unique_names() {
    for rule in Rule::ALL {
        assert_eq!(Rule::named(rule.name()), Some(rule));
    }
    assert_eq!(Rule::named("nothing"), None);
}

#[test]
fn a_node_that_is_not_judged_is_ignored() {
    let mut monitor = Monitor::new();
    monitor.judge([4]);
    for (at, data) in [(0, 0), (10_000, 127), (20_000, 4)] {
        monitor.frame(Instant(at), &Frame::new(0x705, &[data]).unwrap(), Sender::Unknown);
    }
    assert_eq!(text(&monitor), "");
}

#[test]
fn an_injected_fault_excuses_a_reset_until_the_next_boot_up() {
    let mut monitor = Monitor::new();
    let boot_up = |monitor: &mut Monitor, at| {
        monitor.frame(Instant(at), &Frame::new(0x705, &[0]).unwrap(), Sender::Node(0));
    };
    boot_up(&mut monitor, 10_000);
    monitor.incident(Instant(20_000), 0, Incident::Injected);
    monitor.incident(Instant(21_000), 0, Incident::ChipReset);
    boot_up(&mut monitor, 30_000);
    assert_eq!(text(&monitor), "");
    monitor.incident(Instant(40_000), 0, Incident::ChipReset);
    assert_eq!(monitor.breaches()[0].rule, Rule::UnexpectedReset);
}

/// The breaches in these frames of node 5.
fn breaches_of(frames: &[(u64, u16, &[u8])]) -> String {
    let mut monitor = Monitor::new();
    monitor.set_sheet_of_node(NODE, sheet(), true);
    for (at, id, data) in frames {
        monitor.frame(Instant(*at), &Frame::new(*id, data).unwrap(), Sender::Unknown);
    }
    monitor.end();
    text(&monitor)
}

const READ: (u16, &[u8]) = (0x605, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]);
const ANSWER: (u16, &[u8]) = (0x585, &[0x43, 0x00, 0x10, 0, 1, 2, 3, 4]);
const BOOT_UP: (u16, &[u8]) = (0x705, &[0]);

#[test]
fn a_request_before_the_boot_up_message_may_be_answered_after_it() {
    let frames = [(1_000, READ), (2_000, BOOT_UP), (3_000, ANSWER)].map(|(at, (id, data))| (at, id, data));
    assert_eq!(breaches_of(&frames), "");
    let again = [frames.as_slice(), &[(30_000, ANSWER.0, ANSWER.1)]].concat();
    assert!(breaches_of(&again).contains("a response without a request"));
}

/// The node may answer the end of a block that a reset has interrupted, but no segment before it.
#[test]
fn the_rest_of_a_block_after_a_reset_is_no_request() {
    let begin = [0xC4, 0x00, 0x2F, 0, 0, 0, 0, 0];
    let begun = [0xA4, 0x00, 0x2F, 0, 127, 0, 0, 0];
    let abort = [0x80, 0x00, 0x2F, 0, 0x22, 0, 0, 8];
    let segments: Vec<[u8; 8]> = (1..=127).map(|sequence| [sequence, 1, 0x10, 0, 0, 0, 0, 0]).collect();
    let judge = |answered: u8, answer: &[u8]| {
        let mut frames =
            vec![(1_000, BOOT_UP.0, BOOT_UP.1), (2_000, 0x605, &begin[..]), (3_000, 0x585, &begun[..])];
        for (at, segment) in (10_000..).step_by(250).zip(&segments) {
            match segment[0] {
                30 => frames.push((at - 100, 0x000, &[0x82, 5])),
                35 => frames.push((at - 100, BOOT_UP.0, BOOT_UP.1)),
                _ => (),
            }
            frames.push((at, 0x605, segment));
            if segment[0] == answered {
                frames.push((at + 100, 0x585, answer));
            }
        }
        frames.extend([(100_000, READ.0, READ.1), (101_000, ANSWER.0, ANSWER.1)]);
        breaches_of(&frames)
    };
    assert_eq!(judge(127, &abort), "");
    assert_eq!(judge(0, &[]), "");
    let answer = [0x4F, 1, 0x10, 0, 0, 0, 0, 0];
    assert!(judge(0x40, &answer).contains("a response without a request"), "{}", judge(0x40, &answer));
}

/// A bootloader answers the start of a program, and restarts later.
#[test]
fn a_request_to_a_node_that_restarts_itself_may_be_answered_after_its_boot_up_message() {
    let start: (u16, &[u8]) = (0x605, &[0x2F, 0x51, 0x1F, 1, 1, 0, 0, 0]);
    let started: (u16, &[u8]) = (0x585, &[0x60, 0x51, 0x1F, 1, 0, 0, 0, 0]);
    let abort: (u16, &[u8]) = (0x605, &[0x80, 0x00, 0x10, 0, 0, 0, 4, 5]);
    let before = [(1_000, BOOT_UP), (2_000, start), (3_000, started)];
    let once = [(10_000, READ), (20_000, BOOT_UP), (21_000, ANSWER)];
    let twice = [(10_000, READ), (18_000, abort), (19_000, READ), (20_000, BOOT_UP), (21_000, ANSWER)];
    for after in [once.as_slice(), &twice] {
        let frames: Vec<_> = before.iter().chain(after).map(|(at, (id, data))| (*at, *id, *data)).collect();
        assert_eq!(breaches_of(&frames), "");
    }
}

#[test]
fn requests_in_a_row_have_as_many_answers_at_most() {
    let (boot_up, read, answer) = ((1_000, BOOT_UP), READ, ANSWER);
    let row = [
        (10_000, read),
        (10_500, read),
        (11_000, read),
        (15_000, answer),
        (20_000, answer),
        (25_000, answer),
    ];
    let frames: Vec<_> = [boot_up].into_iter().chain(row).map(|(at, (id, data))| (at, id, data)).collect();
    assert_eq!(breaches_of(&frames), "");
    let again = [frames.as_slice(), &[(30_000, ANSWER.0, ANSWER.1)]].concat();
    assert!(breaches_of(&again).contains("a response without a request"));
}
