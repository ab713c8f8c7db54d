//! What this node is: what the identity object says, and which images it takes.

use bsp::update_layout::LAYOUT;
use update::Target;
use update::key::PUBLIC_KEY;

pub(crate) use product::{BOARD as PRODUCT, REVISION, VENDOR_ID as VENDOR};

/// Hardware revision of the board.
const HARDWARE: u8 = 0;

pub(crate) const TARGET: Target =
    Target { layout: LAYOUT, product: PRODUCT, hardware: HARDWARE, key: PUBLIC_KEY };
