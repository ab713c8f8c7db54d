//! What is known of the images beyond their code.

/// Code that can panic.
pub(crate) struct Known {
    pub(crate) image: &'static str,
    /// How the path of its function begins.
    pub(crate) function: &'static str,
    /// How the path of what panics in it begins, in the core library; empty for anything.
    pub(crate) panic: &'static str,
    /// Why that is so, and why it does not happen.
    pub(crate) reason: &'static str,
}

/// All of it. What is not here and can panic fails the check, and so does what is here and cannot.
pub(crate) const KNOWN: [Known; 6] = [
    Known {
        image: "firmware",
        function: "bsp::hardware::fault::__cortex_m_rt_DefaultHandler",
        panic: "",
        reason: "an interrupt that nobody enabled: the panic is what it is for",
    },
    Known {
        image: "firmware",
        function: "defmt_rtt::AtomicRttEncoder",
        panic: "",
        reason: "a log line within a log line; nothing that is logged logs",
    },
    Known {
        image: "bootloader",
        function: "bsp::hardware::fault::__cortex_m_rt_DefaultHandler",
        panic: "",
        reason: "as above",
    },
    Known {
        image: "bootloader",
        function: "canopen::",
        panic: "<[u8]>::copy_from_slice",
        reason: "copies between slices that `get_mut` has made equally long; compiled for size, the length is compared once more, \
                 in the firmware it is not",
    },
    Known {
        image: "bootloader",
        function: "bsp::hardware::flash::Flash",
        panic: "<[u8]>::copy_from_slice",
        reason: "the same",
    },
    Known {
        image: "bootloader",
        function: "salty::",
        panic: "",
        reason: "the signature: it runs in constant time, so its indices depend on the length of the data and not on what \
                 is in it, and every update of the tests goes through all of them",
    },
];

/// Functions that jump where no constant says, and why the stack of what is there does not count.
const LEAVES: [(&str, &str); 1] =
    [("bsp::hardware::application::start", "the bootloader starts the application, with a stack of its own")];

/// Whether the call graph ends with what this function jumps to.
pub(crate) fn leaves_the_image(name: &str) -> bool {
    LEAVES.iter().any(|(leaves, _)| name == *leaves)
}
