//! The client against scripted servers and slaves: correct ones, faulty ones, and ones that send random data.

mod abort_codes;
mod hostile;
mod lss;
mod nmt;
mod server;
mod transfers;
