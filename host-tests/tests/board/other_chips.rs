//! The images for the other chips, each on a board with that chip: clocks, sectors, missing peripherals.

use programmer::sign::product;
use sim::world::World;

use crate::scenario::{Node, observe};
use crate::support::{SECOND, images, world_of};
use crate::update::Bench;

const CHIPS: [&str; 2] = ["stm32f405", "stm32f407"];

fn world(chip: &str, flags: &str) -> World {
    world_of(&format!("{chip}/bootloader"), &format!("--chip {chip} {flags}"))
}

#[test]
#[ignore = "the images come with `cargo xtask test --thorough`"]
fn a_node_measures_speaks_and_saves_on_another_chip() {
    for chip in CHIPS {
        for node in [Node::Saving, Node::Interleaved, Node::Encoder, Node::Absolute] {
            assert_eq!(observe(world(chip, node.flags()), node, |_| (), |_| ()), [""; 0], "{chip}: {node:?}");
        }
    }
}

#[test]
#[ignore = "the images come with `cargo xtask test --thorough`"]
fn a_node_is_updated_on_another_chip() {
    for chip in CHIPS {
        let firmware = std::fs::read(images().join(chip).join("firmware")).unwrap();
        let mut bench = Bench::with(world(chip, "--bitrate 1000"), 1_000_000, 1);
        bench.run(SECOND);
        bench.update(&product::development_image(&firmware).unwrap());
    }
}

/// The image switches HSE on for the clock of a NUCLEO, where the other board has a crystal. The thermometer of the other
/// chip has another channel of the ADC, so the image measures the battery instead: the temperature is on its rail.
#[test]
#[ignore = "the images come with `cargo xtask test --thorough`"]
fn an_image_for_one_chip_is_seen_on_another() {
    let flags = format!("--chip stm32f405 {}", Node::Pressure.flags());
    let said = observe(world_of("bootloader", &flags), Node::Pressure, |_| (), |_| ());
    let [oscillator, emergency] = said.as_slice() else { panic!("{said:?}") };
    assert!(
        oscillator.contains("HSE is switched on for a clock, but the board has a crystal"),
        "{oscillator}"
    );
    assert_eq!(emergency, "EMCY 8001h");
}
