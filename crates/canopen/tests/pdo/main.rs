//! PDOs of dictionaries made for the purpose.

mod bench;
mod interlocks;
mod many;
mod places;
