//! What the protocol asks of the firmware and what the firmware tells the protocol.

use canopen::lss::BitRate;

/// Something only the firmware can do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// NMT reset node: restart the chip; a simulated node makes a new `Protocol`, or calls `Protocol::start` again.
    ResetNode,
    /// NMT reset communication: drop what waits in the transmit queue, then call `Protocol::start`.
    ResetCommunication,
    /// The identifiers of interest have changed: read `process_ids` and `service_ids` again.
    Filters,
    /// Run the bus at this bit rate from now on, or detect it.
    BitRate(BitRate),
    /// 1F51h: restart into the bootloader.
    Bootloader,
    /// Something is to be stored: `Protocol::pack`, then `Parcel::deliver`, then `Protocol::finish`.
    Store,
}

/// What the CAN controller reports besides frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusEvent {
    /// A received frame was lost in the controller or in the receive queue.
    Overrun,
    /// An error counter reached 96.
    Warning,
    /// An error counter went above 127: error passive.
    Passive,
    /// The transmit error counter went above 255: off the bus.
    BusOff,
    /// Error active again, from passive or from bus-off.
    Recovered,
}
