//! The interface of the chip to a program: loads and stores by address, interrupt lines, effects.

mod backup;
mod clocks;
mod conversions;
mod encoder;
mod flash;
mod flash_interface;
mod misuse;
mod others;
mod protection;
mod rules;
mod support;
mod timers;
mod watchdog;
