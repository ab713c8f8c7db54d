//! The work of the lift's installer over SDO: each node gets its virtual devices and their description; then both nodes
//! are saved and reset.

use profiles::lift::devices::Devices;

use crate::controller::{LAMP_OFF, LAMP_ON, LANDINGS, call};
use crate::table::{LOAD, POSITION};

/// A lift that can be installed.
pub(crate) trait Site {
    /// Writes an object of a node.
    fn write(&mut self, node: u8, index: u16, sub: u8, bytes: &[u8]);
    /// Sends an NMT command, and waits for its effect.
    fn nmt(&mut self, command: u8, node: u8);

    /// Describes the position unit at the tape in the shaft: 0.1 mm per mark, no index.
    fn describe_position_unit(&mut self) {
        self.write(POSITION, 0x2305, 0, &[Devices::POSITION.0]);
        self.write(POSITION, 0x2100, 1, &[6]);
        self.write(POSITION, 0x2101, 1, &100_000_u32.to_le_bytes());
        self.write(POSITION, 0x2105, 0, &[0]);
        self.write(POSITION, 0x63B8, 1, &20_100_i32.to_le_bytes());
        self.write(POSITION, 0x63B4, 1, &9_900_i32.to_le_bytes());
    }

    /// Presets the position of the car, which is at the lowest landing. The measurement must have taken the description
    /// before.
    fn preset(&mut self) {
        self.write(POSITION, 0x6382, 1, &LANDINGS[0].to_le_bytes());
    }

    /// Describes the node at the cylinder and the panel.
    fn describe_load_and_panel(&mut self) {
        let panel = Devices::INPUT_PANEL.0 | Devices::OUTPUT_PANEL.0;
        self.write(LOAD, 0x2305, 0, &[Devices::LOAD.0 | panel]);
        for (sub, value) in [(1, 2.0e5_f32), (2, 0.0), (3, 6.0e5), (4, 800.0)] {
            self.write(LOAD, 0x2311, sub, &value.to_le_bytes());
        }
        for (sub, kilograms) in [(1, 30_u16), (2, 300), (3, 600), (4, 660)] {
            self.write(LOAD, 0x6483, sub, &kilograms.to_le_bytes());
        }
        self.write(LOAD, 0x2320, 2, &call(4).to_le_bytes()[..6]);
        self.write(LOAD, 0x2321, 1, &LAMP_OFF.to_le_bytes()[..6]);
        self.write(LOAD, 0x2321, 2, &LAMP_ON.to_le_bytes()[..6]);
    }

    /// Saves the configuration, which must survive a reset.
    fn save(&mut self) {
        for node in [POSITION, LOAD] {
            self.write(node, 0x1010, 1, b"save");
            self.nmt(0x81, node);
        }
    }
}
