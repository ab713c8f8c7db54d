//! Calls under load: two panels with two buttons each, random presses, an inhibit time, a bus that more urgent frames
//! occupy for seconds, and bus-off in between. Every transition of a button reaches the bus once and in order, or is
//! covered by a later full state.

use bsp::can::transmit_queue::{Mailboxes, Offer, TransmitQueue};
use canopen::{Duration, Frame, Instant};
use fastrand::Rng;
use host_tests::bench::{Bench, ID, raw};
use host_tests::calls::{Transition, Verdict, verify};
use host_tests::thorough::either;
use node::{BusEvent, Measurement, Personality, Protocol};
use profiles::board::{Inputs, RawEncoder};
use profiles::lift::devices::Devices;

const MS: Duration = Duration::from_millis(1);
const INPUT: u16 = 0x480 + ID as u16;
/// Number of presses of each of the four buttons.
const PRESSES: usize = 2500;

/// Mean milliseconds between two changes of a button: mostly as by adults, sometimes as by playing children.
const PACES: [u32; 6] = [60, 800, 1500, 3000, 3000, 3000];

/// Three mailboxes that behave like those of bxCAN with the driver.
#[derive(Default)]
struct Boxes(Vec<Frame>);

impl Mailboxes for Boxes {
    fn offer(&mut self, frame: &Frame) -> Offer {
        let is_full = self.0.len() == 3;
        if is_full && self.0[0].id() < frame.id() || self.0.iter().any(|other| other.id() == frame.id()) {
            return Offer::Refused;
        }
        self.0.push(*frame);
        self.0.sort_by_key(|frame| core::cmp::Reverse(frame.id()));
        if is_full { Offer::Replaced(self.0.remove(0)) } else { Offer::Taken }
    }

    fn settle(&mut self, _is_cleared: bool) {}

    fn is_idle(&self) -> bool {
        self.0.is_empty()
    }
}

/// A phase of the bus.
#[derive(Clone, Copy, PartialEq)]
enum Phase {
    /// The bus leaves room for the node's frames.
    Open,
    /// More urgent frames leave room for one frame in this number of milliseconds.
    Crowded(u64),
    /// More urgent frames leave no room.
    Full,
    /// The node is off the bus.
    Off,
}

/// A panel with its transmit queue.
struct Panel {
    protocol: Protocol,
    measurement: Measurement,
    queue: TransmitQueue,
    boxes: Boxes,
    now: Instant,
    pressed: [bool; 2],
    happened: Vec<Transition>,
    log: Vec<Transition>,
}

impl Panel {
    /// An input panel unit with an inhibit time of 200 ms.
    fn new() -> Panel {
        let mut bench = Bench::booted_as(Personality::Lift);
        bench.write(0x2305, 0, &[Devices::INPUT_PANEL.0]).unwrap();
        bench.write(0x6100, 1, &[5, 1, 1, 0, 1, 0]).unwrap();
        bench.write(0x6100, 2, &[5, 2, 1, 0, 1, 0]).unwrap();
        bench.write(0x1881, 1, &(0xC000_0000 | u32::from(INPUT)).to_le_bytes()).unwrap();
        bench.write(0x1881, 3, &2000_u16.to_le_bytes()).unwrap();
        bench.write(0x1881, 1, &(0x4000_0000 | u32::from(INPUT)).to_le_bytes()).unwrap();
        bench.sample(&raw(0.0, 298.15));
        let Bench { protocol, measurement, now, .. } = bench;
        let (queue, boxes) = (TransmitQueue::new(), Boxes::default());
        let (happened, log) = (vec![], vec![]);
        Panel { protocol, measurement, queue, boxes, now, pressed: [false; 2], happened, log }
    }

    fn nmt(&mut self, command: u8) {
        let frame = Frame::new(0, &[command, ID]).unwrap();
        let _ = self.protocol.on_process_frame(&frame, self.now, &mut self.queue);
    }

    fn push(&mut self, button: usize) {
        self.pressed[button] ^= true;
        self.happened.push(Transition { at: self.now.0, button, is_pressed: self.pressed[button] });
    }

    /// Advances node and bus by a millisecond.
    fn pass(&mut self, phase: Phase) {
        self.now = self.now + MS;
        let (analogue, position) = (raw(0.0, 298.15), RawEncoder::default());
        let inputs = Inputs { analogue, position, digital: self.pressed };
        self.measurement.update(&inputs, self.protocol.snapshot_mut());
        let _ = self.protocol.publish(self.now, &mut self.queue);
        let _ = self.protocol.poll_services(self.now, &mut self.queue);
        let frames = match phase {
            Phase::Open => 8,
            Phase::Crowded(period) => u64::from((self.now.0 / 1000).is_multiple_of(period)),
            Phase::Full | Phase::Off => 0,
        };
        for _ in 0..frames {
            self.queue.pump(&mut self.boxes);
            self.log.extend(self.boxes.0.pop().and_then(|frame| self.word(&frame)));
        }
    }

    /// The state of a button in a frame.
    fn word(&self, frame: &Frame) -> Option<Transition> {
        let [5, button, 1, 0, 1, state] = *frame.data() else { return None };
        let (button, is_pressed) = (usize::from(button) - 1, state == 1);
        (frame.id() == INPUT).then_some(Transition { at: self.now.0, button, is_pressed })
    }

    /// Runs until each button was pressed `presses` times. Returns the number of starts.
    fn run(&mut self, presses: usize, rng: &mut Rng, phase: impl Fn(&mut Rng) -> Phase) -> usize {
        let (mut starts, mut now, mut left) = (1, Phase::Open, 0_u32);
        let mut quiet = [0_u32; 2];
        let mut pace = PACES[0];
        self.nmt(1);
        while self.happened.len() < 4 * presses {
            if left == 0 {
                let before = std::mem::replace(&mut now, phase(rng));
                starts += self.change(before, now);
                (left, pace) = (rng.u32(20..4000), PACES[rng.usize(..PACES.len())]);
            }
            left -= 1;
            for (button, quiet) in quiet.iter_mut().enumerate() {
                *quiet = quiet.saturating_sub(1);
                // The node accepts a contact after 10 ms without a change.
                if *quiet == 0 && rng.u32(..pace) == 0 {
                    self.push(button);
                    *quiet = 10;
                }
            }
            self.pass(now);
        }
        starts += self.change(now, Phase::Open);
        (0..20_000).for_each(|_| self.pass(Phase::Open));
        starts
    }

    /// Changes the phase of the bus; returns 1 if the node had to be started again.
    fn change(&mut self, before: Phase, now: Phase) -> usize {
        let was_off = before == Phase::Off && now != Phase::Off;
        if now == Phase::Off && before != Phase::Off {
            let _ = self.protocol.bus_event(BusEvent::BusOff, self.now);
        }
        if was_off {
            let _ = self.protocol.bus_event(BusEvent::Recovered, self.now);
            self.nmt(1);
        }
        usize::from(was_off)
    }

    /// Checks the log with a long lag, because a word may wait as long as the bus is full.
    fn verdict(&self) -> Verdict {
        verify(&self.happened, &self.log, 60_000_000).unwrap_or_else(|error| panic!("{error}"))
    }
}

#[test]
fn every_press_reaches_a_full_bus_or_is_covered_by_a_full_state() {
    for seed in [1, 2] {
        let (mut panel, mut rng) = (Panel::new(), Rng::with_seed(seed));
        let starts = panel.run(PRESSES, &mut rng, |rng| match rng.u32(..8) {
            0..3 => Phase::Open,
            3..5 => Phase::Crowded(rng.u64(2..50)),
            5..7 => Phase::Full,
            _ => Phase::Off,
        });
        let verdict = panel.verdict();
        println!("{PRESSES} presses of each button, {starts} starts: {verdict:?}");
        assert_eq!(verdict.told + verdict.covered, panel.happened.len());
        assert!(verdict.told > panel.happened.len() / 4, "{verdict:?}: most of what there is time for");
        assert!(verdict.covered > 0 && verdict.full_states >= starts / 2, "{verdict:?}");
    }
}

/// While the queue is long enough, every transition is reported individually: the only full state is that of the start.
#[test]
fn all_presses_within_the_capacity_of_the_queue_are_sent() {
    let (mut panel, mut rng) = (Panel::new(), Rng::with_seed(3));
    panel.nmt(1);
    (0..1000).for_each(|_| panel.pass(Phase::Open));
    for _ in 0..either(20, 400) {
        for _ in 0..rng.usize(1..=24) {
            panel.push(rng.usize(..2));
            (0..rng.u32(10..40)).for_each(|_| panel.pass(Phase::Full));
        }
        (0..10_000).for_each(|_| panel.pass(Phase::Crowded(3)));
    }
    let verdict = panel.verdict();
    assert_eq!((verdict.told, verdict.covered, verdict.full_states), (panel.happened.len(), 0, 1));
}
