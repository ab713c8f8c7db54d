//! Points that a verification of a signature has computed before. Tests verify the same images some ten thousand times.

use std::cell::RefCell;
use std::collections::HashMap;
use std::thread_local;

use crate::key::KEY_LEN;
use crate::signature::{HASH_LEN, LEN};

/// The numbers k and S and the key: the point \[S\]B - \[k\]A depends on nothing else.
type Numbers = ([u8; HASH_LEN], [u8; LEN], [u8; KEY_LEN]);

thread_local! {
    static POINTS: RefCell<HashMap<Numbers, [u8; LEN]>> = RefCell::default();
}

/// The compressed point of these numbers, if it was computed before.
pub(crate) fn point(numbers: &Numbers) -> Option<[u8; LEN]> {
    POINTS.with_borrow(|points| points.get(numbers).copied())
}

/// Keeps a computed point.
pub(crate) fn keep(numbers: Numbers, point: [u8; LEN]) {
    POINTS.with_borrow_mut(|points| points.insert(numbers, point));
}
