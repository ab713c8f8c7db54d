//! Events that a test has the chip lose: what the program waits for then never comes.

/// One event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// A request for DMA: nothing is moved. The controller is 1 or 2.
    DmaRequest {
        /// 1 or 2.
        controller: usize,
        /// 0 to 7.
        stream: usize,
    },
    /// A byte that SPI2 has received: it is gone before DMA can fetch it.
    SpiByte,
    /// A compare match of TIM2, on channel 1 to 4: its flag stays down.
    Compare {
        /// 1 to 4.
        channel: u32,
    },
    /// The end of a transmission of CAN1: the frame was sent, its flag stays down.
    TransmitComplete,
    /// The moment at which CAN1 could have given up a frame: the transmission of the frame begins just before the abort request, so the
    /// end of the transmission decides.
    Abort,
    /// A store into the backup SRAM.
    BackupStore,
}

/// What is still to be lost.
#[derive(Clone, Debug, Default)]
pub(crate) struct Losses(Vec<Loss>);

impl Losses {
    pub(crate) fn add(&mut self, loss: Loss, times: usize) {
        self.0.extend(std::iter::repeat_n(loss, times));
    }

    /// Nothing is to be lost: the usual case, which is asked for at each event.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether this event, which happens now, is lost.
    pub(crate) fn take(&mut self, loss: Loss) -> bool {
        let place = self.0.iter().position(|next| *next == loss);
        place.map(|place| self.0.swap_remove(place)).is_some()
    }
}
