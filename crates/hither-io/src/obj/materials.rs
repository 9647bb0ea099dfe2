//! Material libraries (`.mtl`) and their textures.

use super::parse::Statements;
use crate::companions::Companions;
use crate::oddities::Oddities;
use crate::text::{self, Lines, quoted};
use crate::{srgb, texture};
use glam::{DAffine2, DVec2, Vec4};
use hither::scene::{AlphaMode, Filter, Material, Texture, TextureRef, Wrap};
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};

/// The materials of a file.
#[derive(Debug, Default)]
pub(super) struct Materials {
    /// All that the libraries define.
    pub(super) list: Vec<Material>,
    /// Their textures.
    pub(super) textures: Vec<Texture>,
    /// For each of [`Statements::materials`] its place in `list`.
    pub(super) of_name: Vec<Option<u32>>,
}

/// A material as a library states it.
#[derive(Default)]
struct Stated {
    name: Vec<u8>,
    color: Option<[f32; 3]>,
    dissolve: Option<f32>,
    transparency: Option<f32>,
    map: Option<Map>,
}

/// `map_Kd` with its options.
struct Map {
    file: Vec<u8>,
    offset: DVec2,
    scale: DVec2,
    clamp: bool,
}

/// Loads the libraries and the textures of those materials that faces use.
pub(super) fn load(
    statements: &Statements,
    companions: &dyn Companions,
    oddities: &mut Oddities,
) -> Materials {
    let mut stated: Vec<Stated> = Vec::new();
    for library in &statements.libraries {
        for (name, bytes) in library_files(library, companions, oddities) {
            parse(&name, &bytes, &mut stated, oddities);
        }
    }
    // Where a name is stated twice, the later counts.
    let place: HashMap<&[u8], usize> =
        stated.iter().enumerate().map(|(i, m)| (m.name.as_slice(), i)).collect();
    let used: Vec<Option<&Stated>> =
        statements.materials.iter().map(|name| place.get(name.as_slice()).map(|&at| &stated[at])).collect();
    let textures = Textures::load(used.iter().flatten().filter_map(|m| m.map.as_ref()), companions, oddities);
    let mut materials = Materials::default();
    for (name, stated) in statements.materials.iter().zip(used) {
        let Some(stated) = stated else {
            oddities.note(
                "undefined material",
                || format!("material {}", quoted(name)),
                || "it is not defined in a material library; its faces are white".into(),
            );
            materials.of_name.push(None);
            continue;
        };
        materials.of_name.push(Some(materials.list.len() as u32));
        materials.list.push(stated.material(&textures));
    }
    materials.textures = textures.list;
    materials
}

/// The files that a `mtllib` line names: one whose name may have blanks in it, else several.
fn library_files(
    names: &[u8],
    companions: &dyn Companions,
    oddities: &mut Oddities,
) -> Vec<(String, Vec<u8>)> {
    let load = |name: &[u8]| {
        let name = String::from_utf8_lossy(name).into_owned();
        companions.load(&name).map(|bytes| (name, bytes))
    };
    let reason = match load(names) {
        Ok(file) => return vec![file],
        Err(reason) => reason,
    };
    let mut rest = names;
    let words: Vec<&[u8]> = std::iter::from_fn(|| text::word(&mut rest)).collect();
    let several: Vec<_> =
        if words.len() > 1 { words.iter().map(|name| load(name)).collect() } else { Vec::new() };
    let mut missing = |name: &[u8], reason: String| {
        oddities.note(
            "library",
            || format!("material library {}", quoted(name)),
            || format!("{reason}; its materials are taken as undefined"),
        );
    };
    if several.iter().all(Result::is_err) {
        missing(names, reason);
        return Vec::new();
    }
    let mut files = Vec::new();
    for (name, file) in words.iter().zip(several) {
        match file {
            Ok(file) => files.push(file),
            Err(reason) => missing(name, reason),
        }
    }
    files
}

/// Appends the materials of one library.
fn parse(library: &str, bytes: &[u8], stated: &mut Vec<Stated>, oddities: &mut Oddities) {
    let first = stated.len();
    let mut lines = Lines::continued(text::without_mark(bytes));
    let mut number = 0;
    while let Some(line) = lines.next() {
        number += 1;
        let mut rest = line;
        if let Some(keyword) = text::word(&mut rest) {
            let place = || format!("{} line {number}", quoted(library.as_bytes()));
            let rest = rest.trim_ascii();
            // Some software writes `map_kd`.
            let keyword = &keyword.to_ascii_lowercase()[..];
            if keyword == b"newmtl" {
                stated.push(Stated { name: rest.to_owned(), ..Stated::default() });
            } else if stated.len() > first
                && let Some(material) = stated.last_mut()
            {
                material.state(keyword, rest, place, oddities);
            }
        }
        number = lines.number();
    }
    if stated.len() == first && !bytes.trim_ascii().is_empty() {
        oddities.note(
            "empty library",
            || format!("material library {}", quoted(library.as_bytes())),
            || "it defines no material".into(),
        );
    }
}

impl Stated {
    fn state(&mut self, keyword: &[u8], rest: &[u8], place: impl Fn() -> String, oddities: &mut Oddities) {
        match keyword {
            b"kd" => match numbers(rest)[..] {
                [r, g, b, ..] => self.color = Some([r, g, b]),
                [grey] => self.color = Some([grey; 3]),
                _ => oddities.note("Kd", place, || {
                    format!("the colour {} cannot be read; it is taken as white", quoted(rest))
                }),
            },
            b"d" => {
                let rest = rest.strip_prefix(b"-halo").unwrap_or(rest);
                self.dissolve = numbers(rest).first().copied();
            }
            b"tr" => self.transparency = numbers(rest).first().copied(),
            b"map_kd" => self.map = Some(Map::new(rest)),
            b"map_d" | b"map_tr" => {
                let message = || "a texture of transparency is left out; the surface stays as it is".into();
                oddities.note("map_d", place, message);
            }
            // Gloss, bumps, emission and the like: nothing that decides what is seen.
            _ => {}
        }
    }

    fn material(&self, textures: &Textures) -> Material {
        let color = self.color.unwrap_or([1.0; 3]).map(|c| srgb::linear(f64::from(c.clamp(0.0, 1e6))) as f32);
        // Some software writes `Tr` with the meaning of `d`, but then `d` is there too.
        let alpha = self.dissolve.or(self.transparency.map(|t| 1.0 - t)).unwrap_or(1.0).clamp(0.0, 1.0);
        Material {
            name: String::from_utf8_lossy(&self.name).into_owned(),
            base_color: Vec4::new(color[0], color[1], color[2], alpha),
            texture: self.map.as_ref().and_then(|map| textures.reference(map)),
            alpha: if alpha < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque },
            double_sided: true,
        }
    }
}

/// The numbers at the start of `rest`, up to what is none.
fn numbers(mut rest: &[u8]) -> Vec<f32> {
    let mut next = || text::word(&mut rest).and_then(text::number).filter(|n| n.is_finite());
    std::iter::from_fn(&mut next).take(4).collect()
}

impl Map {
    /// Reads options, then a file name that may have blanks in it.
    fn new(line: &[u8]) -> Map {
        let mut map = Map { file: Vec::new(), offset: DVec2::ZERO, scale: DVec2::ONE, clamp: false };
        let mut rest = line;
        loop {
            let before = rest;
            let Some(option) = text::word(&mut rest) else { break };
            match option {
                b"-o" => map.offset = up_to_three(&mut rest, 0.0),
                b"-s" => map.scale = up_to_three(&mut rest, 1.0),
                b"-t" => {
                    up_to_three(&mut rest, 0.0);
                }
                b"-clamp" => map.clamp = text::word(&mut rest) == Some(b"on"),
                b"-mm" => {
                    text::word(&mut rest);
                    text::word(&mut rest);
                }
                b"-blendu" | b"-blendv" | b"-boost" | b"-texres" | b"-cc" | b"-bm" | b"-imfchan"
                | b"-type" => {
                    text::word(&mut rest);
                }
                _ => {
                    let name = before.trim_ascii();
                    let quoted = name.strip_prefix(b"\"").and_then(|rest| rest.strip_suffix(b"\""));
                    map.file = quoted.unwrap_or(name).to_owned();
                    break;
                }
            }
        }
        map
    }

    /// Applies scale and offset to texture coordinates whose v goes down: v' = 1 − (s (1 − v) + o).
    fn transform(&self) -> DAffine2 {
        let offset = DVec2::new(self.offset.x, 1.0 - self.scale.y - self.offset.y);
        DAffine2::from_scale_angle_translation(self.scale, 0.0, offset)
    }
}

/// Takes u and, where they are there, v and w.
fn up_to_three(rest: &mut &[u8], missing: f64) -> DVec2 {
    let mut values = [missing; 3];
    for value in &mut values {
        let mut ahead = *rest;
        let Some(number) = text::word(&mut ahead).and_then(text::number).filter(|n| n.is_finite()) else {
            break;
        };
        *value = f64::from(number);
        *rest = ahead;
    }
    DVec2::new(values[0], values[1])
}

/// Textures by file name, each decoded once.
struct Textures {
    of_file: HashMap<Vec<u8>, u32>,
    list: Vec<Texture>,
}

impl Textures {
    /// Loads the files one after another and decodes them at the same time.
    fn load<'a>(
        maps: impl Iterator<Item = &'a Map>,
        companions: &dyn Companions,
        oddities: &mut Oddities,
    ) -> Textures {
        let mut budget = texture::Budget::default();
        let mut seen: HashSet<&[u8]> = HashSet::new();
        type File<'a> = (&'a [u8], Result<Vec<u8>, String>);
        let loaded: Vec<File> = maps
            .map(|map| map.file.as_slice())
            .filter(|&file| seen.insert(file))
            .map(|file| {
                let bytes = companions.load(&String::from_utf8_lossy(file));
                (file, bytes.and_then(|bytes| budget.pay(&bytes).map(|()| bytes)))
            })
            .collect();
        let decode = |(file, bytes): (&'a [u8], Result<Vec<u8>, String>)| {
            let name = String::from_utf8_lossy(file);
            (file, bytes.and_then(|bytes| texture::decode(&name, &bytes)))
        };
        let decoded: Vec<(&[u8], Result<Texture, String>)> = loaded.into_par_iter().map(decode).collect();
        let mut textures = Textures { of_file: HashMap::new(), list: Vec::new() };
        for (file, texture) in decoded {
            match texture {
                Ok(texture) => {
                    textures.of_file.insert(file.to_owned(), textures.list.len() as u32);
                    textures.list.push(texture);
                }
                Err(reason) => oddities.note(
                    "texture",
                    || format!("texture {}", quoted(file)),
                    || format!("{reason}; its surfaces are drawn without it"),
                ),
            }
        }
        textures
    }

    fn reference(&self, map: &Map) -> Option<TextureRef> {
        let &texture = self.of_file.get(&map.file)?;
        let wrap = if map.clamp { Wrap::Clamp } else { Wrap::Repeat };
        Some(TextureRef { texture, transform: map.transform(), wrap: [wrap; 2], filter: Filter::Linear })
    }
}
