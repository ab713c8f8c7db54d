//! The location of one value in the image of all values.

use crate::copy::copy;

/// Offset and size of a value in the image.
///
/// Beyond the end of an image that is too short, a value reads as zero and a write has no effect; nothing panics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Field {
    pub(crate) offset: u16,
    pub(crate) size: u8,
}

impl Field {
    /// The bytes of the value.
    #[must_use]
    pub fn get(self, image: &[u8]) -> &[u8] {
        let start = usize::from(self.offset);
        image.get(start..start + usize::from(self.size)).unwrap_or(&[])
    }

    /// Replaces the value as `set` does. `value` is the first four bytes as a number: a value of four bytes, the most
    /// frequent size, needs no call of `set`.
    #[inline]
    pub(crate) fn set_number(self, image: &mut [u8], value: u32, bytes: &[u8]) {
        match self.size {
            4 => self.put(image, value.to_le_bytes()),
            _ => self.set(image, bytes),
        }
    }

    /// Replaces the value. If `bytes` is shorter than the value, zeros follow; if it is longer, the rest is ignored.
    pub fn set(self, image: &mut [u8], bytes: &[u8]) {
        // The frequent sizes. A copy of fixed size is cheap.
        match (self.size, bytes.first_chunk(), bytes.first_chunk()) {
            (4, Some(word), _) => return self.put::<4>(image, *word),
            (8, _, Some(words)) => return self.put::<8>(image, *words),
            _ => (),
        }
        let start = usize::from(self.offset);
        let Some(place) = image.get_mut(start..start + usize::from(self.size)) else { return };
        let mut rest = bytes.iter();
        for to in place {
            *to = rest.next().copied().unwrap_or(0);
        }
    }

    /// Whether the value takes this place of the image.
    #[must_use]
    pub fn is_at(self, place: usize) -> bool {
        (usize::from(self.offset)..usize::from(self.end())).contains(&place)
    }

    /// The offset after the value. Saturates for a field outside every image.
    pub(crate) fn end(self) -> u16 {
        self.offset.saturating_add(self.size.into())
    }

    /// Eight bytes from the start of the value; bytes beyond the image are zero.
    pub(crate) fn eight(self, image: &[u8]) -> [u8; 8] {
        let rest = image.get(usize::from(self.offset)..);
        match rest.and_then(<[u8]>::first_chunk) {
            Some(all) => *all,
            None => padded(rest.unwrap_or(&[])),
        }
    }

    /// The `K` bytes from the start of the value. For a value of another size, some are those of a neighbour.
    // Not inlined: profiles read hundreds of values.
    #[inline(never)]
    #[must_use]
    pub fn load<const K: usize>(self, image: &[u8]) -> [u8; K] {
        image.get(usize::from(self.offset)..).and_then(|rest| rest.first_chunk()).copied().unwrap_or([0; K])
    }

    /// Replaces the value, if it has `K` bytes. Otherwise nothing changes: neither a neighbour, nor a part of the value.
    /// Like `set`, for a size that is known at compile time.
    pub fn store<const K: usize>(self, image: &mut [u8], bytes: [u8; K]) {
        if usize::from(self.size) == K {
            self.put(image, bytes);
        }
    }

    /// Replaces a value of `K` bytes.
    fn put<const K: usize>(self, image: &mut [u8], bytes: [u8; K]) {
        if let Some(place) = image.get_mut(usize::from(self.offset)..).and_then(|rest| rest.first_chunk_mut())
        {
            *place = bytes;
        }
    }

    /// The value of an UNSIGNED24 to UNSIGNED64, of a time of day or of a time difference.
    #[must_use]
    pub fn u64(self, image: &[u8]) -> u64 {
        u64::from_le_bytes(padded(self.get(image)))
    }

    /// Sets an UNSIGNED24 to UNSIGNED64, a time of day or a time difference to the lowest bits of the value. A value of
    /// less than three bytes keeps its bytes.
    pub fn set_u64(self, image: &mut [u8], value: u64) {
        if matches!(self.size, 3..=8) {
            self.set(image, &value.to_le_bytes());
        }
    }

    /// The value of an INTEGER24 to INTEGER64.
    #[must_use]
    pub fn i64(self, image: &[u8]) -> i64 {
        let unused = 64_u32.saturating_sub(u32::from(self.size) * 8).min(63);
        (self.u64(image) << unused).cast_signed() >> unused
    }

    /// Sets an INTEGER24 to INTEGER64 to the lowest bits of the value. A value of less than three bytes keeps its bytes.
    pub fn set_i64(self, image: &mut [u8], value: i64) {
        self.set_u64(image, value.cast_unsigned());
    }
}

/// Access to a value of a type with a fixed size.
macro_rules! access {
    ($($kind:ident, $set:ident, $name:literal;)+) => {
        impl Field {
            $(
                #[doc = concat!("The value of ", $name, ".")]
                #[must_use]
                pub fn $kind(self, image: &[u8]) -> $kind {
                    $kind::from_le_bytes(self.load(image))
                }

                #[doc = concat!("Sets ", $name, ". A value of another size keeps its bytes.")]
                pub fn $set(self, image: &mut [u8], value: $kind) {
                    self.store(image, value.to_le_bytes());
                }
            )+
        }
    };
}

access! {
    u8, set_u8, "an UNSIGNED8 or BOOLEAN";
    i8, set_i8, "an INTEGER8";
    u16, set_u16, "an UNSIGNED16";
    i16, set_i16, "an INTEGER16";
    u32, set_u32, "an UNSIGNED32";
    i32, set_i32, "an INTEGER32";
    f32, set_f32, "a REAL32";
    f64, set_f64, "a REAL64";
}

/// The last bytes of an image, followed by zeros.
#[inline(never)]
fn padded(rest: &[u8]) -> [u8; 8] {
    let mut bytes = [0; 8];
    copy(&mut bytes, rest);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A value of two bytes between two neighbours.
    const FIELD: Field = Field { offset: 1, size: 2 };
    const IMAGE: [u8; 6] = [1, 2, 3, 4, 5, 6];

    #[test]
    fn a_value_of_another_size_is_not_written() {
        let mut image = IMAGE;
        FIELD.store(&mut image, [9]);
        FIELD.store(&mut image, [9; 4]);
        FIELD.set_u8(&mut image, 9);
        FIELD.set_i32(&mut image, 9);
        FIELD.set_u64(&mut image, 9);
        assert_eq!(image, IMAGE);
        FIELD.store(&mut image, [8, 9]);
        assert_eq!((image, FIELD.u16(&image)), ([1, 8, 9, 4, 5, 6], 0x0908));
    }

    #[test]
    fn the_last_value_of_an_image_is_written() {
        let mut image = IMAGE;
        Field { offset: 5, size: 1 }.set_i8(&mut image, -1);
        assert_eq!(image, [1, 2, 3, 4, 5, 0xFF]);
        Field { offset: 5, size: 2 }.set_u16(&mut image, 0);
        assert_eq!(image, [1, 2, 3, 4, 5, 0xFF], "the image is too short");
    }

    #[test]
    fn every_type_reads_back_its_values() {
        let field = |size| Field { offset: 3, size };
        let mut image = [0; 12];
        field(1).set_i8(&mut image, -3);
        assert_eq!((field(1).i8(&image), field(1).u8(&image)), (-3, 0xFD));
        field(2).set_i16(&mut image, -300);
        assert_eq!((field(2).i16(&image), field(2).u16(&image)), (-300, 0xFED4));
        field(4).set_i32(&mut image, -70_000);
        assert_eq!(field(4).i32(&image), -70_000);
        field(4).set_f32(&mut image, 1.5);
        assert_eq!(field(4).f32(&image).to_bits(), 1.5_f32.to_bits());
        field(8).set_f64(&mut image, -0.1);
        assert_eq!(field(8).f64(&image).to_bits(), (-0.1_f64).to_bits());
        for size in 3..=8 {
            for value in [-1, -70_000, 8_388_607] {
                field(size).set_i64(&mut image, value);
                assert_eq!(field(size).i64(&image), value, "{size} bytes");
            }
        }
        assert_eq!(image[11], 0, "the neighbour keeps its value");
        field(8).set_u64(&mut image, u64::MAX - 1);
        assert_eq!(field(8).u64(&image), u64::MAX - 1);
        field(6).set_u64(&mut image, 0x0102_0304_0506_0708);
        assert_eq!(field(6).u64(&image), 0x0304_0506_0708);
        assert_eq!((image[2], image[9]), (0, 0xFF), "the neighbours keep their values");
    }
}
