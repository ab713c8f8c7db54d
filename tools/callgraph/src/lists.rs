//! What is known of the images beyond their code.

/// Code that can panic.
pub(crate) struct Known {
    pub(crate) image: &'static str,
    /// How the path of its function begins.
    pub(crate) function: &'static str,
    /// Why that is so, and why it does not happen.
    pub(crate) reason: &'static str,
}

/// All of it. What is not here and can panic fails the check.
pub(crate) const KNOWN: [Known; 1] = [Known {
    image: "firmware",
    function: "defmt_rtt::AtomicRttEncoder",
    reason: "a log line within a log line; nothing that is logged logs",
}];

/// How many other calls another compiler than that of the list may leave, because it takes other ways to see that a panic
/// cannot happen.
pub(crate) const WIDTH: usize = 4;

/// Functions that jump where no constant says, and why the stack of what is there does not count.
const LEAVES: [(&str, &str); 1] =
    [("bsp::hardware::application::start", "the bootloader starts the application, with a stack of its own")];

/// Whether the call graph ends with what this function jumps to.
pub(crate) fn leaves_the_image(name: &str) -> bool {
    LEAVES.iter().any(|(leaves, _)| name == *leaves)
}
