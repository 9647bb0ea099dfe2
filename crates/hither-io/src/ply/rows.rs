//! The rows of a PLY file's elements: vertices with their attributes, and faces as indices.

use super::header::{Element, Kind, Property};
use super::numbers::Numbers;
use crate::oddities::Oddities;
use crate::srgb;
use crate::text::quoted;
use glam::{DVec3, Vec2, Vec3, Vec4};

/// An index that leads nowhere.
pub(super) const NOWHERE: u32 = u32::MAX;

/// What the file holds, as it holds it: indices and coordinates are not checked yet.
#[derive(Debug, Default)]
pub(super) struct Rows {
    pub(super) positions: Vec<Vec3>,
    /// Unit length, or zero where there is none; empty if the file has none.
    pub(super) normals: Vec<Vec3>,
    /// v down; empty if the file has none.
    pub(super) uvs: Vec<Vec2>,
    /// Linear; empty if the file has none.
    pub(super) colors: Vec<Vec4>,
    /// Vertices of all faces, [`NOWHERE`] for an index that cannot be one.
    pub(super) corners: Vec<u32>,
    /// Where in `corners` each face ends.
    pub(super) face_ends: Vec<u32>,
}

/// Reads all elements in their order; on failure one line that says what is wrong.
pub(super) fn read(
    mut numbers: impl Numbers,
    elements: &[Element],
    oddities: &mut Oddities,
) -> Result<Rows, String> {
    let mut rows = Rows::default();
    for element in elements {
        let name = quoted(element.name.as_bytes());
        if element.properties.is_empty() {
            nothing_of(element, oddities)?;
            continue;
        }
        if !numbers.can_hold(element) {
            return Err(format!(
                "its header claims {} rows of {name}, more than the rest of the file can hold; it is truncated or \
                 damaged",
                element.count
            ));
        }
        let read = match element.name.as_str() {
            "vertex" => rows.vertices(&mut numbers, element)?,
            "face" => rows.faces(&mut numbers, element, Rows::face, oddities),
            "tristrips" => rows.faces(&mut numbers, element, Rows::strip, oddities),
            _ => pass_over(&mut numbers, element),
        };
        read.map_err(|row| {
            format!(
                "row {row} of the {} rows of {name} is not complete; the file is truncated or damaged",
                element.count
            )
        })?;
    }
    if !elements.iter().any(|e| e.name == "vertex") {
        return Err("it has no element \"vertex\"".into());
    }
    if rows.face_ends.is_empty() && !rows.positions.is_empty() {
        let message = "it has points but no faces; there is nothing to draw";
        oddities.note("points", || "element \"vertex\"".into(), || message.into());
    }
    if rows.corners.len().max(rows.positions.len()) >= NOWHERE as usize {
        return Err("it has more than 4,294,967,294 vertices or corners; split it".into());
    }
    Ok(rows)
}

/// Rows of nothing, which any file can hold: vertices cannot be such, and of faces it is told.
fn nothing_of(element: &Element, oddities: &mut Oddities) -> Result<(), String> {
    match element.name.as_str() {
        _ if element.count == 0 => {}
        "vertex" => return Err(NO_COORDINATES.into()),
        "face" | "tristrips" => no_list(element, oddities),
        _ => {}
    }
    Ok(())
}

const NO_COORDINATES: &str = "its vertices have no x, y and z";

fn no_list(element: &Element, oddities: &mut Oddities) {
    let place = || format!("element {}", quoted(element.name.as_bytes()));
    oddities.note("no list", place, || "it has no list of vertices and is passed over".into());
}

/// Where a vertex's number goes: index into the values of a row.
#[derive(Clone, Copy)]
enum Slot {
    X,
    Y,
    Z,
    NormalX,
    NormalY,
    NormalZ,
    U,
    V,
    Red,
    Green,
    Blue,
    Alpha,
}

const SLOTS: usize = 12;

impl Slot {
    fn named(name: &str) -> Option<Slot> {
        Some(match name {
            "x" => Slot::X,
            "y" => Slot::Y,
            "z" => Slot::Z,
            "nx" => Slot::NormalX,
            "ny" => Slot::NormalY,
            "nz" => Slot::NormalZ,
            "u" | "s" | "texture_u" | "texture_s" => Slot::U,
            "v" | "t" | "texture_v" | "texture_t" => Slot::V,
            "red" | "r" | "diffuse_red" => Slot::Red,
            "green" | "g" | "diffuse_green" => Slot::Green,
            "blue" | "b" | "diffuse_blue" => Slot::Blue,
            "alpha" | "a" | "diffuse_alpha" => Slot::Alpha,
            _ => return None,
        })
    }
}

/// The largest value of a colour channel.
fn full(kind: Kind) -> f64 {
    match kind {
        Kind::I8 => 127.0,
        Kind::I16 => 32767.0,
        Kind::U16 => 65535.0,
        Kind::F32 | Kind::F64 => 1.0,
        Kind::U8 | Kind::I32 | Kind::U32 => 255.0,
    }
}

/// Turns colour channels into linear light; bytes, which are most common, by a table.
struct Linear {
    of_byte: [f32; 256],
}

impl Linear {
    fn new() -> Linear {
        Linear { of_byte: std::array::from_fn(|code| srgb::linear(code as f64 / 255.0) as f32) }
    }

    #[inline]
    fn of(&self, value: f64, kind: Kind) -> f32 {
        if kind == Kind::U8 {
            return self.of_byte[usize::from(value as u8)];
        }
        srgb::linear((value / full(kind)).max(0.0)) as f32
    }
}

impl Rows {
    /// The inner error is the row that is not complete.
    fn vertices(&mut self, numbers: &mut impl Numbers, element: &Element) -> Result<Result<(), u64>, String> {
        let mut has = [false; SLOTS];
        let mut kinds = [Kind::F32; SLOTS];
        let columns: Vec<(&Property, Option<usize>)> = element
            .properties
            .iter()
            .map(|property| {
                let slot =
                    Slot::named(&property.name).filter(|_| property.list.is_none()).map(|s| s as usize);
                if let Some(slot) = slot {
                    has[slot] = true;
                    kinds[slot] = property.kind;
                }
                (property, slot)
            })
            .collect();
        let all = |slots: [Slot; 3]| slots.into_iter().all(|s| has[s as usize]);
        if !all([Slot::X, Slot::Y, Slot::Z]) {
            return Err(NO_COORDINATES.into());
        }
        let has_normals = all([Slot::NormalX, Slot::NormalY, Slot::NormalZ]);
        let has_uvs = has[Slot::U as usize] && has[Slot::V as usize];
        let has_colors = all([Slot::Red, Slot::Green, Slot::Blue]);
        let count = element.count as usize;
        self.positions.reserve_exact(count);
        self.normals.reserve_exact(if has_normals { count } else { 0 });
        self.uvs.reserve_exact(if has_uvs { count } else { 0 });
        self.colors.reserve_exact(if has_colors { count } else { 0 });
        let linear = Linear::new();
        let mut values = [0.0; SLOTS];
        values[Slot::Alpha as usize] = 1.0;
        for row in 0..element.count {
            for (property, slot) in &columns {
                let read = match slot {
                    Some(slot) => numbers.next(property.kind).map(|n| values[*slot] = n),
                    None => pass_property(numbers, property),
                };
                if read.is_none() {
                    return Ok(Err(row));
                }
            }
            let [x, y, z, nx, ny, nz, u, v, red, green, blue, alpha] = values;
            self.positions.push(DVec3::new(x, y, z).as_vec3());
            if has_normals {
                let normal = DVec3::new(nx, ny, nz).normalize_or_zero().as_vec3();
                self.normals.push(if normal.is_finite() { normal } else { Vec3::ZERO });
            }
            if has_uvs {
                let uv = Vec2::new(u as f32, 1.0 - v as f32);
                self.uvs.push(if uv.is_finite() { uv } else { Vec2::ZERO });
            }
            if has_colors {
                let red = linear.of(red, kinds[Slot::Red as usize]);
                let green = linear.of(green, kinds[Slot::Green as usize]);
                let blue = linear.of(blue, kinds[Slot::Blue as usize]);
                let alpha = (alpha / full(kinds[Slot::Alpha as usize])).clamp(0.0, 1.0);
                let color = Vec4::new(red, green, blue, alpha as f32);
                self.colors.push(if color.is_finite() { color } else { Vec4::ONE });
            }
        }
        Ok(Ok(()))
    }

    /// Reads rows with a list of vertices, given to `add`. The error is the row that is not complete.
    fn faces(
        &mut self,
        numbers: &mut impl Numbers,
        element: &Element,
        add: fn(&mut Rows, &[f64]),
        oddities: &mut Oddities,
    ) -> Result<(), u64> {
        let is_list =
            |p: &Property| p.list.is_some() && matches!(p.name.as_str(), "vertex_indices" | "vertex_index");
        let list = element.properties.iter().position(is_list);
        let place = || format!("element {}", quoted(element.name.as_bytes()));
        if list.is_none() {
            no_list(element, oddities);
        }
        for property in &element.properties {
            match property.name.as_str() {
                "red" => oddities.note("face colours", place, || "colours of faces are left out".into()),
                "texcoord" => {
                    oddities.note("wedges", place, || {
                        "texture coordinates of faces' corners are left out".into()
                    });
                }
                _ => {}
            }
        }
        let mut indices: Vec<f64> = Vec::new();
        for row in 0..element.count {
            for (at, property) in element.properties.iter().enumerate() {
                let read = if Some(at) == list {
                    indices.clear();
                    entries(numbers, property, &mut indices)
                } else {
                    pass_property(numbers, property)
                };
                read.ok_or(row)?;
            }
            if list.is_some() {
                add(self, &indices);
            }
        }
        Ok(())
    }

    fn face(&mut self, indices: &[f64]) {
        self.corners.extend(indices.iter().map(|&i| index(i)));
        self.face_ends.push(self.corners.len() as u32);
    }

    /// A strip: each index makes a triangle with the two before; −1 begins anew. Every other triangle turns
    /// the other way, so two of its corners change places.
    fn strip(&mut self, indices: &[f64]) {
        for run in indices.split(|&i| i == -1.0) {
            for (i, w) in run.windows(3).enumerate() {
                self.face(&if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] });
            }
        }
    }
}

fn index(number: f64) -> u32 {
    // What the cast rounds or clamps is not an index.
    let index = number as u32;
    if f64::from(index) == number { index } else { NOWHERE }
}

/// Reads the entries of a list.
#[inline]
fn entries(numbers: &mut impl Numbers, property: &Property, into: &mut Vec<f64>) -> Option<()> {
    let count = list_length(numbers, property)?;
    for _ in 0..count {
        into.push(numbers.next(property.kind)?);
    }
    Some(())
}

fn list_length(numbers: &mut impl Numbers, property: &Property) -> Option<u64> {
    let count = numbers.next(property.list?)?;
    (count >= 0.0 && count <= numbers.most(property.kind) as f64).then_some(count as u64)
}

fn pass_property(numbers: &mut impl Numbers, property: &Property) -> Option<()> {
    let count = if property.list.is_some() { list_length(numbers, property)? } else { 1 };
    numbers.skip(property.kind, count)
}

fn pass_over(numbers: &mut impl Numbers, element: &Element) -> Result<(), u64> {
    for row in 0..element.count {
        for property in &element.properties {
            pass_property(numbers, property).ok_or(row)?;
        }
    }
    Ok(())
}
