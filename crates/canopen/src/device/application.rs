//! The interface between a device and the product's own code.

use super::{Soundness, Stored};
use crate::dictionary::{Entry, Group, Groups};
use crate::emcy::{Condition, Fault};
use crate::nmt::State;
use crate::sdo::{Abort, Multiplexer};

/// The part of a device that is the product's own code: what its objects mean. Every method has a default that does
/// nothing, so an application implements what it needs.
///
/// `image` is the memory of all values of the dictionary; a [`Field`](crate::dictionary::Field) reads and writes one of
/// them. A value that a method changes is sent as any other change is.
pub trait Application {
    /// The faults of the application itself, at most 32. [`Fault::Application`] names one by its place here.
    const CONDITIONS: &'static [Condition] = &[];

    /// Whether clients may upload in blocks (CiA 301, 7.2.4.3.12, optional). A device that is short of flash and has no long entry
    /// does without: a block upload is refused with [`Abort::Command`], and its client uploads in segments.
    const BLOCK_UPLOAD: bool = true;

    /// The bits of the error register (1001h) that the device has. The generic error, bit 0, must be one of them (CiA 301,
    /// 7.5.2.2).
    fn register_bits(&self) -> u8 {
        0xFF
    }

    /// Fills in what no table can know (identity, versions, the last measured values), after every reset.
    fn initialise(&mut self, _image: &mut [u8]) {}

    /// Decides on a write to an entry that is [`handled`](crate::dictionary::Object::handled), by SDO or by an RPDO; type
    /// and limits are checked already. The method may change other values, and bit 31 of the COB-ID of a PDO: after a write by SDO
    /// the device follows it. The device stores the bytes.
    ///
    /// # Errors
    /// The reason to refuse the write; nothing is stored then.
    fn write(&mut self, _entry: &Entry, _bytes: &[u8], _image: &mut [u8]) -> Result<(), Abort> {
        Ok(())
    }

    /// An SDO client has written this entry.
    fn written(&mut self, _entry: &Entry, _image: &mut [u8]) {}

    /// An RPDO has been written into the image. `rpdo` is its number, 1 to 512. A synchronous RPDO is written with the next
    /// SYNC.
    fn received(&mut self, _rpdo: u16, _image: &mut [u8]) {}

    /// A SYNC has come in the state Operational. The synchronous RPDOs are in the image, and the synchronous TPDOs are
    /// sent when the method returns. `counter` is `None` where 1019h asks for no counter.
    fn synchronised(&mut self, _counter: Option<u8>, _image: &mut [u8]) {}

    /// The NMT state is another one.
    fn state(&mut self, _state: State, _image: &mut [u8]) {}

    /// A fault has come (`active`) or has gone.
    fn fault(&mut self, _fault: Fault, _active: bool, _image: &mut [u8]) {}

    /// An error of this class has happened: a missing heartbeat and bus-off are [`ErrorClass::COMMUNICATION`]. The device
    /// then changes its NMT state as object 1029h says.
    fn error(&mut self, _class: ErrorClass, _image: &mut [u8]) {}

    /// Whether a TPDO tells events, such as the calls of a lift, and not how things are. `tpdo` is the number of the TPDO, 1 to
    /// 512. Asked whenever the communication parameters or the mapping of the TPDO change.
    ///
    /// Such a TPDO is sent once for each event that [`next_event`](Application::next_event) gives, in the order of the events.
    /// No newer frame takes the place of one that waits for the bus. A value that changes sends nothing by itself. With an
    /// event timer, all events that wait are sent when the timer elapses; where none waits, the last one is sent again. With
    /// a synchronous type, a SYNC sends one event.
    fn sends_events(&self, _tpdo: u16) -> bool {
        false
    }

    /// The groups that an SDO client's write to this entry stores, as 1010h would: the response waits for it.
    fn stores(&self, _entry: &Entry) -> Option<Groups> {
        None
    }

    /// A TPDO that tells events can be sent from now on: the device has become operational, or the TPDO valid. Events of
    /// the time before are old; the application tells how things are now, with the events that it gives next.
    fn begin_events(&mut self, _tpdo: u16, _image: &mut [u8]) {}

    /// Puts the next event of a TPDO that tells events into the image; whether there was one. Asked when the TPDO may be
    /// sent: after [`publish`](super::Device::publish), and when the inhibit time is over. Until then, the event waits with
    /// the application.
    fn next_event(&mut self, _tpdo: u16, _image: &mut [u8]) -> bool {
        false
    }

    /// Whether a multiplexed RPDO takes the frames of all nodes with the function code of its CAN-ID, and not only those of one
    /// node: CiA 417 has one such RPDO for each of 127 producers. Nodes that have an RPDO of their own are left to that one.
    fn takes_all_nodes(&self, _rpdo: u16) -> bool {
        false
    }

    /// Whether a multiplexed TPDO in destination address mode tells this object to all nodes. An application says no for the
    /// objects of a part of the device that is not there. Asked whenever the TPDO is configured, and after a write to an entry
    /// that is [`handled`](crate::dictionary::Object::handled).
    fn broadcasts(&self, _at: Multiplexer, _image: &[u8]) -> bool {
        true
    }

    /// The stored values of a group. Asked for at every reset that covers the group.
    fn stored(&self, _group: Group) -> Stored<'_> {
        Stored { packed: &[], soundness: Soundness::Whole }
    }

    /// Whether what is stored of a group was sound and fitted the dictionary. Where it did not fit, the group has its
    /// defaults.
    fn loaded(&mut self, _group: Group, _good: bool) {}

    /// A client wants to stop or to reset the program (1F51h, CiA 302-3), which ends what the device does.
    ///
    /// # Errors
    /// The reason to refuse the command: an application that wants to know who asks says [`Abort::DeviceState`] until it does.
    fn stop_program(&mut self) -> Result<(), Abort> {
        Ok(())
    }

    /// The content of a domain.
    ///
    /// # Errors
    /// The reason why the domain cannot be read.
    fn read_domain(&self, _at: Multiplexer) -> Result<&[u8], Abort> {
        Err(Abort::Access)
    }

    /// A download to a domain: its parts come in order, from [`Part::Begin`] to [`Part::End`]. A download that is given
    /// up has no end.
    ///
    /// # Errors
    /// The reason to refuse the part and with it the download.
    fn write_domain(&mut self, _at: Multiplexer, _part: Part<'_>) -> Result<(), Abort> {
        Err(Abort::Access)
    }
}

/// An application that only holds values.
impl Application for () {}

/// A class of errors: a sub-index of object 1029h, which says how the NMT state changes (CiA 301, 7.5.2.33).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorClass(pub u8);

impl ErrorClass {
    /// Communication errors, sub-index 1.
    pub const COMMUNICATION: ErrorClass = ErrorClass(1);
    /// Errors of the device itself: sub-index 2, the first that a device profile or the manufacturer defines.
    pub const DEVICE: ErrorClass = ErrorClass(2);
}

/// A part of a download to a domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part<'a> {
    /// The download begins; so many bytes will come, where the client says so.
    Begin(Option<usize>),
    /// Bytes, and the place of the first of them in the domain.
    Data(usize, &'a [u8]),
    /// The download is complete, with so many bytes.
    End(usize),
}
