//! The location of a value whose type is known: read and written as a number of Rust.

use core::marker::PhantomData;

use super::entry::Kind;
use super::fail::fail;
use super::{Dictionary, Field};

/// A number of Rust that an entry can have.
pub trait Number: Copy + sealed::Sealed {
    #[doc(hidden)]
    const SIZE: usize;
    #[doc(hidden)]
    const IS_SIGNED: bool;
    #[doc(hidden)]
    const IS_REAL: bool;
    #[doc(hidden)]
    fn read(field: Field, image: &[u8]) -> Self;
    #[doc(hidden)]
    fn write(self, field: Field, image: &mut [u8]);
}

mod sealed {
    pub trait Sealed {}
}

/// The location of a value of type `T`, from [`Dictionary::variable`]. Unlike a [`Field`], it has one getter and one setter,
/// and the compiler has compared the type with that of the entry.
///
/// ```
/// use canopen::dictionary::{Access, Dictionary, Object, Type, Variable};
///
/// const ROWS: &[Object] = &[Object::new(0x6401, 0, "Analogue input", Type::Integer16, Access::ReadOnly)];
/// static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);
/// const INPUT: Variable<i16> = DICTIONARY.variable(0x6401, 0);
///
/// let mut image = [0; 2];
/// INPUT.set(&mut image, -300);
/// assert_eq!(INPUT.get(&image), -300);
/// ```
///
/// Another type does not compile:
///
/// ```compile_fail
/// # use canopen::dictionary::{Access, Dictionary, Object, Type, Variable};
/// # const ROWS: &[Object] = &[Object::new(0x6401, 0, "Analogue input", Type::Integer16, Access::ReadOnly)];
/// # static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);
/// const INPUT: Variable<u16> = DICTIONARY.variable(0x6401, 0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variable<T> {
    field: Field,
    kind: PhantomData<T>,
}

impl<T: Number> Variable<T> {
    /// The value.
    #[must_use]
    pub fn get(self, image: &[u8]) -> T {
        T::read(self.field, image)
    }

    /// Replaces the value.
    pub fn set(self, image: &mut [u8], value: T) {
        value.write(self.field, image);
    }

    /// The location without the type.
    #[must_use]
    pub const fn field(self) -> Field {
        self.field
    }
}

impl Dictionary {
    /// The location of a value with the type of its entry, for use at compile time. The sign of an integer is compared up to
    /// 32 bits, and a REAL64 counts as an integer of 64 bits. A BOOLEAN is a `u8`.
    ///
    /// # Panics
    /// During compilation, when there is no such entry, or when it has another type.
    #[must_use]
    pub const fn variable<T: Number>(&self, index: u16, sub: u8) -> Variable<T> {
        let (field, kind) = self.location(index, sub);
        let is_same = match kind {
            Kind::Signed => T::IS_SIGNED,
            Kind::Real32 => T::IS_REAL,
            Kind::Plain => T::SIZE == 8 || !T::IS_SIGNED && !T::IS_REAL,
            Kind::Text | Kind::Domain => false,
        };
        if field.size as usize != T::SIZE || !is_same {
            fail(index, sub, "the entry has another type");
        }
        Variable { field, kind: PhantomData }
    }
}

macro_rules! numbers {
    ($($kind:ident, $get:ident, $set:ident, $signed:literal, $real:literal;)+) => {
        $(
            impl sealed::Sealed for $kind {}

            impl Number for $kind {
                const SIZE: usize = $kind::MAX.to_le_bytes().len();
                const IS_SIGNED: bool = $signed;
                const IS_REAL: bool = $real;

                fn read(field: Field, image: &[u8]) -> $kind {
                    field.$get(image)
                }

                fn write(self, field: Field, image: &mut [u8]) {
                    field.$set(image, self);
                }
            }
        )+
    };
}

numbers! {
    u8, u8, set_u8, false, false;
    u16, u16, set_u16, false, false;
    u32, u32, set_u32, false, false;
    u64, u64, set_u64, false, false;
    i8, i8, set_i8, true, false;
    i16, i16, set_i16, true, false;
    i32, i32, set_i32, true, false;
    i64, i64, set_i64, true, false;
    f32, f32, set_f32, false, true;
    f64, f64, set_f64, false, true;
}

#[cfg(test)]
mod tests {
    use crate::dictionary::{Access, Dictionary, Object, Type, Variable};

    const fn row(sub: u8, kind: Type) -> Object {
        Object::new(0x2000, sub, "", kind, Access::ReadWrite)
    }

    const ROWS: &[Object] = &[
        Object::highest(0x2000, 7, ""),
        row(1, Type::Boolean),
        row(2, Type::Integer8),
        row(3, Type::Unsigned16),
        row(4, Type::Integer32),
        row(5, Type::Real32),
        row(6, Type::Integer64),
        row(7, Type::Real64),
    ];
    static DICTIONARY: Dictionary = crate::dictionary!(ROWS);
    const FLAG: Variable<u8> = DICTIONARY.variable(0x2000, 1);
    const SHORT: Variable<i8> = DICTIONARY.variable(0x2000, 2);
    const WORD: Variable<u16> = DICTIONARY.variable(0x2000, 3);
    const LONG: Variable<i32> = DICTIONARY.variable(0x2000, 4);
    const REAL: Variable<f32> = DICTIONARY.variable(0x2000, 5);
    const WIDE: Variable<i64> = DICTIONARY.variable(0x2000, 6);
    const DOUBLE: Variable<f64> = DICTIONARY.variable(0x2000, 7);

    #[test]
    fn a_variable_reads_back_and_leaves_its_neighbours() {
        let mut image = [0; 29];
        assert_eq!(DICTIONARY.image_size(), image.len());
        FLAG.set(&mut image, 1);
        SHORT.set(&mut image, -2);
        WORD.set(&mut image, 0xFFFE);
        LONG.set(&mut image, -70_000);
        REAL.set(&mut image, 1.5);
        WIDE.set(&mut image, i64::MIN);
        DOUBLE.set(&mut image, -0.1);
        assert_eq!((FLAG.get(&image), SHORT.get(&image), WORD.get(&image)), (1, -2, 0xFFFE));
        assert_eq!((LONG.get(&image), WIDE.get(&image)), (-70_000, i64::MIN));
        assert_eq!(REAL.get(&image).to_bits(), 1.5_f32.to_bits());
        assert_eq!(DOUBLE.get(&image).to_bits(), (-0.1_f64).to_bits());
        assert_eq!(WORD.field(), DICTIONARY.field(0x2000, 3));
    }
}
