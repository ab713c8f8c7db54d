//! PDOs of dictionaries made for the purpose.

mod bench;
mod interlocks;
mod places;
