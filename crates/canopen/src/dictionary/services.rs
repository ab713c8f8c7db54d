//! The services that the rows of a table ask for.

use super::compile::can_be_multiplexed;
use super::{DefaultValue, Object, Rule};

/// The services of a [`Device`](crate::Device). The code of a service outside the set is not linked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Services(u32);

impl Services {
    /// SYNC consumer: the rows have 1005h. Without it, a PDO has no synchronous transmission type.
    pub const SYNC: Services = Services(1);
    /// EMCY producer: the rows have 1014h. Without it, a fault sets the error register (1001h) and has the effect of
    /// 1029h, but no EMCY is sent and no error is listed in 1003h.
    pub const EMCY: Services = Services(1 << 1);
    /// Storing and restoring by 1010h, 1011h, a [`setting`](Object::setting) or the command for the calibration.
    pub const STORE: Services = Services(1 << 2);
    /// Multiplexed RPDOs: the rows have an RPDO that can be [`multiplexed`](crate::objects::multiplexed).
    pub const MULTIPLEXED_RPDO: Services = Services(1 << 3);
    /// Faults, the error register (1001h), the error behaviour (1029h), and jobs of the caller, such as storing a
    /// configuration of LSS. Every [`Device`](crate::Device) has them but a [`ServiceDevice`](crate::ServiceDevice).
    pub const FAULTS: Services = Services(1 << 4);
    /// Program control (CiA 302-3): the rows have 1F51h.
    pub const PROGRAM_CONTROL: Services = Services(1 << 5);
    /// Start without a command of the master: the rows have 1F80h.
    pub const SELF_START: Services = Services(1 << 6);

    /// SYNC producer: the rows are those of [`sync_producer`](crate::objects::sync_producer).
    pub const SYNC_PRODUCER: Services = Services(1 << 7);
    /// Time stamp, consumer and producer: the rows have 1012h.
    pub const TIME: Services = Services(1 << 8);

    /// Node guarding and life guarding: the rows have 100Ch.
    pub const GUARDING: Services = Services(1 << 9);

    /// EMCY consumer: the rows have 1028h.
    pub const EMCY_CONSUMER: Services = Services(1 << 10);
    /// SDO client: the rows have 1280h or a further object of this kind.
    pub const SDO_CLIENT: Services = Services(1 << 11);

    /// Storage groups of the product: the rows have a sub-index of 4 and up in 1010h or 1011h.
    pub const OWN_GROUPS: Services = Services(1 << 12);

    /// Answers to remote frames: the rows have a TPDO whose COB-ID allows them by default, or of type 252 or 253. All
    /// other TPDOs are those of [`without_remote`](crate::objects::without_remote).
    pub const REMOTE: Services = Services(1 << 13);

    /// TPDOs, RPDOs, the heartbeat consumer, the multiplexed TPDO and further SDO servers follow from the numbers in
    /// [`Sizes`](super::Sizes).
    pub(crate) const TPDO: Services = Services(1 << 16);
    pub(crate) const RPDO: Services = Services(1 << 17);
    pub(crate) const HEARTBEAT_CONSUMER: Services = Services(1 << 18);
    pub(crate) const MULTIPLEXED_TPDO: Services = Services(1 << 19);
    pub(crate) const SDO_SERVERS: Services = Services(1 << 20);

    /// None of these services.
    pub const NONE: Services = Services(0);
    /// All services, for a device whose rows are not known when it is compiled.
    pub const ALL: Services = Services(0xFFFF);

    /// The services that these rows ask for.
    #[must_use]
    #[allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]
    pub const fn of(rows: &[Object]) -> Services {
        let (mut services, mut i) = (Services::FAULTS, 0);
        while i < rows.len() {
            let row = &rows[i];
            services = services.with(match row.rule {
                Rule::SyncCobId => Services::SYNC,
                Rule::EmcyCobId => Services::EMCY,
                Rule::Store | Rule::Restore if row.sub > 3 => Services::STORE.with(Services::OWN_GROUPS),
                Rule::Store | Rule::Restore | Rule::StoreCalibration | Rule::Setting => Services::STORE,
                Rule::SyncProducer => Services::SYNC.with(Services::SYNC_PRODUCER),
                Rule::GuardTime => Services::GUARDING,
                Rule::TimeCobId => Services::TIME,
                Rule::EmcyWatch => Services::EMCY_CONSUMER,
                Rule::SdoClientCobId => Services::SDO_CLIENT,
                Rule::ProgramControl => Services::PROGRAM_CONTROL,
                Rule::StartUp => Services::SELF_START,
                Rule::PdoCount if row.index < 0x1800 && can_be_multiplexed(row) => Services::MULTIPLEXED_RPDO,
                Rule::PdoCobId | Rule::PdoPredefined | Rule::PdoType if answers_remote(row) => {
                    Services::REMOTE
                }
                _ => Services::NONE,
            });
            i += 1;
        }
        services
    }

    /// The services of both sets.
    #[must_use]
    pub const fn with(self, other: Services) -> Services {
        Services(self.0 | other.0)
    }

    /// The set, and another service if a condition is met.
    pub(crate) const fn with_if(self, condition: bool, other: Services) -> Services {
        if condition { self.with(other) } else { self }
    }

    /// Whether all services of `other` are in the set.
    #[must_use]
    pub const fn contains(self, other: Services) -> bool {
        self.0 & other.0 == other.0
    }

    /// The set as a number, for [`device!`](crate::device!).
    #[doc(hidden)]
    #[must_use]
    pub const fn bits(self) -> u32 {
        self.0
    }

    pub(crate) const fn from_bits(bits: u32) -> Services {
        Services(bits)
    }
}

/// Whether a row of a TPDO, its COB-ID or its type, makes the TPDO answer remote frames.
const fn answers_remote(row: &Object) -> bool {
    let value = match row.default {
        DefaultValue::Integer(value) => value,
        DefaultValue::NodeId(base) => base as i64,
        _ => 0,
    };
    let is_sent = row.index & 0xFE00 == 0x1800;
    is_sent
        && if matches!(row.rule, Rule::PdoType) { matches!(value, 252 | 253) } else { value & 1 << 30 == 0 }
}
