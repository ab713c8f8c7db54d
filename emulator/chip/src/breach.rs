//! The rules that silicon enforces, with their places in the manuals.

use thiserror::Error;

/// A rule that a program has broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Error)]
pub enum Breach {
    /// The flash is read with too few wait states (RM0390 table 5, RM0090 table 10, for 2.7 to 3.6 V).
    #[error("{states} wait states of the flash at {hertz} Hz; it needs {least}")]
    WaitStates {
        /// HCLK in hertz.
        hertz: u64,
        /// FLASH_ACR.LATENCY.
        states: u32,
        /// The least number of wait states.
        least: u32,
    },
    /// A clock outside its limits (DS10693 and DS8626, general operating conditions and PLL characteristics).
    #[error("{name} at {hertz} Hz; the data sheet allows {least} to {most} Hz")]
    Clock {
        /// The name of the clock.
        name: &'static str,
        /// The frequency of the clock.
        hertz: u64,
        /// The lowest allowed frequency.
        least: u64,
        /// The highest allowed frequency.
        most: u64,
    },
    /// A peripheral is used, but the pin is not switched to the peripheral.
    #[error("P{port}{pin} is not switched to {function}")]
    Pin {
        /// The port: `'A'` to `'I'`.
        port: char,
        /// The pin: 0 to 15.
        pin: u32,
        /// The function that the board needs at the pin.
        function: &'static str,
    },
    /// The sampling time of a source is too short (DS10693, temperature sensor and internal reference characteristics).
    #[error("ADC channel {channel} is sampled for {nanoseconds} ns; it takes {least} ns")]
    SamplingTime {
        /// The channel.
        channel: u32,
        /// The sampling time.
        nanoseconds: u64,
        /// The least sampling time.
        least: u64,
    },
    /// CAN samples outside the range that CiA 301 gives, 85 to 90 % of the bit.
    #[error("CAN samples at {permille} permille of a bit; CiA 301 allows 850 to 900")]
    SamplePoint {
        /// The sample point, as a share of the bit in permille.
        permille: u32,
    },
    /// CAN1 joins the bus while its transceiver sleeps.
    #[error("CAN joins the bus with its transceiver asleep: P{port}{pin}")]
    Asleep {
        /// The port of the pin that puts the transceiver to sleep: `'A'` to `'I'`.
        port: char,
        /// The pin: 0 to 15.
        pin: u32,
    },
    /// A DMA stream is enabled before the flags of its last transfer were cleared (RM0390 section 9.5.5, EN).
    #[error("stream {stream} of DMA{controller} begins with flags of its last transfer")]
    DmaFlags {
        /// The controller: 1 or 2.
        controller: usize,
        /// The stream: 0 to 7.
        stream: usize,
    },
    /// An access to a peripheral whose clock is off or whose reset is held.
    #[error("{name} is accessed without its clock")]
    ClockOff {
        /// The name of the peripheral.
        name: &'static str,
    },
    /// A master's SPI samples by the clock that it reads back from its pin, which is too late at the lowest output speed
    /// (ES0298 2.14, ES0182 2.12.4).
    #[error("P{port}{pin} has the lowest output speed; {function} needs more")]
    PinSpeed {
        /// The port: `'A'` to `'I'`.
        port: char,
        /// The pin: 0 to 15.
        pin: u32,
        /// The function of the pin.
        function: &'static str,
    },
    /// WFI in flash at an address that is not a multiple of eight, with DBG_SLEEP set: the core may execute wrong
    /// instructions afterwards (ES0298 and ES0182, debugging Sleep/Stop mode with WFE/WFI entry).
    #[error("WFI at {address:#010x} in flash with DBG_SLEEP set; it needs a multiple of eight")]
    Sleep {
        /// The address of the instruction.
        address: u32,
    },
    /// The system clock is switched before new dividers of the buses are in force (RM0390 section 6.3.3, PPRE1).
    #[error("the system clock is switched {cycles} cycles after a divider; it takes 16")]
    Divider {
        /// The HCLK cycles since the change of the divider.
        cycles: u64,
    },
    /// An operation of the flash by words of 32 bits, with a supply below 2.7 V (RM0390 table 7, PSIZE).
    #[error("the flash is changed by words at {millivolts} mV; words need 2700 mV")]
    FlashSupply {
        /// The supply.
        millivolts: u32,
    },
    /// System memory, which has the unique identifier and the calibration, is flash: a read during an operation of the flash
    /// stops the core until its end, up to 2 s (RM0390 section 3.5).
    #[error("system memory is read while the flash is busy")]
    SystemMemory,
    /// A write to the backup domain while it is protected.
    #[error("{name} is written while the backup domain is protected")]
    Protected {
        /// The name of the peripheral.
        name: &'static str,
    },
    /// The voltage scale of the core is changed while the PLL is on (RM0390 section 5.4.1, VOS).
    #[error("the voltage scale is changed while the PLL is on")]
    VoltageScale,
    /// The core is switched to over-drive before over-drive is on (RM0390 section 5.1.4, entering over-drive mode).
    #[error("the core is switched to over-drive without over-drive")]
    OverDrive,
    /// HSEBYP is written while HSE is on (RM0390 section 6.3.1).
    #[error("HSEBYP is changed while HSE is on")]
    Bypass,
    /// HSE is set to something else than what the board has at `OSC_IN`.
    #[error("HSE is switched on for {set}, but the board has {present}")]
    Oscillator {
        /// The setting of the program.
        set: &'static str,
        /// The property of the board.
        present: &'static str,
    },
    /// The flash is changed by double words, for which VPP needs 8 to 9 V (RM0390 table 7, PSIZE).
    #[error("the flash is changed by double words without VPP")]
    NoVpp,
    /// A conversion starts before the ADC is stable (DS10693, tSTAB).
    #[error("a conversion starts {nanoseconds} ns after ADON; the ADC is stable after {least} ns")]
    Stabilisation {
        /// The time since ADON.
        nanoseconds: u64,
        /// The least time.
        least: u64,
    },
    /// A stream is set up again before its EN reads 0 (RM0390 section 9.3.18).
    #[error("stream {stream} of DMA{controller} is set up before it has stopped")]
    DmaStop {
        /// The controller: 1 or 2.
        controller: usize,
        /// The stream: 0 to 7.
        stream: usize,
    },
    /// An address of a stream is no multiple of its width (RM0390 section 9.3.11).
    #[error("stream {stream} of DMA{controller} has an address that is no multiple of its width")]
    DmaAddress {
        /// The controller: 1 or 2.
        controller: usize,
        /// The stream: 0 to 7.
        stream: usize,
    },
    /// A line of a cache of the flash is used although the flash has changed (RM0390 section 3.4.2).
    #[error("the cache of the {what} has a line of the flash at {address:#010x} from before its change")]
    StaleCache {
        /// Code or constants.
        what: &'static str,
        /// The line.
        address: u32,
    },
    /// VTOR is not aligned to the size of the vector table, rounded up to a power of two (ARMv7-M, B3.2.5).
    #[error("the vector table at {address:#010x} is not aligned to {least} bytes")]
    VectorTable {
        /// VTOR.
        address: u32,
        /// The least alignment.
        least: u32,
    },
    /// A function that the emulator does not model.
    #[error("{what} is not modelled")]
    NotModelled {
        /// The name of the function.
        what: &'static str,
    },
}
