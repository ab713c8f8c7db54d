//! The parts of a device: its application, the room for its objects, and its services.

use super::Application;
use super::inner::Inner;
use crate::array::Array;
use crate::dictionary::Services;
use crate::heartbeat::Monitored;
use crate::pdo::{Rpdo, Tpdo, Watched};
use crate::sdo::Channel;
use core::marker::PhantomData;

/// The definition of a [`Device`](super::Device): [`device!`](crate::device!) and
/// [`service_device!`](crate::service_device!) make one from the rows of a table.
///
/// The compiler removes the code of every service that a definition lacks.
pub trait Definition: Sized {
    /// The application code of the product.
    type Application: Application;
    /// The memory of all values.
    type Image: Array<u8>;
    #[doc(hidden)]
    type Tpdos: Array<Tpdo>;
    #[doc(hidden)]
    type Rpdos: Array<Rpdo>;
    #[doc(hidden)]
    type Heartbeats: Array<Monitored>;
    #[doc(hidden)]
    type Scanned: Array<Watched>;
    #[doc(hidden)]
    type Servers: Array<Channel<Inner<Self>>>;
    /// The services of the device.
    const SERVICES: Services;
}

/// The definition that follows from rows, written by the macros only.
#[doc(hidden)]
#[derive(Debug)]
pub struct Rows<
    A,
    const IMAGE: usize,
    const TPDOS: usize,
    const RPDOS: usize,
    const HEARTBEATS: usize,
    const SCANNED: usize,
    const SERVERS: usize,
    const SERVICES: u32,
>(PhantomData<A>);

impl<
    A: Application,
    const IMAGE: usize,
    const TPDOS: usize,
    const RPDOS: usize,
    const HEARTBEATS: usize,
    const SCANNED: usize,
    const SERVERS: usize,
    const SERVICES: u32,
> Definition for Rows<A, IMAGE, TPDOS, RPDOS, HEARTBEATS, SCANNED, SERVERS, SERVICES>
{
    type Application = A;
    type Image = [u8; IMAGE];
    type Tpdos = [Tpdo; TPDOS];
    type Rpdos = [Rpdo; RPDOS];
    type Heartbeats = [Monitored; HEARTBEATS];
    type Scanned = [Watched; SCANNED];
    type Servers = [Channel<Inner<Self>>; SERVERS];
    const SERVICES: Services = Services::from_bits(SERVICES)
        .with_if(TPDOS > 0, Services::TPDO)
        .with_if(RPDOS > 0, Services::RPDO)
        .with_if(HEARTBEATS > 0, Services::HEARTBEAT_CONSUMER)
        .with_if(SCANNED > 0, Services::MULTIPLEXED_TPDO)
        .with_if(SERVERS > 0, Services::SDO_SERVERS);
}
