//! One emulated board: the machine that runs the images, its flash, its log, and its counters.

use std::rc::Rc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use canbus::{Controller, Time};
use chip::plant::Signal;
use chip::{FLASH_BASE, Stm32f4};
use emulator::{Incident, Machine, Model, Stop};
use update::HEADER_LEN;

use crate::bad_reads::BadReads;
use crate::figures;
use crate::image::Image;
use crate::log::{Line, Log, Ram};
use crate::personality::Personality;
use crate::status::NodeStatus;
use crate::stimuli::{BoardStimuli, Inputs, Stimulus};
use crate::summary::NodeSummary;
use crate::traffic::Heard;

/// The address of the application's header (memory.x).
const HEADER_ADDRESS: u32 = 0x0802_0000;
/// Start of RAM.
const RAM: u32 = 0x2000_0000;

/// The ELF files that every board runs.
pub struct Images {
    /// The application.
    pub(crate) firmware: Image,
    /// The application's header, signed with the development key.
    pub(crate) header: Option<[u8; HEADER_LEN]>,
    /// The bootloader, if any.
    pub(crate) bootloader: Option<Image>,
}

/// The memory contents that a board has kept without power.
#[derive(Clone, Copy)]
pub(crate) struct Contents<'a> {
    /// The flash array.
    pub(crate) flash: &'a [u8],
    /// The backup SRAM; `None` when no battery has kept its content.
    pub(crate) backup: Option<&'a [u8]>,
    /// Whether the images are written over the flash, as a debug probe does; otherwise the flash stays unchanged.
    pub(crate) writes_images: bool,
}

/// The programs that a board runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Programs {
    /// The images, which were written into the flash.
    Written,
    /// The images, which the flash has kept.
    Kept,
    /// Other programs, which the flash has kept. Their log cannot be read.
    Others,
}

/// How far all boards run next.
#[derive(Clone, Copy)]
pub(crate) struct Turn {
    /// The end of the turn.
    pub(crate) limit: Time,
    /// A frame is on the wire: a request can wait for its end.
    pub(crate) bus_is_busy: bool,
    /// The host's time is measured.
    pub(crate) is_measured: bool,
}

/// One emulated board.
pub struct Board {
    id: u8,
    personality: Personality,
    machine: Machine<Stm32f4>,
    images: Rc<Images>,
    firmware: emulator::Image,
    bootloader_flash: u32,
    programs: Programs,
    log: Log,
    /// The address at which the core has locked up; a watchdog resets it.
    locked_up: Option<u32>,
    /// Whether the supply was above the level of the chip's reset.
    is_supplied: bool,
    bad_reads: BadReads,
    /// The host's time for this board, if measured.
    host: Duration,
}

impl Board {
    /// A board with these memory contents, switched on.
    ///
    /// # Errors
    /// When an image does not fit the chip.
    pub(crate) fn new(
        id: u8,
        personality: Personality,
        mut chip: Stm32f4,
        contents: Contents,
        images: Rc<Images>,
    ) -> Result<Board> {
        contents.backup.into_iter().for_each(|backup| chip.set_kept_by_battery(backup));
        let mut machine = Machine::new(Model::stm32f4(contents.flash.len() as u32), chip)?;
        machine.set_flash(contents.flash)?;
        let (firmware, bootloader) = images.parsed(&machine)?;
        let programs = if contents.writes_images {
            images.write(&mut machine)?
        } else if bootloader
            .iter()
            .chain([&firmware])
            .all(|image| image.is_in(machine.model(), contents.flash))
        {
            Programs::Kept
        } else {
            Programs::Others
        };
        let bootloader_flash = bootloader.map_or(0, |bootloader| bootloader.flash_size);
        machine.set_power_up(id.into());
        machine.power_on(Time::ZERO);
        Ok(Board {
            id,
            personality,
            machine,
            images,
            firmware,
            bootloader_flash,
            programs,
            log: Log::default(),
            locked_up: None,
            is_supplied: true,
            bad_reads: BadReads::default(),
            host: Duration::ZERO,
        })
    }

    /// The node-ID from the command line.
    pub fn id(&self) -> u8 {
        self.id
    }

    /// The personality from the command line.
    pub fn personality(&self) -> Personality {
        self.personality
    }

    /// The programs that the board runs.
    pub fn programs(&self) -> Programs {
        self.programs
    }

    /// Number of changes of the flash.
    pub(crate) fn flash_changes(&self) -> u64 {
        self.machine.flash_changes()
    }

    /// The earliest instant at which the board can request a frame, if the bus changes nothing before.
    pub(crate) fn next_event(&self) -> Time {
        self.machine.next_event().min(self.next_look())
    }

    /// Runs to the end of a turn, or to an earlier request of a frame on an idle bus; returns the instant reached.
    pub(crate) fn run(&mut self, turn: Turn) -> Time {
        let start = turn.is_measured.then(Instant::now);
        let limit = self.follow_supply(turn.limit);
        let reached = loop {
            let stop = self.machine.run_until(limit);
            self.locked_up = if let Stop::Lockup { pc } = stop { Some(pc) } else { None };
            match stop {
                Stop::Poked if turn.bus_is_busy => {}
                Stop::Poked => break limit.min(self.machine.now()),
                _ => break limit,
            }
        };
        self.host += start.map_or(Duration::ZERO, |start| start.elapsed());
        reached
    }

    /// Switches the chip on or off where the supply crosses the level of its reset. Returns the instant of the next look
    /// at a supply that changes, or `limit`.
    fn follow_supply(&mut self, limit: Time) -> Time {
        let (now, chip) = (self.machine.now(), self.machine.peripherals());
        let is_supplied = chip.is_supplied(now, self.is_supplied);
        let is_too_slow = is_supplied && chip.reads_flash_too_fast(now);
        self.bad_reads.step(&mut self.machine, is_too_slow);
        if is_supplied != self.is_supplied {
            self.is_supplied = is_supplied;
            if is_supplied { self.machine.power_on(now) } else { self.machine.power_off() }
        }
        limit.min(self.next_look())
    }

    /// The next look at the supply.
    fn next_look(&self) -> Time {
        const LOOK: Time = Time::from_micros(100);
        let (now, chip) = (self.machine.now(), self.machine.peripherals());
        let is_too_slow = self.is_supplied && chip.reads_flash_too_fast(now);
        let is_steady = matches!(chip.plant().supply_signal(), Signal::Constant(_)) && !is_too_slow;
        if is_steady { Time::NEVER } else { now + LOOK }
    }

    /// Core, memory and chip, for a change from outside.
    pub(crate) fn machine(&mut self) -> &mut Machine<Stm32f4> {
        self.machine.stir();
        &mut self.machine
    }

    /// The CAN controller.
    pub(crate) fn controller(&mut self) -> &mut dyn Controller {
        self.machine.peripherals_mut().can1_mut()
    }

    pub(crate) fn apply(&mut self, stimulus: &Stimulus, now: Time) {
        // The board may have run a few instructions further, and the chip's time cannot go back.
        let now = now.max(self.machine.now());
        stimulus.act_on(self.machine().peripherals_mut(), now);
    }

    /// The current stimuli of the sensors.
    pub(crate) fn stimuli(&self, node_id: u8) -> BoardStimuli {
        let (chip, now) = (self.machine.peripherals(), self.machine.now());
        BoardStimuli {
            board: self.id,
            node: node_id,
            personality: self.personality,
            inputs: Inputs::of(chip, now),
        }
    }

    /// Reads the lines that the firmware has logged since the last call.
    pub(crate) fn read_log(&mut self, into: &mut Vec<Line>) {
        let (at, node) = (self.machine.now(), self.id);
        let (Some(control_block), Some(table)) = (self.firmware.rtt, &self.images.firmware.log) else {
            return;
        };
        if self.programs == Programs::Others {
            return;
        }
        self.log.poll(table, &mut self.machine, control_block, &mut |level, text| {
            into.push(Line { at, node, level, text });
        });
    }

    /// The flash array.
    pub fn flash(&self) -> Vec<u8> {
        self.machine.flash()
    }

    /// The content of the backup SRAM that the battery would keep if the board were switched off now.
    pub fn backup(&self) -> Option<Vec<u8>> {
        self.machine.peripherals().kept_by_battery(self.machine.now())
    }

    /// Rules of the chip that the board's program has broken.
    pub(crate) fn broken_rules(&self) -> Vec<String> {
        let images = [Some(&self.images.firmware), self.images.bootloader.as_ref()];
        figures::broken_rules(&self.machine, |pc| {
            // The bootloader is located below the application, and also runs from RAM.
            let ours =
                if (FLASH_BASE..HEADER_ADDRESS).contains(&pc) || pc >= RAM { images[1] } else { images[0] };
            ours.or(images[0])?.place(pc)
        })
    }

    /// Number of wrong reads of the flash, with a supply that is too low for the clock.
    pub(crate) fn bad_reads(&self) -> u64 {
        self.bad_reads.count()
    }

    /// How often the board was switched on.
    pub(crate) fn power_ons(&self) -> u64 {
        self.machine.power_ons()
    }

    /// Whether the board is switched on.
    pub(crate) fn is_powered(&self) -> bool {
        self.machine.is_powered()
    }

    /// The incidents since power-on.
    pub(crate) fn incidents(&self) -> &[(Time, Incident)] {
        self.machine.incidents()
    }

    /// Whether the board's program has broken a rule of the chip.
    pub(crate) fn has_broken_rules(&self) -> bool {
        self.machine.incidents().iter().any(|(_, incident)| matches!(incident, Incident::Breach { .. }))
    }

    pub(crate) fn status(&self, node_id: u8, heard: Heard) -> NodeStatus {
        let (now, plant) = (self.machine.now(), self.machine.peripherals().plant());
        NodeStatus {
            id: self.id,
            node_id,
            personality: self.personality,
            heard,
            pressure: plant.pressure(now),
            temperature: plant.temperature(now),
            position: plant.revolutions(now),
            awake: now.since(self.machine.stats().asleep),
        }
    }

    pub(crate) fn summary(&self, heard: Heard) -> NodeSummary {
        let locked_up = self.locked_up.map(|pc| format!("the core has locked up at {pc:#010x}"));
        NodeSummary {
            id: self.id,
            personality: self.personality,
            heard,
            host_seconds: (!self.host.is_zero()).then_some(self.host.as_secs_f64()),
            sampling: figures::sampling(&self.machine),
            receiving: figures::receiving(&self.machine),
            cpu: figures::cpu(&self.machine),
            memory: figures::memory(
                &self.machine,
                &self.images.firmware,
                &self.firmware,
                self.bootloader_flash,
            ),
            broken_rules: self.broken_rules(),
            incidents: figures::incidents(&self.machine).chain(locked_up).collect(),
            unmodelled: figures::unmodelled(&self.machine),
        }
    }
}

impl Images {
    /// Firmware and bootloader, parsed for the chip.
    fn parsed(&self, machine: &Machine<Stm32f4>) -> Result<(emulator::Image, Option<emulator::Image>)> {
        let parse = |image: &Image| {
            machine
                .parse_elf(&image.elf)
                .with_context(|| format!("{} is not an image for the board", image.path))
        };
        Ok((parse(&self.firmware)?, self.bootloader.as_ref().map(parse).transpose()?))
    }

    fn write(&self, machine: &mut Machine<Stm32f4>) -> Result<Programs> {
        for image in self.bootloader.iter().chain([&self.firmware]) {
            machine.load_elf(&image.elf)?;
        }
        if let Some(header) = &self.header {
            machine.write(HEADER_ADDRESS, header).map_err(|_| anyhow::anyhow!("no flash for a header"))?;
        }
        Ok(Programs::Written)
    }
}

impl Ram for Machine<Stm32f4> {
    fn read(&self, address: u32, bytes: &mut [u8]) -> Option<()> {
        Machine::read(self, address, bytes).ok()
    }

    fn write(&mut self, address: u32, bytes: &[u8]) -> Option<()> {
        Machine::write(self, address, bytes).ok()
    }
}
