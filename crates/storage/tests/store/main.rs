//! Tests of the store on mock flashes, compared with a plain model of the stored values.

mod cells;
mod damage;
mod figures;
mod lookup;
mod model;
mod ordinary;
mod power_cuts;
mod random;
