//! Encoders as CiA 406 describes them: from native steps of a sensor to position, speed, cams and work area.
//!
//! ```text
//! sensor word -> Tracker -> Shaft -> Scale -> + offset -> position 6004h -> cams 6300h, area 6400h
//!                             |
//!                             +---> Speedometer -> speed 6030h
//! ```
//!
//! Everything here is arithmetic on values; where they come from (a timer in encoder mode, an SSI word) and where
//! they go (the object dictionary) is the caller's affair.

mod area;
mod cam;
mod scale;
mod shaft;
mod speed;
mod ssi;

pub use area::{Area, AreaState};
pub use cam::{Cam, CamChannel, CamControl};
pub use scale::{Invalid, Native, Scale, Settings};
pub use shaft::{Shaft, Tracker};
pub use speed::{Ratio, Speedometer};
pub use ssi::{Coding, Fault, Format, Parity, Reading};
