//! Memory budget of the application. The longest image has 127 KiB of code: the remaining space is a reserve for growth
//! in the field.

use callgraph::budget::{Budget, Compiler};

use crate::support::{SECOND, images, world};

const KIB: u64 = 1024;
const FLASH: Budget = Budget { what: "application, bytes of flash", limit: 124 * KIB, width: 10 };
/// RAM of the variables; the stack has 24 KiB of its own.
const RAM: Budget = Budget { what: "application, bytes of RAM", limit: 28 * KIB, width: 5 };

#[test]
fn the_application_keeps_to_its_budget() {
    let mut world = world("--bitrate 1000");
    world.run_until(SECOND);
    let memory = world.summary(1.0, 0).nodes[0].memory;
    let compiler = Compiler::of(&images().join("firmware")).unwrap();
    println!("{}", FLASH.check(memory.flash.into(), &compiler).unwrap());
    println!("{}, and {} of stack", RAM.check(memory.ram.into(), &compiler).unwrap(), memory.stack);
}
