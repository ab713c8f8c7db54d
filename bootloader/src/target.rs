//! Properties of this node for the check of images.

use bsp::flash::update_layout::LAYOUT;
use update::Target;
use update::key::{HAS_PUBLISHED_KEY, PUBLIC_KEYS};

/// Hardware revision of the board.
const HARDWARE: u8 = 0;

pub(crate) const TARGET: Target =
    Target { layout: LAYOUT, board: profiles::product::BOARD, hardware: HARDWARE, keys: &PUBLIC_KEYS };

const _: () = assert!(
    cfg!(any(feature = "development", feature = "published-keys")) || !HAS_PUBLISHED_KEY,
    "the bootloader needs a key of its owner in UPDATE_RELEASE_KEY and one in UPDATE_ROOT_KEY, that are not published, or the feature `development` \
     (docs/update.md)"
);
