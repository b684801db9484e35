//! Pictures: tone-mapped PNG for looking at, linear EXR for measuring.

use super::{WriteError, write_bytes};
use exr::meta::header::LayerAttributes;
use exr::prelude::{Encoding, Image, Layer, SpecificChannels, Text, Vec2, WritableImage};
use image::ImageEncoder;
use std::io::Cursor;
use std::path::Path;

/// Writes 8-bit sRGB `pixels`, row by row from the top left, as the PNG file `path`.
///
/// # Errors
/// `pixels` does not hold `width * height` entries, a side is 0, or the file cannot be written.
///
/// ```
/// use ondelette_io::write::{ToneMap, write_png};
/// let folder = tempfile::tempdir().unwrap();
/// let linear = [[0.1, 0.2, 0.3], [1.0, 1.0, 1.0]];
/// let tone = ToneMap::auto(&linear);
/// write_png(&folder.path().join("two.png"), 2, 1, &linear.map(|p| tone.encode(p))).unwrap();
/// ```
pub fn write_png(path: &Path, width: u32, height: u32, pixels: &[[u8; 3]]) -> Result<(), WriteError> {
    let bytes = png_bytes(width, height, pixels).map_err(|reason| WriteError::data(path, reason))?;
    write_bytes(path, &bytes)
}

/// Writes `linear` pixels, row by row from the top left, as the EXR file `path`: 32-bit floats, channels R, G, B,
/// ZIP-compressed, with `attributes` (name, value) such as exposure, quantity and unit in the header's `comments`, a
/// line each.
///
/// # Errors
/// `linear` does not hold `width * height` finite entries, a side is 0, or the file cannot be written.
///
/// ```
/// let folder = tempfile::tempdir().unwrap();
/// let path = folder.path().join("two.exr");
/// ondelette_io::write::write_exr(&path, 2, 1, &[[0.0; 3], [7.5; 3]], &[("unit", "W/(m^2 sr)")]).unwrap();
/// ```
pub fn write_exr(
    path: &Path,
    width: u32,
    height: u32,
    linear: &[[f32; 3]],
    attributes: &[(&str, &str)],
) -> Result<(), WriteError> {
    let bytes = exr_bytes(width, height, linear, attributes).map_err(|reason| WriteError::data(path, reason))?;
    write_bytes(path, &bytes)
}

/// The bytes of [`write_png`]'s file.
///
/// # Errors
/// A sentence saying what is wrong with the picture.
pub fn png_bytes(width: u32, height: u32, pixels: &[[u8; 3]]) -> Result<Vec<u8>, String> {
    check_size(width, height, pixels.len())?;
    let mut bytes = Vec::new();
    image::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(pixels.as_flattened(), width, height, image::ExtendedColorType::Rgb8)
        .map_err(|e| format!("encoding the PNG failed: {e}"))?;
    Ok(bytes)
}

/// The bytes of [`write_exr`]'s file.
///
/// # Errors
/// A sentence saying what is wrong with the picture.
pub fn exr_bytes(width: u32, height: u32, linear: &[[f32; 3]], attributes: &[(&str, &str)]) -> Result<Vec<u8>, String> {
    check_size(width, height, linear.len())?;
    if let Some(i) = linear.iter().position(|p| p.iter().any(|c| !c.is_finite())) {
        let (x, y) = (i % width as usize, i / width as usize);
        return Err(format!("the pixel in column {x}, row {y} is {:?}, which is not finite", linear[i]));
    }
    // One text field and not custom attributes: the library keeps those in a hash map, which it writes in random order.
    let comments: String = attributes.iter().map(|(name, value)| format!("{name}: {value}\n")).collect();
    let text = |s: &str| Text::new_or_none(s).ok_or_else(|| format!("EXR headers cannot hold the text {s:?}"));
    let software = concat!("Ondelette ", env!("CARGO_PKG_VERSION"));
    let layer = LayerAttributes {
        comments: if comments.is_empty() { None } else { Some(text(&comments)?) },
        software_name: Some(text(software)?),
        ..LayerAttributes::default()
    };
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
        let [r, g, b] = linear[at.y() * width as usize + at.x()];
        (r, g, b)
    });
    let layer = Layer::new((width as usize, height as usize), layer, Encoding::SMALL_LOSSLESS, channels);
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)
        .map_err(|e| format!("encoding the EXR failed: {e}"))?;
    Ok(bytes.into_inner())
}

fn check_size(width: u32, height: u32, pixels: usize) -> Result<(), String> {
    if width == 0 || height == 0 {
        return Err(format!("a picture of {width} x {height} pixels is empty"));
    }
    if pixels as u64 != u64::from(width) * u64::from(height) {
        return Err(format!("{pixels} pixels do not make a picture of {width} x {height}"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(width: u32, height: u32) -> Vec<[f32; 3]> {
        (0..width * height).map(|i| [i as f32 * 0.37, 1e-7 * i as f32, 1000.0 - i as f32]).collect()
    }

    #[test]
    fn png_pixels_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let pixels: Vec<[u8; 3]> = (0..12u8).map(|i| [i, 100 + i, 255 - i]).collect();
        write_png(&path, 4, 3, &pixels).unwrap();
        let back = image::open(&path).unwrap().into_rgb8();
        assert_eq!(back.dimensions(), (4, 3));
        assert_eq!(back.get_pixel(1, 2).0, pixels[9]);
    }

    #[test]
    fn exr_pixels_read_back_to_the_bit_with_their_unit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let linear = ramp(37, 21);
        write_exr(&path, 37, 21, &linear, &[("quantity", "radiance"), ("unit", "W/(m^2 sr)")]).unwrap();
        let image = exr::prelude::read_first_rgba_layer_from_file(
            &path,
            |size, _| (size.width(), vec![[0f32; 3]; size.width() * size.height()]),
            |(width, pixels), at, (r, g, b, _): (f32, f32, f32, f32)| pixels[at.y() * *width + at.x()] = [r, g, b],
        )
        .unwrap();
        assert_eq!(image.layer_data.channel_data.pixels.1, linear);
        let comments = image.layer_data.attributes.comments.unwrap().to_string();
        assert!(comments.contains("unit: W/(m^2 sr)"), "{comments}");
    }

    #[test]
    fn the_same_pixels_give_the_same_bytes() {
        let linear = ramp(64, 48);
        let names = [("a", "1"), ("b", "2"), ("c", "3"), ("d", "4")];
        let once = exr_bytes(64, 48, &linear, &names).unwrap();
        for _ in 0..8 {
            assert_eq!(exr_bytes(64, 48, &linear, &names).unwrap(), once);
        }
    }

    #[test]
    fn pictures_that_cannot_be_are_refused_by_pixel() {
        assert!(png_bytes(2, 2, &[[0; 3]; 3]).unwrap_err().contains("3 pixels"));
        assert!(png_bytes(0, 2, &[]).unwrap_err().contains("empty"));
        let mut linear = ramp(4, 4);
        linear[6][1] = f32::NAN;
        assert!(exr_bytes(4, 4, &linear, &[]).unwrap_err().contains("column 2, row 1"));
        assert!(exr_bytes(4, 4, &ramp(4, 4), &[("unit", "Ω")]).unwrap_err().contains("cannot hold"));
    }
}
