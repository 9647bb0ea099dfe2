//! From a file to a first picture: a million triangles read and indexed.

use super::{TableInfo, column, world};
use crate::Options;
use crate::report::{Cell, Table};
use crate::timing::{median, timed};
use hither::scene::Mesh;
use hither::{IndexOptions, SceneIndex};
use serde_json::json;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Duration;

pub(crate) const INFO: TableInfo = TableInfo {
    name: "load",
    title: "1,024,000 triangles from a file to an index",
    make,
    columns: &[
        column("format", "format", 0),
        column("file_mib", "MiB", 1),
        column("read_ms", "read ms", 0),
        column("index_ms", "index ms", 0),
        column("total_ms", "total ms", 0),
    ],
};

/// Writes a mesh in one format.
type Writer = fn(&Mesh, &mut dyn Write) -> std::io::Result<()>;

fn make(table: &mut Table, _options: &Options) -> Result<(), String> {
    const RUNS: usize = 5;
    let scene = world("spheres")?;
    let formats: [(&str, Writer); 3] = [("glb", write_glb), ("ply", write_ply), ("stl", write_stl)];
    let folder = std::env::temp_dir();
    for (format, write) in formats {
        let path = folder.join(format!("hither-bench-{}.{format}", std::process::id()));
        let bytes = save(&path, &scene.meshes[0], write)?;
        let (mut read, mut indexed) = (Vec::new(), Vec::new());
        let mut fault = None;
        for _ in 0..RUNS {
            let (time, loaded) = timed(|| hither_io::read(&path));
            match loaded {
                Ok(loaded) => {
                    read.push(time);
                    let build = || SceneIndex::build(loaded.scene, &IndexOptions::default());
                    indexed.push(timed(build).0);
                }
                Err(e) => fault = Some(e.to_string()),
            }
        }
        let _ = std::fs::remove_file(&path);
        if let Some(fault) = fault {
            return Err(fault);
        }
        let ms = |times: &mut Vec<Duration>| median(times).as_secs_f64() * 1e3;
        let (read, indexed) = (ms(&mut read), ms(&mut indexed));
        table.push([
            Cell::from(format),
            (bytes as f64 / f64::from(1 << 20)).into(),
            read.into(),
            indexed.into(),
            (read + indexed).into(),
        ]);
    }
    table.notes.push("All cores; the file is in the system's cache.".into());
    Ok(())
}

fn save(path: &Path, mesh: &Mesh, write: Writer) -> Result<u64, String> {
    let saved = std::fs::File::create(path).and_then(|file| {
        let mut out = BufWriter::new(file);
        write(mesh, &mut out)?;
        out.into_inner().map_err(|e| e.into_error())?.metadata()
    });
    match saved {
        Ok(metadata) => Ok(metadata.len()),
        Err(e) => {
            let _ = std::fs::remove_file(path);
            Err(format!("{}: cannot be written: {e}", path.display()))
        }
    }
}

fn write_glb(mesh: &Mesh, out: &mut dyn Write) -> std::io::Result<()> {
    let (vertices, corners) = (mesh.positions.len(), mesh.triangles.len() * 3);
    let (positions_len, indices_len) = (vertices * 12, corners * 4);
    let bounds = mesh.bounds();
    let document = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
        "buffers": [{ "byteLength": positions_len + indices_len }],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": positions_len },
            { "buffer": 0, "byteOffset": positions_len, "byteLength": indices_len },
        ],
        "accessors": [
            {
                "bufferView": 0, "componentType": 5126, "count": vertices, "type": "VEC3",
                "min": bounds.min.to_array(), "max": bounds.max.to_array(),
            },
            { "bufferView": 1, "componentType": 5125, "count": corners, "type": "SCALAR" },
        ],
    });
    let mut text = document.to_string();
    while !text.len().is_multiple_of(4) {
        text.push(' ');
    }
    let total = 12 + 8 + text.len() + 8 + positions_len + indices_len;
    out.write_all(b"glTF")?;
    for word in [2, total as u32, text.len() as u32] {
        out.write_all(&word.to_le_bytes())?;
    }
    out.write_all(b"JSON")?;
    out.write_all(text.as_bytes())?;
    out.write_all(&((positions_len + indices_len) as u32).to_le_bytes())?;
    out.write_all(b"BIN\0")?;
    for p in &mesh.positions {
        p.to_array().into_iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
    }
    mesh.triangles.as_flattened().iter().try_for_each(|i| out.write_all(&i.to_le_bytes()))
}

fn write_ply(mesh: &Mesh, out: &mut dyn Write) -> std::io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}", mesh.positions.len())?;
    writeln!(out, "property float x\nproperty float y\nproperty float z")?;
    writeln!(out, "element face {}\nproperty list uchar uint vertex_indices", mesh.triangles.len())?;
    writeln!(out, "end_header")?;
    for p in &mesh.positions {
        p.to_array().into_iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
    }
    for t in &mesh.triangles {
        out.write_all(&[3])?;
        t.iter().try_for_each(|i| out.write_all(&i.to_le_bytes()))?;
    }
    Ok(())
}

fn write_stl(mesh: &Mesh, out: &mut dyn Write) -> std::io::Result<()> {
    out.write_all(&[b' '; 80])?;
    out.write_all(&(mesh.triangles.len() as u32).to_le_bytes())?;
    for t in &mesh.triangles {
        out.write_all(&[0; 12])?;
        for &corner in t {
            let p = mesh.positions[corner as usize].to_array();
            p.into_iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
        }
        out.write_all(&[0; 2])?;
    }
    Ok(())
}
