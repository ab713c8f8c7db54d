//! The store on mock flashes, beside a plain model of what should be stored.

mod damage;
mod figures;
mod lookup;
mod model;
mod ordinary;
mod power_cuts;
mod random;
