//! The interface between a device and the application code of the product.

use super::{Reset, Soundness, Stored};
use crate::NodeId;
use crate::dictionary::{Entry, Group, Groups};
use crate::emcy::{Condition, ErrorClass, Fault, Message};
use crate::nmt::State;
use crate::sdo::{Abort, Multiplexer, Part};
use crate::time_stamp::TimeOfDay;

/// The application code of a product: the behaviour behind the objects. Every method has a default that does nothing,
/// so an application implements only the methods that it needs.
///
/// `image` is the memory of all values of the dictionary. A [`Field`](crate::dictionary::Field) reads and writes one
/// value. A value that a method changes is sent by PDO like any other change.
pub trait Application {
    /// The faults of the application, at most 32. [`Fault::Application`] names a fault by its position in this list.
    const CONDITIONS: &'static [Condition] = &[];

    /// Whether the upper half of an entry of 1003h has the first two bytes of the error field of its EMCY. Otherwise it
    /// is 0.
    const LISTS_DETAIL: bool = false;

    /// Whether clients may upload in blocks (CiA 301, 7.2.4.3.12, optional). A device that is short of flash and has no
    /// long entry can switch block uploads off: the request is then refused with [`Abort::Command`], and the client
    /// uploads in segments.
    const BLOCK_UPLOAD: bool = true;

    /// Whether clients may download in blocks (CiA 301, 7.2.4.3.9, optional). Otherwise the request is refused with
    /// [`Abort::Command`], and the client downloads in segments.
    const BLOCK_DOWNLOAD: bool = true;

    /// Whether the application uploads domains in parts ([`begin_upload`](Application::begin_upload)) and learns of a
    /// download that ends before it is complete ([`download_aborted`](Application::download_aborted)). Without it, the
    /// content of a domain is one slice ([`read_domain`](Application::read_domain)).
    const DOMAIN_PARTS: bool = false;

    /// Whether SDO requests of less than eight bytes are taken, as if zeros followed. CiA 301, 7.2.4.3, demands eight
    /// bytes, but some older controllers send less. Otherwise such a request is ignored.
    const SHORT_REQUESTS: bool = false;

    /// Whether the device has an LSS slave (CiA 305, optional). Without one, the device needs a node-ID from its caller.
    const LSS: bool = true;

    /// Whether a TPDO sends events ([`sends_events`](Application::sends_events)).
    const SENDS_EVENTS: bool = false;

    /// Whether small changes of mapped values are not sent ([`is_quiet`](Application::is_quiet)).
    const THRESHOLDS: bool = false;

    /// Whether PDOs take at most three quarters of the bus, so that heartbeat, EMCY and SDO always have room. A product
    /// whose PDOs cannot fill the bus, and that is short of flash, can do without.
    const BUS_SHARE: bool = true;

    /// The bits of the error register (1001h) that the device supports. Bit 0, the generic error, must be one of them
    /// (CiA 301, 7.5.2.2).
    fn register_bits(&self) -> u8 {
        0xFF
    }

    /// Sets values that the table of rows cannot contain (identity, versions, the last measured values). Called after
    /// every reset. The device has given the objects of `reset` their stored values or defaults; after
    /// [`Reset::Communication`], parameters of the application have the values that clients have written, and keep them
    /// (CiA 301, 7.3.2.2.3).
    fn initialise(&mut self, _reset: Reset, _image: &mut [u8]) {}

    /// Decides on a write to an entry that is [`handled`](crate::dictionary::Object::handled), by SDO or by an RPDO.
    /// Type and limits are checked already, and the device stores the bytes. The method may change other values.
    ///
    /// # Errors
    /// The reason to refuse the write; nothing is stored then.
    fn write(&mut self, _entry: &Entry, _bytes: &[u8], _image: &mut [u8]) -> Result<(), Abort> {
        Ok(())
    }

    /// Whether a write to this [`handled`](crate::dictionary::Object::handled) entry can change bit 31 of the COB-ID of a
    /// PDO, or the result of [`broadcasts`](Application::broadcasts). After such a write by SDO, the device switches its
    /// PDOs on or off accordingly. This takes time in proportion to the number of PDOs.
    fn switches_pdos(&self, _entry: &Entry) -> bool {
        false
    }

    /// An SDO client reads this entry. The method may set its value in `image`, or refuse the upload. A domain asks
    /// [`read_domain`](Application::read_domain) instead.
    ///
    /// # Errors
    /// The reason to refuse the upload.
    fn read(&mut self, _entry: &Entry, _image: &mut [u8]) -> Result<(), Abort> {
        Ok(())
    }

    /// An SDO client has written this entry.
    fn written(&mut self, _entry: &Entry, _image: &mut [u8]) {}

    /// The data of an RPDO is in the image. `rpdo` is the number of the RPDO, 1 to 512. The data of a synchronous RPDO
    /// is written to the image with the next SYNC. Not called for a multiplexed PDO whose value is not taken.
    fn received(&mut self, _rpdo: u16, _image: &mut [u8]) {}

    /// A SYNC has arrived in the state Operational. The data of the synchronous RPDOs is in the image; the synchronous
    /// TPDOs are sent when the method returns. `counter` is `None` where 1019h asks for no counter.
    fn synchronised(&mut self, _counter: Option<u8>, _image: &mut [u8]) {}

    /// A time stamp has arrived.
    fn time(&mut self, _time: TimeOfDay, _image: &mut [u8]) {}

    /// The NMT state has changed.
    fn state(&mut self, _state: State, _image: &mut [u8]) {}

    /// The error field of the EMCY of a fault of the application, by its number in
    /// [`CONDITIONS`](Application::CONDITIONS): for example the channel and its value. `None` for the error field of the
    /// condition. Called for each EMCY of the fault: when it occurs, and when it is reported again after a reset.
    fn fault_detail(&self, _number: u8) -> Option<[u8; 5]> {
        None
    }

    /// A node whose heartbeat is monitored (1016h) is in another state than before, or boots up
    /// ([`State::Initialising`]). A heartbeat that is missing is a [`fault`](Application::fault).
    fn node_state(&mut self, _node: NodeId, _state: State, _image: &mut [u8]) {}

    /// A node that is consumed (1028h) has sent an EMCY; code 0 when none of its faults is left.
    fn emergency(&mut self, _node: NodeId, _message: Message, _image: &mut [u8]) {}

    /// A fault has occurred (`active`) or is over.
    fn fault(&mut self, _fault: Fault, _active: bool, _image: &mut [u8]) {}

    /// An error of this class has occurred. A missing heartbeat and bus-off are [`ErrorClass::COMMUNICATION`]. After
    /// this call, the device changes its NMT state as object 1029h requires.
    fn error(&mut self, _class: ErrorClass, _image: &mut [u8]) {}

    /// Whether a TPDO sends events, such as the calls of a lift, instead of present values. `tpdo` is the number of the
    /// TPDO, 1 to 512. Only asked with [`SENDS_EVENTS`](Application::SENDS_EVENTS). Called whenever the communication parameters or the mapping of the TPDO change.
    ///
    /// Such a TPDO is sent once for each event from [`next_event`](Application::next_event), in the order of the
    /// events. A frame that waits for the bus is not replaced by a newer one. A changed value sends nothing by itself.
    /// With an event timer, all waiting events are sent when the timer elapses; if no event waits, the last one is sent
    /// again. With a synchronous transmission type, a SYNC sends one event.
    fn sends_events(&self, _tpdo: u16) -> bool {
        false
    }

    /// Whether the change of the value at this place of the image since the last [`sent`](Application::sent) of the TPDO is
    /// too small for a TPDO of type 255, such as a change below the threshold of a measured value. The TPDO is sent with the
    /// next change that is large enough. `tpdo` is the position of the TPDO among those of the dictionary, from 0. Called
    /// after each [`publish`](crate::Device::publish) for the bytes that have changed since the TPDO was sent. Only asked with
    /// [`THRESHOLDS`](Application::THRESHOLDS).
    fn is_quiet(&self, _tpdo: usize, _place: usize, _image: &[u8]) -> bool {
        false
    }

    /// A TPDO that sends on changes has been sent with the values of the image, for whatever reason. Its position is as for
    /// [`is_quiet`](Application::is_quiet). Only called with [`THRESHOLDS`](Application::THRESHOLDS).
    fn sent(&mut self, _tpdo: usize, _image: &[u8]) {}

    /// The groups to store when this entry is written, by SDO or by an RPDO, as a write to 1010h would. The SDO response
    /// is sent when the groups are stored. The device asks before the write: if they cannot be stored, or if a restore of
    /// one of them (1011h) waits for its reset, the write is refused and has no effect. For a mapped object the device also
    /// asks when the mapping is enabled, so an object that is stored at once is so from the start.
    fn stores(&self, _entry: &Entry) -> Option<Groups> {
        None
    }

    /// Whether a job can be stored now. Asked before the effect of every request that stores values. A job that runs
    /// does not count: the answer must be valid for one more job.
    ///
    /// # Errors
    /// The reason to refuse the request, for example [`Abort::DeviceState`] while the memory has no room.
    fn can_store(&self) -> Result<(), Abort> {
        Ok(())
    }

    /// From now on, a TPDO with [`sends_events`](Application::sends_events) can be sent: the device has become
    /// operational, or the TPDO valid. Earlier events are obsolete. The application reports its present state with the
    /// next events.
    fn begin_events(&mut self, _tpdo: u16, _image: &mut [u8]) {}

    /// Puts the next event of a TPDO with [`sends_events`](Application::sends_events) into the image. Returns whether
    /// there was one. Called when the TPDO may be sent: after [`publish`](super::Device::publish), and when the inhibit
    /// time is over. Until then, the application keeps its events.
    fn next_event(&mut self, _tpdo: u16, _image: &mut [u8]) -> bool {
        false
    }

    /// Whether a multiplexed RPDO takes the frames of all nodes, that is all frames with the function code of its
    /// CAN-ID: CiA 417 defines one such RPDO for each of 127 producers. Frames with the CAN-ID of another valid RPDO go
    /// to that RPDO only.
    fn takes_all_nodes(&self, _rpdo: u16) -> bool {
        false
    }

    /// Whether a multiplexed TPDO in destination address mode sends this object to all nodes. An application returns
    /// `false` for the objects of a device part that is not installed. Called whenever the TPDO is configured, and
    /// after a write to an entry with [`switches_pdos`](Application::switches_pdos).
    fn broadcasts(&self, _at: Multiplexer, _image: &[u8]) -> bool {
        true
    }

    /// The stored values of a group. Called at every reset that covers the group.
    fn stored(&self, _group: Group) -> Stored<'_> {
        Stored { packed: &[], soundness: Soundness::Whole }
    }

    /// Reports whether the stored values of a group were undamaged and fitted the dictionary. Values that did not fit
    /// are discarded, and the group has its defaults.
    fn loaded(&mut self, _group: Group, _good: bool) {}

    /// Whether an SDO client may write this entry now, for example stop the program (1F51h, CiA 302-3). Called before
    /// type and limits are checked. A domain that arrives in several parts asks
    /// [`write_domain`](Application::write_domain) only.
    ///
    /// # Errors
    /// The reason to refuse the write; nothing changes then. An application that has to identify the client first returns
    /// [`Abort::DeviceState`] until then.
    fn admits(&self, _entry: &Entry) -> Result<(), Abort> {
        Ok(())
    }

    /// The content of a DOMAIN entry.
    ///
    /// # Errors
    /// The reason why the domain cannot be read.
    fn read_domain(&self, _at: Multiplexer) -> Result<&[u8], Abort> {
        Err(Abort::Access)
    }

    /// An SDO client begins to read a domain. Returns the number of bytes; the parts follow
    /// ([`upload_part`](Application::upload_part)), then the end ([`end_upload`](Application::end_upload)). `None` for a
    /// domain that [`read_domain`](Application::read_domain) gives as a whole.
    ///
    /// With a second SDO server, two clients can read the same domain at the same time: an application that cannot serve
    /// both refuses with [`Abort::DeviceState`].
    ///
    /// # Errors
    /// The reason why the domain cannot be read.
    fn begin_upload(&mut self, _at: Multiplexer) -> Result<Option<usize>, Abort> {
        Ok(None)
    }

    /// Fills `part` with the content of the domain from `offset` on. A client that has lost a block asks for it again, so
    /// the offset can go back by up to 889 bytes.
    ///
    /// # Errors
    /// The reason to abort the upload.
    fn upload_part(&mut self, _at: Multiplexer, _offset: usize, _part: &mut [u8]) -> Result<(), Abort> {
        Err(Abort::Access)
    }

    /// The upload that [`begin_upload`](Application::begin_upload) has begun is over: complete, or aborted by either
    /// side, by a time-out, by a new transfer of the client, or by the NMT state.
    fn end_upload(&mut self, _at: Multiplexer, _is_complete: bool) {}

    /// A download whose [`Part::Begin`] was accepted is over without an accepted [`Part::End`], for one of the reasons of
    /// [`end_upload`](Application::end_upload). Called with [`DOMAIN_PARTS`](Application::DOMAIN_PARTS) only.
    fn download_aborted(&mut self, _at: Multiplexer) {}

    /// A download to a DOMAIN entry. The parts arrive in order, from [`Part::Begin`] to [`Part::End`]. A download that
    /// is aborted has no [`Part::End`].
    ///
    /// # Errors
    /// The reason to refuse the part, and with it the download.
    fn write_domain(&mut self, _at: Multiplexer, _part: Part<'_>) -> Result<(), Abort> {
        Err(Abort::Access)
    }
}

/// An application without behaviour: the device holds values only.
impl Application for () {}
