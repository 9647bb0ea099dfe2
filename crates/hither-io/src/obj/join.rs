//! The pieces of an OBJ file, put together in its order.
//!
//! A piece counts from its own first line and vertex, and knows neither the names nor the material that hold when
//! it begins. Here they are known.

use super::parse::{
    BEFORE, CountedBack, Face, NONE, NOWHERE, Names, Piece, Polyline, Run, Statements, TooLarge,
};
use crate::oddities::Oddities;
use glam::Vec4;
use std::collections::{HashMap, HashSet};

/// One file from its pieces. What they left out is noted in `oddities`, with its place in the file.
pub(super) fn join(pieces: Vec<Piece>, oddities: &mut Oddities) -> Result<Statements, TooLarge> {
    let mut file = File { material: NONE, ..File::default() };
    for mut piece in pieces {
        oddities.append(std::mem::take(&mut piece.oddities), file.lines);
        file.append(piece);
        file.all.check_counts()?;
    }
    Ok(file.all)
}

/// A file up to the end of some piece.
#[derive(Default)]
struct File {
    all: Statements,
    lines: u64,
    object: String,
    group: String,
    material: u32,
    part_of_name: HashMap<String, u32>,
    material_of_name: HashMap<Vec<u8>, u32>,
    known_libraries: HashSet<Vec<u8>>,
}

impl File {
    fn append(&mut self, mut piece: Piece) {
        self.resolve(&mut piece);
        let parts: Vec<u32> = piece.parts.iter().map(|names| self.part(names)).collect();
        let materials: Vec<u32> =
            std::mem::take(&mut piece.statements.materials).into_iter().map(|name| self.name(name)).collect();
        let material = |piece: u32| if piece == BEFORE { self.material } else { materials[piece as usize] };
        let last_material = material(piece.material);
        let runs = piece.statements.runs.iter().map(|run| Run {
            first_face: run.first_face + self.all.faces.len() as u32,
            part: parts[run.part as usize],
            material: material(run.material),
        });
        for run in runs {
            if self.all.runs.last().is_none_or(|r| r.part != run.part || r.material != run.material) {
                self.all.runs.push(run);
            }
        }
        for library in std::mem::take(&mut piece.statements.libraries) {
            if self.known_libraries.insert(library.clone()) {
                self.all.libraries.push(library);
            }
        }
        self.append_lists(piece.statements, &parts);
        self.material = last_material;
        self.lines += piece.lines;
        self.object = piece.names.object.unwrap_or(std::mem::take(&mut self.object));
        self.group = piece.names.group.unwrap_or(std::mem::take(&mut self.group));
    }

    /// Finds what the indices that count back refer to.
    fn resolve(&self, piece: &mut Piece) {
        let known = [self.all.positions.len(), self.all.uvs.len(), self.all.normals.len()];
        let found = |back: &CountedBack| {
            let index = u32::try_from(back.index + known[back.which] as i64);
            index.map_or(NOWHERE, |index| index.min(NOWHERE))
        };
        for back in &piece.corners_back {
            piece.statements.corners[back.corner][back.which] = found(back);
        }
        for back in piece.lines_back.iter().filter(|back| back.which == 0) {
            piece.statements.line_corners[back.corner] = found(back);
        }
    }

    /// The number of the part with these names.
    fn part(&mut self, names: &Names) -> u32 {
        let object = names.object.as_ref().unwrap_or(&self.object);
        let group = names.group.as_ref().unwrap_or(&self.group);
        let name = match (object.as_str(), group.as_str()) {
            (object, "") => object.to_owned(),
            ("", group) => group.to_owned(),
            (object, group) => format!("{object}/{group}"),
        };
        let parts = &mut self.all.parts;
        *self.part_of_name.entry(name).or_insert_with_key(|name| {
            parts.push(name.clone());
            (parts.len() - 1) as u32
        })
    }

    /// The number of the material with this name.
    fn name(&mut self, name: Vec<u8>) -> u32 {
        let materials = &mut self.all.materials;
        *self.material_of_name.entry(name).or_insert_with_key(|name| {
            materials.push(name.clone());
            (materials.len() - 1) as u32
        })
    }

    fn append_lists(&mut self, piece: Statements, parts: &[u32]) {
        let all = &mut self.all;
        if !all.colors.is_empty() || !piece.colors.is_empty() {
            all.colors.resize(all.positions.len(), Vec4::ONE);
            all.colors.extend(&piece.colors);
            all.colors.resize(all.positions.len() + piece.positions.len(), Vec4::ONE);
        }
        let line = |line: u32| u32::try_from(self.lines + u64::from(line)).unwrap_or(u32::MAX);
        let (corners, line_corners) = (all.corners.len() as u32, all.line_corners.len() as u32);
        all.polylines.extend(piece.polylines.iter().map(|polyline| Polyline {
            end: polyline.end.saturating_add(line_corners),
            line: line(polyline.line),
            part: parts[polyline.part as usize],
        }));
        if all.faces.is_empty() && self.lines == 0 {
            all.faces = piece.faces;
        } else {
            let moved = |face: &Face| Face { end: face.end.saturating_add(corners), line: line(face.line) };
            all.faces.extend(piece.faces.iter().map(moved));
        }
        append(&mut all.positions, piece.positions);
        append(&mut all.uvs, piece.uvs);
        append(&mut all.normals, piece.normals);
        append(&mut all.corners, piece.corners);
        append(&mut all.line_corners, piece.line_corners);
        all.known_lines += piece.known_lines;
        all.losses.append(piece.losses, self.lines);
    }
}

/// Puts `more` after `list`, without a copy where there is nothing before it.
fn append<T>(list: &mut Vec<T>, mut more: Vec<T>) {
    if list.is_empty() {
        *list = more;
    } else {
        list.append(&mut more);
    }
}
