//! The device with its clock, its transmit queue and its pins.

use bxcan::{Can, Data, Id, StandardId};
use canopen::dictionary::{Access, Dictionary, Field, Mapping, Object, Type};
use canopen::{
    Action, Application, Device, Duration, Frame, Instant, Next, NodeId, QueueFull, Transmit, objects,
};
use heapless::Deque;
use stm32f4xx_hal::can::Can1;
use stm32f4xx_hal::gpio::{Input, Output, PA5, PC13};
use stm32f4xx_hal::pac::{SCB, TIM2, TIM5};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::timer::{CounterUs, Flag};

const BUTTON: Object =
    Object::new(0x6000, 1, "Button", Type::Unsigned8, Access::ReadOnly).mappable(Mapping::Tpdo);
const LED: Object = Object::new(0x6200, 1, "LED", Type::Unsigned8, Access::ReadWrite).mappable(Mapping::Rpdo);

const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0x0003_0191), objects::error_register(), objects::device_name("NUCLEO")],
    objects::identity(0, 1, 0x0001_0000),
    objects::emergency(),
    [objects::heartbeat_producer(1000)],
    objects::rpdo(1, &[LED]),
    objects::tpdo(1, &[BUTTON]),
    [Object::highest(0x6000, 1, "Read input 8 bit"), BUTTON],
    [Object::highest(0x6200, 1, "Write output 8 bit"), LED],
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);
const PRESSED: Field = DICTIONARY.field(0x6000, 1);
const LIT: Field = DICTIONARY.field(0x6200, 1);

/// Interval at which the button is read.
const PERIOD: Duration = Duration::from_millis(10);

/// Microseconds since the start, from a timer of 32 bits.
pub(crate) struct Clock {
    timer: CounterUs<TIM5>,
    last: u32,
    now: u64,
}

impl Clock {
    pub(crate) fn new(mut timer: CounterUs<TIM5>) -> Clock {
        // The longest period that the HAL accepts; a start fails only for a longer one.
        let _ = timer.start(u32::MAX.micros());
        Clock { timer, last: 0, now: 0 }
    }

    /// Must be called at least once an hour: the timer begins again after 71 minutes.
    fn now(&mut self) -> Instant {
        let ticks = self.timer.now().ticks();
        self.now += u64::from(ticks.wrapping_sub(self.last));
        self.last = ticks;
        Instant(self.now)
    }
}

/// The frames that wait for the bus, in the order of their sending.
struct Queue(Deque<Frame, 24>);

impl Transmit for Queue {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.0.push_back(frame).map_err(|_| QueueFull)
    }

    fn room(&self) -> usize {
        self.0.capacity() - self.0.len()
    }
}

/// The application: the LED.
struct Panel(PA5<Output>);

impl Panel {
    fn light(&mut self, image: &[u8]) {
        self.0.set_state((LIT.u8(image) & 1 != 0).into());
    }
}

impl Application for Panel {
    fn received(&mut self, _rpdo: u16, image: &mut [u8]) {
        self.light(image);
    }

    fn written(&mut self, _entry: &canopen::dictionary::Entry, image: &mut [u8]) {
        self.light(image);
    }
}

/// The node.
pub struct Node {
    device: canopen::device!(Panel, ROWS),
    queue: Queue,
    can: Can<Can1>,
    clock: Clock,
    alarm: CounterUs<TIM2>,
    button: PC13<Input>,
}

impl Node {
    pub(crate) fn new(
        can: Can<Can1>,
        clock: Clock,
        alarm: CounterUs<TIM2>,
        button: PC13<Input>,
        led: PA5<Output>,
    ) -> Node {
        let device = Device::new(&DICTIONARY, NodeId::new(5), Panel(led));
        Node { device, queue: Queue(Deque::new()), can, clock, alarm, button }
    }

    /// Boots up.
    pub(crate) fn start(&mut self) {
        let now = self.clock.now();
        let next = self.device.start(now, &mut self.queue);
        self.finish(next, now);
    }

    /// Takes the received frames. An overrun reads as the end of the frames.
    pub(crate) fn receive(&mut self) {
        while let Ok(received) = self.can.receive() {
            let Id::Standard(id) = received.id() else { continue };
            let frame = match received.data() {
                Some(data) => Frame::new(id.as_raw(), data),
                None => Frame::remote(id.as_raw(), received.dlc()),
            };
            if let Some(frame) = frame {
                let now = self.clock.now();
                let next = self.device.on_frame(&frame, now, &mut self.queue);
                self.finish(next, now);
            }
        }
    }

    /// A deadline has come.
    pub(crate) fn alarm(&mut self) {
        self.alarm.clear_flags(Flag::Update);
        let now = self.clock.now();
        let next = self.device.poll(now, &mut self.queue);
        self.finish(next, now);
    }

    /// Sends the next frame when the one before has been sent, so that no frame overtakes another.
    pub(crate) fn transmit(&mut self) {
        self.can.clear_tx_interrupt();
        if !self.can.is_transmitter_idle() {
            return;
        }
        let Some(frame) = self.queue.0.pop_front() else { return };
        if let (Some(id), Some(data)) = (StandardId::new(frame.id()), Data::new(frame.data())) {
            let _ = self.can.transmit(&bxcan::Frame::new_data(id, data));
        }
    }

    /// Carries out the actions, sends what has changed, and sets the alarm.
    fn finish(&mut self, mut next: Next, now: Instant) {
        while let Some(action) = next.action {
            next = match action {
                Action::ResetNode => SCB::sys_reset(),
                Action::ResetCommunication => {
                    self.queue.0.clear();
                    self.device.start(now, &mut self.queue)
                }
                // All frames are received, and there is one bit rate, no bootloader and no memory.
                _ => self.device.poll(now, &mut self.queue),
            };
        }
        let is_pressed = self.button.is_low();
        let next = self.device.publish(now, &mut self.queue, |_, image| {
            PRESSED.set_u8(image, u8::from(is_pressed));
        });
        self.transmit();
        let wait = next.due().0.saturating_sub(now.0).clamp(1, PERIOD.0);
        let _ = self.alarm.start(u32::try_from(wait).unwrap_or(1).micros());
    }
}
