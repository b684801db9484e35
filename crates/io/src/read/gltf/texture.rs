//! The picture of a texture and its mean.

use super::super::picture::{self, Mean, Unread};
use super::data::Data;
use ::gltf::json::Root;

/// Mean of the picture that a texture names.
pub(super) fn mean(root: &Root, data: &Data<'_>, texture: usize) -> Result<Mean, Unread> {
    let broken = |message: String| Unread::Broken(format!("texture {texture}: {message}"));
    let source = root.textures.get(texture).ok_or_else(|| broken("is not there".into()))?.source;
    let Some(image) = root.get(source) else {
        return Err(Unread::Format(format!("texture {texture} has no picture in a format of core glTF")));
    };
    let owned;
    let bytes: &[u8] = match (&image.uri, image.buffer_view) {
        (Some(uri), _) => {
            owned = data.fetch(uri).map_err(broken)?;
            &owned
        }
        (None, Some(view)) => data.view(view).map_err(broken)?.0,
        (None, None) => return Err(broken("its picture has neither a file nor a buffer view".into())),
    };
    picture::mean(bytes).map_err(|error| match error {
        Unread::Broken(message) => broken(message),
        Unread::Format(message) => Unread::Format(format!("texture {texture}: {message}")),
    })
}
