//! An emulated Cortex-M4 with its NVIC that runs ELF files in virtual time.
