//! Triangles of surfaces, for programs that know no splines: OBJ and binary glTF.

use ondelette_modeling::shape::Mesh;
use serde_json::json;
use std::fmt::Write;

/// A Wavefront OBJ file with positions, parameters as texture coordinates, and normals.
pub fn obj(mesh: &Mesh, name: &str) -> String {
    let name: String = name.chars().map(|c| if c.is_whitespace() || c.is_control() { '_' } else { c }).collect();
    let mut out = format!("o {name}\n");
    // Writing to a String does not fail.
    for p in &mesh.points {
        let _ = writeln!(out, "v {} {} {}", p[0], p[1], p[2]);
    }
    for p in &mesh.parameters {
        let _ = writeln!(out, "vt {} {}", p[0], p[1]);
    }
    for n in &mesh.normals {
        let _ = writeln!(out, "vn {} {} {}", n[0] as f32, n[1] as f32, n[2] as f32);
    }
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| v + 1);
        let _ = writeln!(out, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}");
    }
    out
}

/// A binary glTF 2.0 file: one mesh with normals and a matt, double-sided material; coordinates as they are, in f32.
///
/// # Errors
/// No triangles; more than 4 GiB.
pub fn glb(mesh: &Mesh, name: &str) -> Result<Vec<u8>, String> {
    if mesh.triangles.is_empty() {
        return Err("the surface has no triangles".to_owned());
    }
    let local = |p: &[f64; 3]| -> [f32; 3] { p.map(|x| x as f32) };
    let ends = |end: fn(f32, f32) -> f32, start: f32| -> [f32; 3] {
        mesh.points.iter().map(local).fold([start; 3], |m, p| std::array::from_fn(|c| end(m[c], p[c])))
    };
    let (n, bytes) = (mesh.points.len(), 12 * mesh.points.len());
    let mut binary = Vec::with_capacity(2 * bytes + 12 * mesh.triangles.len());
    mesh.points.iter().flat_map(local).for_each(|x| binary.extend_from_slice(&x.to_le_bytes()));
    mesh.normals.iter().flatten().for_each(|x| binary.extend_from_slice(&(*x as f32).to_le_bytes()));
    mesh.triangles.iter().flatten().for_each(|i| binary.extend_from_slice(&i.to_le_bytes()));
    let document = json!({
        "asset": { "version": "2.0", "generator": "Ondelette" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "name": name, "mesh": 0 }],
        "meshes": [{ "name": name, "primitives": [{
            "attributes": { "POSITION": 0, "NORMAL": 1 }, "indices": 2, "material": 0, "mode": 4,
        }] }],
        "materials": [{ "name": "clay", "doubleSided": true, "pbrMetallicRoughness": {
            "baseColorFactor": [0.72, 0.74, 0.78, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.6,
        } }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": n, "type": "VEC3",
              "min": ends(f32::min, f32::INFINITY), "max": ends(f32::max, f32::NEG_INFINITY) },
            { "bufferView": 1, "componentType": 5126, "count": n, "type": "VEC3" },
            { "bufferView": 2, "componentType": 5125, "count": 3 * mesh.triangles.len(), "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": bytes, "target": 34962 },
            { "buffer": 0, "byteOffset": bytes, "byteLength": bytes, "target": 34962 },
            { "buffer": 0, "byteOffset": 2 * bytes, "byteLength": 12 * mesh.triangles.len(), "target": 34963 },
        ],
        "buffers": [{ "byteLength": binary.len() }],
    });
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + text.len() + 8 + binary.len();
    let word = |x: usize| {
        u32::try_from(x).map(u32::to_le_bytes).map_err(|_| "more than 4 GiB: raise the tolerance".to_owned())
    };
    let mut out = Vec::with_capacity(total);
    out.extend_from_slice(b"glTF");
    out.extend_from_slice(&2_u32.to_le_bytes());
    out.extend_from_slice(&word(total)?);
    out.extend_from_slice(&word(text.len())?);
    out.extend_from_slice(b"JSON");
    out.extend_from_slice(&text);
    out.extend_from_slice(&word(binary.len())?);
    out.extend_from_slice(b"BIN\0");
    out.extend_from_slice(&binary);
    Ok(out)
}
