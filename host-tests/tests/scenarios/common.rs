//! Nodes on a bus, with sensors that a scenario moves.

use canopen::sdo::Multiplexer;
use canopen::{Duration, Frame, Instant, NodeId};
use host_tests::bench::{raw, setup};
use host_tests::network::Network;
use host_tests::sdo::{Client, Failure};
use host_tests::station::{Sensors, Station};
use node::{BitRate, Personality, Setup};
use profiles::board::{Inputs, RawEncoder};

/// Sensors in motion: a shaft that turns, a pressure with noise, buttons that are pressed.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Motion {
    /// Encoder steps in a millisecond.
    pub(crate) speed: u64,
    /// Amplitude of the noise of the pressure, in Pa.
    pub(crate) noise: u64,
    /// Milliseconds between two changes of both buttons; 0 for buttons at rest.
    pub(crate) press: u64,
}

impl Sensors for Motion {
    fn read(&mut self, now: Instant) -> Inputs {
        let ms = now.0 / 1000;
        #[allow(clippy::cast_possible_truncation)] // The counter of the timer wraps.
        let position = RawEncoder { counter: (self.speed * ms) as u16, ..RawEncoder::default() };
        let noise = if self.noise == 0 { 0 } else { ms.wrapping_mul(0x9E37_79B9) % self.noise };
        #[allow(clippy::cast_precision_loss)] // Small.
        let analogue = raw(250_000.0 + noise as f64, 298.15);
        let is_pressed = self.press > 0 && (ms / self.press) % 2 == 1;
        Inputs { analogue, position, digital: [is_pressed; 2] }
    }
}

/// A bus of nodes with sensors in motion.
pub(crate) type Bus = Network<Station<Motion>>;

/// A bus with one node that has booted, with node-ID 1.
pub(crate) fn bus(kbit: u16, personality: Personality, motion: Motion) -> Bus {
    let bit_rate = BitRate::from_kbit(kbit).expect("a bit rate");
    let setup = Setup { personality, node_id: NodeId::new(1), bit_rate, ..setup() };
    let mut bus = Network::at(kbit, [Station::new(&setup, motion)]);
    bus.start();
    bus.run(Duration::from_millis(100));
    bus
}

/// A download that the node accepts.
pub(crate) fn write(bus: &mut Bus, node: u8, index: u16, sub: u8, bytes: &[u8]) {
    assert_eq!(try_write(bus, node, index, sub, bytes), Ok(()), "{index:04X}h:{sub}");
}

/// A download with any result.
pub(crate) fn try_write(bus: &mut Bus, node: u8, index: u16, sub: u8, bytes: &[u8]) -> Result<(), Failure> {
    Client::new(&mut bus.server(node)).write(Multiplexer { index, sub }, bytes)
}

/// An NMT command to all nodes.
pub(crate) fn nmt(bus: &mut Bus, command: u8) {
    bus.send(&Frame::new(0, &[command, 0]).expect("a frame"));
}

/// Lets time pass while frames with this identifier take the bus.
pub(crate) fn run_with_load(bus: &mut Bus, milliseconds: u64, id: u16, frames: u32) {
    for _ in 0..milliseconds {
        for _ in 0..frames {
            bus.send(&Frame::new(id, &[0x55; 8]).expect("a frame"));
        }
        bus.run(Duration::from_millis(1));
    }
}
