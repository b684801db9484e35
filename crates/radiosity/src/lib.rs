//! Diffuse interreflection of light by wavelet radiosity (thesis chapters 3 and 4).

mod rgb;
pub mod scene;

pub use rgb::Rgb;
pub use scene::Scene;
