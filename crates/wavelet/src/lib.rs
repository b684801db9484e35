//! Wavelet bases.

pub mod cell;
