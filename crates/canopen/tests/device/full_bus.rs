//! A transmit queue without room for a long time, with every service, at any moment.

use std::collections::VecDeque;

use canopen::dictionary::{Access, Dictionary, Mapping, Object, Type};
use canopen::lss::Request as LssRequest;
use canopen::nmt::{Command, State};
use canopen::sdo::Abort;
use canopen::testing::settle;
use canopen::{
    Action, Application, BusEvent, Condition, Device, ErrorClass, Frame, Instant, Next, NodeId, Part,
    QueueFull, TimeOfDay, Transmit, objects,
};
use proptest::prelude::*;

use crate::bench::repeatable;

const ID: u8 = 5;
const BOOT_UP: u16 = 0x705;
const LSS_RESPONSE: u16 = 0x7E4;

const VALUE: Object = Object::new(0x6000, 1, "", Type::Unsigned8, Access::ReadOnly).mappable(Mapping::Tpdo);
const OUTPUT: Object = Object::new(0x6200, 1, "", Type::Unsigned8, Access::ReadWrite).mappable(Mapping::Rpdo);
const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register(), objects::heartbeat_producer(10)],
    objects::error_field::<4>(),
    objects::sync_producer(20_000),
    objects::node_guarding(),
    [objects::time_stamp(), objects::start_up()],
    objects::emergency(),
    objects::identity(1, 2, 3),
    objects::heartbeat_consumer::<3>(),
    objects::emcy_consumer::<3>(),
    objects::error_behaviour(2),
    objects::store_parameters(),
    objects::restore_parameters(),
    objects::sdo_server(2),
    objects::rpdo(1, &[OUTPUT]),
    objects::multiplexed(objects::rpdo(2, &[])),
    objects::with(objects::tpdo(1, &[VALUE]), 5, 7),
    objects::with(objects::tpdo(2, &[VALUE]), 2, 1),
    objects::multiplexed(objects::tpdo(3, &[])),
    [
        Object::highest(0x6000, 1, ""),
        VALUE,
        Object::highest(0x6200, 1, ""),
        OUTPUT,
        Object::new(0x6300, 0, "", Type::Domain, Access::ReadWrite).handled(),
        Object::new(0x6400, 0, "", Type::Unsigned32, Access::ReadWrite),
    ],
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);
const CONTENT: [u8; 200] = [7; 200];

/// An application with a domain and with a fault that stops the device.
#[derive(Default)]
struct Product {
    states: Vec<State>,
}

impl Application for Product {
    const CONDITIONS: &'static [Condition] =
        &[Condition::new(0x5006), Condition::new(0x5003).of_class(ErrorClass::DEVICE)];

    fn read_domain(&self, _: canopen::sdo::Multiplexer) -> Result<&[u8], Abort> {
        Ok(&CONTENT)
    }

    fn write_domain(&mut self, _: canopen::sdo::Multiplexer, _: Part<'_>) -> Result<(), Abort> {
        Ok(())
    }

    fn state(&mut self, state: State, _: &mut [u8]) {
        self.states.push(state);
    }
}

/// A queue with some free places.
struct Queue {
    frames: VecDeque<Frame>,
    room: usize,
}

impl Transmit for Queue {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.room = self.room.checked_sub(1).ok_or(QueueFull)?;
        self.frames.push_back(frame);
        Ok(())
    }

    fn room(&self) -> usize {
        self.room
    }
}

/// A device with its caller.
struct Node {
    device: canopen::device!(Product, ROWS),
    out: Queue,
    now: Instant,
    actions: VecDeque<Action>,
    /// The boot-up message of the last start has been sent.
    is_up: bool,
    /// The caller has the two halves apart.
    halves: bool,
}

impl Node {
    fn started(room: usize, halves: bool) -> Node {
        let device = Device::new(&DICTIONARY, NodeId::new(ID), Product::default());
        let out = Queue { frames: VecDeque::new(), room };
        let mut node = Node { device, out, now: Instant(1), actions: VecDeque::new(), is_up: false, halves };
        node.start();
        node
    }

    fn start(&mut self) {
        self.is_up = false;
        let next = self.device.start(self.now, &mut self.out);
        self.keep(next);
    }

    fn keep(&mut self, next: Next) {
        self.actions.extend(next.action);
    }

    /// Polls until nothing is due, and returns the next deadline.
    fn settle(&mut self) -> Instant {
        let due = settle(self.now, || {
            let next = if self.halves {
                let _ = self.device.poll_process(self.now, &mut self.out);
                self.device.poll_services(self.now, &mut self.out)
            } else {
                self.device.poll(self.now, &mut self.out)
            };
            self.actions.extend(next.action);
            next
        });
        due.due()
    }

    fn receive(&mut self, id: u16, data: &[u8]) {
        let frame = Frame::new(id, data).unwrap();
        self.take(&frame);
    }

    fn take(&mut self, frame: &Frame) {
        let next = if self.halves {
            let _ = self.device.on_process_frame(frame, self.now, &mut self.out);
            self.device.on_service_frame(frame, self.now, &mut self.out)
        } else {
            self.device.on_frame(frame, self.now, &mut self.out)
        };
        self.keep(next);
    }

    /// Lets time pass, from deadline to deadline.
    fn run(&mut self, microseconds: u64) {
        let end = Instant(self.now.0 + microseconds);
        loop {
            let due = self.settle();
            if due > end {
                break;
            }
            self.now = due;
        }
        self.now = end;
    }

    /// The frames sent. The boot-up message is the first frame after a start, except for LSS responses.
    fn sent(&mut self) -> Result<Vec<Frame>, TestCaseError> {
        let mut sent = vec![];
        while let Some(frame) = self.out.frames.pop_front() {
            if frame.id() == BOOT_UP && !self.is_up {
                prop_assert_eq!(frame.data(), &[0]);
                self.is_up = true;
            }
            prop_assert!(
                self.is_up || frame.id() == LSS_RESPONSE,
                "{:?} precedes the boot-up message",
                frame
            );
            sent.push(frame);
        }
        Ok(sent)
    }
}

impl Node {
    /// The first byte of the answer to a request; `None` without one.
    fn answer(&mut self, id: u16, data: &[u8]) -> Result<Option<u8>, TestCaseError> {
        self.receive(id, data);
        self.settle();
        let response = if id == 0x7E5 { LSS_RESPONSE } else { id - 0x80 };
        let answers: Vec<Frame> = self.sent()?.into_iter().filter(|frame| frame.id() == response).collect();
        prop_assert!(answers.len() <= 1, "{:?}", answers);
        Ok(answers.first().map(|frame| frame.data()[0]))
    }
}

#[derive(Clone, Debug)]
enum Step {
    Receive(u16, Vec<u8>),
    Guard,
    Room(usize),
    Run(u64),
    Act,
    Load,
    Start,
    Publish(u8),
    Condition(u8, bool),
    Bus(u8),
    Nmt(Command),
    Time,
    SetNodeId,
}

fn frame() -> impl Strategy<Value = Step> {
    let sdo = prop::sample::select(vec![
        vec![0x40, 0x00, 0x10, 0, 0, 0, 0, 0],
        vec![0x2F, 0x00, 0x62, 1, 9, 0, 0, 0],
        vec![0x23, 0x00, 0x64, 0, 1, 2, 3, 4],
        // Block upload of the domain: initiate, start, acknowledge, end.
        vec![0xA4, 0x00, 0x63, 0, 127, 0, 0, 0],
        vec![0xA3, 0, 0, 0, 0, 0, 0, 0],
        vec![0xA2, 20, 127, 0, 0, 0, 0, 0],
        vec![0xA1, 0, 0, 0, 0, 0, 0, 0],
        // Segmented upload, block download.
        vec![0x40, 0x00, 0x63, 0, 0, 0, 0, 0],
        vec![0x60, 0, 0, 0, 0, 0, 0, 0],
        vec![0x70, 0, 0, 0, 0, 0, 0, 0],
        vec![0xC6, 0x00, 0x63, 0, 20, 0, 0, 0],
        vec![0x01, 1, 2, 3, 4, 5, 6, 7],
        vec![0x82, 1, 2, 3, 4, 5, 6, 7],
        vec![0x80, 0, 0, 0, 0, 0, 0, 5],
        vec![0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'],
        vec![0x23, 0x11, 0x10, 1, b'l', b'o', b'a', b'd'],
        vec![0x2B, 0x17, 0x10, 0, 0, 0, 0, 0],
        vec![0x2B, 0x17, 0x10, 0, 20, 0, 0, 0],
        vec![0x2B, 0x0C, 0x10, 0, 50, 0, 0, 0],
        vec![0x2F, 0x0D, 0x10, 0, 3, 0, 0, 0],
        vec![0x23, 0x06, 0x10, 0, 0, 0, 0, 0],
        vec![0x23, 0x06, 0x10, 0, 0x10, 0x27, 0, 0],
        vec![0x23, 0x05, 0x10, 0, 0x80, 0, 0, 0],
        vec![0x23, 0x05, 0x10, 0, 0x80, 0, 0, 0x40],
        vec![0x23, 0x16, 0x10, 1, 20, 0, 7, 0],
        vec![0x2F, 0x02, 0x1A, 0, 255, 0, 0, 0],
        vec![0x2F, 0x01, 0x16, 0, 255, 0, 0, 0],
        vec![0x23, 0x02, 0x18, 1, 0x85, 3, 0, 0],
        vec![0x23, 0x01, 0x14, 1, 0x05, 3, 0, 0],
        vec![0x23, 0x14, 0x10, 0, 0x85, 0, 0, 0x80],
        vec![0x23, 0x14, 0x10, 0, 0x85, 0, 0, 0],
        vec![0x23, 0x01, 0x12, 1, 0x40, 6, 0, 0],
        vec![0x23, 0x01, 0x12, 2, 0xC0, 5, 0, 0],
        vec![0x2F, 0x29, 0x10, 1, 2, 0, 0, 0],
        vec![0x23, 0x80, 0x1F, 0, 8, 0, 0, 0],
    ]);
    let lss = prop::sample::select(vec![
        LssRequest::SwitchGlobal { configuration: true },
        LssRequest::SwitchGlobal { configuration: false },
        LssRequest::NodeId(ID),
        LssRequest::BitTiming { table: 0, index: 2 },
        LssRequest::Activate { delay: 3 },
        LssRequest::Activate { delay: 0 },
        LssRequest::Store,
        LssRequest::InquireNodeId,
        LssRequest::IdentifyUnconfigured,
    ]);
    let nmt = prop::sample::select(vec![1, 1, 1, 2, 0x80, 0x81, 0x82]);
    prop_oneof![
        8 => sdo.clone().prop_map(|data| Step::Receive(0x605, data)),
        2 => sdo.prop_map(|data| Step::Receive(0x640, data)),
        3 => lss.prop_map(|request| Step::Receive(0x7E5, request.encode().to_vec())),
        3 => nmt.prop_map(|command| Step::Receive(0, vec![command, ID])),
        2 => Just(Step::Receive(0x80, vec![])),
        1 => Just(Step::Receive(0x80, vec![1])),
        1 => (0..3_usize).prop_map(|len| Step::Receive(0x205, vec![1; len])),
        1 => Just(Step::Receive(0x305, vec![0x85, 0x00, 0x62, 1, 4, 0, 0, 0])),
        1 => Just(Step::Receive(0x305, vec![0x85, 0x00, 0x70, 1, 4, 0, 0, 0])),
        1 => Just(Step::Receive(0x707, vec![5])),
        1 => Just(Step::Receive(0x100, vec![0; 6])),
        1 => Just(Step::Receive(0x081, vec![1; 8])),
        1 => Just(Step::Guard),
    ]
}

fn step() -> impl Strategy<Value = Step> {
    let room = prop_oneof![3 => Just(0), 1 => 0..30_usize, 1 => Just(1000)];
    let command = prop::sample::select(vec![
        Command::Start,
        Command::Stop,
        Command::EnterPreOperational,
        Command::ResetNode,
        Command::ResetCommunication,
    ]);
    prop_oneof![
        12 => frame(),
        4 => room.prop_map(Step::Room),
        6 => prop_oneof![0..3_000_u64, 0..2_000_000_u64, Just(1_100_000)].prop_map(Step::Run),
        3 => Just(Step::Act),
        1 => Just(Step::Load),
        1 => Just(Step::Start),
        1 => any::<u8>().prop_map(Step::Publish),
        2 => (0..3_u8, any::<bool>()).prop_map(|(number, active)| Step::Condition(number, active)),
        1 => (0..5_u8).prop_map(Step::Bus),
        1 => command.prop_map(Step::Nmt),
        1 => Just(Step::Time),
        1 => Just(Step::SetNodeId),
    ]
}

impl Node {
    fn step(&mut self, step: Step) {
        match step {
            Step::Receive(id, data) => self.receive(id, &data),
            Step::Guard => self.take(&Frame::remote(BOOT_UP, 1).unwrap()),
            Step::Room(room) => self.out.room = room,
            Step::Run(microseconds) => self.run(microseconds),
            Step::Act => {
                let action = self.actions.pop_front();
                match action {
                    Some(Action::ResetNode | Action::ResetCommunication) => {
                        self.out.frames.clear();
                        self.start();
                    }
                    Some(Action::Store(_)) => {
                        let next = self.device.finish(Ok(()), self.now, &mut self.out);
                        self.keep(next);
                    }
                    _ => (),
                }
            }
            Step::Load => self.device.load(),
            Step::Start => {
                self.out.frames.clear();
                self.start();
            }
            Step::Publish(value) => {
                let field = DICTIONARY.field(0x6000, 1);
                let next =
                    self.device.publish(self.now, &mut self.out, |_, image| field.set(image, &[value]));
                self.keep(next);
            }
            Step::Condition(number, active) => {
                let next = self.device.set_condition(number, active, self.now);
                self.keep(next);
            }
            Step::Bus(number) => {
                let events = [
                    BusEvent::Overrun,
                    BusEvent::Warning,
                    BusEvent::Passive,
                    BusEvent::BusOff,
                    BusEvent::Recovered,
                ];
                let next = self.device.on_bus(events[usize::from(number)], self.now);
                self.keep(next);
            }
            Step::Nmt(command) => {
                let next = self.device.nmt(command, self.now, &mut self.out);
                self.keep(next);
            }
            Step::Time => {
                let time = TimeOfDay { days: 1, milliseconds: 2 };
                let _ = self.device.send_time(time, self.now, &mut self.out);
            }
            Step::SetNodeId => self.device.set_node_id(NodeId::new(ID)),
        }
    }
}

proptest! {
    #![proptest_config(repeatable())]

    /// Nothing panics, no deadline is in the past, nothing precedes the boot-up message, and in the end the device works.
    #[test]
    fn a_full_queue_disturbs_no_later_service(
        steps in prop::collection::vec(step(), 1..60),
        room in prop_oneof![Just(0), Just(1000)],
        halves in any::<bool>(),
    ) {
        let mut node = Node::started(room, halves);
        for step in steps {
            node.step(step);
            node.settle();
            node.sent()?;
        }
        // The queue has room again, and the caller carries out all actions.
        node.out.room = usize::MAX;
        for _ in 0..20 {
            node.step(Step::Act);
            node.run(100_000);
        }
        prop_assert!(node.actions.is_empty(), "{:?}", node.actions);
        node.sent()?;
        prop_assert!(node.is_up, "no boot-up message");
        prop_assert_ne!(node.device.state(), State::Initialising);
        node.step(Step::Bus(4));
        node.receive(0, &[0x80, ID]);
        node.run(2_000_000);
        node.sent()?;
        node.receive(0x605, &[0x80, 0, 0, 0, 0, 0, 0, 5]);
        prop_assert_eq!(node.answer(0x605, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0])?, Some(0x43));
        // No job is stuck, no state of LSS, no change of the bit rate.
        prop_assert_eq!(node.answer(0x605, &[0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'])?, None);
        let action = node.actions.pop_front();
        prop_assert!(matches!(action, Some(Action::Store(_))), "{:?}", action);
        let next = node.device.finish(Ok(()), node.now, &mut node.out);
        node.keep(next);
        prop_assert_eq!(node.sent()?.iter().find(|frame| frame.id() == 0x585).map(|f| f.data()[0]), Some(0x60));
        let lss = |request: LssRequest| request.encode();
        prop_assert_eq!(node.answer(0x7E5, &lss(LssRequest::SwitchGlobal { configuration: true }))?, None);
        prop_assert_eq!(node.answer(0x7E5, &lss(LssRequest::InquireNodeId))?, Some(0x5E));
        // Heartbeat, SYNC and TPDOs keep their periods.
        prop_assert_eq!(node.answer(0x605, &[0x2B, 0x17, 0x10, 0, 20, 0, 0, 0])?, Some(0x60));
        prop_assert_eq!(node.answer(0x605, &[0x23, 0x06, 0x10, 0, 0x10, 0x27, 0, 0])?, Some(0x60));
        prop_assert_eq!(node.answer(0x605, &[0x23, 0x05, 0x10, 0, 0x80, 0, 0, 0x40])?, Some(0x60));
        node.receive(0, &[1, ID]);
        node.run(10_000);
        node.sent()?;
        node.run(1_000_000);
        let sent = node.sent()?;
        let count = |id| sent.iter().filter(|frame| frame.id() == id).count();
        prop_assert_eq!(count(0x705), 50);
        prop_assert_eq!(count(0x080), 100);
        prop_assert!((110..150).contains(&count(0x185)), "TPDO 1: {}", count(0x185));
        prop_assert_eq!(count(0x285), 100, "TPDO 2");
    }
}

/// A request of a client or of the LSS master, and its data.
fn exchange_step() -> impl Strategy<Value = Step> {
    let number = |index: u16, sub: u8, size: u8| {
        let [low, high] = index.to_le_bytes();
        any::<[u8; 4]>().prop_map(move |mut data| {
            data[usize::from(size)..].fill(0);
            let [a, b, c, d] = data;
            Step::Receive(0x605, vec![0x23 | (4 - size) << 2, low, high, sub, a, b, c, d])
        })
    };
    let read = |index: u16, sub: u8| {
        let [low, high] = index.to_le_bytes();
        Just(Step::Receive(0x605, vec![0x40, low, high, sub, 0, 0, 0, 0]))
    };
    let lss = prop::sample::select(vec![
        LssRequest::SwitchGlobal { configuration: true },
        LssRequest::NodeId(ID),
        LssRequest::BitTiming { table: 0, index: 2 },
        LssRequest::InquireNodeId,
    ]);
    prop_oneof![
        4 => number(0x6400, 0, 4),
        2 => number(0x6200, 1, 1),
        1 => number(0x1015, 0, 2),
        1 => number(0x1017, 0, 2),
        1 => read(0x6400, 0),
        1 => read(0x6200, 1),
        1 => read(0x7000, 0),
        3 => lss.prop_map(|request| Step::Receive(0x7E5, request.encode().to_vec())),
        1 => prop::sample::select(vec![1, 2, 0x80, 0x82]).prop_map(|command| Step::Receive(0, vec![command, ID])),
        4 => prop_oneof![Just(0), Just(1), Just(1000)].prop_map(Step::Room),
        3 => (0..400_000_u64).prop_map(Step::Run),
        2 => Just(Step::Act),
    ]
}

/// Checks a response of the SDO server against its request and the image.
fn check_answer(request: &[u8], answer: &[u8], image: &[u8]) -> Result<(), TestCaseError> {
    prop_assert_eq!(&request[1..4], &answer[1..4], "the answer to another request: {:x?}", answer);
    let at = (u16::from_le_bytes([request[1], request[2]]), request[3]);
    let stored = DICTIONARY.find(at.0, at.1).map(|entry| entry.field().get(image).to_vec());
    match (request[0], answer[0]) {
        (_, 0x80) => prop_assert!(stored.is_err(), "refused: {:x?}", answer),
        (0x40, _) => prop_assert!(answer[4..].starts_with(&stored.unwrap())),
        (_, command) => {
            prop_assert_eq!(command, 0x60);
            prop_assert!(request[4..].starts_with(&stored.unwrap()), "no effect: {:x?}", request);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(repeatable())]

    /// The server answers the last request, once. An accepted value is in the image.
    #[test]
    fn an_answer_of_a_full_queue_belongs_to_the_last_request(
        steps in prop::collection::vec(exchange_step(), 1..80),
        halves in any::<bool>(),
    ) {
        let mut node = Node::started(1000, halves);
        let (mut asked, mut lss, mut selected) = (None, None, false);
        for step in steps.into_iter().chain([Step::Room(1000), Step::Run(5000)]) {
            let services = node.device.state().has_services();
            match &step {
                Step::Receive(0x605, data) if services => asked = Some(data.clone()),
                Step::Receive(0x7E5, data) => {
                    selected |= data[0] == 0x04;
                    lss = Some(data[0]).filter(|command| selected && *command != 0x04);
                }
                Step::Receive(0, data) if data[0] != 1 && data[0] != 0x80 => asked = None,
                Step::Act if matches!(node.actions.front(), Some(Action::ResetNode | Action::ResetCommunication)) => {
                    (asked, lss, selected) = (None, None, false);
                }
                _ => (),
            }
            node.step(step);
            node.settle();
            for frame in node.sent()? {
                match frame.id() {
                    0x585 => {
                        let request = asked.take();
                        prop_assert!(request.is_some(), "nothing was asked: {:?}", frame);
                        check_answer(&request.unwrap(), frame.data(), node.device.image())?;
                    }
                    0x7E4 => {
                        prop_assert!(lss.take() == Some(frame.data()[0]), "LSS: {:?}", frame);
                    }
                    _ => (),
                }
            }
        }
        prop_assert_eq!(asked.filter(|_| node.device.state().has_services()), None, "no answer");
        prop_assert_eq!(lss, None, "no answer of LSS");
    }
}
