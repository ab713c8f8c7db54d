//! The objects that store and restore parameters.

use super::command;
use crate::dictionary::{Access, Object, Type};

/// 1010h: store all parameters (sub-index 1), the communication parameters (2), the application parameters (3).
#[must_use]
pub const fn store_parameters() -> [Object; 4] {
    store_parameters_with(&[])
}

/// 1011h: restore the defaults of the same groups.
#[must_use]
pub const fn restore_parameters() -> [Object; 4] {
    restore_parameters_with(&[])
}

/// The rows of [`store_parameters`] with groups of the product, from sub-index 4 on
/// ([`Group::Own4`](crate::dictionary::Group::Own4) and up): `N` is 4 and their number, `names` are theirs.
///
/// # Panics
/// During compilation, for more than five names, or for another number of names than `N` - 4.
#[must_use]
pub const fn store_parameters_with<const N: usize>(names: &[&'static str]) -> [Object; N] {
    let common = ["Store parameters", "Save all", "Save communication", "Save application"];
    commands(0x1010, common, names)
}

/// 1011h for the groups of [`store_parameters_with`].
///
/// # Panics
/// As [`store_parameters_with`].
#[must_use]
pub const fn restore_parameters_with<const N: usize>(names: &[&'static str]) -> [Object; N] {
    let common =
        ["Restore default parameters", "Restore all", "Restore communication", "Restore application"];
    commands(0x1011, common, names)
}

const fn commands<const N: usize>(
    index: u16,
    common: [&'static str; 4],
    names: &[&'static str],
) -> [Object; N] {
    assert!(names.len() <= 5, "a product has at most five storage groups");
    assert!(N == 4 + names.len(), "N is 4 and the number of names");
    let number = Object::new(index, 0, common[0], Type::Unsigned8, Access::Const).value(N as i64 - 1);
    let (mut rows, mut sub) = ([number; N], 1);
    while sub < N {
        let name = if sub < 4 { common[sub] } else { names[sub - 4] };
        rows[sub] = command(index, sub as u8, name);
        sub += 1;
    }
    rows
}
