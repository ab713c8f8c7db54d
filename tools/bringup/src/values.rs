//! The numbers of the values in 2005h (crates/bsp/src/start/self_test.rs), and its commands.

/// The upper bytes of what selects a value: "tes".
const KEY: u32 = 0x0074_6573 << 8;

/// DBGMCU_IDCODE.
pub const IDCODE: u8 = 0;
/// RCC_CR; then RCC_PLLCFGR and RCC_CFGR.
pub const RCC: u8 = 1;
/// FLASH_ACR.
pub const FLASH_ACR: u8 = 4;
/// FLASH_OPTCR.
pub const FLASH_OPTCR: u8 = 5;
/// GPIOB_IDR; GPIOA and GPIOC are beside it.
pub const PORT_B: u8 = 8;
/// VREFIN_CAL in the upper half; then TS_CAL1 and TS_CAL2.
pub const CALIBRATION: u8 = 11;
/// RCC_CSR at the start.
pub const RESET_FLAGS: u8 = 13;
/// The highest transmit and receive error counters.
pub const PEAKS: u8 = 14;
/// The counts of the six errors of LEC.
pub const ERRORS: u8 = 15;
/// The longest erase of a parameter page in microseconds.
pub const LONGEST_ERASE: u8 = 21;
/// Resets since power-on without a clock on OSC_IN, in the lower half.
pub const CLOCK_TRIES: u8 = 22;
/// The first eight bytes of the last SSI word.
pub const SSI_WORD: u8 = 23;
/// The conversions of two milliseconds, two in a word.
pub const CONVERSIONS: u8 = 25;

/// The frequency of the LSI in hertz, as TIM5 has measured it at the start; 0 in a release, as with the next ones.
pub const LSI: u8 = 105;
/// The result of the test in loop-back at the start.
pub const LOOP_BACK: u8 = 106;
/// The time from the start of the program to the clock of the PLL in microseconds.
pub const CLOCK_WAIT: u8 = 107;
/// Bytes of the stack that were never used.
pub const FREE_STACK: u8 = 108;

/// The results of the test in loop-back, from 1 on.
pub const LOOP_BACK_RESULTS: [&str; 5] = [
    "received as sent",
    "initialisation does not end, or not begin",
    "not sent",
    "not received",
    "another frame received",
];

/// The commands of a development image, with the words of the log after the reset.
pub const COMMANDS: [(u8, &str, &str); 4] = [
    (0xF0, "hang", "reset by independent watchdog"),
    (0xF1, "fault", "the last run ended in a fault"),
    (0xF2, "stack overflow", "the last run ended in a stack overflow"),
    (0xF3, "panic", "the last run ended in a panic"),
];

/// The value of a write to 2005h.
#[must_use]
pub const fn selection(number: u8) -> [u8; 4] {
    (KEY | number as u32).to_le_bytes()
}
