//! The statements of an OBJ file as flat lists: positions, attributes, and faces with their part and material.
//!
//! Nothing is looked up here but names, so a face may come before what it refers to.

use crate::oddities::Oddities;
use crate::srgb;
use crate::text::{self, Lines, is_blank};
use glam::{DVec3, Vec2, Vec3, Vec4};
use std::collections::{HashMap, HashSet};

/// No texture coordinate, no normal.
pub(super) const NONE: u32 = u32::MAX;

/// An index that leads nowhere, whatever the lists hold.
const NOWHERE: u32 = u32::MAX - 1;

/// The largest number of things of one kind that can be referred to.
const MOST: usize = NOWHERE as usize;

/// Indices of a face's corner: position, texture coordinate, normal.
pub(super) type Corner = [u32; 3];

/// What an OBJ file says, in its order.
#[derive(Debug, Default)]
pub(super) struct Statements {
    /// `v`; not a number where it could not be read.
    pub(super) positions: Vec<Vec3>,
    /// Linear colours of the positions, or empty if none has one.
    pub(super) colors: Vec<Vec4>,
    /// `vt`, v down.
    pub(super) uvs: Vec<Vec2>,
    /// `vn`, unit length, or zero where it is none.
    pub(super) normals: Vec<Vec3>,
    /// Corners of all faces.
    pub(super) corners: Vec<Corner>,
    /// Faces.
    pub(super) faces: Vec<Face>,
    /// Faces of one part with one material, in a row.
    pub(super) runs: Vec<Run>,
    /// Segments of lines (`l`): the part, the indices of two positions, and where they are in the file.
    pub(super) segments: Vec<(u32, [u32; 2], u32)>,
    /// Names of parts: object, group, or both with a `/` between.
    pub(super) parts: Vec<String>,
    /// Names that `usemtl` gives.
    pub(super) materials: Vec<Vec<u8>>,
    /// What follows `mtllib`.
    pub(super) libraries: Vec<Vec<u8>>,
    /// Lines that begin with a word of the format.
    pub(super) known_lines: u64,
}

/// A face: its corners end here, and begin where those of the face before end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    pub(super) end: u32,
    pub(super) line: u32,
}

/// Faces from `first_face` up to the next run's.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    pub(super) first_face: u32,
    pub(super) part: u32,
    /// Index into [`Statements::materials`], or [`NONE`].
    pub(super) material: u32,
}

/// The file is larger than indices reach.
#[derive(Debug)]
pub(super) struct TooLarge;

/// Where new faces belong.
struct State {
    object: String,
    group: String,
    material: u32,
    /// Whether the names have changed since the last face.
    changed: bool,
    /// The part of these names, if it was needed.
    part: Option<u32>,
    part_of_name: HashMap<String, u32>,
    material_of_name: HashMap<Vec<u8>, u32>,
    known_libraries: HashSet<Vec<u8>>,
}

/// Reads all statements. What is left out is noted in `oddities`.
pub(super) fn parse(bytes: &[u8], oddities: &mut Oddities) -> Result<Statements, TooLarge> {
    let mut all = Statements::default();
    let mut state = State {
        object: String::new(),
        group: String::new(),
        material: NONE,
        changed: true,
        part: None,
        part_of_name: HashMap::new(),
        material_of_name: HashMap::new(),
        known_libraries: HashSet::new(),
    };
    let mut lines = Lines::continued(bytes);
    // `number()` borrows what the line borrows.
    let mut number = 0;
    while let Some(line) = lines.next() {
        let line_number = number + 1;
        match line {
            [] | [b'#', ..] => {}
            [b'v', b, rest @ ..] if is_blank(*b) => all.position(rest, line_number, oddities),
            [b'f', b, rest @ ..] if is_blank(*b) => all.face(rest, line_number, &mut state, oddities),
            [b'v', b'n', b, rest @ ..] if is_blank(*b) => all.normal(rest),
            [b'v', b't', b, rest @ ..] if is_blank(*b) => all.uv(rest),
            _ => all.other(line, line_number, &mut state, oddities),
        }
        number = lines.number();
        if all
            .corners
            .len()
            .max(all.segments.len())
            .max(all.positions.len())
            .max(all.uvs.len())
            .max(all.normals.len())
            >= MOST
        {
            return Err(TooLarge);
        }
    }
    all.mend_corners(oddities);
    Ok(all)
}

impl Statements {
    fn position(&mut self, mut line: &[u8], number: u64, oddities: &mut Oddities) {
        let mut values = [f32::NAN; 7];
        let mut count = 0;
        while count < 7 {
            let Some(word) = text::word(&mut line) else { break };
            let Some(value) = text::number(word) else { break };
            values[count] = value;
            count += 1;
        }
        let [x, y, z, ..] = values;
        let position = Vec3::new(x, y, z);
        if count < 3 {
            oddities.in_line(number, "a vertex has fewer than three numbers; its faces are left out");
        }
        // Three more numbers are a colour, four a colour and its alpha; one alone is a weight for curves.
        let color = match count {
            6 => Some([values[3], values[4], values[5], 1.0]),
            7 => Some([values[3], values[4], values[5], values[6]]),
            _ => None,
        };
        if let Some([r, g, b, a]) = color {
            self.colors.resize(self.positions.len(), Vec4::ONE);
            let color = Vec4::new(linear(r), linear(g), linear(b), a);
            self.colors.push(if color.is_finite() { color } else { Vec4::ONE });
        } else if !self.colors.is_empty() {
            self.colors.push(Vec4::ONE);
        }
        self.positions.push(position);
    }

    fn normal(&mut self, line: &[u8]) {
        let [x, y, z] = leading_numbers(line).map(f64::from);
        let normal = DVec3::new(x, y, z).normalize_or_zero().as_vec3();
        self.normals.push(if normal.is_finite() { normal } else { Vec3::ZERO });
    }

    fn uv(&mut self, line: &[u8]) {
        let [u, v, _] = leading_numbers(line);
        // A texture of one dimension has no v.
        let v = if v.is_nan() { 0.0 } else { v };
        let uv = Vec2::new(u, 1.0 - v);
        self.uvs.push(if uv.is_finite() { uv } else { Vec2::ZERO });
    }

    fn face(&mut self, line: &[u8], number: u64, state: &mut State, oddities: &mut Oddities) {
        let first = self.corners.len();
        let counts = [self.positions.len(), self.uvs.len(), self.normals.len()];
        let mut rest = line;
        loop {
            while let [b, after @ ..] = rest
                && is_blank(*b)
            {
                rest = after;
            }
            if rest.first().is_none_or(|&b| b == b'#') {
                break;
            }
            let Some(corner) = corner(&mut rest, counts) else {
                self.corners.truncate(first);
                oddities.note(
                    "corner",
                    || format!("line {number}"),
                    || format!("the face {} cannot be read and is left out", text::quoted(line)),
                );
                return;
            };
            self.corners.push(corner);
        }
        if self.corners.len() < first + 3 {
            self.corners.truncate(first);
            oddities.in_line(number, "a face has fewer than three corners and is left out");
            return;
        }
        if state.changed {
            self.begin_run(state);
        }
        let line = u32::try_from(number).unwrap_or(u32::MAX);
        self.faces.push(Face { end: self.corners.len() as u32, line });
    }

    /// `l`: a line through corners; texture coordinates are of no use to it.
    fn line(&mut self, line: &[u8], number: u64, state: &mut State, oddities: &mut Oddities) {
        let counts = [self.positions.len(), self.uvs.len(), self.normals.len()];
        let part = self.part(state);
        let at = u32::try_from(number).unwrap_or(u32::MAX);
        let (mut rest, mut before) = (line, None);
        loop {
            rest = rest.trim_ascii_start();
            if rest.first().is_none_or(|&b| b == b'#') {
                break;
            }
            let Some([position, ..]) = corner(&mut rest, counts) else {
                return oddities.in_line(number, "a line cannot be read; what follows of it is left out");
            };
            if let Some(before) = before.replace(position) {
                self.segments.push((part, [before, position], at));
            }
        }
    }

    /// The number of the part that new faces and lines belong to.
    fn part(&mut self, state: &mut State) -> u32 {
        if let Some(part) = state.part {
            return part;
        }
        let name = match (state.object.as_str(), state.group.as_str()) {
            (object, "") => object.to_owned(),
            ("", group) => group.to_owned(),
            (object, group) => format!("{object}/{group}"),
        };
        let parts = &mut self.parts;
        let part = *state.part_of_name.entry(name).or_insert_with_key(|name| {
            parts.push(name.clone());
            (parts.len() - 1) as u32
        });
        state.part = Some(part);
        part
    }

    fn begin_run(&mut self, state: &mut State) {
        state.changed = false;
        let part = self.part(state);
        let material = state.material;
        if self.runs.last().is_none_or(|run| run.part != part || run.material != material) {
            self.runs.push(Run { first_face: self.faces.len() as u32, part, material });
        }
    }

    fn other(&mut self, line: &[u8], number: u64, state: &mut State, oddities: &mut Oddities) {
        let mut rest = line;
        let Some(keyword) = text::word(&mut rest) else { return };
        let rest = rest.trim_ascii();
        let place = || format!("line {number}");
        self.known_lines += 1;
        match keyword {
            b"o" => {
                state.object = String::from_utf8_lossy(rest).into_owned();
                state.group.clear();
                (state.changed, state.part) = (true, None);
            }
            b"g" => {
                // Several names on a line put a face into several groups; together they name one part.
                state.group = String::from_utf8_lossy(rest).into_owned();
                (state.changed, state.part) = (true, None);
            }
            b"usemtl" => {
                let materials = &mut self.materials;
                state.material = *state.material_of_name.entry(rest.to_owned()).or_insert_with_key(|name| {
                    materials.push(name.clone());
                    (materials.len() - 1) as u32
                });
                state.changed = true;
            }
            b"mtllib" => {
                if state.known_libraries.insert(rest.to_owned()) {
                    self.libraries.push(rest.to_owned());
                }
            }
            // Smoothing groups: where a file has no normals, its faces are flat. The rest is rendering state.
            b"s" | b"mg" | b"bevel" | b"c_interp" | b"d_interp" | b"lod" | b"usemap" | b"maplib"
            | b"shadow_obj" | b"trace_obj" => {}
            b"fo" => self.face(rest, number, state, oddities),
            b"p" => oddities.in_line(number, "points are left out; only faces and lines are read"),
            b"l" => self.line(rest, number, state, oddities),
            b"call" | b"csh" => {
                oddities
                    .in_line(number, "other files are not called, nor commands run; the line is left out");
            }
            b"vp" | b"cstype" | b"deg" | b"bmat" | b"step" | b"curv" | b"curv2" | b"surf" | b"parm"
            | b"trim" | b"hole" | b"scrv" | b"sp" | b"end" | b"con" | b"ctech" | b"stech" | b"bsp"
            | b"bzp" | b"cdc" | b"cdp" | b"res" => oddities.note("curves", place, || {
                "curves and curved surfaces are left out; only faces and lines are read".into()
            }),
            _ => {
                self.known_lines -= 1;
                oddities.note("unknown", place, || {
                    format!("{} is not a word of the format; the line is left out", text::quoted(keyword))
                });
            }
        }
    }

    /// Takes off corners what does not exist: texture coordinates and normals that are not there.
    fn mend_corners(&mut self, oddities: &mut Oddities) {
        let (uvs, normals) = (&self.uvs, &self.normals);
        let mut missing = 0u64;
        for [_, uv, normal] in &mut self.corners {
            if *uv as usize >= uvs.len() && *uv != NONE {
                *uv = NONE;
                missing += 1;
            }
            match normals.get(*normal as usize) {
                Some(&n) if n != Vec3::ZERO => {}
                Some(_) => *normal = NONE,
                None if *normal == NONE => {}
                None => {
                    *normal = NONE;
                    missing += 1;
                }
            }
        }
        if missing > 0 {
            let what = "name texture coordinates or normals that do not exist; they are taken as none";
            oddities.note("mended", || format!("{missing} corners"), || what.into());
        }
    }
}

/// The first three numbers of a line; NaN for each that is missing.
fn leading_numbers(mut line: &[u8]) -> [f32; 3] {
    let mut values = [f32::NAN; 3];
    for value in &mut values {
        let Some(number) = text::word(&mut line).and_then(text::number) else { break };
        *value = number;
    }
    values
}

/// Colours in OBJ files are what a screen without colour management shows: sRGB.
fn linear(encoded: f32) -> f32 {
    srgb::linear(f64::from(encoded.max(0.0))) as f32
}

/// Takes `v`, `v/vt`, `v//vn` or `v/vt/vn` from the front of `rest`.
#[inline]
fn corner(rest: &mut &[u8], [positions, uvs, normals]: [usize; 3]) -> Option<Corner> {
    let position = index(rest, positions)?;
    let (mut uv, mut normal) = (NONE, NONE);
    if let [b'/', after @ ..] = *rest {
        *rest = after;
        if rest.first().is_some_and(|&b| b != b'/' && !is_blank(b)) {
            uv = index(rest, uvs)?;
        }
        if let [b'/', after @ ..] = *rest {
            *rest = after;
            if rest.first().is_some_and(|&b| !is_blank(b)) {
                normal = index(rest, normals)?;
            }
        }
    }
    rest.first().is_none_or(|&b| is_blank(b) || b == b'#').then_some([position, uv, normal])
}

/// Takes an index from the front of `rest`, from 1, or negative counting back from the last of `count`.
#[inline]
fn index(rest: &mut &[u8], count: usize) -> Option<u32> {
    let (negative, mut digits) = match *rest {
        [b'-', after @ ..] => (true, after),
        _ => (false, *rest),
    };
    let mut value: u64 = 0;
    let before = digits.len();
    while let [digit @ b'0'..=b'9', after @ ..] = digits {
        value = value.saturating_mul(10).saturating_add(u64::from(digit - b'0'));
        digits = after;
    }
    if digits.len() == before {
        return None;
    }
    *rest = digits;
    let from_zero = if negative { (count as u64).checked_sub(value) } else { value.checked_sub(1) };
    // 0 is no index; -0 is the one after the last, which is as wrong.
    let found = from_zero.filter(|_| value != 0).unwrap_or(u64::from(NOWHERE));
    Some(found.min(u64::from(NOWHERE)) as u32)
}
