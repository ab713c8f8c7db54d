//! The PDOs that CiA 417-3-1 pre-defines for lift 1, as data.
//!
//! A TPDO of one device is an RPDO of the same number in another, so one entry describes both sides. Where the printed
//! tables contradict each other, a comment beside the entry gives the interpretation. These rules apply to all entries:
//!
//! * TPDOs have sub-indexes up to 6 (up to 5 for number 2), RPDOs up to 5. Sub-index 0 of most RPDOs is printed as up
//!   to 6, but an RPDO has no SYNC start value and no row for it.
//! * The number of mapped objects of many RPDOs is printed as 0 to n. Here it is n, as a default is one value.
//! * The mapping of many RPDOs is printed as mandatory. Here it exists if the communication parameter exists, as with
//!   the other RPDOs.
//! * The CAN-IDs lie inside the pre-defined connection set of CiA 301: 181h to 18Fh are TPDO 1 of the nodes 1 to 15,
//!   200h to 207h RPDO 1 of the nodes up to 7, 400h RPDO 3, 480h and 500h and up TPDO 4 and RPDO 4 of any node. A lift
//!   device has no PDOs of the pre-defined connection set (`docs/lift.md`).
//! * Misprints of single characters (an ordinal, a missing h, an event timer of two digits) are not repeated.
//! * COB-IDs of TPDOs are printed with bit 30 set or clear, and both are allowed. Producers here set the bit, because
//!   remote frames should not be used.
//! * Type 255: without an event timer, a PDO is sent on entering Operational and on each change; with an event timer,
//!   only on entering Operational and when the timer elapses. CiA 301 leaves the event to the profile; `canopen`
//!   implements this rule for type 255.

/// One pre-defined PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pdo {
    /// Number of the TPDO. The RPDO has the same number, except for [`CobId::PlusNode`].
    pub number: u16,
    /// Name of the content.
    pub name: &'static str,
    /// CAN-ID.
    pub cob_id: CobId,
    /// Mapping.
    pub content: Content,
}

/// The identifier of a PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CobId {
    /// The same CAN-ID in every device: the lift has one producer.
    Fixed(u16),
    /// The producer's node-ID is added. A consumer has one RPDO for each of the 127 producers.
    PlusNode(u16),
}

/// The content of a PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// Mapped objects in their order.
    Objects(&'static [Object]),
    /// A multiplexed PDO in destination address mode: index, sub-index and data travel in the frame.
    Multiplexed,
}

/// An object mapped into a PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Object {
    /// Object index.
    pub index: u16,
    /// Sub-index.
    pub sub: u8,
    /// Length in bits.
    pub bits: u8,
    /// Name of the object.
    pub name: &'static str,
}

impl Object {
    /// The reserved byte in the drive PDOs. The profile gives it no meaning; producers send 0.
    pub const RESERVED: u16 = 0x67FE;

    /// The mapping on the consumer's side, where the reserved byte is the dummy object 0005h (UNSIGNED8).
    #[must_use]
    pub const fn consumed(self) -> Object {
        if self.index == Self::RESERVED { Object { index: 0x0005, ..self } } else { self }
    }

    /// Whether the value can be negative: velocities and the effort of the drive, as in CiA 402.
    #[must_use]
    pub const fn is_signed(self) -> bool {
        matches!(self.index, 0x6406 | 0x6430 | 0x6433)
    }

    /// The value of a PDO mapping entry (CiA 301: index, sub-index, length).
    #[must_use]
    pub const fn entry(self) -> u32 {
        (self.index as u32) << 16 | (self.sub as u32) << 8 | self.bits as u32
    }
}

impl Pdo {
    /// Index of the TPDO communication parameter; the mapping parameter is 200h higher.
    #[must_use]
    pub const fn tpdo_index(&self) -> u16 {
        0x1800 + self.number - 1
    }

    /// Index of the RPDO communication parameter for frames of `producer`; the mapping parameter is 200h higher.
    /// `None` for a producer that is no node-ID. A PDO with a fixed identifier does not depend on the producer.
    #[must_use]
    pub const fn rpdo_index(&self, producer: u8) -> Option<u16> {
        match self.cob_id {
            CobId::Fixed(_) => Some(0x1400 + self.number - 1),
            CobId::PlusNode(_) if 1 <= producer && producer <= 127 => {
                Some(0x1400 + self.number - 1 + producer as u16 - 1)
            }
            CobId::PlusNode(_) => None,
        }
    }

    /// The CAN-ID that `producer` uses.
    #[must_use]
    pub const fn can_id(&self, producer: u8) -> u16 {
        match self.cob_id {
            CobId::Fixed(id) => id,
            CobId::PlusNode(base) => base + (producer & 0x7F) as u16,
        }
    }
}

/// Meaning of a frame with a pre-defined identifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Definition {
    /// The PDO.
    pub pdo: &'static Pdo,
    /// Node-ID of the producer, if the identifier contains it.
    pub producer: Option<u8>,
}

/// A field of a PDO: the place of an object in the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// The object, as the producer maps it.
    pub object: Object,
    /// First bit of the field; bit 0 is the lowest of the first byte.
    pub start: u8,
}

impl Definition {
    /// The fields in order. A multiplexed PDO has none, because its frame names the object ([`name_of`]).
    pub fn fields(&self) -> impl Iterator<Item = Field> {
        let objects = match self.pdo.content {
            Content::Objects(objects) => objects,
            Content::Multiplexed => &[],
        };
        objects.iter().scan(0_u8, |next, &object| {
            let start = *next;
            *next = start.saturating_add(object.bits);
            Some(Field { object, start })
        })
    }
}

impl Field {
    /// The value in the data of a frame; `None` if the frame is too short.
    #[must_use]
    pub fn value(&self, data: &[u8]) -> Option<u64> {
        let first = usize::from(self.start / 8);
        let bytes = data.get(first..first + usize::from(self.object.bits / 8))?;
        Some(bytes.iter().rev().fold(0, |value, &byte| value << 8 | u64::from(byte)))
    }
}

/// Meaning of the frames with a COB-ID, whose bits 30 and 31 are ignored. `None` if the COB-ID is not pre-defined.
#[must_use]
pub fn by_cob_id(cob_id: u32) -> Option<Definition> {
    let id = u16::try_from(cob_id & 0x3FFF_FFFF).ok()?;
    PDOS.iter().find_map(|pdo| {
        let producer = match pdo.cob_id {
            CobId::Fixed(own) => (own == id).then_some(None)?,
            CobId::PlusNode(base) => Some(producer(id.checked_sub(base)?)?),
        };
        Some(Definition { pdo, producer })
    })
}

fn producer(node_id: u16) -> Option<u8> {
    u8::try_from(node_id).ok().filter(|node_id| (1..=127).contains(node_id))
}

/// The PDO of this number.
#[must_use]
pub const fn by_number(number: u16) -> Option<&'static Pdo> {
    let mut rest: &[Pdo] = PDOS;
    while let [pdo, others @ ..] = rest {
        if pdo.number == number {
            return Some(pdo);
        }
        rest = others;
    }
    None
}

/// Name of an object that one of the PDOs carries.
#[must_use]
pub fn name_of(index: u16, sub: u8) -> Option<&'static str> {
    let mapped = PDOS.iter().filter_map(|pdo| match pdo.content {
        Content::Objects(objects) => Some(objects),
        Content::Multiplexed => None,
    });
    let found = mapped.flatten().find(|object| (object.index, object.sub) == (index, sub));
    found.map(|object| object.name)
}

const fn fixed(number: u16, name: &'static str, id: u16, objects: &'static [Object]) -> Pdo {
    Pdo { number, name, cob_id: CobId::Fixed(id), content: Content::Objects(objects) }
}

const fn object(index: u16, sub: u8, bits: u8, name: &'static str) -> Object {
    Object { index, sub, bits, name }
}

const RESERVED: Object = object(Object::RESERVED, 0, 8, "reserved");

/// All PDOs, by number. The profile skips number 266, between door control and the first door.
pub const PDOS: &[Pdo; 19] = &[
    // The index ranges are printed one too long (to 1480h and 1680h): 127 producers need 1401h to 147Fh, and 1480h
    // belongs to RPDO 129. 1801h has no SYNC start value, as printed, unlike the other TPDOs.
    Pdo { number: 2, name: "multiplexed PDO", cob_id: CobId::PlusNode(0x500), content: Content::Multiplexed },
    // The consumer's table maps 6011h, the virtual output; the producer's table maps the input, 6010h, which is used
    // here.
    Pdo {
        number: 130,
        name: "virtual input",
        cob_id: CobId::PlusNode(0x480),
        content: Content::Objects(&[object(0x6010, 0, 48, "virtual input")]),
    },
    fixed(257, "virtual output", 0x400, &[object(0x6011, 0, 48, "virtual output")]),
    // The consumer's mapping is printed at 1501h, the index of its communication parameter. It is at 1701h, and each of
    // the two exists if the other does. The second entry is printed as sub-index 1 again. Two are mapped, so it is 2.
    fixed(
        258,
        "load measuring unit",
        0x188,
        &[object(0x6482, 1, 8, "load signals"), object(0x6480, 1, 16, "load")],
    ),
    fixed(
        259,
        "car drive, velocity command",
        0x182,
        &[
            object(0x6400, 0, 16, "controlword"),
            object(0x6403, 0, 8, "mode of operation"),
            RESERVED,
            object(0x6430, 0, 32, "target velocity"),
        ],
    ),
    fixed(
        260,
        "car drive, velocity status",
        0x183,
        &[
            object(0x6401, 0, 16, "statusword"),
            object(0x6404, 0, 8, "mode of operation display"),
            RESERVED,
            object(0x6433, 0, 32, "actual velocity"),
        ],
    ),
    // 180h is a restricted identifier of CiA 301, but this profile uses it. The consumer's table prints 6432h where the
    // producer has 6423h; both call it the profile velocity.
    fixed(
        261,
        "car drive, position command",
        0x180,
        &[object(0x6420, 0, 32, "target position"), object(0x6423, 0, 32, "profile velocity")],
    ),
    fixed(262, "car drive, control effort", 0x181, &[object(0x6406, 0, 32, "control effort")]),
    fixed(263, "car position 1", 0x18C, &[object(0x6383, 1, 32, "position 1")]),
    fixed(264, "car position 2", 0x18D, &[object(0x6383, 2, 32, "position 2")]),
    // Four doors are controlled and three report: the profile has no status PDO for the fourth. A consumer maps the
    // dummy object 0006h (UNSIGNED16) in place of a door that it does not have.
    fixed(
        265,
        "car door control",
        0x200,
        &[
            object(0x6300, 1, 16, "door 1 controlword"),
            object(0x6300, 2, 16, "door 2 controlword"),
            object(0x6300, 3, 16, "door 3 controlword"),
            object(0x6300, 4, 16, "door 4 controlword"),
        ],
    ),
    fixed(
        267,
        "car door 1",
        0x201,
        &[object(0x6301, 1, 16, "door 1 statusword"), object(0x6302, 1, 16, "door 1 position")],
    ),
    fixed(268, "light barrier 1", 0x205, &[object(0x6310, 1, 8, "light barrier 1 status")]),
    fixed(
        269,
        "car door 2",
        0x202,
        &[object(0x6301, 2, 16, "door 2 statusword"), object(0x6302, 2, 16, "door 2 position")],
    ),
    fixed(270, "light barrier 2", 0x206, &[object(0x6310, 2, 8, "light barrier 2 status")]),
    fixed(
        271,
        "car door 3",
        0x203,
        &[object(0x6301, 3, 16, "door 3 statusword"), object(0x6302, 3, 16, "door 3 position")],
    ),
    fixed(272, "light barrier 3", 0x207, &[object(0x6310, 3, 8, "light barrier 3 status")]),
    fixed(385, "car position 3", 0x18E, &[object(0x6383, 3, 32, "position 3")]),
    fixed(386, "car position 4", 0x18F, &[object(0x6383, 4, 32, "position 4")]),
];

#[cfg(test)]
mod tests;
