//! The web server of `nodectl serve`: it has the files of the page inside itself, takes WebSockets from browsers, and carries
//! texts between them and a service that knows the bus. What the texts say is in `PROTOCOL.md`; nothing here reads them.
//!
//! Whoever may connect is decided by the module `access`; what waits for a page is bounded ([`Hub`]), so that a page that does not
//! read, says nonsense or says nothing at all costs the others nothing.
#![forbid(unsafe_code)]

mod access;
mod files;
mod hub;
mod listen;
mod pace;
mod routes;
mod socket;

pub use access::Token;
pub use hub::{FromPage, Hub, PageId};
pub use listen::{Options, Server, start};
