//! Height fields: arrays (.npy), ESRI ASCII grids (.asc) and grey pictures (.png, 8 and 16 bits).

use crate::npy::{self, Grid, Values};
use image::{DynamicImage, ImageFormat, ImageReader, Limits};
use std::fmt::Write;
use std::io::Cursor;

/// Heights on a grid; some may be missing.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightField {
    /// Rows and columns.
    pub shape: [usize; 2],
    /// Heights, row by row from the top of the file; 0 where they are missing.
    pub heights: Vec<f64>,
    /// Which heights are known; empty if all are.
    pub known: Vec<bool>,
    /// Height and width of a cell (rows and columns apart), in the units of the file; 1 if it does not say.
    pub cell: [f64; 2],
    /// Lower left corner of the last row's first cell (x, y), in the units of the file; 0 if it does not say.
    pub corner: [f64; 2],
}

/// Most heights of a file.
const MOST: usize = 1 << 28;

impl HeightField {
    /// Heights that are all known.
    ///
    /// # Errors
    /// A sentence: another number of heights than the shape says, one that is not finite, none at all.
    pub fn new(shape: [usize; 2], heights: Vec<f64>) -> Result<HeightField, String> {
        let want = shape[0].checked_mul(shape[1]).filter(|n| *n <= MOST).ok_or("more heights than can be held")?;
        if want == 0 {
            return Err("the height field is empty".to_owned());
        }
        if heights.len() != want {
            return Err(format!("{} heights for {} x {}", heights.len(), shape[0], shape[1]));
        }
        if let Some(i) = heights.iter().position(|h| !h.is_finite()) {
            return Err(format!("the height in row {}, column {} is {}", i / shape[1], i % shape[1], heights[i]));
        }
        Ok(HeightField { shape, heights, known: Vec::new(), cell: [1.0; 2], corner: [0.0; 2] })
    }

    /// Whether a height is known.
    pub fn is_known(&self, i: usize) -> bool {
        self.known.is_empty() || self.known[i]
    }

    /// Heights of which those that are not numbers are missing.
    fn with_gaps(
        shape: [usize; 2],
        mut heights: Vec<f64>,
        missing: impl Fn(f64) -> bool,
    ) -> Result<HeightField, String> {
        let known: Vec<bool> = heights.iter().map(|h| !missing(*h)).collect();
        heights.iter_mut().zip(&known).filter(|h| !h.1).for_each(|h| *h.0 = 0.0);
        let mut out = HeightField::new(shape, heights)?;
        if !known.contains(&true) {
            return Err("every height is missing".to_owned());
        }
        if known.contains(&false) {
            out.known = known;
        }
        Ok(out)
    }
}

/// Reads a `.npy` file of two axes; not-a-number means missing.
///
/// # Errors
/// A sentence: a broken file, another number of axes, infinite heights.
pub fn read_npy(bytes: &[u8]) -> Result<HeightField, String> {
    let grid = npy::parse_numbers(bytes)?;
    let &[rows, columns] = grid.shape.as_slice() else {
        return Err(format!("its shape {:?} has not two axes", grid.shape));
    };
    let heights = match grid.values {
        Values::F32(v) => v.into_iter().map(f64::from).collect(),
        Values::F64(v) => v,
    };
    HeightField::with_gaps([rows, columns], heights, f64::is_nan)
}

/// A `.npy` file of f64; missing heights are not-a-number.
pub fn write_npy(field: &HeightField) -> Vec<u8> {
    let height = |(i, h): (usize, &f64)| if field.is_known(i) { *h } else { f64::NAN };
    let values = Values::F64(field.heights.iter().enumerate().map(height).collect());
    npy::write(&Grid { shape: field.shape.to_vec(), values })
}

/// Reads an ESRI ASCII grid; cells that are not square have `dx` and `dy`, as GDAL writes them.
///
/// # Errors
/// A sentence: a header or a number that is none, another number of heights than it says.
pub fn read_asc(text: &str) -> Result<HeightField, String> {
    let mut words = text.split_whitespace().peekable();
    let (mut rows, mut columns, mut cell, mut gap) = (None, None, [1.0; 2], -9999.0);
    let (mut corner, mut centred) = ([0.0; 2], [false; 2]);
    // A first height that is no number begins with a letter, too.
    let is_name = |w: &&str| w.starts_with(|c: char| c.is_ascii_alphabetic()) && w.parse::<f64>().is_err();
    while let Some(name) = words.next_if(is_name) {
        let value = words.next().unwrap_or_default();
        let number = || value.parse::<f64>().map_err(|_| format!("{name} {value:?} is no number"));
        let count = || value.parse::<usize>().map_err(|_| format!("{name} {value:?} is no count"));
        match name.to_ascii_lowercase().as_str() {
            "ncols" => columns = Some(count()?),
            "nrows" => rows = Some(count()?),
            "cellsize" => cell = [number()?; 2],
            "dx" => cell[1] = number()?,
            "dy" => cell[0] = number()?,
            "nodata_value" => gap = number()?,
            name @ ("xllcorner" | "yllcorner" | "xllcenter" | "yllcenter") => {
                let axis = usize::from(name.starts_with('y'));
                (corner[axis], centred[axis]) = (number()?, name.ends_with("center"));
            }
            _ => return Err(format!("{name:?} is no line of an ASCII grid's header")),
        }
    }
    let (Some(rows), Some(columns)) = (rows, columns) else {
        return Err("no ASCII grid: ncols and nrows are missing".to_owned());
    };
    if let Some(size) = cell.iter().find(|c| !(**c > 0.0 && c.is_finite())) {
        return Err(format!("the cell size is {size}"));
    }
    // Rows are along y.
    for axis in (0..2).filter(|a| centred[*a]) {
        corner[axis] -= 0.5 * cell[1 - axis];
    }
    if let Some(place) = corner.iter().find(|c| !c.is_finite()) {
        return Err(format!("the corner is at {place}"));
    }
    // the text is longer than the numbers it holds: nothing is reserved for those it only promises
    let heights = words
        .map(|w| w.parse::<f64>().map_err(|_| format!("{w:?} is no number")))
        .collect::<Result<Vec<f64>, String>>()?;
    let missing = |h: f64| h == gap || h.is_nan();
    let mut out = HeightField::with_gaps([rows, columns], heights, missing)?;
    (out.cell, out.corner) = (cell, corner);
    Ok(out)
}

/// An ESRI ASCII grid; `dx` and `dy` instead of `cellsize` where cells are not square.
pub fn write_asc(field: &HeightField) -> String {
    let [rows, columns] = field.shape;
    let mut gap = -9999.0;
    while field.heights.contains(&gap) {
        gap = gap * 10.0 - 9.0;
    }
    let [[x, y], [dy, dx]] = [field.corner, field.cell];
    let size = if dx == dy { format!("cellsize {dx}") } else { format!("dx {dx}\ndy {dy}") };
    let mut out = format!("ncols {columns}\nnrows {rows}\nxllcorner {x}\nyllcorner {y}\n{size}\nNODATA_value {gap}\n");
    for (i, h) in field.heights.iter().enumerate() {
        // Writing to a String does not fail.
        let _ = write!(out, "{}", if field.is_known(i) { *h } else { gap });
        out.push(if (i + 1) % columns == 0 { '\n' } else { ' ' });
    }
    out
}

/// Reads a grey `.png` picture of 8 or 16 bits: heights 0 to 255 or 65535. Colours are refused.
///
/// # Errors
/// A sentence: a broken file, a picture of another kind.
pub fn read_png(bytes: &[u8]) -> Result<HeightField, String> {
    let mut reader = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Png);
    let mut limits = Limits::default();
    limits.max_alloc = Some(1 << 30);
    reader.limits(limits);
    let picture = reader.decode().map_err(|e| format!("the picture is broken: {e}"))?;
    let shape = [picture.height() as usize, picture.width() as usize];
    let heights = match picture {
        DynamicImage::ImageLuma8(p) => p.into_raw().into_iter().map(f64::from).collect(),
        DynamicImage::ImageLuma16(p) => p.into_raw().into_iter().map(f64::from).collect(),
        _ => return Err("the picture has colours or transparency: a height field is grey".to_owned()),
    };
    HeightField::new(shape, heights)
}

/// A grey `.png` picture of 16 bits; returns it with the heights that 0 and 65535 stand for. Missing heights are 0.
///
/// # Errors
/// A picture larger than PNG allows.
pub fn write_png(field: &HeightField) -> Result<(Vec<u8>, [f64; 2]), String> {
    let known = || field.heights.iter().enumerate().filter(|(i, _)| field.is_known(*i)).map(|(_, h)| *h);
    let (low, high) = (known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max));
    let by = if high > low { 65535.0 / (high - low) } else { 0.0 };
    let value = |(i, h): (usize, &f64)| if field.is_known(i) { ((h - low) * by).round() as u16 } else { 0 };
    let values: Vec<u16> = field.heights.iter().enumerate().map(value).collect();
    let side = |n: usize| u32::try_from(n).map_err(|_| format!("a side of {n} is more than PNG allows"));
    let picture =
        image::ImageBuffer::<image::Luma<u16>, _>::from_raw(side(field.shape[1])?, side(field.shape[0])?, values)
            .ok_or("the shape does not fit the heights")?;
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, ImageFormat::Png).map_err(|e| format!("encoding the PNG failed: {e}"))?;
    Ok((bytes.into_inner(), [low, high]))
}
