//! The deepest stack of the images under full load, compared with the bound derived from their code.

use callgraph::stack_bound;
use emulator::Estimate;
use sim::world::World;

use crate::support::images;
use crate::timing::busy_run;

/// The deepest stack since power-on is within the bound of one of these images, which have run one after the other.
pub(crate) fn assert_bound(world: &World, ran: &[&str]) {
    let measured = world.summary(1.0, 0).nodes[0].memory.stack;
    let bounds = ran.iter().map(|name| stack_bound(&images(), name).unwrap());
    let bound = bounds.map(|bound| bound.bytes()).max().unwrap_or(0);
    println!("{}: {measured} bytes of stack measured, {bound} possible", ran.join(" and "));
    assert!(measured > bound / 4, "something has run");
    assert!(measured <= bound, "the bound is none");
}

#[test]
fn the_tasks_stay_within_the_bound_of_their_stack() {
    assert_bound(&busy_run(Estimate::Modelled, |_| ()), &["bootloader", "firmware"]);
}
