//! bxCAN as its driver and the bus use it.

mod filters;
mod modes;
mod receive;
mod rig;
mod transmit;
