//! Builds a world from the command line.

use std::ops::Range;
use std::rc::Rc;

use anyhow::{Context, Result, ensure};
use bsp::boards::{Button, Light, Pull};
use chip::{Board as Wiring, ButtonPin, FrontEnd, Stm32f4, Variant};
use storage::{DeviceRecord, Memory, Pages};

use crate::board::{Board, Contents, Images};
use crate::cli::{Node, Options, UNCONFIGURED};
use crate::flash;
use crate::image::Image;
use crate::oscillator::Lsi;
use crate::stimuli::Targeted;
use crate::world::World;

/// The two pages of the parameter store: sectors 2 and 3 (memory.x).
const PAGES: Pages = Pages::new(0x8000, 0x4000);
const PARAMETERS: Range<usize> = 0x8000..0x1_0000;

/// A bit rate in bit/s from one in kbit/s.
pub fn bits_per_second(kbit: u16) -> u32 {
    u32::from(kbit) * 1000
}

/// The boards with their images, parameters and stimuli, before power-on.
pub fn world(options: &Options) -> Result<World> {
    let firmware = Image::load(&options.firmware)?;
    let bootloader = options.bootloader.as_deref().map(Image::load).transpose()?;
    let header = bootloader.is_some().then(|| programmer::sign::product::development_image(&firmware.elf));
    let header = header.transpose()?.map(|image| image.header.encode());
    let images = Rc::new(Images { firmware, header, bootloader });
    let boards = options.nodes.iter().map(|node| board(node, options, &images));
    let boards = boards.collect::<Result<Vec<Board>>>()?;
    let mut world = World::new(boards, options.bitrate, options.load);
    if let Some(threads) = options.threads {
        world.set_threads(threads);
    }
    let boards = 0..options.nodes.len();
    boards.clone().try_for_each(|board| world.machine(board).set_estimate(options.cycles))?;
    if let Some(seed) = options.interleave {
        // Each board gets another seed, so that interrupts do not come at the same instructions on all boards.
        boards
            .into_iter()
            .try_for_each(|board| world.machine(board).interleave(Some(seed + board as u64)))?;
    }
    ensure!(all_are_for_a_node(&options.oscillator, options), "an oscillator is for nobody");
    ensure!(all_are_for_a_node(&options.lsi, options), "an LSI is for nobody");
    for stimulus in options.stimuli.all() {
        world.apply(stimulus).context("a stimulus")?;
    }
    Ok(world)
}

fn all_are_for_a_node<T>(values: &[Targeted<T>], options: &Options) -> bool {
    values.iter().all(|value| options.nodes.iter().any(|node| value.is_for(node.id)))
}

fn board(node: &Node, options: &Options, images: &Rc<Images>) -> Result<Board> {
    let twice = options.nodes.iter().filter(|other| other.id == node.id).count() > 1;
    ensure!(!twice, "node {} is given more than once", node.id);
    let kept =
        options.flash.as_deref().map(|dir| flash::load(dir, node.id, options.chip)).transpose()?.flatten();
    let writes_images = kept.is_none() || options.reflash;
    let mut contents = kept.unwrap_or_else(|| vec![0xFF; options.chip.flash_size() as usize]);
    provision(&mut contents, node, options.bitrate)?;
    let backup = options.flash.as_deref().map(|dir| flash::load_backup(dir, node.id)).transpose()?.flatten();
    let contents = Contents { flash: &contents, backup: backup.as_deref(), writes_images };
    let chip = chip(node, options);
    Board::new(node.id, node.personality, chip, contents, Rc::clone(images))
}

/// The chip of a board, with its clock and its own unique identifier, from which the firmware derives the serial
/// number.
fn chip(node: &Node, options: &Options) -> Stm32f4 {
    let oscillator = own(&options.oscillator, node).unwrap_or_default();
    let board = image_board(options.chip);
    let buttons = board.buttons.map(|Button { pin, pull, pressed }| {
        // Without a resistor of the chip, the board has one.
        let released = (pull == Pull::None).then_some(!pressed);
        ButtonPin::new(pin.port, pin.number.into(), pressed, released)
    });
    let Light { pin: standby, on } = board.standby;
    let mut wiring = Wiring {
        hse: oscillator.hertz(board.oscillator.hertz),
        hse_is_clock: board.oscillator.is_bypassed,
        lsi: own(&options.lsi, node).map_or(Wiring::default().lsi, Lsi::hertz),
        buttons,
        front_end: front_end(&board.front_end),
        standby: (standby.port, standby.number.into(), on),
        ..Wiring::default()
    };
    wiring.unique_id[0] = node.id.into();
    Stm32f4::new(options.chip, wiring)
}

/// The board that the images for a chip are built for: the same description as theirs.
fn image_board(chip: Variant) -> bsp::boards::Board {
    let found = bsp::boards::ALL.into_iter().find(|(_, board)| board.chip.name == chip.name());
    found.map_or(*bsp::boards::ALL[0].1, |(_, board)| *board)
}

/// The front end as the emulated board takes it: volts and ratios.
fn front_end(board: &bsp::boards::FrontEnd) -> FrontEnd {
    let bsp::boards::FrontEnd { supply, divider, transducer, thermistor } = *board;
    let permille = |value: u32| f64::from(value) / 1000.0;
    FrontEnd {
        supply: permille(supply),
        divider: f64::from(divider.lower) / f64::from(divider.upper + divider.lower),
        output: (permille(transducer.zero), permille(transducer.full)),
        full_scale: transducer.range.into(),
        thermistor: thermistor.ohms.into(),
        beta: thermistor.beta.into(),
        series: thermistor.series.into(),
        divided: f64::from(divider.upper) * f64::from(divider.lower)
            / f64::from(divider.upper + divider.lower),
    }
}

/// The last value on the command line that applies to the board.
fn own<T: Copy>(values: &[Targeted<T>], node: &Node) -> Option<T> {
    values.iter().rfind(|value| value.is_for(node.id)).map(|value| value.what)
}

/// Writes the device record of a new board: one whose parameter pages are erased. The pages of another board stay as they
/// are, damaged or not: the firmware reports the damage.
fn provision(flash: &mut [u8], node: &Node, bit_rate: u16) -> Result<()> {
    let pages = flash.get(PARAMETERS).context("no parameter pages")?;
    if pages.iter().any(|byte| *byte != 0xFF) {
        return Ok(());
    }
    let node_id = if node.id < UNCONFIGURED { node.id } else { DeviceRecord::UNCONFIGURED };
    let bit_rate = if node.auto { DeviceRecord::AUTO } else { bit_rate };
    let record =
        DeviceRecord::new(node_id, bit_rate, node.personality.number()).context("no such device record")?;
    let done = storage::provision(Memory(flash), PAGES, &record);
    done.map_err(|error| anyhow::anyhow!("the parameter store takes no device record: {error:?}"))
}
