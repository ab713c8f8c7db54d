//! Facts about the images that their code does not tell.

/// Code that can panic.
pub(crate) struct Known {
    pub(crate) image: &'static str,
    /// The beginning of the path of the function.
    pub(crate) function: &'static str,
    /// Why the code can panic, and why the panic does not happen.
    pub(crate) reason: &'static str,
}

/// All known code that can panic. Other code that can panic fails the check.
pub(crate) const KNOWN: [Known; 1] = [Known {
    image: "firmware",
    function: "defmt_rtt::AtomicRttEncoder",
    reason: "a log line within a log line; nothing that is logged logs",
}];

/// How many other calls another compiler than the one of the list may leave. Such a compiler may miss, or see in other
/// places, that a panic cannot happen.
pub(crate) const WIDTH: usize = 4;

/// Functions that jump to an address that is no constant, and why the stack behind the jump does not count.
const LEAVES: [(&str, &str); 1] =
    [("bsp::chip::application::start", "the bootloader starts the application, with a stack of its own")];

/// Whether a function jumps out of the image, so that the call graph ends there.
pub(crate) fn leaves_the_image(name: &str) -> bool {
    LEAVES.iter().any(|(leaves, _)| name == *leaves)
}
