//! The PDOs that CiA 417-3-1 pre-defines for lift 1, as data.
//!
//! A TPDO of one device is an RPDO of the same number in another, so one entry describes both sides. Where the
//! printed tables contradict each other the entry follows the reading given in a comment beside it.

/// One pre-defined PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pdo {
    /// Number of the TPDO. RPDOs have the same number, but for those of [`CobId::PlusNode`].
    pub number: u16,
    /// What it carries.
    pub name: &'static str,
    /// Its identifier.
    pub cob_id: CobId,
    /// Its content.
    pub content: Content,
}

/// The identifier of a PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CobId {
    /// The same in every device: one producer in the lift.
    Fixed(u16),
    /// The producer's node-ID is added. A consumer has one RPDO for each of the 127 producers.
    PlusNode(u16),
}

/// The content of a PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// Mapped objects in order.
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
}

impl Object {
    /// The reserved byte in the drive PDOs. The profile gives it no meaning; producers send 0.
    pub const RESERVED: u16 = 0x67FE;

    /// The mapping on the consumer's side, where the reserved byte is the dummy object 0005h (UNSIGNED8).
    #[must_use]
    pub const fn consumed(self) -> Object {
        if self.index == Self::RESERVED { Object { index: 0x0005, ..self } } else { self }
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

    /// The CAN-ID that `producer` sends it with.
    #[must_use]
    pub const fn can_id(&self, producer: u8) -> u16 {
        match self.cob_id {
            CobId::Fixed(id) => id,
            CobId::PlusNode(base) => base + (producer & 0x7F) as u16,
        }
    }
}

/// The PDO that travels with a CAN-ID, and its producer where the identifier tells it.
#[must_use]
pub fn by_can_id(id: u16) -> Option<(&'static Pdo, Option<u8>)> {
    PDOS.iter().find_map(|pdo| match pdo.cob_id {
        CobId::Fixed(own) => (own == id).then_some((pdo, None)),
        CobId::PlusNode(base) => {
            let producer = u8::try_from(id.checked_sub(base)?).ok()?;
            (1..=127).contains(&producer).then_some((pdo, Some(producer)))
        }
    })
}

const fn fixed(number: u16, name: &'static str, id: u16, objects: &'static [Object]) -> Pdo {
    Pdo { number, name, cob_id: CobId::Fixed(id), content: Content::Objects(objects) }
}

const fn object(index: u16, sub: u8, bits: u8) -> Object {
    Object { index, sub, bits }
}

/// All of them, by number. Number 266 is left out of the profile: a gap between door control and the first door.
pub const PDOS: [Pdo; 19] = [
    // The index ranges are printed one too long (1480h, 1680h): 127 producers need 1401h to 147Fh.
    Pdo { number: 2, name: "multiplexed PDO", cob_id: CobId::PlusNode(0x500), content: Content::Multiplexed },
    // The consumer's table maps 6011h, which is the virtual output; the producer maps the input, 6010h.
    Pdo {
        number: 130,
        name: "virtual input",
        cob_id: CobId::PlusNode(0x480),
        content: Content::Objects(&[object(0x6010, 0, 48)]),
    },
    fixed(257, "virtual output", 0x400, &[object(0x6011, 0, 48)]),
    // The consumer's mapping is printed at 1501h, which is its own communication parameter: 1701h.
    fixed(258, "load measuring unit", 0x188, &[object(0x6482, 1, 8), object(0x6480, 1, 16)]),
    fixed(
        259,
        "car drive, velocity command",
        0x182,
        &[object(0x6400, 0, 16), object(0x6403, 0, 8), object(Object::RESERVED, 0, 8), object(0x6430, 0, 32)],
    ),
    fixed(
        260,
        "car drive, velocity status",
        0x183,
        &[object(0x6401, 0, 16), object(0x6404, 0, 8), object(Object::RESERVED, 0, 8), object(0x6433, 0, 32)],
    ),
    // 180h is a restricted identifier of CiA 301 that this profile uses all the same. The consumer's table prints
    // 6432h where the producer has the profile velocity, 6423h.
    fixed(261, "car drive, position command", 0x180, &[object(0x6420, 0, 32), object(0x6423, 0, 32)]),
    fixed(262, "car drive, control effort", 0x181, &[object(0x6406, 0, 32)]),
    fixed(263, "car position 1", 0x18C, &[object(0x6383, 1, 32)]),
    fixed(264, "car position 2", 0x18D, &[object(0x6383, 2, 32)]),
    // Four doors are controlled, three report: the profile has no status PDO for the fourth. A consumer maps the
    // dummy object 0006h (UNSIGNED16) for a door it does not have.
    fixed(
        265,
        "car door control",
        0x200,
        &[object(0x6300, 1, 16), object(0x6300, 2, 16), object(0x6300, 3, 16), object(0x6300, 4, 16)],
    ),
    fixed(267, "car door 1", 0x201, &[object(0x6301, 1, 16), object(0x6302, 1, 16)]),
    fixed(268, "light barrier 1", 0x205, &[object(0x6310, 1, 8)]),
    fixed(269, "car door 2", 0x202, &[object(0x6301, 2, 16), object(0x6302, 2, 16)]),
    fixed(270, "light barrier 2", 0x206, &[object(0x6310, 2, 8)]),
    fixed(271, "car door 3", 0x203, &[object(0x6301, 3, 16), object(0x6302, 3, 16)]),
    fixed(272, "light barrier 3", 0x207, &[object(0x6310, 3, 8)]),
    fixed(385, "car position 3", 0x18E, &[object(0x6383, 3, 32)]),
    fixed(386, "car position 4", 0x18F, &[object(0x6383, 4, 32)]),
];
