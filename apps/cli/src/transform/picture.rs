//! Pictures as grids: .png (values 0 to 1) and .exr (linear), channels last.

use std::path::Path;

use ondelette_io::npy::{Grid, Values};
use ondelette_io::write::write_bytes;

/// True for endings that are taken by channel.
pub(crate) fn is_picture(path: &Path) -> bool {
    matches!(ending(path).as_str(), "png" | "exr")
}

pub(crate) fn ending(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// Reads a picture as rows x columns x channels of f32; parsers that panic on broken files are contained.
pub(crate) fn read(path: &Path) -> Result<Grid, String> {
    let read = || if ending(path) == "png" { read_png(path) } else { read_exr(path) };
    match std::panic::catch_unwind(read) {
        Ok(done) => done,
        Err(_) => Err("its decoder gave up: the file is damaged".to_owned()),
    }
}

fn read_png(path: &Path) -> Result<Grid, String> {
    let mut reader = image::ImageReader::open(path).map_err(|e| e.to_string())?;
    reader.set_format(image::ImageFormat::Png);
    let picture = reader.decode().map_err(|e| e.to_string())?;
    let (w, h) = (picture.width() as usize, picture.height() as usize);
    let (channels, values) = match picture.color().channel_count() {
        1 => (1, picture.to_luma16().into_raw()),
        2 => (2, picture.to_luma_alpha16().into_raw()),
        3 => (3, picture.to_rgb16().into_raw()),
        _ => (4, picture.to_rgba16().into_raw()),
    };
    let values = values.iter().map(|&v| f32::from(v) / 65535.0).collect();
    Ok(Grid { shape: vec![h, w, channels], values: Values::F32(values) })
}

fn read_exr(path: &Path) -> Result<Grid, String> {
    let picture = exr::prelude::read_first_rgba_layer_from_file(
        path,
        |size, _| (size.width(), vec![0.0_f32; size.width() * size.height() * 3]),
        |(width, values), at, (r, g, b, _): (f32, f32, f32, f32)| {
            values[(at.y() * *width + at.x()) * 3..][..3].copy_from_slice(&[r, g, b]);
        },
    )
    .map_err(|e| e.to_string())?;
    let (width, values) = picture.layer_data.channel_data.pixels;
    let height = picture.layer_data.size.height();
    Ok(Grid { shape: vec![height, width, 3], values: Values::F32(values) })
}

/// Writes rows x columns x channels as a picture.
pub(crate) fn write(path: &Path, grid: &Grid) -> Result<(), String> {
    let (h, w, c) = match grid.shape[..] {
        [h, w] => (h, w, 1),
        [h, w, c @ 1..=4] => (h, w, c),
        _ => {
            return Err(format!(
                "{}: a picture has rows, columns and 1 to 4 channels, this is {:?}",
                path.display(),
                grid.shape
            ));
        }
    };
    let values: Vec<f32> = match &grid.values {
        Values::F32(v) => v.clone(),
        Values::F64(v) => v.iter().map(|x| *x as f32).collect(),
    };
    let mut bytes = std::io::Cursor::new(Vec::new());
    let failed = |e: String| format!("{}: {e}", path.display());
    if ending(path) == "png" {
        let color = [
            image::ExtendedColorType::L16,
            image::ExtendedColorType::La16,
            image::ExtendedColorType::Rgb16,
            image::ExtendedColorType::Rgba16,
        ][c - 1];
        let raw: Vec<u8> =
            values.iter().flat_map(|v| ((v.clamp(0.0, 1.0) * 65535.0).round() as u16).to_ne_bytes()).collect();
        image::write_buffer_with_format(&mut bytes, &raw, w as u32, h as u32, color, image::ImageFormat::Png)
            .map_err(|e| failed(e.to_string()))?;
    } else {
        let pixel = |x: usize, y: usize| {
            let at = (y * w + x) * c;
            let v = |i: usize| values[at + i.min(c - 1)];
            if c < 3 { (v(0), v(0), v(0)) } else { (v(0), v(1), v(2)) }
        };
        use exr::prelude::WritableImage;
        let picture = exr::prelude::Image::from_channels(
            (w, h),
            exr::prelude::SpecificChannels::rgb(|at: exr::prelude::Vec2<usize>| pixel(at.x(), at.y())),
        );
        picture.write().to_buffered(&mut bytes).map_err(|e| failed(e.to_string()))?;
    }
    write_bytes(path, bytes.get_ref()).map_err(|e| e.to_string())
}
