//! The images on the emulated board. Needs the ELF files: `cargo xtask images` builds them.

mod adapter;
mod budget;
mod bus_faults;
mod chip_faults;
mod configuring;
mod conforming;
mod cost;
mod damage;
mod differential;
mod encoder;
mod faults;
mod lift;
mod lost_events;
mod measuring;
mod position_faults;
mod power_cycles;
mod races;
mod rules;
mod running;
mod saves;
mod sensor_faults;
mod stack;
mod start_up;
mod support;
mod timing;
mod update;
