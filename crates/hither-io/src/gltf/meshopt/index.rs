//! Index streams: triangle lists (mode 1) and plain sequences (mode 2).
//!
//! A triangle is one byte where it shares an edge with a recent one; two rings of sixteen hold the recent
//! edges and vertices. Entries of a ring that were never written read as an index that no mesh has.

use super::{Cursor, Damage, TOO_LONG, TOO_SHORT, unzigzag};

const TRIANGLES: u8 = 0xe1;
const SEQUENCE: u8 = 0xd1;

/// The last sixteen things pushed; 0 is the latest.
struct Ring<T> {
    entries: [T; 16],
    next: usize,
}

impl<T: Copy> Ring<T> {
    fn new(nothing: T) -> Ring<T> {
        Ring { entries: [nothing; 16], next: 0 }
    }

    fn push(&mut self, entry: T) {
        self.entries[self.next & 15] = entry;
        self.next = self.next.wrapping_add(1);
    }

    fn get(&self, back: u8) -> T {
        self.entries[self.next.wrapping_sub(1 + usize::from(back)) & 15]
    }
}

struct Decoder<'a> {
    data: Cursor<'a>,
    edges: Ring<(u32, u32)>,
    vertices: Ring<u32>,
    /// The index that the next new vertex gets.
    next: u32,
    /// The index that explicit ones are told relative to.
    last: u32,
}

/// `count` indices, three to a triangle.
pub(super) fn triangles(source: &[u8], count: usize) -> Result<Vec<u32>, Damage> {
    if !count.is_multiple_of(3) {
        return Err("its count is not a multiple of 3");
    }
    let mut whole = Cursor { rest: source };
    if whole.byte()? != TRIANGLES {
        return Err("it does not begin as triangles do");
    }
    let codes = whole.take(count / 3)?;
    let (data, table) = whole.rest.split_last_chunk::<16>().ok_or(TOO_SHORT)?;
    let mut decoder = Decoder {
        data: Cursor { rest: data },
        edges: Ring::new((u32::MAX, u32::MAX)),
        vertices: Ring::new(u32::MAX),
        next: 0,
        last: 0,
    };
    let mut out = Vec::with_capacity(count);
    for &code in codes {
        let triangle =
            if code < 0xf0 { decoder.beside_edge(code)? } else { decoder.apart(code & 15, table)? };
        out.extend(triangle);
    }
    if decoder.data.rest.is_empty() { Ok(out) } else { Err(TOO_LONG) }
}

impl Decoder<'_> {
    fn new_vertex(&mut self) -> u32 {
        let index = self.next;
        self.next = self.next.wrapping_add(1);
        index
    }

    fn explicit(&mut self) -> Result<u32, Damage> {
        self.last = self.last.wrapping_add(unzigzag(self.data.number()?));
        Ok(self.last)
    }

    /// A triangle on a recent edge.
    fn beside_edge(&mut self, code: u8) -> Result<[u32; 3], Damage> {
        let (a, b) = self.edges.get(code >> 4);
        let c = match code & 15 {
            0 => self.new_vertex(),
            back @ 1..=12 => self.vertices.get(back),
            13 => {
                self.last = self.last.wrapping_sub(1);
                self.last
            }
            14 => {
                self.last = self.last.wrapping_add(1);
                self.last
            }
            _ => self.explicit()?,
        };
        if !(1..=12).contains(&(code & 15)) {
            self.vertices.push(c);
        }
        self.edges.push((c, b));
        self.edges.push((a, c));
        Ok([a, b, c])
    }

    /// A triangle on no recent edge.
    fn apart(&mut self, kind: u8, table: &[u8; 16]) -> Result<[u32; 3], Damage> {
        let corners = match kind {
            14 | 15 => self.data.byte()?,
            short => table[usize::from(short)],
        };
        if kind >= 14 && corners == 0 {
            self.next = 0;
        }
        let a = if kind == 15 { self.explicit()? } else { self.new_vertex() };
        // The table never names an explicit index, which would need data of its own.
        let b = self.corner(corners >> 4)?;
        let c = self.corner(corners & 15)?;
        self.vertices.push(a);
        if matches!(corners >> 4, 0 | 15) {
            self.vertices.push(b);
        }
        if matches!(corners & 15, 0 | 15) {
            self.vertices.push(c);
        }
        self.edges.push((b, a));
        self.edges.push((c, b));
        self.edges.push((a, c));
        Ok([a, b, c])
    }

    fn corner(&mut self, code: u8) -> Result<u32, Damage> {
        match code {
            0 => Ok(self.new_vertex()),
            15 => self.explicit(),
            back => Ok(self.vertices.get(back - 1)),
        }
    }
}

/// `count` indices in no particular order.
pub(super) fn sequence(source: &[u8], count: usize) -> Result<Vec<u32>, Damage> {
    let mut whole = Cursor { rest: source };
    if whole.byte()? != SEQUENCE {
        return Err("it does not begin as an index sequence does");
    }
    let (data, _padding) = whole.rest.split_last_chunk::<4>().ok_or(TOO_SHORT)?;
    if count > data.len() {
        return Err(TOO_SHORT);
    }
    let mut data = Cursor { rest: data };
    let mut last = [0u32; 2];
    let mut out = Vec::with_capacity(count);
    for _ in 0..count {
        let code = data.number()?;
        let baseline = &mut last[(code & 1) as usize];
        *baseline = baseline.wrapping_add(unzigzag(code >> 1));
        out.push(*baseline);
    }
    if data.rest.is_empty() { Ok(out) } else { Err(TOO_LONG) }
}
