//! A device, a recording queue, the time, and a client that talks to the device.

use std::collections::VecDeque;

use canopen::lss::BitRate;
use canopen::sdo::{Abort, Multiplexer, Request, Response};
use canopen::testing::settle;
use canopen::{
    Action, BusEvent, Device, Duration, ErrorClass, Frame, Instant, Next, NodeId, QueueFull, Transmit,
};
use proptest::prelude::ProptestConfig;
use proptest::test_runner::RngSeed;

use crate::application::Numbers;
use crate::exchange;
use crate::rows::ROWS;

pub(crate) use crate::application::{
    DEVICE_FAULT, PRESSURE_RAIL, SENSOR_BREAK, TEMPERATURE_RAIL, Told, UNEXPECTED_RESET,
};
pub(crate) use crate::rows::{DICTIONARY, rows};

/// A transmit queue that keeps all frames, as long as it has room.
pub(crate) struct Queue {
    pub(crate) frames: Vec<Frame>,
    /// Identifiers of the frames sent as states.
    pub(crate) states: Vec<u16>,
    pub(crate) room: usize,
}

impl Transmit for Queue {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.room = self.room.checked_sub(1).ok_or(QueueFull)?;
        self.frames.push(frame);
        Ok(())
    }

    fn send_state(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.send(frame)?;
        self.states.push(frame.id());
        Ok(())
    }

    fn room(&self) -> usize {
        self.room
    }
}

/// Node-ID of the device under test.
pub(crate) const ID: u8 = 5;

/// A device, its queue and the time.
pub(crate) struct Bench {
    pub(crate) device: canopen::device!(Numbers, ROWS),
    pub(crate) out: Queue,
    pub(crate) now: Instant,
    /// Actions that the device has left to its caller.
    actions: VecDeque<Action>,
    parameters: bool,
}

impl Bench {
    /// A device that has booted and whose boot-up message has been taken.
    pub(crate) fn booted() -> Bench {
        Bench::unstarted().boot()
    }

    /// A device that has booted with this configured bit rate.
    pub(crate) fn booted_at(bit_rate: BitRate) -> Bench {
        let device = Device::new(&DICTIONARY, NodeId::new(ID), Numbers::default()).with_bit_rate(bit_rate);
        Bench { device, ..Bench::unstarted() }.boot()
    }

    fn boot(mut self) -> Bench {
        self.start();
        self.take();
        self
    }

    pub(crate) fn operational() -> Bench {
        let mut bench = Bench::booted();
        bench.nmt(1);
        bench.take();
        bench
    }

    pub(crate) fn unstarted() -> Bench {
        Bench::with_node_id(NodeId::new(ID))
    }

    /// A device that has started without a node-ID.
    pub(crate) fn unconfigured() -> Bench {
        let mut bench = Bench::with_node_id(None);
        bench.start();
        bench
    }

    fn with_node_id(node_id: Option<NodeId>) -> Bench {
        let device = Device::new(&DICTIONARY, node_id, Numbers::default());
        Bench {
            device,
            out: Queue { frames: vec![], states: vec![], room: usize::MAX },
            now: Instant(1_000_000),
            actions: VecDeque::new(),
            parameters: false,
        }
    }

    pub(crate) fn start(&mut self) {
        let next = self.device.start(self.now, &mut self.out);
        self.follow(next);
    }

    /// Keeps the result of a call. Waiting actions are returned by the next call.
    fn follow(&mut self, next: Next) {
        self.keep(next);
        if next.action.is_some() {
            self.poll();
        }
    }

    fn keep(&mut self, next: Next) {
        self.parameters |= next.parameters;
        self.actions.extend(next.action);
    }

    /// The next action that was left to the caller.
    pub(crate) fn take_action(&mut self) -> Option<Action> {
        self.poll();
        self.actions.pop_front()
    }

    pub(crate) fn take_parameters(&mut self) -> bool {
        self.poll();
        std::mem::take(&mut self.parameters)
    }

    pub(crate) fn raise(&mut self, condition: u8) {
        let _ = self.device.set_condition(condition, true, self.now);
    }

    pub(crate) fn clear(&mut self, condition: u8) {
        let _ = self.device.set_condition(condition, false, self.now);
    }

    pub(crate) fn bus(&mut self, event: BusEvent) {
        let next = self.device.on_bus(event, self.now);
        self.follow(next);
        self.poll();
    }

    pub(crate) fn error(&mut self, class: ErrorClass) {
        let next = self.device.error(class);
        self.follow(next);
    }

    pub(crate) fn finish(&mut self, result: Result<(), Abort>) {
        let next = self.device.finish(result, self.now, &mut self.out);
        self.follow(next);
    }

    /// Calls of the application since the last call of this function.
    pub(crate) fn told(&mut self) -> Vec<Told> {
        std::mem::take(&mut self.device.application_mut().told)
    }

    /// All frames sent since the last call.
    pub(crate) fn take(&mut self) -> Vec<Frame> {
        std::mem::take(&mut self.out.frames)
    }

    /// Frames sent since the last call, as identifier and data.
    pub(crate) fn sent(&mut self) -> Vec<(u16, Vec<u8>)> {
        self.take().iter().map(|frame| (frame.id(), frame.data().to_vec())).collect()
    }

    /// Gives a frame to both halves, which acceptance filters would not.
    pub(crate) fn receive(&mut self, frame: Frame) {
        let next = self.device.on_frame(&frame, self.now, &mut self.out);
        self.follow(next);
        self.poll();
    }

    /// Does all work that is due, and returns the next deadline.
    pub(crate) fn poll(&mut self) -> Instant {
        let next = settle(self.now, || {
            let next = self.device.poll(self.now, &mut self.out);
            self.keep(next);
            next
        });
        next.due()
    }

    pub(crate) fn nmt(&mut self, command: u8) {
        self.receive(Frame::new(0, &[command, ID]).unwrap());
    }

    pub(crate) fn sync(&mut self) {
        self.receive(Frame::new(0x80, &[]).unwrap());
    }

    /// Lets time pass, from deadline to deadline as in the firmware.
    pub(crate) fn run(&mut self, span: Duration) {
        let end = self.now + span;
        loop {
            let due = self.poll();
            if due > end {
                self.now = end;
                return;
            }
            self.now = due;
        }
    }

    /// Runs for `span` and returns the instants at which frames with this identifier were sent.
    pub(crate) fn times_of(&mut self, id: u16, span: Duration) -> Vec<u64> {
        let (start, end) = (self.now, self.now + span);
        let mut times = vec![];
        loop {
            let due = self.poll();
            let sent = self.take().iter().filter(|frame| frame.id() == id).count();
            times.extend(std::iter::repeat_n(self.now.0 - start.0, sent));
            if due > end {
                self.now = end;
                return times;
            }
            self.now = due;
        }
    }

    pub(crate) fn set_value(&mut self, sub: u8, bytes: &[u8]) {
        let field = DICTIONARY.field(0x6000, sub);
        let next = self.device.publish(self.now, &mut self.out, |_, image| field.set(image, bytes));
        self.follow(next);
    }

    /// One SDO exchange.
    pub(crate) fn ask(&mut self, request: Request) -> Option<Response> {
        self.ask_raw(request.encode())
    }

    pub(crate) fn ask_raw(&mut self, request: [u8; 8]) -> Option<Response> {
        let responses = self.respond(Frame::new(0x600 + u16::from(ID), &request).unwrap());
        assert!(responses.len() <= 1, "more than one response");
        let data = responses.first()?.data().try_into().unwrap();
        Some(Response::parse(data).expect("no valid response"))
    }

    /// Gives a request to the device and returns the responses, taken out of the queue.
    fn respond(&mut self, request: Frame) -> Vec<Frame> {
        let before = self.take();
        self.receive(request);
        let id = 0x580 + u16::from(ID);
        let (responses, others): (Vec<_>, Vec<_>) = self.take().into_iter().partition(|f| f.id() == id);
        self.out.frames = before.into_iter().chain(others).collect();
        responses
    }

    /// Reads a value; the abort code if the device refuses.
    pub(crate) fn read(&mut self, index: u16, sub: u8) -> Result<Vec<u8>, u32> {
        exchange::read(ID, Multiplexer { index, sub }, |request| self.respond(request))
    }

    /// Writes a value; the abort code if the device refuses.
    pub(crate) fn write(&mut self, index: u16, sub: u8, bytes: &[u8]) -> Result<(), u32> {
        exchange::write(ID, Multiplexer { index, sub }, bytes, |request| self.respond(request))
    }

    pub(crate) fn write32(&mut self, index: u16, sub: u8, value: u32) -> Result<(), u32> {
        self.write(index, sub, &value.to_le_bytes())
    }
}

/// Property tests with the same cases each time.
pub(crate) fn repeatable() -> ProptestConfig {
    ProptestConfig { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() }
}
