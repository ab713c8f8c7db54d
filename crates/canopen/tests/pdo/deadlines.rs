//! After every poll, all deadlines lie in the future: with short queues, with events, and after a write that leaves
//! nothing to send.

use canopen::dictionary::{self, Access, DefaultValue, Dictionary, Entry, Mapping, Object, Type};
use canopen::sdo::{Abort, Multiplexer};
use canopen::testing::settle;
use canopen::{Application, Device, Duration, Frame, Instant, NodeId};

use crate::bench::{ID, Sent, Short, download};

const MS: Duration = Duration::from_millis(1);
/// TPDO 1 sends events, TPDO 2 values, TPDO 3 is multiplexed.
const EVENTS: u16 = 0x185;
const VALUES: u16 = 0x285;
const MULTIPLEXED: u16 = 0x385;

const fn communication(index: u16, cob_id: u32) -> [Object; 4] {
    [
        Object::highest(index, 5, ""),
        Object::new(index, 1, "", Type::Unsigned32, Access::ReadWrite).default(DefaultValue::NodeId(cob_id)),
        Object::new(index, 2, "", Type::Unsigned8, Access::ReadWrite).value(255),
        Object::new(index, 5, "", Type::Unsigned16, Access::ReadWrite),
    ]
}

const fn mapping(index: u16, mapped: i64) -> [Object; 2] {
    [
        Object::new(index, 0, "", Type::Unsigned8, Access::Const).value(1),
        Object::new(index, 1, "", Type::Unsigned32, Access::Const).value(mapped),
    ]
}

const fn value(index: u16) -> Object {
    Object::new(index, 0, "", Type::Unsigned16, Access::ReadOnly).mappable(Mapping::Tpdo)
}

const PARTS: &[&[Object]] = &[
    &communication(0x1800, 0x180),
    &communication(0x1801, 0x280),
    &communication(0x1802, 0x380),
    &mapping(0x1A00, 0x2001_0010),
    &mapping(0x1A01, 0x2002_0010),
    &[Object::new(0x1A02, 0, "", Type::Unsigned8, Access::Const).value(0xFF)],
    &[value(0x2001), value(0x2002), value(0x2003), value(0x2004)],
    &[Object::new(0x2010, 0, "", Type::Unsigned8, Access::ReadWrite).handled()],
];
static TABLE: [Object; dictionary::count(PARTS)] = dictionary::gather(PARTS);
const DICTIONARY: Dictionary = canopen::dictionary!(&TABLE);

/// An application with events, and with objects that 2010h chooses for the multiplexed TPDO.
#[derive(Default)]
struct Choice {
    events: usize,
    chosen: bool,
}

impl Application for Choice {
    const SENDS_EVENTS: bool = true;

    fn write(&mut self, _: &Entry, bytes: &[u8], _: &mut [u8]) -> Result<(), Abort> {
        self.chosen = bytes != [0];
        Ok(())
    }

    fn sends_events(&self, tpdo: u16) -> bool {
        tpdo == 1
    }

    fn next_event(&mut self, _: u16, _: &mut [u8]) -> bool {
        let is_event = self.events > 0;
        self.events -= usize::from(is_event);
        is_event
    }

    fn switches_pdos(&self, entry: &Entry) -> bool {
        entry.index() == 0x2010
    }

    fn broadcasts(&self, _: Multiplexer, _: &[u8]) -> bool {
        self.chosen
    }
}

struct Bench {
    device: canopen::device!(Choice, &TABLE),
    out: Short,
    now: Instant,
}

impl Bench {
    /// An operational device on which these objects of the multiplexed TPDO are chosen, after its first frames.
    fn operational(chosen: bool, event_timer: u16) -> Bench {
        let device = Device::new(&DICTIONARY, NodeId::new(ID), Choice { events: 0, chosen });
        let out = Short { sent: vec![], room: usize::MAX };
        let mut bench = Bench { device, out, now: Instant(1_000_000) };
        let _ = bench.device.start(bench.now, &mut bench.out);
        bench.write(0x1802, 5, &event_timer.to_le_bytes());
        let start = Frame::new(0, &[1, ID]).unwrap();
        let _ = bench.device.on_frame(&start, bench.now, &mut bench.out);
        bench.poll();
        bench.out.sent.clear();
        bench
    }

    fn write(&mut self, index: u16, sub: u8, bytes: &[u8]) {
        download(&mut self.device, (index, sub), bytes, self.now).unwrap();
        self.poll();
    }

    fn poll(&mut self) -> Instant {
        settle(self.now, || self.device.poll(self.now, &mut self.out)).due()
    }

    fn publish(&mut self, index: u16, value: u16) {
        let field = DICTIONARY.field(index, 0);
        let show = |_: &mut Choice, image: &mut [u8]| field.store(image, value.to_le_bytes());
        let _ = self.device.publish(self.now, &mut self.out, show);
        self.poll();
    }

    fn run(&mut self, span: Duration) {
        let end = self.now + span;
        while self.now < end {
            self.now = self.poll().min(end);
        }
        self.poll();
    }

    fn sent(&mut self, id: u16) -> usize {
        self.out.sent.drain(..).filter(|frame| frame.id() == id).count()
    }
}

#[test]
fn no_deadline_lies_in_the_past_while_events_wait_for_a_full_queue() {
    let mut bench = Bench::operational(false, 0);
    for room in 0..=20 {
        bench.out.room = room;
        bench.device.application_mut().events = 20;
        bench.publish(0x2002, 1000 + u16::try_from(room).unwrap());
        bench.run(Duration::from_millis(5));
    }
    bench.out.room = usize::MAX;
    bench.run(Duration::from_millis(5));
    assert_eq!((bench.device.application().events, bench.poll()), (0, Instant::NEVER));
    assert!(bench.sent(EVENTS) > 0);
}

#[test]
fn pdos_leave_room_in_the_queue_for_services() {
    let mut bench = Bench::operational(true, 1);
    bench.write(0x1801, 5, &[1, 0]);
    bench.device.application_mut().events = usize::MAX;
    bench.out.room = 32;
    bench.run(Duration::from_millis(100));
    assert!(bench.out.room >= 4, "{} free places", bench.out.room);
    let sent: Vec<u16> = bench.out.sent.iter().map(Frame::id).collect();
    assert!([EVENTS, VALUES].iter().all(|id| sent.contains(id)), "{sent:x?}");
}

#[test]
fn no_deadline_lies_in_the_past_after_the_last_object_of_a_multiplexed_tpdo_is_deselected() {
    let mut bench = Bench::operational(true, 100);
    bench.run(MS);
    bench.write(0x2010, 0, &[0]);
    bench.run(Duration::from_millis(1000));
    assert_eq!(bench.sent(MULTIPLEXED), 0);
    bench.write(0x2010, 0, &[1]);
    bench.run(Duration::from_millis(1000));
    assert!(bench.sent(MULTIPLEXED) >= 20, "chosen again");
}

#[test]
fn objects_chosen_in_operational_are_sent_at_once() {
    for event_timer in [0, 1000] {
        let mut bench = Bench::operational(false, event_timer);
        bench.run(Duration::from_millis(300));
        assert_eq!(bench.sent(MULTIPLEXED), 0);
        bench.write(0x2010, 0, &[1]);
        assert_eq!(bench.sent(MULTIPLEXED), 2, "event timer {event_timer} ms");
        bench.run(Duration::from_millis(10));
        assert_eq!(bench.sent(MULTIPLEXED), 0, "once");
    }
}

#[test]
fn a_queue_with_room_leaves_no_event_waiting() {
    let mut bench = Bench::operational(false, 0);
    bench.device.application_mut().events = 100;
    let mut sent = Sent::default();
    let _ = bench.device.publish(bench.now, &mut sent, |_, _| ());
    assert_eq!(sent.0.len(), 100);
}

/// The values in the image are no event.
#[test]
fn a_remote_frame_before_the_first_event_has_no_answer() {
    let mut bench = Bench::operational(false, 0);
    let request = Frame::remote(EVENTS, 2).unwrap();
    let ask = |bench: &mut Bench| {
        let _ = bench.device.on_frame(&request, bench.now, &mut bench.out);
        bench.run(Duration::from_millis(10));
        bench.sent(EVENTS)
    };
    assert_eq!(ask(&mut bench), 0);
    bench.device.application_mut().events = 1;
    bench.publish(0x2001, 1);
    assert_eq!((bench.sent(EVENTS), ask(&mut bench)), (1, 1));
}
