//! Tests of the least-squares solver: against certified and classic problems, derivatives by dual numbers, the dense
//! solution of grouped problems, and samples of known errors.

mod classics;
mod duals;
mod flat;
mod grouped;
mod information;
mod manifolds;
mod nist;
mod priors;
mod sample;
mod stationary;
