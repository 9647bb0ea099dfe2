//! Pictures that know where they are: a layer's is cut to what it covers.

use crate::render::Window;

/// A piece of a picture: rows from the top, linear premultiplied RGBA; transparent outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sprite {
    /// Column of its left edge in the picture.
    pub x: u32,
    /// Row of its top edge.
    pub y: u32,
    /// Width, pixels, perhaps 0.
    pub width: u32,
    /// Height, pixels, perhaps 0.
    pub height: u32,
    /// Row by row.
    pub pixels: Vec<[f32; 4]>,
}

impl Sprite {
    /// Cuts a whole picture `width` pixels wide to the pixels that are not transparent.
    pub fn cut(width: u32, pixels: &[[f32; 4]]) -> Sprite {
        let w = width as usize;
        let covered = |row: &[[f32; 4]]| row.iter().any(|p| *p != [0.0; 4]);
        let mut rows = pixels.chunks_exact(w).enumerate().filter(|(_, row)| covered(row)).map(|(y, _)| y);
        let Some(top) = rows.next() else { return Sprite::default() };
        let bottom = rows.next_back().unwrap_or(top);
        let (mut left, mut right) = (w, 0);
        for row in pixels[top * w..(bottom + 1) * w].chunks_exact(w) {
            let first = row.iter().position(|p| *p != [0.0; 4]).unwrap_or(w);
            let last = row.iter().rposition(|p| *p != [0.0; 4]).unwrap_or(0);
            (left, right) = (left.min(first), right.max(last));
        }
        let cut = (top..=bottom).flat_map(|y| pixels[y * w + left..=y * w + right].iter().copied()).collect();
        Sprite {
            x: left as u32,
            y: top as u32,
            width: (right + 1 - left) as u32,
            height: (bottom + 1 - top) as u32,
            pixels: cut,
        }
    }

    /// Cuts a window of a picture, given its pixels, to those that are not transparent.
    pub(super) fn of_window(window: &Window, pixels: &[[f32; 4]]) -> Sprite {
        if pixels.is_empty() {
            return Sprite::default();
        }
        let mut sprite = Sprite::cut(window.columns.len() as u32, pixels);
        if !sprite.is_empty() {
            (sprite.x, sprite.y) = (sprite.x + window.columns.start, sprite.y + window.rows.start);
        }
        sprite
    }

    /// Whether it shows nothing.
    pub fn is_empty(&self) -> bool {
        self.pixels.is_empty()
    }

    /// The pixel at (x, y) of the whole picture.
    pub fn at(&self, x: u32, y: u32) -> [f32; 4] {
        let inside = x >= self.x && x - self.x < self.width && y >= self.y && y - self.y < self.height;
        if inside { self.pixels[((y - self.y) * self.width + x - self.x) as usize] } else { [0.0; 4] }
    }

    /// The whole picture it is a part of, row by row.
    pub fn expanded(&self, width: u32, height: u32) -> Vec<[f32; 4]> {
        let mut canvas = Canvas::new(width, height);
        canvas.add(self);
        canvas.pixels
    }

    fn rows(&self) -> impl Iterator<Item = (u32, &[[f32; 4]])> {
        (self.y..).zip(self.pixels.chunks_exact(self.width.max(1) as usize))
    }

    /// Leaves what lies outside of `other`.
    pub fn cut_out(&mut self, other: &Sprite) {
        self.attenuate(other, |alpha| 1.0 - alpha);
    }

    /// Multiplies every pixel by what `factor` makes of the other's alpha there.
    pub(super) fn attenuate(&mut self, by: &Sprite, factor: impl Fn(f32) -> f32) {
        let (x0, width) = (self.x, self.width.max(1));
        for (i, pixel) in self.pixels.iter_mut().enumerate() {
            let (x, y) = (x0 + i as u32 % width, self.y + i as u32 / width);
            let f = factor(by.at(x, y)[3]);
            *pixel = pixel.map(|c| c * f);
        }
    }
}

/// A whole picture: rows from the top, linear premultiplied RGBA.
#[derive(Clone, Debug, PartialEq)]
pub struct Canvas {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Row by row.
    pub pixels: Vec<[f32; 4]>,
}

impl Canvas {
    /// A transparent picture.
    pub fn new(width: u32, height: u32) -> Canvas {
        Canvas { width, height, pixels: vec![[0.0; 4]; width as usize * height as usize] }
    }

    fn row(&mut self, x: u32, y: u32, width: usize) -> &mut [[f32; 4]] {
        let start = y as usize * self.width as usize + x as usize;
        &mut self.pixels[start..start + width]
    }

    /// Puts `behind` behind what is there. Where that is opaque, no bit changes.
    pub fn over(&mut self, behind: &Sprite) {
        for (y, row) in behind.rows() {
            for (front, behind) in self.row(behind.x, y, row.len()).iter_mut().zip(row) {
                let through = 1.0 - front[3];
                for (f, b) in front.iter_mut().zip(behind) {
                    *f += b * through;
                }
            }
        }
    }

    /// Adds.
    pub fn add(&mut self, other: &Sprite) {
        for (y, row) in other.rows() {
            for (sum, term) in self.row(other.x, y, row.len()).iter_mut().zip(row) {
                for (s, t) in sum.iter_mut().zip(term) {
                    *s += t;
                }
            }
        }
    }

    /// Combines pixel by pixel with another picture of the same size.
    pub fn combine(&mut self, other: &Canvas, f: impl Fn([f32; 4], [f32; 4]) -> [f32; 4]) {
        for (a, b) in self.pixels.iter_mut().zip(&other.pixels) {
            *a = f(*a, *b);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cutting_and_expanding_keep_every_pixel() {
        let mut pixels = vec![[0.0; 4]; 7 * 5];
        assert!(Sprite::cut(7, &pixels).is_empty());
        pixels[2 * 7 + 3] = [1.0, 0.5, 0.25, 1.0];
        pixels[3 * 7 + 5] = [0.1; 4];
        let sprite = Sprite::cut(7, &pixels);
        assert_eq!((sprite.x, sprite.y, sprite.width, sprite.height), (3, 2, 3, 2));
        assert_eq!(sprite.expanded(7, 5), pixels);
        assert_eq!(sprite.at(5, 3), [0.1; 4]);
        assert_eq!(sprite.at(6, 3), [0.0; 4]);
    }
}
