//! The statements of an OBJ file as flat lists: positions, attributes, and faces with their part and material.
//!
//! Nothing is looked up here but names, so a face may come before what it refers to. A long file is read in
//! pieces, each by a thread that knows nothing of the others: it counts lines, vertices and names from its own
//! first on, and [`super::join`] puts the pieces together.

use super::join;
use crate::oddities::{Losses, Oddities};
use crate::srgb;
use crate::text::{self, Lines, is_blank};
use glam::{DVec3, Vec2, Vec3, Vec4};
use rayon::prelude::*;
use std::collections::HashMap;

/// No texture coordinate, no normal.
pub(super) const NONE: u32 = u32::MAX;

/// An index that leads nowhere, whatever the lists hold.
pub(super) const NOWHERE: u32 = u32::MAX - 1;

/// Of a piece: the material that was in use when it began.
pub(super) const BEFORE: u32 = u32::MAX - 1;

/// The largest number of things of one kind that can be referred to.
const MOST: usize = NOWHERE as usize;

/// Bytes that are worth a thread of their own: a millisecond's work, or two.
const SHORTEST_PIECE: usize = 1 << 19;

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
    /// Indices of the positions that all polylines go through.
    pub(super) line_corners: Vec<u32>,
    /// Polylines (`l`).
    pub(super) polylines: Vec<Polyline>,
    /// Names of parts: object, group, or both with a `/` between.
    pub(super) parts: Vec<String>,
    /// Names that `usemtl` gives.
    pub(super) materials: Vec<Vec<u8>>,
    /// What follows `mtllib`.
    pub(super) libraries: Vec<Vec<u8>>,
    /// Lines that begin with a word of the format.
    pub(super) known_lines: u64,
    /// Faces that are not among these, since they cannot be read.
    pub(super) losses: Losses,
}

/// A face: its corners end here, and begin where those of the face before end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    pub(super) end: u32,
    pub(super) line: u32,
}

/// A polyline: its corners end here, and begin where those of the one before end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polyline {
    pub(super) end: u32,
    pub(super) line: u32,
    pub(super) part: u32,
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

/// The names that a part has its name from; `None` where those hold that held when the piece began.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct Names {
    pub(super) object: Option<String>,
    /// A new object begins without a group, so where the object is given this is, too.
    pub(super) group: Option<String>,
}

/// An index that counts back from the last thing known, and may lead out of its piece.
#[derive(Clone, Copy, Debug)]
pub(super) struct CountedBack {
    /// The number among the piece's corners, or corners of polylines.
    pub(super) corner: usize,
    /// 0 for a position, 1 for a texture coordinate, 2 for a normal.
    pub(super) which: usize,
    /// What it refers to, counted from the piece's first.
    pub(super) index: i64,
}

/// What a piece of a file says. Its parts are [`Piece::parts`], not those of its statements.
#[derive(Debug)]
pub(super) struct Piece {
    pub(super) statements: Statements,
    pub(super) oddities: Oddities,
    /// Names of its parts.
    pub(super) parts: Vec<Names>,
    /// Indices of [`Statements::corners`] that count back.
    pub(super) corners_back: Vec<CountedBack>,
    /// Indices of [`Statements::line_corners`] that count back.
    pub(super) lines_back: Vec<CountedBack>,
    /// Physical lines.
    pub(super) lines: u64,
    /// What is in force at its end.
    pub(super) names: Names,
    pub(super) material: u32,
    /// Whether the names have changed since the last face.
    changed: bool,
    /// The part of these names, if it was needed.
    part: Option<u32>,
    part_of_names: HashMap<Names, u32>,
    material_of_name: HashMap<Vec<u8>, u32>,
}

/// Reads all statements, by several threads where they are many. What is left out is noted in `oddities`.
pub(super) fn parse(bytes: &[u8], oddities: &mut Oddities) -> Result<Statements, TooLarge> {
    let worthwhile = bytes.len() / SHORTEST_PIECE + 1;
    parse_in(worthwhile.min(rayon::current_num_threads()), bytes, oddities)
}

/// As [`parse`], in so many pieces; the answer is the same.
pub(super) fn parse_in(pieces: usize, bytes: &[u8], oddities: &mut Oddities) -> Result<Statements, TooLarge> {
    let pieces = text::pieces(text::without_mark(bytes), pieces);
    let pieces = pieces.into_par_iter().map(Piece::read).collect::<Result<_, _>>()?;
    let mut all = join::join(pieces, oddities)?;
    all.mend_corners(oddities);
    Ok(all)
}

impl Statements {
    /// Refuses more than indices reach.
    #[inline]
    pub(super) fn check_counts(&self) -> Result<(), TooLarge> {
        let most = (self.corners.len().max(self.line_corners.len()).max(self.positions.len()))
            .max(self.uvs.len())
            .max(self.normals.len());
        if most < MOST { Ok(()) } else { Err(TooLarge) }
    }

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

impl Piece {
    /// Reads a piece of a file. Texts are cut only where a statement ends.
    fn read(bytes: &[u8]) -> Result<Piece, TooLarge> {
        let mut piece = Piece {
            statements: Statements::default(),
            oddities: Oddities::default(),
            parts: Vec::new(),
            corners_back: Vec::new(),
            lines_back: Vec::new(),
            lines: 0,
            names: Names::default(),
            material: BEFORE,
            changed: true,
            part: None,
            part_of_names: HashMap::new(),
            material_of_name: HashMap::new(),
        };
        let mut lines = Lines::continued(bytes);
        // `number()` borrows what the line borrows.
        let mut number = 0;
        while let Some(line) = lines.next() {
            let line_number = number + 1;
            let all = &mut piece.statements;
            match line {
                [] | [b'#', ..] => {}
                [b'v', b, rest @ ..] if is_blank(*b) => {
                    all.position(rest, line_number, &mut piece.oddities);
                }
                [b'f', b, rest @ ..] if is_blank(*b) => piece.face(rest, line_number),
                [b'v', b'n', b, rest @ ..] if is_blank(*b) => all.normal(rest),
                [b'v', b't', b, rest @ ..] if is_blank(*b) => all.uv(rest),
                _ => piece.other(line, line_number),
            }
            number = lines.number();
            piece.statements.check_counts()?;
        }
        piece.lines = number;
        Ok(piece)
    }

    /// How many positions, texture coordinates and normals are known.
    #[inline]
    fn counts(&self) -> [usize; 3] {
        [self.statements.positions.len(), self.statements.uvs.len(), self.statements.normals.len()]
    }

    fn face(&mut self, line: &[u8], number: u64) {
        let counts = self.counts();
        let corners = &mut self.statements.corners;
        let (first, first_back) = (corners.len(), self.corners_back.len());
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
            let Some(corner) = corner(&mut rest, counts, corners.len(), &mut self.corners_back) else {
                corners.truncate(first);
                self.corners_back.truncate(first_back);
                self.statements.losses.lost(number, "a face cannot be read and is left out");
                return self.oddities.in_line_with(number, "corner", || {
                    format!("the face {} cannot be read and is left out", text::quoted(line))
                });
            };
            corners.push(corner);
        }
        let end = corners.len();
        if end < first + 3 {
            corners.truncate(first);
            self.corners_back.truncate(first_back);
            let why = "a face has fewer than three corners and is left out";
            self.statements.losses.lost(number, why);
            return self.oddities.in_line(number, why);
        }
        if self.changed {
            self.begin_run();
        }
        let line = u32::try_from(number).unwrap_or(u32::MAX);
        self.statements.faces.push(Face { end: end as u32, line });
    }

    /// `l`: a line through corners; texture coordinates are of no use to it.
    fn line(&mut self, line: &[u8], number: u64) {
        let counts = self.counts();
        let part = self.part();
        let corners = &mut self.statements.line_corners;
        let mut rest = line;
        loop {
            rest = rest.trim_ascii_start();
            if rest.first().is_none_or(|&b| b == b'#') {
                break;
            }
            let Some([position, ..]) = corner(&mut rest, counts, corners.len(), &mut self.lines_back) else {
                self.lines_back.retain(|back| back.corner < corners.len());
                self.oddities.in_line(number, "a line cannot be read; what follows of it is left out");
                break;
            };
            corners.push(position);
        }
        let (end, line) = (corners.len() as u32, u32::try_from(number).unwrap_or(u32::MAX));
        self.statements.polylines.push(Polyline { end, line, part });
    }

    /// The number of the part that new faces and lines belong to.
    fn part(&mut self) -> u32 {
        if let Some(part) = self.part {
            return part;
        }
        let parts = &mut self.parts;
        let part = *self.part_of_names.entry(self.names.clone()).or_insert_with_key(|names| {
            parts.push(names.clone());
            (parts.len() - 1) as u32
        });
        self.part = Some(part);
        part
    }

    fn begin_run(&mut self) {
        self.changed = false;
        let (part, material) = (self.part(), self.material);
        let all = &mut self.statements;
        if all.runs.last().is_none_or(|run| run.part != part || run.material != material) {
            all.runs.push(Run { first_face: all.faces.len() as u32, part, material });
        }
    }

    fn other(&mut self, line: &[u8], number: u64) {
        let mut rest = line;
        let Some(keyword) = text::word(&mut rest) else {
            // Zeros part words, too; where there is nothing else, they are what a crash or a bad disk leaves.
            if line.contains(&0) {
                self.oddities.in_line(number, "a line holds zero bytes instead of text and is left out");
            }
            return;
        };
        let rest = rest.trim_ascii();
        let all = &mut self.statements;
        all.known_lines += 1;
        match keyword {
            b"o" => {
                let object = Some(String::from_utf8_lossy(rest).into_owned());
                self.names = Names { object, group: Some(String::new()) };
                (self.changed, self.part) = (true, None);
            }
            b"g" => {
                // Several names on a line put a face into several groups; together they name one part.
                self.names.group = Some(String::from_utf8_lossy(rest).into_owned());
                (self.changed, self.part) = (true, None);
            }
            b"usemtl" => {
                let materials = &mut all.materials;
                self.material = *self.material_of_name.entry(rest.to_owned()).or_insert_with_key(|name| {
                    materials.push(name.clone());
                    (materials.len() - 1) as u32
                });
                self.changed = true;
            }
            b"mtllib" => all.libraries.push(rest.to_owned()),
            // Smoothing groups: where a file has no normals, its faces are flat. The rest is rendering state.
            b"s" | b"mg" | b"bevel" | b"c_interp" | b"d_interp" | b"lod" | b"usemap" | b"maplib"
            | b"shadow_obj" | b"trace_obj" => {}
            b"fo" => self.face(rest, number),
            b"p" => self.oddities.in_line(number, "points are left out; only faces and lines are read"),
            b"l" => self.line(rest, number),
            b"call" | b"csh" => {
                self.oddities
                    .in_line(number, "other files are not called, nor commands run; the line is left out");
            }
            b"vp" | b"cstype" | b"deg" | b"bmat" | b"step" | b"curv" | b"curv2" | b"surf" | b"parm"
            | b"trim" | b"hole" | b"scrv" | b"sp" | b"end" | b"con" | b"ctech" | b"stech" | b"bsp"
            | b"bzp" | b"cdc" | b"cdp" | b"res" => self.oddities.in_line_with(number, "curves", || {
                "curves and curved surfaces are left out; only faces and lines are read".into()
            }),
            _ => {
                all.known_lines -= 1;
                self.oddities.in_line_with(number, "unknown", || {
                    format!("{} is not a word of the format; the line is left out", text::quoted(keyword))
                });
            }
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

/// Takes `v`, `v/vt`, `v//vn` or `v/vt/vn` from the front of `rest`. Indices that count back are noted in `back`,
/// as those of corner `number`.
#[inline]
fn corner(
    rest: &mut &[u8],
    counts: [usize; 3],
    number: usize,
    back: &mut Vec<CountedBack>,
) -> Option<Corner> {
    let mut corner = [NONE; 3];
    let mut take = |rest: &mut &[u8], which: usize| -> Option<()> {
        corner[which] = match index(rest, counts[which])? {
            Index::At(index) => index,
            Index::Back(index) => {
                back.push(CountedBack { corner: number, which, index });
                NOWHERE
            }
        };
        Some(())
    };
    take(rest, 0)?;
    if let [b'/', after @ ..] = *rest {
        *rest = after;
        if rest.first().is_some_and(|&b| b != b'/' && !is_blank(b)) {
            take(rest, 1)?;
        }
        if let [b'/', after @ ..] = *rest {
            *rest = after;
            if rest.first().is_some_and(|&b| !is_blank(b)) {
                take(rest, 2)?;
            }
        }
    }
    rest.first().is_none_or(|&b| is_blank(b) || b == b'#').then_some(corner)
}

/// What an index of a file says.
enum Index {
    /// The thing of this number in the whole file, or [`NOWHERE`].
    At(u32),
    /// The thing of this number in the piece; the negative ones are of the pieces before.
    Back(i64),
}

/// Takes an index from the front of `rest`, from 1, or negative counting back from the last of `count`.
#[inline]
fn index(rest: &mut &[u8], count: usize) -> Option<Index> {
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
    let nowhere = u64::from(NOWHERE);
    Some(match value {
        // 0 is no index; -0 is the one after the last, which is as wrong.
        0 => Index::At(NOWHERE),
        _ if negative && value <= nowhere => Index::Back(count as i64 - value as i64),
        _ if negative => Index::At(NOWHERE),
        _ => Index::At((value - 1).min(nowhere) as u32),
    })
}
