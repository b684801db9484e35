//! NumPy's `.npy` files: f32 and f64, and integers where asked for.

/// Values of a grid in one of the two types the transforms run in.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Single precision.
    F32(Vec<f32>),
    /// Double precision, and integers.
    F64(Vec<f64>),
}

/// A row-major grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Length of each axis.
    pub shape: Vec<usize>,
    /// Values, the last axis running fastest.
    pub values: Values,
}

impl Values {
    /// `f32` or `f64`.
    pub fn name(&self) -> &'static str {
        match self {
            Values::F32(_) => "f32",
            Values::F64(_) => "f64",
        }
    }
}

/// The text between the quotes, or up to the next comma or bracket, after a key of the header's dictionary.
fn entry<'a>(header: &'a str, key: &str) -> Result<&'a str, String> {
    let missing = || format!("its header has no {key:?}");
    let at = header.find(&format!("'{key}'")).ok_or_else(missing)?;
    let rest = header[at + key.len() + 2..].trim_start().strip_prefix(':').ok_or_else(missing)?.trim_start();
    if let Some(quoted) = rest.strip_prefix('\'') {
        return quoted.split('\'').next().ok_or_else(missing);
    }
    if let Some(list) = rest.strip_prefix('(') {
        return list.split(')').next().ok_or_else(missing);
    }
    rest.split([',', '}']).next().map(str::trim).ok_or_else(missing)
}

/// Parses a file; its order (C or Fortran) and byte order may be any.
///
/// ```
/// use ondelette_io::npy::{Grid, Values, parse, write};
/// let grid = Grid { shape: vec![2, 1], values: Values::F64(vec![0.5, 2.0]) };
/// assert_eq!(parse(&write(&grid)), Ok(grid));
/// ```
///
/// # Errors
/// A sentence: no such file, an element type that is no number, a shape that does not fit the bytes.
pub fn parse(bytes: &[u8]) -> Result<Grid, String> {
    read(bytes, false)
}

/// As [`parse`], and integers of 1 to 8 bytes as f64.
///
/// # Errors
/// As [`parse`].
pub fn parse_numbers(bytes: &[u8]) -> Result<Grid, String> {
    read(bytes, true)
}

fn read(bytes: &[u8], integers: bool) -> Result<Grid, String> {
    let rest = bytes.strip_prefix(b"\x93NUMPY").ok_or("it is not a .npy file")?;
    let (version, rest) = rest.split_first_chunk::<2>().ok_or("it ends inside its header")?;
    let (len, rest) = match version[0] {
        1 => rest.split_first_chunk::<2>().map(|(n, r)| (usize::from(u16::from_le_bytes(*n)), r)),
        2 | 3 => rest.split_first_chunk::<4>().map(|(n, r)| (u32::from_le_bytes(*n) as usize, r)),
        v => return Err(format!("it has version {v} of the format; versions 1 to 3 are known")),
    }
    .ok_or("it ends inside its header")?;
    let (header, data) = rest.split_at_checked(len).ok_or("it ends inside its header")?;
    let header = std::str::from_utf8(header).map_err(|_| "its header is not text")?;
    let shape: Vec<usize> = entry(header, "shape")?
        .split(',')
        .map(str::trim)
        .filter(|n| !n.is_empty())
        .map(|n| n.parse().map_err(|_| format!("its shape has the entry {n:?}")))
        .collect::<Result<_, _>>()?;
    let descr = entry(header, "descr")?;
    let (big, kind) = match descr.as_bytes().first() {
        Some(b'<' | b'=') => (false, &descr[1..]),
        Some(b'>') => (true, &descr[1..]),
        _ => (false, descr),
    };
    let count = shape.iter().try_fold(1_usize, |n, &d| n.checked_mul(d)).ok_or("its shape is too large")?;
    let size = match kind.get(1..) {
        Some("1") if integers && matches!(kind, "i1" | "u1") => 1,
        Some("2") if integers && matches!(kind, "i2" | "u2") => 2,
        Some("4") if kind == "f4" || integers && matches!(kind, "i4" | "u4") => 4,
        Some("8") if kind == "f8" || integers && matches!(kind, "i8" | "u8") => 8,
        _ if integers => return Err(format!("it holds {descr:?}; floats and integers are read, convert it")),
        _ => {
            return Err(format!("it holds {descr:?}; only f32 ('<f4') and f64 ('<f8') can be transformed, convert it"));
        }
    };
    if count.checked_mul(size) != Some(data.len()) {
        return Err(format!("its shape {shape:?} of {descr} needs {count} values, the file has {} bytes", data.len()));
    }
    let order = |at: usize| match entry(header, "fortran_order") {
        Ok("True") => transposed_index(at, &shape),
        _ => at,
    };
    // the bytes of an element, little-endian, in the low end of eight
    let at = |i: usize| {
        let mut b = [0; 8];
        b[..size].copy_from_slice(&data[order(i) * size..][..size]);
        if big {
            b[..size].reverse();
        }
        b
    };
    let low = |i: usize| <[u8; 4]>::try_from(&at(i)[..4]).unwrap_or_default();
    let values = match kind.as_bytes()[0] {
        b'f' if size == 4 => Values::F32((0..count).map(|i| f32::from_le_bytes(low(i))).collect()),
        b'f' => Values::F64((0..count).map(|i| f64::from_le_bytes(at(i))).collect()),
        b'u' => Values::F64((0..count).map(|i| u64::from_le_bytes(at(i)) as f64).collect()),
        _ => {
            // an arithmetic shift keeps the sign
            let empty = 64 - 8 * size as u32;
            Values::F64((0..count).map(|i| ((i64::from_le_bytes(at(i)) << empty) >> empty) as f64).collect())
        }
    };
    Ok(Grid { shape, values })
}

/// Place in column-major order of row-major index `at`.
fn transposed_index(mut at: usize, shape: &[usize]) -> usize {
    let mut index = vec![0; shape.len()];
    for (i, &n) in index.iter_mut().zip(shape).rev() {
        *i = at % n;
        at /= n;
    }
    index.iter().zip(shape).rev().fold(0, |sum, (i, n)| sum * n + i)
}

/// A file with the given grid, little-endian, C order.
pub fn write(grid: &Grid) -> Vec<u8> {
    let descr = if matches!(grid.values, Values::F32(_)) { "<f4" } else { "<f8" };
    let dims: Vec<String> = grid.shape.iter().map(usize::to_string).collect();
    let shape = if dims.len() == 1 { format!("({},)", dims[0]) } else { format!("({})", dims.join(", ")) };
    let mut header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}");
    while (header.len() + 11) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend_from_slice(&(header.len() as u16).to_le_bytes());
    out.extend_from_slice(header.as_bytes());
    match &grid.values {
        Values::F32(v) => v.iter().for_each(|x| out.extend_from_slice(&x.to_le_bytes())),
        Values::F64(v) => v.iter().for_each(|x| out.extend_from_slice(&x.to_le_bytes())),
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_come_back() {
        for shape in [vec![6], vec![2, 3], vec![1, 3, 2]] {
            let grid = Grid { shape: shape.clone(), values: Values::F64((0..6).map(f64::from).collect()) };
            assert_eq!(parse(&write(&grid)), Ok(grid));
            let grid = Grid { shape, values: Values::F32((0..6).map(|i| i as f32).collect()) };
            assert_eq!(parse(&write(&grid)), Ok(grid));
        }
    }

    #[test]
    fn column_major_big_endian_files_are_read() {
        let header = "{'descr': '>f4', 'fortran_order': True, 'shape': (2, 3), }\n";
        let mut file = b"\x93NUMPY\x01\x00".to_vec();
        file.extend_from_slice(&(header.len() as u16).to_le_bytes());
        file.extend_from_slice(header.as_bytes());
        for x in [0.0_f32, 3.0, 1.0, 4.0, 2.0, 5.0] {
            file.extend_from_slice(&x.to_be_bytes());
        }
        let grid = Grid { shape: vec![2, 3], values: Values::F32(vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0]) };
        assert_eq!(parse(&file), Ok(grid));
    }

    #[test]
    fn integers_are_read_with_their_sign() {
        let header = "{'descr': '<i2', 'fortran_order': False, 'shape': (3,), }\n";
        let mut file = b"\x93NUMPY\x01\x00".to_vec();
        file.extend_from_slice(&(header.len() as u16).to_le_bytes());
        file.extend_from_slice(header.as_bytes());
        [-5_i16, 7, i16::MIN].iter().for_each(|x| file.extend_from_slice(&x.to_le_bytes()));
        let grid = Grid { shape: vec![3], values: Values::F64(vec![-5.0, 7.0, -32768.0]) };
        assert_eq!(parse_numbers(&file), Ok(grid));
        assert!(parse(&file).is_err());
    }

    #[test]
    fn damaged_files_are_refused_without_panic() {
        let good = write(&Grid { shape: vec![2, 2], values: Values::F64(vec![1.0; 4]) });
        for cut in 0..good.len() {
            assert!(parse(&good[..cut]).is_err(), "cut at {cut}");
        }
        for at in 0..good.len() {
            let mut bad = good.clone();
            bad[at] ^= 0x55;
            // Any answer is fine, a panic is not.
            let _ = parse(&bad);
        }
    }
}
