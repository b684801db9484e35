//! Wavelet bases.
