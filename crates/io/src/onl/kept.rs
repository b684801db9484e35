//! The samples that a solution kept, as chunks.

use super::{ChunkFile, ChunkWriter, OnlError};
use ondelette_compress::Forest;
use ondelette_radiosity::{Kept, Scene};

/// Whether a file has them.
pub(super) fn has(file: &ChunkFile) -> bool {
    file.has("k.groups")
}

pub(super) fn add<'a>(writer: &mut ChunkWriter<'a>, kept: &'a Kept) {
    writer.add_array("k.groups", &kept.groups);
    writer.add_array("k.lamps", &kept.lamps);
    writer.add_array("k.direct", &kept.direct);
    writer.add_array("k.misfit", &kept.misfit);
    writer.add_array("k.scattr", &kept.scatter);
    writer.add_array("k.lrays", &kept.lamp_rays);
    writer.add_array("k.crowd", &kept.crowded);
    writer.add_array("k.gather", &kept.gathers);
    writer.add_array("k.places", &kept.places);
    writer.add_array("k.keys", &kept.keys);
    writer.add_array("k.open", &kept.open);
    writer.add_array("k.ends", &kept.ends);
    writer.add_array("k.leaves", &kept.leaves);
    writer.add_array("k.starts", &kept.starts);
}

pub(super) fn read(file: &ChunkFile, scene: &Scene, forest: &Forest) -> Result<Kept, OnlError> {
    let kept = Kept {
        groups: file.array("k.groups")?,
        lamps: file.array("k.lamps")?,
        direct: file.finite_f64("k.direct")?,
        misfit: file.finite_f32("k.misfit")?,
        scatter: file.finite_f32("k.scattr")?,
        lamp_rays: file.finite_f32("k.lrays")?,
        crowded: file.array("k.crowd")?,
        gathers: file.array("k.gather")?,
        places: file.array("k.places")?,
        keys: file.array("k.keys")?,
        open: file.array("k.open")?,
        ends: file.array("k.ends")?,
        leaves: file.array("k.leaves")?,
        starts: file.array("k.starts")?,
    };
    kept.check(scene, forest).map_err(|reason| file.content("k.gather", reason))?;
    Ok(kept)
}
