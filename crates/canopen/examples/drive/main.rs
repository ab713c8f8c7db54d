//! A CiA 402 drive on Linux, without a motor: the state machine, profile position and profile velocity mode.
//!
//! ```text
//! drive --eds FILE            writes its data sheet
//! drive HOST:PORT BUS NODE    runs on a bus of a socketcand server, such as
//!                             `cargo sim -- --socketcand 127.0.0.1:29536`
//! ```
//!
//! Standard input is the machine around the drive: `overcurrent 1` and `overcurrent 0` set and clear a fault, `local 1`
//! takes the control away from the bus.

#[path = "../socketcand/command_line.rs"]
mod command_line;
mod machine;
mod motor;
mod objects;
#[path = "../socketcand/mod.rs"]
mod socketcand;

use std::io;
use std::sync::mpsc::Receiver;

use canopen::dictionary::Entry;
use canopen::sdo::Abort;
use canopen::{Application, Condition, Device, ErrorClass, Instant, Next, Reset};
use machine::State;
use motor::{Motor, Ramp};
use objects::{DICTIONARY, ROWS, at};
use socketcand::{Bus, Product};

/// Bits of the controlword.
const NEW_SET_POINT: u16 = 1 << 4;
const IMMEDIATELY: u16 = 1 << 5;
const RELATIVE: u16 = 1 << 6;
const FAULT_RESET: u16 = 1 << 7;
const HALT: u16 = 1 << 8;

/// Bits of the statusword.
const REMOTE: u16 = 1 << 9;
const TARGET_REACHED: u16 = 1 << 10;
const INTERNAL_LIMIT: u16 = 1 << 11;
/// Set point acknowledged, or velocity 0.
const OF_MODE: u16 = 1 << 12;

/// Modes of operation (6060h).
const PROFILE_POSITION: i8 = 1;
const PROFILE_VELOCITY: i8 = 3;

/// Error codes (603Fh).
const OVERCURRENT: u16 = 0x2310;
const COMMUNICATION: u16 = 0x8100;

/// Values of 6007h and 605Ah.
const NO_ACTION: i16 = 0;
const DISABLE_VOLTAGE: i16 = 2;
const STAY_IN_QUICK_STOP: i16 = 6;

/// One cycle in seconds.
const CYCLE: f64 = 0.01;

/// The drive behind the objects.
#[derive(Default)]
struct Drive {
    state: State,
    motor: Motor,
    controlword: u16,
    /// The position to go to.
    set_point: Option<f64>,
    is_reached: bool,
    is_limited: bool,
    is_local: bool,
    has_overcurrent: bool,
}

impl Drive {
    /// Carries out the controlword.
    fn control(&mut self, image: &mut [u8]) {
        let controlword = at::CONTROLWORD.u16(image);
        let rising = controlword & !self.controlword;
        self.controlword = controlword;
        let before = self.state;
        let is_reset = rising & FAULT_RESET != 0 && !self.has_overcurrent;
        self.state = self.state.after(controlword, is_reset);
        if before == State::Fault && self.state != before {
            at::ERROR_CODE.set_u16(image, 0);
        }
        if self.state != State::OperationEnabled {
            self.set_point = None;
        } else if rising & NEW_SET_POINT != 0 {
            self.take_set_point(image);
        }
        self.show(image);
    }

    fn take_set_point(&mut self, image: &[u8]) {
        if self.set_point.is_some() && self.controlword & IMMEDIATELY == 0 {
            return;
        }
        let start = if self.controlword & RELATIVE != 0 { self.motor.position } else { 0.0 };
        let wanted = start + f64::from(at::TARGET_POSITION.i32(image));
        let [low, high] = at::LIMITS.map(|field| f64::from(field.i32(image)));
        let allowed = wanted.clamp(low, high.max(low));
        self.is_limited = allowed.to_bits() != wanted.to_bits();
        (self.set_point, self.is_reached) = (Some(allowed), false);
    }

    /// A fault: the motor stops, then the drive is in the state Fault.
    fn fail(&mut self, code: u16, image: &mut [u8]) {
        if !matches!(self.state, State::Fault | State::FaultReactionActive) {
            at::ERROR_CODE.set_u16(image, code);
            self.state = if self.state.has_torque() { State::FaultReactionActive } else { State::Fault };
        }
        self.show(image);
    }

    /// Moves the motor for one cycle.
    fn cycle(&mut self, image: &mut [u8]) {
        let field = |field: canopen::dictionary::Field| f64::from(field.u32(image));
        let ramp = Ramp {
            velocity: field(at::PROFILE_VELOCITY),
            acceleration: field(at::ACCELERATION),
            deceleration: field(at::DECELERATION),
        };
        let quick = Ramp { deceleration: field(at::QUICK_STOP_DECELERATION), ..ramp };
        let mode = at::MODE.i8(image);
        match self.state {
            State::OperationEnabled if self.controlword & HALT != 0 => self.motor.turn(0.0, ramp, CYCLE),
            State::OperationEnabled if mode == PROFILE_VELOCITY => {
                let target = f64::from(at::TARGET_VELOCITY.i32(image));
                self.motor.turn(target, ramp, CYCLE);
                self.is_reached = (self.motor.velocity - target).abs() < 1.0;
            }
            State::OperationEnabled => match self.set_point {
                Some(target) if self.motor.approach(target, ramp, CYCLE) => {
                    (self.set_point, self.is_reached) = (None, true);
                }
                Some(_) => (),
                None => self.motor.turn(0.0, ramp, CYCLE),
            },
            State::QuickStopActive | State::FaultReactionActive => self.motor.turn(0.0, quick, CYCLE),
            _ => self.motor.velocity = 0.0,
        }
        if self.motor.velocity.to_bits() << 1 == 0 {
            self.state = match self.state {
                State::FaultReactionActive => State::Fault,
                State::QuickStopActive if at::QUICK_STOP_OPTION.i16(image) < STAY_IN_QUICK_STOP - 1 => {
                    State::SwitchOnDisabled
                }
                state => state,
            };
        }
        self.show(image);
    }

    /// Writes statusword, mode, position and velocity.
    #[allow(clippy::cast_possible_truncation)] // A cast of f64 saturates.
    fn show(&self, image: &mut [u8]) {
        let mode = at::MODE.i8(image);
        let is_at_rest = self.motor.velocity.abs() < 1.0;
        let of_mode =
            if mode == PROFILE_VELOCITY { is_at_rest } else { self.controlword & NEW_SET_POINT != 0 };
        let is_reached = if self.controlword & HALT != 0 { is_at_rest } else { self.is_reached };
        let bit = |is_set: bool, bit: u16| if is_set { bit } else { 0 };
        let statusword = self.state.statusword()
            | bit(!self.is_local, REMOTE)
            | bit(is_reached, TARGET_REACHED)
            | bit(self.is_limited, INTERNAL_LIMIT)
            | bit(of_mode && self.state == State::OperationEnabled, OF_MODE);
        at::STATUSWORD.set_u16(image, statusword);
        at::MODE_DISPLAY.set_i8(image, mode);
        at::POSITION.set_i32(image, self.motor.position as i32);
        at::VELOCITY.set_i32(image, self.motor.velocity as i32);
    }
}

impl Application for Drive {
    const CONDITIONS: &'static [Condition] = &[Condition::new(OVERCURRENT)];

    fn initialise(&mut self, _: Reset, image: &mut [u8]) {
        self.show(image);
    }

    /// Decides on 6040h and 6060h, by SDO and by RPDO alike.
    fn write(&mut self, entry: &Entry, bytes: &[u8], _image: &mut [u8]) -> Result<(), Abort> {
        match (entry.index(), bytes) {
            (0x6040, _) if self.is_local => return Err(Abort::LocalControl),
            (0x6060, &[mode]) => {
                let mode = mode.cast_signed();
                if !matches!(mode, PROFILE_POSITION | PROFILE_VELOCITY) {
                    return Err(Abort::InvalidValue);
                }
                if self.state == State::OperationEnabled && self.motor.velocity.abs() >= 1.0 {
                    return Err(Abort::DeviceState);
                }
                self.is_reached = false;
            }
            _ => (),
        }
        Ok(())
    }

    fn written(&mut self, entry: &Entry, image: &mut [u8]) {
        if entry.index() == 0x6040 {
            self.control(image);
        }
    }

    /// All values of the RPDO are in the image: the controlword applies to the target beside it.
    fn received(&mut self, _rpdo: u16, image: &mut [u8]) {
        self.control(image);
    }

    /// The connection to the master is lost: 6007h decides.
    fn error(&mut self, class: ErrorClass, image: &mut [u8]) {
        if class != ErrorClass::COMMUNICATION || !self.state.has_torque() {
            return;
        }
        match at::ABORT_CONNECTION.i16(image) {
            NO_ACTION => (),
            DISABLE_VOLTAGE => self.state = State::SwitchOnDisabled,
            3 => self.state = State::QuickStopActive,
            _ => self.fail(COMMUNICATION, image),
        }
        self.show(image);
    }
}

/// The drive as a program: nothing is stored.
struct Program;

impl Product for Program {
    type Definition = canopen::definition!(Drive, ROWS);

    fn cycle(
        &mut self,
        device: &mut Device<Self::Definition>,
        bus: &mut Bus,
        lines: &Receiver<String>,
        now: Instant,
    ) -> Next {
        for line in lines.try_iter() {
            match line.split_once(' ') {
                Some(("overcurrent", value)) => {
                    let is_active = value == "1";
                    device.application_mut().has_overcurrent = is_active;
                    let _ = device.set_condition(0, is_active, now);
                    if is_active {
                        device.show(|drive, image| drive.fail(OVERCURRENT, image));
                    }
                }
                Some(("local", value)) => device.application_mut().is_local = value == "1",
                _ => eprintln!("what is {line}?"),
            }
        }
        device.publish(now, bus, Drive::cycle)
    }
}

fn main() -> io::Result<()> {
    command_line::main("Drive", ROWS, |node| (Program, Device::new(&DICTIONARY, node, Drive::default())))
}
