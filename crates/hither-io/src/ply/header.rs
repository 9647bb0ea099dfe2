//! The header of a PLY file: which elements follow, in which order, and what each is made of.

use crate::text::{self, quoted};
use std::collections::HashSet;

/// How the numbers after the header are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// Type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

/// A property of an element.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Property {
    pub(super) name: String,
    /// Type of the number, or of a list's entries.
    pub(super) kind: Kind,
    /// Type of the number of entries; `None` is a single number.
    pub(super) list: Option<Kind>,
}

/// A table: `count` rows with the same properties.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

#[derive(Debug)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// Where the header ends.
    pub(super) length: usize,
}

impl Kind {
    fn named(name: &[u8]) -> Result<Kind, String> {
        Ok(match name {
            b"char" | b"int8" => Kind::I8,
            b"uchar" | b"uint8" => Kind::U8,
            b"short" | b"int16" => Kind::I16,
            b"ushort" | b"uint16" => Kind::U16,
            b"int" | b"int32" => Kind::I32,
            b"uint" | b"uint32" => Kind::U32,
            b"float" | b"float32" => Kind::F32,
            b"double" | b"float64" => Kind::F64,
            other => return Err(format!("{} is not a type of numbers", quoted(other))),
        })
    }

    /// Bytes of a binary number.
    pub(super) fn size(self) -> usize {
        match self {
            Kind::I8 | Kind::U8 => 1,
            Kind::I16 | Kind::U16 => 2,
            Kind::I32 | Kind::U32 | Kind::F32 => 4,
            Kind::F64 => 8,
        }
    }

    pub(super) fn is_float(self) -> bool {
        matches!(self, Kind::F32 | Kind::F64)
    }
}

/// Reads the header; on failure one line that says what is wrong with it.
pub(super) fn parse(bytes: &[u8]) -> Result<Header, String> {
    let mut lines =
        HeaderLines::new(bytes).ok_or("it does not begin with a line \"ply\"; it is not a PLY file")?;
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    // A header may declare as many elements as it has room for: each is asked for once, not held against all others.
    let mut declared: HashSet<String> = HashSet::new();
    loop {
        let Some(line) = lines.next() else {
            return Err("its header does not end; it is truncated, or not a PLY file".into());
        };
        let mut rest = line;
        let at = |message: String| format!("line {} of its header: {message}", lines.number);
        // Comments are free text, `#` included; nothing else has one.
        match text::word(&mut rest) {
            None | Some(b"comment" | b"obj_info") => {}
            Some(b"end_header") => break,
            Some(b"format") => encoding = Some(encoding_named(rest).map_err(at)?),
            Some(b"element") => {
                let element = element(rest).map_err(at)?;
                if !declared.insert(element.name.clone()) {
                    return Err(at(format!(
                        "the element {} is declared twice",
                        quoted(element.name.as_bytes())
                    )));
                }
                elements.push(element);
            }
            Some(b"property") => match elements.last_mut() {
                Some(element) => element.properties.push(property(rest).map_err(at)?),
                None => return Err(at("a property comes before any element".into())),
            },
            Some(other) => return Err(at(format!("{} is not a word of the format", quoted(other)))),
        }
    }
    let encoding = encoding.ok_or("its header does not state a format")?;
    Ok(Header { encoding, elements, length: lines.at })
}

fn encoding_named(mut rest: &[u8]) -> Result<Encoding, String> {
    match text::word(&mut rest) {
        Some(b"ascii") => Ok(Encoding::Text),
        Some(b"binary_little_endian") => Ok(Encoding::LittleEndian),
        Some(b"binary_big_endian") => Ok(Encoding::BigEndian),
        other => Err(format!("{} is not a format of PLY files", quoted(other.unwrap_or_default()))),
    }
}

fn element(mut rest: &[u8]) -> Result<Element, String> {
    let name = text::word(&mut rest).ok_or("an element has no name")?;
    let count = text::word(&mut rest).unwrap_or_default();
    let count = std::str::from_utf8(count)
        .ok()
        .and_then(|c| c.parse().ok())
        .ok_or_else(|| format!("{} is not a number of elements", quoted(count)))?;
    Ok(Element { name: String::from_utf8_lossy(name).into_owned(), count, properties: Vec::new() })
}

fn property(mut rest: &[u8]) -> Result<Property, String> {
    let mut word = || text::word(&mut rest).ok_or("a property is incomplete");
    let first = word()?;
    let (list, kind) = if first == b"list" {
        let list = Kind::named(word()?)?;
        if list.is_float() {
            return Err("the number of a list's entries cannot be a float".into());
        }
        (Some(list), Kind::named(word()?)?)
    } else {
        (None, Kind::named(first)?)
    };
    let name = String::from_utf8_lossy(word()?).into_owned();
    Ok(Property { name, kind, list })
}

/// Lines that end as the first one does: after the last, binary numbers follow, which may look like line ends.
struct HeaderLines<'a> {
    bytes: &'a [u8],
    at: usize,
    end: &'static [u8],
    number: u64,
}

impl<'a> HeaderLines<'a> {
    fn new(bytes: &'a [u8]) -> Option<HeaderLines<'a>> {
        let ends: [&[u8]; 3] = [b"\r\n", b"\n", b"\r"];
        let rest = bytes.strip_prefix(b"ply")?;
        let blanks = rest.iter().take_while(|&&b| b == b' ' || b == b'\t').count();
        let end = ends.into_iter().find(|end| rest[blanks..].starts_with(end))?;
        Some(HeaderLines { bytes, at: 3 + blanks + end.len(), end, number: 1 })
    }

    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = &self.bytes[self.at..];
        let length = memchr::memmem::find(rest, self.end)?;
        self.at += length + self.end.len();
        self.number += 1;
        Some(rest[..length].trim_ascii())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "ply\nformat ascii 1.0\ncomment # hello\nobj_info x\nelement vertex 3\n\
        property float32 x\nproperty double y\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n\n1";

    #[test]
    fn any_line_end_gives_the_same_elements() {
        for end in ["\n", "\r\n", "\r"] {
            let text = GOOD.replace('\n', end);
            let header = parse(text.as_bytes()).unwrap();
            assert_eq!(header.encoding, Encoding::Text);
            // What follows the header's last line end belongs to the numbers.
            assert_eq!(&text[header.length..], format!("{end}1"));
            let [vertex, face] = &header.elements[..] else { panic!("{:?}", header.elements) };
            assert_eq!((vertex.name.as_str(), vertex.count, vertex.properties.len()), ("vertex", 3, 2));
            assert_eq!(vertex.properties[1], Property { name: "y".into(), kind: Kind::F64, list: None });
            assert_eq!(face.properties[0].list, Some(Kind::U8));
        }
    }

    /// Comparing each with all others would take minutes.
    #[test]
    fn many_elements_are_as_many_steps() {
        const COUNT: usize = 200_000;
        let element = |i: usize| format!("element e{i} 0\nproperty float x\n");
        let elements: String = (0..COUNT).map(element).collect();
        let text = format!("ply\nformat ascii 1.0\n{elements}end_header\n");
        assert_eq!(parse(text.as_bytes()).unwrap().elements.len(), COUNT);
        let again = text.replace("end_header", "element e0 1\nend_header");
        assert!(parse(again.as_bytes()).unwrap_err().contains("the element \"e0\" is declared twice"));
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        for (from, to, part) in [
            ("ply", "plx", "does not begin"),
            ("end_header", "end", "\"end\" is not a word"),
            ("end_header\n\n1", "", "does not end"),
            ("ascii", "asci", "line 2 of its header: \"asci\" is not a format"),
            ("format ascii 1.0", "", "does not state a format"),
            ("float32", "float128", "line 6 of its header: \"float128\" is not a type"),
            ("vertex 3", "vertex -3", "\"-3\" is not a number of elements"),
            ("vertex 3", "vertex", "\"\" is not a number"),
            ("vertex 3", "vertex 99999999999999999999", "is not a number of elements"),
            ("element face", "element vertex", "declared twice"),
            ("element vertex 3", "", "before any element"),
            ("list uchar", "list float", "cannot be a float"),
            ("double y", "double", "incomplete"),
        ] {
            let error = parse(GOOD.replacen(from, to, 1).as_bytes()).unwrap_err();
            assert!(error.contains(part), "{error}");
        }
    }
}
