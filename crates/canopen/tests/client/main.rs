//! The client against servers and slaves that are scripted: good ones, bad ones, and ones that say anything.

mod abort_codes;
mod hostile;
mod lss;
mod server;
mod transfers;
