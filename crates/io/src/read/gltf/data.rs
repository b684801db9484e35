//! Buffers and accessors: numbers out of bytes, every offset and count checked first.

use super::super::read_bytes;
use ::gltf::json::accessor::{ComponentType, GenericComponentType, Type, sparse::Sparse};
use ::gltf::json::validation::Checked;
use ::gltf::json::{Accessor, Index, Root, buffer::View};
use base64::Engine;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Elements of an accessor without a buffer view (all zero) beyond this are refused.
const MOST_ZEROS: usize = 1 << 22;

/// The bytes of a file and of all that it refers to.
pub(super) struct Data<'a> {
    root: &'a Root,
    path: &'a Path,
    /// None: the buffer has no bytes of its own (a fallback for an extension).
    buffers: Vec<Option<Cow<'a, [u8]>>>,
}

impl<'a> Data<'a> {
    /// Loads every buffer: the binary chunk, data URIs, files beside the scene.
    pub(super) fn load(root: &'a Root, path: &'a Path, binary: Option<&'a [u8]>) -> Result<Self, String> {
        let mut data = Data { root, path, buffers: Vec::with_capacity(root.buffers.len()) };
        for (number, buffer) in root.buffers.iter().enumerate() {
            let bytes = match &buffer.uri {
                Some(uri) => Some(Cow::Owned(data.fetch(uri).map_err(|m| format!("buffer {number}: {m}"))?)),
                None if number == 0 => binary.map(Cow::Borrowed),
                None => None,
            };
            let stated = buffer.byte_length.0;
            if let Some(bytes) = &bytes
                && (bytes.len() as u64) < stated
            {
                let have = bytes.len();
                return Err(format!("buffer {number} is truncated: it states {stated} bytes, but has {have}"));
            }
            data.buffers.push(bytes);
        }
        Ok(data)
    }

    /// The bytes that a URI stands for.
    pub(super) fn fetch(&self, uri: &str) -> Result<Vec<u8>, String> {
        if let Some(inline) = uri.strip_prefix("data:") {
            let (_, text) = inline.split_once(";base64,").ok_or("a data URI must be in base64")?;
            return base64::engine::general_purpose::STANDARD
                .decode(text.trim())
                .map_err(|error| format!("a data URI is not valid base64: {error}"));
        }
        if uri.contains("://") {
            return Err(format!("'{uri}' is not a local file; download it beside the scene"));
        }
        let name = percent_encoding::percent_decode_str(uri).decode_utf8_lossy().into_owned();
        let file: PathBuf = self.path.parent().unwrap_or_else(|| Path::new("")).join(name);
        read_bytes(&file).map_err(|error| error.to_string())
    }

    /// The bytes of a buffer view, with its stride if it states one.
    pub(super) fn view(&self, index: Index<View>) -> Result<(&[u8], Option<usize>), String> {
        let number = index.value();
        let view = self.root.get(index).ok_or_else(|| format!("buffer view {number} is not there"))?;
        let buffer = self
            .buffers
            .get(view.buffer.value())
            .ok_or_else(|| format!("buffer view {number} refers to buffer {}, which is not there", view.buffer))?
            .as_ref()
            .ok_or_else(|| format!("buffer {} has no bytes", view.buffer))?;
        let start = view.byte_offset.map_or(0, |o| o.0);
        let range = to_range(start, view.byte_length.0);
        let bytes = range.and_then(|r| buffer.get(r)).ok_or_else(|| {
            let (length, have) = (view.byte_length.0, buffer.len());
            format!("buffer view {number} ({length} bytes from {start}) runs over the end of its buffer ({have} bytes)")
        })?;
        Ok((bytes, view.byte_stride.map(|s| s.0)))
    }

    /// The numbers of an accessor of vectors with `N` components.
    pub(super) fn vectors<const N: usize>(&self, index: Index<Accessor>) -> Result<Vec<[f64; N]>, String> {
        let accessor = self.accessor(index)?;
        let expected = match N {
            1 => Type::Scalar,
            2 => Type::Vec2,
            3 => Type::Vec3,
            _ => Type::Vec4,
        };
        if accessor.type_ != Checked::Valid(expected) {
            return Err(format!("accessor {index} is not a {expected:?}"));
        }
        let Checked::Valid(GenericComponentType(component)) = accessor.component_type else {
            return Err(format!("accessor {index} has an unknown component type"));
        };
        let count = usize::try_from(accessor.count.0).map_err(|_| format!("accessor {index} is too large"))?;
        let read = |bytes: &[u8]| {
            let size = component.size();
            std::array::from_fn(|i| number(component, accessor.normalized, &bytes[i * size..(i + 1) * size]))
        };
        let size = N * component.size();
        let mut list: Vec<[f64; N]> = match accessor.buffer_view {
            Some(view) => {
                let elements = self.elements(view, accessor.byte_offset.map_or(0, |o| o.0), count, size);
                elements.map_err(|m| format!("accessor {index}: {m}"))?.map(read).collect()
            }
            None if count <= MOST_ZEROS => vec![[0.0; N]; count],
            None => return Err(format!("accessor {index} has {count} elements, but no data")),
        };
        if let Some(sparse) = &accessor.sparse {
            self.substitute(sparse, &mut list, size, read).map_err(|m| format!("accessor {index}, sparse: {m}"))?;
        }
        Ok(list)
    }

    /// Vertex colours, with or without alpha.
    pub(super) fn colours(&self, index: Index<Accessor>) -> Result<Vec<[f64; 3]>, String> {
        if self.accessor(index)?.type_ == Checked::Valid(Type::Vec4) {
            return Ok(self.vectors::<4>(index)?.into_iter().map(|[r, g, b, _]| [r, g, b]).collect());
        }
        self.vectors::<3>(index)
    }

    /// The whole numbers of an accessor of indices.
    pub(super) fn indices(&self, index: Index<Accessor>) -> Result<Vec<u32>, String> {
        let component = self.accessor(index)?.component_type;
        match component {
            Checked::Valid(GenericComponentType(ComponentType::U8 | ComponentType::U16 | ComponentType::U32)) => {}
            _ => return Err(format!("accessor {index} does not hold unsigned whole numbers")),
        }
        let numbers = self.vectors::<1>(index)?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "read from unsigned numbers")]
        Ok(numbers.into_iter().map(|[x]| x as u32).collect())
    }

    fn accessor(&self, index: Index<Accessor>) -> Result<&Accessor, String> {
        self.root.get(index).ok_or_else(|| format!("accessor {index} is not there"))
    }

    /// `count` elements of `size` bytes in a buffer view.
    fn elements(
        &self,
        view: Index<View>,
        offset: u64,
        count: usize,
        size: usize,
    ) -> Result<impl Iterator<Item = &[u8]>, String> {
        let (bytes, stride) = self.view(view)?;
        let stride = stride.unwrap_or(size);
        if stride < size {
            return Err(format!("elements of {size} bytes do not fit the stride of {stride} bytes"));
        }
        let length =
            if count == 0 { 0 } else { (count as u64 - 1).saturating_mul(stride as u64).saturating_add(size as u64) };
        let bytes = to_range(offset, length).and_then(|r| bytes.get(r)).ok_or_else(|| {
            let have = bytes.len();
            format!("{count} elements from byte {offset} run over the end of buffer view {view} ({have} bytes)")
        })?;
        Ok((0..count).map(move |i| &bytes[i * stride..i * stride + size]))
    }

    /// Replaces the elements that a sparse accessor names.
    fn substitute<const N: usize>(
        &self,
        sparse: &Sparse,
        list: &mut [[f64; N]],
        size: usize,
        read: impl Fn(&[u8]) -> [f64; N],
    ) -> Result<(), String> {
        let count = usize::try_from(sparse.count.0).map_err(|_| "too large")?;
        let Checked::Valid(kind) = &sparse.indices.component_type else {
            return Err("the indices have an unknown component type".into());
        };
        let width = kind.0.size();
        let places = self.elements(sparse.indices.buffer_view, sparse.indices.byte_offset.0, count, width)?;
        let values = self.elements(sparse.values.buffer_view, sparse.values.byte_offset.0, count, size)?;
        for (place, value) in places.zip(values) {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "read from unsigned numbers")]
            let at = number(kind.0, false, place) as usize;
            let have = list.len();
            *list.get_mut(at).ok_or_else(|| format!("element {at} is replaced, but there are only {have}"))? =
                read(value);
        }
        Ok(())
    }
}

fn to_range(start: u64, length: u64) -> Option<std::ops::Range<usize>> {
    let end = start.checked_add(length)?;
    Some(usize::try_from(start).ok()?..usize::try_from(end).ok()?)
}

/// One component (glTF 2.0, section 3.6.2; normalised integers by section 3.11's rule). `bytes` has its exact size.
fn number(component: ComponentType, normalized: bool, bytes: &[u8]) -> f64 {
    let pair = || [bytes[0], bytes[1]];
    let four = || [bytes[0], bytes[1], bytes[2], bytes[3]];
    let (value, largest) = match component {
        ComponentType::I8 => (f64::from(i8::from_le_bytes([bytes[0]])), 127.0),
        ComponentType::U8 => (f64::from(bytes[0]), 255.0),
        ComponentType::I16 => (f64::from(i16::from_le_bytes(pair())), 32767.0),
        ComponentType::U16 => (f64::from(u16::from_le_bytes(pair())), 65535.0),
        ComponentType::U32 => return f64::from(u32::from_le_bytes(four())),
        ComponentType::F32 => return f64::from(f32::from_le_bytes(four())),
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}
