//! The mean colour of a picture: what a texture contributes to a material that has one reflectance.

use image::{DynamicImage, ImageReader, Limits};
use std::io::Cursor;

/// Largest width or height of a texture in pixels.
const LARGEST_SIDE: u32 = 16_384;
/// Largest decoded size of a texture in bytes.
const LARGEST_PICTURE: u64 = 1 << 29;

/// Mean assumed for a picture in a format that is not read.
pub(super) const UNREAD: f64 = 0.5;

/// Why there is no mean.
pub(super) enum Unread {
    /// The picture is in a format that is not read: go on with [`UNREAD`].
    Format(String),
    /// The picture is missing or broken.
    Broken(String),
}

/// Mean of each channel of a picture, in [0, 1].
pub(super) struct Mean {
    /// Red, green, blue decoded from sRGB: linear light.
    pub(super) linear: [f64; 3],
    /// The values as stored (for textures that are no colours).
    pub(super) stored: [f64; 3],
}

/// Decodes a PNG or JPEG picture and averages it over its pixels; transparency does not count.
pub(super) fn mean(bytes: &[u8]) -> Result<Mean, Unread> {
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|error| Unread::Broken(format!("the picture cannot be read: {error}")))?;
    match reader.format() {
        Some(image::ImageFormat::Png | image::ImageFormat::Jpeg) => {}
        _ => return Err(Unread::Format("the picture is neither PNG nor JPEG".into())),
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(LARGEST_SIDE);
    limits.max_image_height = Some(LARGEST_SIDE);
    limits.max_alloc = Some(LARGEST_PICTURE);
    reader.limits(limits);
    let picture = reader.decode().map_err(|error| Unread::Broken(format!("the picture is broken: {error}")))?;
    Ok(average(picture))
}

fn average(picture: DynamicImage) -> Mean {
    let mut linear = [0.0; 3];
    let mut stored = [0.0; 3];
    let pixels = f64::from(picture.width()) * f64::from(picture.height());
    let deep = matches!(
        picture,
        DynamicImage::ImageLuma16(_)
            | DynamicImage::ImageLumaA16(_)
            | DynamicImage::ImageRgb16(_)
            | DynamicImage::ImageRgba16(_)
    );
    if deep {
        for pixel in picture.into_rgb16().pixels() {
            for (channel, &value) in pixel.0.iter().enumerate() {
                let value = f64::from(value) / 65535.0;
                stored[channel] += value;
                linear[channel] += decode_srgb(value);
            }
        }
    } else {
        // Counting values first makes the sum exact and its cost one addition a channel.
        let mut counts = [[0u64; 256]; 3];
        for pixel in picture.into_rgb8().pixels() {
            for (channel, &value) in pixel.0.iter().enumerate() {
                counts[channel][usize::from(value)] += 1;
            }
        }
        for (channel, counts) in counts.iter().enumerate() {
            for (value, &count) in (0u8..=255).zip(counts) {
                let value = f64::from(value) / 255.0;
                #[expect(clippy::cast_precision_loss, reason = "pixel counts stay far below 2^53")]
                let count = count as f64;
                stored[channel] += count * value;
                linear[channel] += count * decode_srgb(value);
            }
        }
    }
    Mean { linear: linear.map(|s| s / pixels), stored: stored.map(|s| s / pixels) }
}

/// IEC 61966-2-1: linear light of an sRGB value in [0, 1].
fn decode_srgb(value: f64) -> f64 {
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgb, RgbImage};

    /// Half black and half white reflects half the light; the mean of the stored values would be called 0.21 in
    /// linear light.
    #[test]
    fn pictures_are_averaged_in_linear_light() {
        let checks = RgbImage::from_fn(4, 4, |x, y| if (x + y) % 2 == 0 { Rgb([255; 3]) } else { Rgb([0; 3]) });
        let mean = average(DynamicImage::ImageRgb8(checks));
        assert!((mean.linear[0] - 0.5).abs() < 1e-15);
        let grey = RgbImage::from_pixel(3, 2, Rgb([188, 188, 188]));
        let mean = average(DynamicImage::ImageRgb8(grey.clone()));
        assert!((mean.linear[1] - 0.5029).abs() < 1e-4, "sRGB 188 is 0.5029 linear, not {}", mean.linear[1]);
        assert!((mean.stored[1] - 188.0 / 255.0).abs() < 1e-15);
        let deep = DynamicImage::ImageRgb16(DynamicImage::ImageRgb8(grey).to_rgb16());
        assert!((average(deep).linear[1] - mean.linear[1]).abs() < 1e-4);
    }
}
