//! Chips on a bus, driven only by register accesses.

use canbus::{Bus, Controller, Event, Frame, HostNode, Id, StandardId, Time};
use chip::can::DualCan;
use proptest::test_runner::{Config, RngSeed};

pub(crate) const MCR: u32 = 0x00;
pub(crate) const MSR: u32 = 0x04;
pub(crate) const TSR: u32 = 0x08;
pub(crate) const RF0R: u32 = 0x0C;
pub(crate) const RF1R: u32 = 0x10;
/// CAN_RFxR: releases the output mailbox.
pub(crate) const RFOM: u32 = 1 << 5;
pub(crate) const IER: u32 = 0x14;
pub(crate) const ESR: u32 = 0x18;
pub(crate) const BTR: u32 = 0x1C;
pub(crate) const FMR: u32 = 0x200;
pub(crate) const FM1R: u32 = 0x204;
pub(crate) const FS1R: u32 = 0x20C;
pub(crate) const FFA1R: u32 = 0x214;
pub(crate) const FA1R: u32 = 0x21C;
/// The first register of each transmit mailbox.
pub(crate) const TX: [u32; 3] = [0x180, 0x190, 0x1A0];
pub(crate) const RX: [u32; 2] = [0x1B0, 0x1C0];

pub(crate) const INRQ: u32 = 1;
pub(crate) const SLEEP: u32 = 1 << 1;
pub(crate) const TXFP: u32 = 1 << 2;
pub(crate) const RFLM: u32 = 1 << 3;
pub(crate) const NART: u32 = 1 << 4;
pub(crate) const AWUM: u32 = 1 << 5;
pub(crate) const ABOM: u32 = 1 << 6;
pub(crate) const LBKM: u32 = 1 << 30;
pub(crate) const SILM: u32 = 1 << 31;
pub(crate) const INAK: u32 = 1;
pub(crate) const SLAK: u32 = 1 << 1;

/// 36 MHz / (1 + 14 + 3) / 2 = 1 Mbit/s, sample point at 83 %.
pub(crate) const APB1: u64 = 36_000_000;
pub(crate) const ONE_MEGABIT: u32 = 0x002D_0001;
pub(crate) const BIT: Time = Time(Time::PER_MICRO);

/// The bank register `half` of a filter bank.
pub(crate) fn bank(n: u32, half: u32) -> u32 {
    0x240 + 8 * n + 4 * half
}

pub(crate) fn standard(id: u16, data: &[u8]) -> Frame {
    Frame::data(StandardId::new(id).unwrap(), data).unwrap()
}

/// Property tests run the same cases each time.
pub(crate) fn fixed() -> Config {
    Config { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() }
}

/// Some chips, some host nodes, and the bus between them.
pub(crate) struct Rig {
    pub(crate) chips: Vec<DualCan>,
    pub(crate) hosts: Vec<HostNode>,
    pub(crate) bus: Bus,
    pub(crate) now: Time,
    pub(crate) events: Vec<Event>,
}

impl Rig {
    /// Chips after reset, not on the bus yet. Only their CAN1 is wired.
    pub(crate) fn new(chips: usize, hosts: usize) -> Rig {
        Rig {
            chips: (0..chips).map(|_| DualCan::new(APB1)).collect(),
            hosts: (0..hosts).map(|_| HostNode::new(BIT)).collect(),
            bus: Bus::new(),
            now: Time::ZERO,
            events: Vec::new(),
        }
    }

    /// Chips on the bus at 1 Mbit/s whose FIFO 0 takes every frame.
    pub(crate) fn started(chips: usize, hosts: usize, options: u32) -> Rig {
        let mut rig = Rig::new(chips, hosts);
        for chip in 0..chips {
            rig.initialise(chip, ONE_MEGABIT);
            rig.accept_all(chip);
            rig.write(chip, MCR, options);
        }
        rig.run(BIT * 11);
        rig
    }

    pub(crate) fn initialise(&mut self, chip: usize, timing: u32) {
        self.write(chip, MCR, INRQ);
        assert_eq!(self.read(chip, MSR) & (INAK | SLAK), INAK);
        self.write(chip, BTR, timing);
    }

    pub(crate) fn accept_all(&mut self, chip: usize) {
        self.write(chip, FS1R, 1);
        self.write(chip, FA1R, 1);
        self.write(chip, FMR, 0x0E00);
    }

    pub(crate) fn read(&mut self, chip: usize, offset: u32) -> u32 {
        self.chips[chip].read(offset, self.now).expect("a register")
    }

    pub(crate) fn write(&mut self, chip: usize, offset: u32, value: u32) {
        self.chips[chip].write(offset, value, self.now).expect("a register");
    }

    /// Puts a frame in a mailbox and requests its transmission.
    pub(crate) fn request(&mut self, chip: usize, mailbox: usize, frame: &Frame) {
        let Id::Standard(id) = frame.id() else { panic!("a base frame") };
        let word = |at: usize| (0..4).rev().fold(0, |w, n| w << 8 | u32::from(byte(frame, at + n)));
        self.write(chip, TX[mailbox] + 4, frame.bytes().len() as u32);
        self.write(chip, TX[mailbox] + 8, word(0));
        self.write(chip, TX[mailbox] + 12, word(4));
        self.write(chip, TX[mailbox], u32::from(id.as_raw()) << 21 | 1);
    }

    /// Takes the frame in an output mailbox: identifier and data.
    pub(crate) fn take(&mut self, chip: usize, fifo: usize) -> Option<(u32, Vec<u8>)> {
        let status = [RF0R, RF1R][fifo];
        if self.read(chip, status) & 3 == 0 {
            return None;
        }
        let [id, control, low, high] = [0, 4, 8, 12].map(|offset| self.read(chip, RX[fifo] + offset));
        self.write(chip, status, RFOM);
        while self.read(chip, status) & RFOM != 0 {
            self.run(Time(1));
        }
        let data = u64::from(high) << 32 | u64::from(low);
        Some((id >> 21, data.to_le_bytes()[..(control & 15) as usize].to_vec()))
    }

    /// Lets `span` pass.
    pub(crate) fn run(&mut self, span: Time) {
        let until = self.now + span;
        loop {
            let next = self.step().min(until);
            if next <= self.now && next == until {
                return;
            }
            self.now = next;
        }
    }

    /// Brings the bus and the chips up to the current instant and returns the instant of the next event.
    fn step(&mut self) -> Time {
        let now = self.now;
        self.chips.iter_mut().for_each(|chip| chip.advance(now));
        let chips = self.chips.iter_mut().map(|chip| &mut chip.can1 as &mut dyn Controller);
        let hosts = self.hosts.iter_mut().map(|host| host as &mut dyn Controller);
        let mut participants: Vec<_> = chips.chain(hosts).collect();
        let next = self.bus.step(&mut participants, now, &mut |event| self.events.push(event));
        self.chips.iter().map(DualCan::deadline).fold(next, Time::min)
    }
}

fn byte(frame: &Frame, n: usize) -> u8 {
    frame.bytes().get(n).copied().unwrap_or(0)
}
