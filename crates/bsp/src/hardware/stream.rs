//! What the streams of DMA1 have in common.

use stm32f4xx_hal::dma::traits::Stream;

/// How often to look whether a stream has stopped: it ends the transfer that it is at, some ten clocks.
const STOP_POLLS: u32 = 1_000;

/// Switches a stream off, so that it can be set up anew (RM0390, 9.3.17), and forgets its flags.
pub(super) fn stop(stream: &mut impl Stream) {
    // SAFETY: a stream that is off moves nothing.
    unsafe { stream.disable() };
    let _ = (0..STOP_POLLS).find(|_| !stream.is_enabled());
    stream.clear_all_flags();
}
