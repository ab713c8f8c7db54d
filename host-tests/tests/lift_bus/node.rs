//! A node in personality lift, and the readings of its sensors in the simulated world.

use std::cell::RefCell;
use std::rc::Rc;

use canopen::{Instant, NodeId};
use host_tests::bench::setup;
use host_tests::station::{Sensors, Station};
use node::{Personality, Setup};
use profiles::board::Inputs;

use crate::table::POSITION;
use crate::world::World;

/// The node.
pub(crate) type LiftNode = Station<Sight>;

/// The sensors of a node, which read the world.
pub(crate) struct Sight {
    node_id: u8,
    world: Rc<RefCell<World>>,
}

impl Sensors for Sight {
    fn read(&mut self, now: Instant) -> Inputs {
        let mut world = self.world.borrow_mut();
        if self.node_id == POSITION {
            let car = world.car;
            world.measured.push((now, car));
        }
        Inputs { analogue: world.pressure(), position: world.tape(), digital: [world.is_pressed, false] }
    }
}

/// The node with this node-ID.
pub(crate) fn lift_node(node_id: u8, world: &Rc<RefCell<World>>) -> LiftNode {
    let setup = Setup { personality: Personality::Lift, node_id: NodeId::new(node_id), ..setup() };
    Station::new(&setup, Sight { node_id, world: Rc::clone(world) })
}
