//! The web server of `nodectl serve`. It contains the files of the page, accepts WebSockets from browsers, and carries
//! texts between the pages and the service that knows the bus. The texts are defined in `PROTOCOL.md`; the server does
//! not read them.
//!
//! The module `access` decides which requests are allowed. The queue of each page is bounded ([`Hub`]), so that a page
//! that does not read, sends nonsense or sends nothing does not disturb the others.

mod access;
mod files;
mod hub;
mod listen;
mod pace;
mod places;
mod routes;
mod socket;

pub use access::Token;
pub use hub::{FromPage, Hub, PageId};
pub use listen::{Options, Server, start};
pub(crate) use socket::LARGEST;
