//! A node on a bus, as the tests of the matrix use it.

use canopen::{Duration, Frame};

/// A bus with one node, in process or on an emulated board.
pub(crate) trait Bus {
    /// Lets time pass.
    fn run(&mut self, span: Duration);
    /// Sends a frame from the master.
    fn send(&mut self, id: u16, data: &[u8]);
    /// Takes the oldest frame with this identifier.
    fn hear(&mut self, id: u16) -> Option<Frame>;
    /// The bit rate in kbit/s.
    fn kbit(&self) -> u16;
}

/// A node on a bus, with the steps of an SDO client.
pub(crate) struct Node<'b, B> {
    pub(crate) bus: &'b mut B,
    pub(crate) id: u8,
}

impl<B: Bus> Node<'_, B> {
    /// Longest wait for a frame: an answer, or a node that restarts.
    const PATIENCE: u32 = 3000;

    /// Waits for a frame with this identifier.
    pub(crate) fn await_id(&mut self, id: u16) -> Frame {
        for _ in 0..Self::PATIENCE {
            if let Some(frame) = self.bus.hear(id) {
                return frame;
            }
            self.bus.run(Duration::from_millis(1));
        }
        panic!("no frame with {id:03X}h");
    }

    /// Drops the frames with this identifier so far.
    pub(crate) fn forget(&mut self, id: u16) {
        while self.bus.hear(id).is_some() {}
    }

    fn ask(&mut self, request: [u8; 8]) -> [u8; 8] {
        let id = u16::from(self.id);
        self.forget(0x580 + id);
        self.bus.send(0x600 + id, &request);
        self.await_id(0x580 + id).data().try_into().expect("eight bytes")
    }

    /// Reads a value of at most four bytes.
    pub(crate) fn read(&mut self, index: u16, sub: u8) -> u32 {
        let [low, high] = index.to_le_bytes();
        let [command, _, _, _, value @ ..] = self.ask([0x40, low, high, sub, 0, 0, 0, 0]);
        assert_eq!(command & 0xE3, 0x43, "{index:04X}h:{sub}");
        u32::from_le_bytes(value) & u32::MAX >> (8 * (command >> 2 & 3))
    }

    /// Writes a value of `size` bytes.
    pub(crate) fn write(&mut self, index: u16, sub: u8, size: u8, value: u32) {
        let ([low, high], [a, b, c, d]) = (index.to_le_bytes(), value.to_le_bytes());
        let answer = self.ask([0x23 | (4 - size) << 2, low, high, sub, a, b, c, d]);
        assert_eq!(answer[0], 0x60, "{index:04X}h:{sub}: {answer:02X?}");
    }

    /// An NMT command to the node.
    pub(crate) fn nmt(&mut self, command: u8) {
        self.bus.send(0, &[command, self.id]);
        self.bus.run(Duration::from_millis(20));
    }

    /// Restarts the node by an NMT command and waits for its boot-up message.
    pub(crate) fn restart(&mut self, command: u8) {
        let id = 0x700 + u16::from(self.id);
        self.forget(id);
        self.bus.send(0, &[command, self.id]);
        while self.await_id(id).data() != [0] {}
        // The node may be busy after its start.
        self.bus.run(Duration::from_millis(50));
    }

    /// The state in the next heartbeat.
    pub(crate) fn state(&mut self) -> u8 {
        let id = 0x700 + u16::from(self.id);
        // A heartbeat with the state before may be on its way.
        self.bus.run(Duration::from_millis(20));
        self.forget(id);
        self.await_id(id).data()[0]
    }

    /// An LSS request.
    pub(crate) fn lss(&mut self, request: &canopen::lss::Request) {
        self.bus.send(0x7E5, &request.encode());
        self.bus.run(Duration::from_millis(60));
    }
}
