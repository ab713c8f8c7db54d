//! Events that a test makes the chip lose: the program then waits in vain for the event.

/// An event to lose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// A DMA request: nothing is moved.
    DmaRequest {
        /// The controller: 1 or 2.
        controller: usize,
        /// The stream: 0 to 7.
        stream: usize,
    },
    /// A byte received by SPI2, lost before DMA reads it.
    SpiByte,
    /// A compare match of TIM2: the flag is not set.
    Compare {
        /// The channel: 1 to 4.
        channel: u32,
    },
    /// The end of a transmission of CAN1: the frame is sent, but the flag is not set.
    TransmitComplete,
    /// An abort by CAN1 comes too late: the transmission of the frame begins just before the abort request, so the
    /// request is over only at the end of the transmission.
    Abort,
    /// The end of the frame on the bus of CAN1, for a controller that is to leave the bus: it stays on the bus until a
    /// reset, as with RX held dominant.
    LeaveBus,
    /// A frame of CAN1 in loop-back: it is sent and not received.
    LoopBack,
    /// A store into the backup SRAM.
    BackupStore,
}

/// The events still to be lost.
#[derive(Clone, Debug, Default)]
pub(crate) struct Losses(Vec<Loss>);

impl Losses {
    pub(crate) fn add(&mut self, loss: Loss, times: usize) {
        self.0.extend(std::iter::repeat_n(loss, times));
    }

    /// Whether no event is to be lost. This is the usual case and is checked at each event.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether this event, which happens now, is to be lost.
    pub(crate) fn take(&mut self, loss: Loss) -> bool {
        let place = self.0.iter().position(|next| *next == loss);
        place.map(|place| self.0.swap_remove(place)).is_some()
    }
}
