//! What this node is: what the identity object says, and which images it takes.

use node::Personality;
use update::key::PUBLIC_KEY;
use update::{Layout, Target};

pub(crate) const VENDOR: u32 = node::VENDOR_ID;
pub(crate) const REVISION: u32 = node::REVISION;
/// Of the board, not of the personality: an image has all of them.
pub(crate) const PRODUCT: u32 = Personality::Pressure.product_code();
/// Hardware revision of the board.
const HARDWARE: u8 = 0;

pub(crate) const TARGET: Target =
    Target { layout: Layout::STM32F4, product: PRODUCT, hardware: HARDWARE, key: PUBLIC_KEY };
