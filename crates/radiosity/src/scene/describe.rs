//! What is in a scene, in words (`ondelette info`).

use super::{Scene, Shape};
use crate::rgb::Rgb;
use glam::DVec3;
use std::fmt::Write;

/// Emitters listed one by one; further ones are summed up.
const LISTED: usize = 20;

/// A page of text: patches, sides, materials, emitters with their power, size and unit, camera and warnings.
///
/// ```
/// # use glam::DVec3;
/// # use ondelette_radiosity::scene::{BuildOptions, DraftFace, LengthUnit, Material, Object, Quantity, SceneDraft};
/// # use ondelette_radiosity::{Rgb, scene::describe};
/// # let corners = [[0., 0., 0.], [2., 0., 0.], [2., 1., 0.], [0., 1., 0.]].map(DVec3::from).to_vec();
/// # let face =
/// #     DraftFace { corners, uv0: vec![], uv1: vec![], material: 0, object: 0, index: 0, line: None };
/// # let lamp =
/// #     Material { name: "lamp".into(), reflectance: Rgb::BLACK, radiance: Rgb::grey(1.0), two_sided: false };
/// # let draft = SceneDraft {
/// #     name: "lamp".into(),
/// #     unit: LengthUnit { metres: 1.0, stated: true },
/// #     quantity: Quantity::Photometric,
/// #     materials: vec![lamp],
/// #     objects: vec![Object { name: "bulb".into(), mesh: 0, primitive: 0 }],
/// #     faces: vec![face],
/// #     camera: None,
/// #     warnings: vec![],
/// # };
/// let scene = draft.build(BuildOptions::default())?; // one lamp of 2 m^2 with luminance 1 cd/m^2
/// assert!(describe(&scene).contains("bulb: 6.28319 6.28319 6.28319 lm"));
/// # Ok::<(), ondelette_radiosity::scene::SceneError>(())
/// ```
pub fn describe(scene: &Scene) -> String {
    let mut out = String::new();
    // Writing to a String does not fail.
    let _ = write(scene, &mut out);
    out
}

fn write(scene: &Scene, out: &mut String) -> std::fmt::Result {
    let quads = scene.patches.iter().filter(|p| p.shape == Shape::Parallelogram).count();
    let triangles = scene.patches.len() - quads;
    let mut faces: Vec<(u32, u32)> =
        scene.patches.iter().flat_map(|p| p.provenance.faces.iter().map(|&f| (p.provenance.object, f))).collect();
    faces.sort_unstable();
    faces.dedup();
    let area: f64 = scene.patches.iter().map(|p| p.area()).sum();
    let metres = scene.unit.metres;
    writeln!(out, "scene      {}", scene.name)?;
    writeln!(out, "patches    {} ({quads} parallelograms, {triangles} triangles)", scene.patches.len())?;
    writeln!(out, "sides      {} that reflect, emit and receive", scene.sides.len())?;
    writeln!(out, "from       {} faces of {} objects in the file", faces.len(), scene.objects.len())?;
    let stated = if scene.unit.stated { "stated by the file" } else { "assumed: the file states no unit" };
    writeln!(out, "unit       1 unit = {} m ({stated})", number(metres))?;
    let [low, high] = scene.bounds;
    writeln!(out, "bounds     {} to {} units", point(low), point(high))?;
    writeln!(out, "size       {} m, area {} m^2", point((high - low) * metres), number(area * metres * metres))?;
    let unit = scene.quantity;
    writeln!(out, "light      radiance in {}, irradiance in {}", unit.radiance_unit(), unit.irradiance_unit())?;
    match &scene.camera {
        Some(c) => writeln!(
            out,
            "camera     eye {} at {} up {} fov {} degrees",
            point(c.eye),
            point(c.at),
            point(c.up),
            number(c.fov)
        )?,
        None => writeln!(out, "camera     none in the file")?,
    }

    let emitters = scene.emitters();
    if emitters.is_empty() {
        writeln!(out, "emitters   none: nothing gives off light")?;
    } else {
        let total = scene.emitted_power();
        writeln!(out, "emitters   {}, in all {} {} (r g b)", emitters.len(), rgb(total), unit.power_unit())?;
        for e in emitters.iter().take(LISTED) {
            let name = &scene.objects[e.object as usize].name;
            let (area, s) = (number(e.area), if e.sides == 1 { "" } else { "s" });
            writeln!(out, "  {name}: {} {}, {} side{s}, {area} m^2", rgb(e.power), unit.power_unit(), e.sides)?;
        }
        if emitters.len() > LISTED {
            let rest = emitters[LISTED..].iter().fold(Rgb::BLACK, |sum, e| sum + e.power);
            writeln!(out, "  {} more: {} {}", emitters.len() - LISTED, rgb(rest), unit.power_unit())?;
        }
    }

    writeln!(out, "materials  {}", scene.materials.len())?;
    for m in &scene.materials {
        write!(out, "  {}: reflectance {}", m.name, rgb(m.reflectance))?;
        if m.radiance.sum() > 0.0 {
            write!(out, ", radiance {} {}", rgb(m.radiance), unit.radiance_unit())?;
        }
        writeln!(out, "{}", if m.two_sided { ", two-sided" } else { "" })?;
    }
    writeln!(
        out,
        "warnings   {}",
        if scene.warnings.is_empty() { "none".into() } else { scene.warnings.len().to_string() }
    )?;
    for w in &scene.warnings {
        writeln!(out, "  {w}")?;
    }
    Ok(())
}

/// To a millionth of its size, without trailing zeros.
fn number(x: f64) -> String {
    let size = x.abs();
    if size != 0.0 && !(1e-4..1e7).contains(&size) {
        return format!("{x:.5e}");
    }
    let mut text = x.to_string();
    for places in 0..16 {
        let short = format!("{x:.places$}");
        if let Ok(back) = short.parse::<f64>()
            && (back - x).abs() <= 1e-6 * size
        {
            text = short;
            break;
        }
    }
    text
}

fn point(p: DVec3) -> String {
    format!("({}, {}, {})", number(p.x), number(p.y), number(p.z))
}

fn rgb(c: Rgb) -> String {
    c.0.map(number).join(" ")
}
