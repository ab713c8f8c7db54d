//! Common functions for the streams of DMA1.
#![expect(unsafe_code, reason = "the end of a stream of DMA")]

use stm32f4xx_hal::dma::traits::Stream;

/// Number of polls for a stream to stop: the stream ends its present transfer, some ten clocks.
const STOP_POLLS: u32 = 1_000;

/// Switches a stream off, so that it can be set up again (RM0390, 9.3.17), and clears its flags.
pub(crate) fn stop(stream: &mut impl Stream) {
    // SAFETY: a stream that is off transfers nothing.
    unsafe { stream.disable() };
    let _ = (0..STOP_POLLS).find(|_| !stream.is_enabled());
    stream.clear_all_flags();
}
