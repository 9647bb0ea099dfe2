//! Depth of field by blurring layers, and what it is compared with [Snyder & Lengyel 1997, §10].
//!
//! The lens is a disc of the aperture's diameter around the pinhole, in focus at one distance. A point at distance
//! d is smeared to a disc of diameter `aperture · pixels_per_unit · |1/d − 1/focus|` pixels: exact for a pinhole
//! moved over the lens, which is what the truth does ([`lens_offsets`]).
//!
//! A layer's pixels are spread, each over the disc of its own distance; where discs of one layer pile up to more
//! than full coverage they are scaled back. A layer of little depth so gets one blur, a deep one a blur that
//! varies over it. Blurred layers are composited as sharp ones are. [`blur_whole`] is the blur of the single
//! finished picture that this improves on [Potmesil & Chakravarty 1981]: normalised, because it knows nothing of
//! what is behind an edge.

use super::paint::Painted;
use super::sprite::{Canvas, Sprite};
use crate::conventions::{Projection, View};
use std::collections::HashMap;

/// A lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Distance in focus along the view axis, metres, > 0.
    pub focus: f64,
    /// Diameter of the aperture, metres: focal length over f-number.
    pub aperture: f64,
}

impl Lens {
    /// From the marks on a lens: focal length in millimetres, f-number.
    pub fn of(focus: f64, f_number: f64, focal_length_mm: f64) -> Lens {
        Lens { focus, aperture: focal_length_mm * 1e-3 / f_number }
    }

    /// Radius of the disc that a point at `distance` is smeared to, pixels.
    pub fn radius_px(&self, view: &View, distance: f64) -> f64 {
        let scale = match view.projection {
            Projection::Perspective { .. } => view.pixels_per_unit(),
            Projection::Orthographic { .. } => return 0.0,
        };
        0.5 * self.aperture * scale * (1.0 / distance - 1.0 / self.focus).abs()
    }
}

/// Radii are told apart in steps of this many pixels.
const STEP_PX: f64 = 0.25;
/// Discs are not larger than this, pixels.
const LARGEST_PX: f64 = 200.0;

/// Offsets and weights.
type Disc = Vec<(i32, i32, f32)>;

/// Whether a pixel is the first, and the last, of its row; and of its column.
type Ends = [[bool; 2]; 2];

/// Discs by their radius in steps, whose weights sum to one; and what becomes of them at the ends of rows and columns.
#[derive(Default)]
struct Discs(HashMap<(u32, Ends), Disc>);

impl Discs {
    fn of(&mut self, radius: f64, ends: Ends) -> &[(i32, i32, f32)] {
        let steps = (radius.min(LARGEST_PX) / STEP_PX).round() as u32;
        self.0.entry((steps, ends)).or_insert_with(|| continued(disc(f64::from(steps) * STEP_PX), ends))
    }
}

/// A disc together with those of all pixels that would lie beyond the ends, each as the one at the end, as far as they
/// reach into the picture.
fn continued(disc: Disc, [of_row, of_column]: Ends) -> Disc {
    if of_row == [false; 2] && of_column == [false; 2] {
        return disc;
    }
    let reach = disc.iter().map(|d| d.0.max(d.1)).max().unwrap_or(0);
    let side = (2 * reach + 1) as usize;
    let place = |x: i32, y: i32| (y + reach) as usize * side + (x + reach) as usize;
    let mut square = vec![0.0; side * side];
    disc.iter().for_each(|&(x, y, weight)| square[place(x, y)] = weight);
    square.chunks_exact_mut(side).for_each(|row| continue_line(row, of_row));
    for column in 0..side {
        let mut line: Vec<f32> = square[column..].iter().step_by(side).copied().collect();
        continue_line(&mut line, of_column);
        square[column..].iter_mut().step_by(side).zip(line).for_each(|(to, weight)| *to = weight);
    }
    let all = (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| (x, y)));
    all.map(|(x, y)| (x, y, square[place(x, y)])).filter(|d| d.2 > 0.0).collect()
}

/// The same for the weights of a line, around its middle.
fn continue_line(line: &mut [f32], [first, last]: [bool; 2]) {
    let middle = line.len() / 2;
    match [first, last] {
        [false, false] => {}
        [true, true] => {
            let sum = line.iter().sum();
            line.fill(0.0);
            line[middle] = sum;
        }
        [true, false] => {
            (middle..line.len() - 1).rev().for_each(|at| line[at] += line[at + 1]);
            line[..middle].fill(0.0);
        }
        [false, true] => {
            line.reverse();
            continue_line(line, [true, false]);
            line.reverse();
        }
    }
}

/// Pixels are weighted by how far their centre is inside the rim.
fn disc(radius: f64) -> Disc {
    let reach = radius.ceil() as i32 + 1;
    let mut found = Vec::new();
    let mut sum = 0.0;
    for y in -reach..=reach {
        for x in -reach..=reach {
            let weight = (radius + 0.5 - f64::from(x * x + y * y).sqrt()).clamp(0.0, 1.0);
            if weight > 0.0 {
                found.push((x, y, weight as f32));
                sum += weight as f32;
            }
        }
    }
    found.iter_mut().for_each(|d| d.2 /= sum);
    found
}

/// A layer as the lens sees it alone. What lies beyond the edge of the picture continues as the edge does, as in
/// [`accumulate`]. Cost: its pixels times the discs' areas.
pub fn blur_layer(layer: &Painted, view: &View, lens: &Lens) -> Sprite {
    let mut canvas = Canvas::new(view.width, view.height);
    scatter(&mut canvas, layer, view, lens);
    for p in &mut canvas.pixels {
        if p[3] > 1.0 {
            *p = p.map(|c| c / p[3]);
        }
    }
    Sprite::cut(view.width, &canvas.pixels)
}

/// The finished picture, blurred by the distance of what each pixel shows, and normalised.
pub fn blur_whole(picture: &Painted, view: &View, lens: &Lens) -> Canvas {
    let mut canvas = Canvas::new(view.width, view.height);
    let mut background = picture.clone();
    // What shows nothing has a weight, too: it is sharp and transparent.
    let mut weights = vec![0.0f32; canvas.pixels.len()];
    scatter(&mut canvas, &background, view, lens);
    background.sprite.pixels.iter_mut().for_each(|p| *p = [0.0, 0.0, 0.0, 1.0]);
    let mut all = Canvas::new(view.width, view.height);
    scatter(&mut all, &background, view, lens);
    for y in 0..view.height {
        for x in 0..view.width {
            let at = (y * view.width + x) as usize;
            let seen = picture.sprite.at(x, y)[3];
            weights[at] = all.pixels[at][3] + (1.0 - seen);
        }
    }
    for (p, w) in canvas.pixels.iter_mut().zip(&weights) {
        if *w > 0.0 {
            *p = p.map(|c| c / w);
        }
    }
    canvas
}

fn scatter(canvas: &mut Canvas, layer: &Painted, view: &View, lens: &Lens) {
    let sprite = &layer.sprite;
    let (width, height) = (view.width as i32, view.height as i32);
    // What is blended has no distance of its own; it gets the layer's mean.
    let known = layer.distances.iter().copied().filter(|d| d.is_finite()).map(f64::from);
    let (sum, count) = known.fold((0.0, 0usize), |(s, n), d| (s + d, n + 1));
    let mean = if count > 0 { sum / count as f64 } else { lens.focus };
    let mut discs = Discs::default();
    for (i, pixel) in sprite.pixels.iter().enumerate() {
        if *pixel == [0.0; 4] {
            continue;
        }
        let distance = f64::from(layer.distances[i]);
        let distance = if distance.is_finite() { distance } else { mean };
        let x = (sprite.x + i as u32 % sprite.width) as i32;
        let y = (sprite.y + i as u32 / sprite.width) as i32;
        let ends = [[x == 0, x == width - 1], [y == 0, y == height - 1]];
        for &(dx, dy, weight) in discs.of(lens.radius_px(view, distance), ends) {
            let (x, y) = (x + dx, y + dy);
            if x >= 0 && y >= 0 && x < width && y < height {
                let target = &mut canvas.pixels[(y * width + x) as usize];
                target.iter_mut().zip(pixel).for_each(|(t, c)| *t += c * weight);
            }
        }
    }
}

/// Offsets in the lens are looked at up to so many steps from its middle: whole pixels, or several where it is larger.
const STEPS: i32 = 512;
/// The radius of a lens counts as no larger than this, in pixels at the focus: pictures are moved by so many at most.
const LARGEST_LENS_PX: f64 = 1e9;

/// Where the pinhole is moved for the truth: offsets right and up in view space, metres, and by how many whole
/// pixels the picture from there must be moved right and down so that what is in focus stays. At most `count`,
/// spread evenly over the lens; fewer if the lens is so small that they would fall together, and never more than some
/// 800,000. In an orthographic view, whose rays are parallel wherever it is, the middle alone: nothing is blurred
/// there ([`Lens::radius_px`]).
pub fn lens_offsets(view: &View, lens: &Lens, count: usize) -> Vec<([f64; 2], [i32; 2])> {
    if let Projection::Orthographic { .. } = view.projection {
        return vec![([0.0; 2], [0; 2])];
    }
    // A whole pixel at the focus is this far on the lens.
    let pixel = lens.focus / view.pixels_per_unit();
    let radius = (0.5 * lens.aperture / pixel).min(LARGEST_LENS_PX);
    let step = (radius.floor() as i32 / STEPS + 1).max(1);
    let radius_steps = radius / f64::from(step);
    let reach = radius_steps.floor() as i32;
    let mut all: Vec<[i32; 2]> = (-reach..=reach)
        .flat_map(|y| (-reach..=reach).map(move |x| [x, y]))
        .filter(|[x, y]| f64::from(x * x + y * y) <= radius_steps * radius_steps)
        .collect();
    if all.len() > count.max(1) {
        // A stride through the rows would leave stripes; order by a low-discrepancy sequence instead.
        let key = |[x, y]: &[i32; 2]| {
            (f64::from(*x) * 0.754_877_666 + f64::from(*y) * 0.569_840_291).rem_euclid(1.0)
        };
        all.sort_by(|a, b| key(a).total_cmp(&key(b)));
        all.truncate(count.max(1));
    }
    let shifts = all.into_iter().map(|offset| offset.map(|steps| steps * step));
    shifts.map(|[x, y]| ([f64::from(x) * pixel, f64::from(-y) * pixel], [x, y])).collect()
}

/// The view from a point of the lens.
pub fn view_from(view: &View, offset: [f64; 2]) -> View {
    let mut moved = *view;
    moved.view_from_world.translation -= glam::DVec3::new(offset[0], offset[1], 0.0);
    moved
}

/// The mean of pictures from points of the lens, each moved by whole pixels.
pub fn accumulate(size: (u32, u32), pictures: impl Iterator<Item = (Canvas, [i32; 2])>) -> Canvas {
    let mut sum = Canvas::new(size.0, size.1);
    let mut count = 0.0f32;
    for (picture, [dx, dy]) in pictures {
        count += 1.0;
        for y in 0..size.1 as i32 {
            for x in 0..size.0 as i32 {
                // What lies beyond the edge continues as the edge does.
                let from_x = (x - dx).clamp(0, size.0 as i32 - 1);
                let from_y = (y - dy).clamp(0, size.1 as i32 - 1);
                let p = picture.pixels[(from_y * size.0 as i32 + from_x) as usize];
                let target = &mut sum.pixels[(y * size.0 as i32 + x) as usize];
                target.iter_mut().zip(p).for_each(|(t, c)| *t += c);
            }
        }
    }
    let share = 1.0 / count.max(1.0);
    sum.pixels.iter_mut().for_each(|p| *p = p.map(|c| c * share));
    sum
}

/// Root mean square difference over all channels.
pub fn rms_difference(a: &Canvas, b: &Canvas) -> f64 {
    let squares =
        a.pixels.as_flattened().iter().zip(b.pixels.as_flattened()).map(|(a, b)| f64::from(a - b).powi(2));
    (squares.sum::<f64>() / a.pixels.as_flattened().len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn view() -> View {
        let projection = Projection::Perspective { fov_y: 1.0, near: 0.1 };
        View::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, projection, (64, 64))
    }

    /// A lens in focus at 2 m with a radius of so many pixels there.
    fn lens(view: &View, radius_px: f64) -> Lens {
        let focus = 2.0;
        Lens { focus, aperture: 2.0 * radius_px * focus / view.pixels_per_unit() }
    }

    #[test]
    fn a_small_lens_has_every_whole_pixel_and_none_twice() {
        let view = view();
        let disc = |radius: i32| {
            let side = -radius..=radius;
            let all = side.clone().flat_map(|y| side.clone().map(move |x| x * x + y * y));
            all.filter(|square| *square <= radius * radius).count()
        };
        for radius in [0, 1, 7, 50] {
            let found = lens_offsets(&view, &lens(&view, f64::from(radius) + 1e-6), usize::MAX);
            assert_eq!(found.len(), disc(radius));
        }
    }

    #[test]
    fn no_lens_is_too_large() {
        let view = view();
        for radius in [300.0, 512.5, 600.0, 1e5, 1e12, 1e300, f64::INFINITY, f64::NAN] {
            let found = lens_offsets(&view, &lens(&view, radius), 20);
            assert_eq!(found.len(), 20, "{radius}");
            let reach = found.iter().map(|(_, [x, y])| f64::from(*x).hypot(f64::from(*y)));
            let reach = reach.fold(0.0, f64::max);
            let radius = radius.min(LARGEST_LENS_PX);
            assert!(reach <= radius && reach > 0.6 * radius, "{reach} of {radius}");
            assert!(lens_offsets(&view, &lens(&view, radius), usize::MAX).len() < 850_000);
        }
    }

    #[test]
    fn parallel_rays_are_blurred_neither_in_layers_nor_in_the_truth() {
        let view =
            View { projection: Projection::Orthographic { half_height: 1.5, near: 0.1, far: 9.0 }, ..view() };
        let lens = lens(&view, 8.0);
        assert_eq!(lens.radius_px(&view, 5.0), 0.0);
        assert_eq!(lens_offsets(&view, &lens, 400), [([0.0; 2], [0; 2])]);
    }

    /// A layer at one distance, all of one colour, that covers some columns of the whole height.
    fn stripe(view: &View, x: u32, width: u32, distance: f32) -> Painted {
        let pixels = vec![[0.5, 0.25, 0.0, 1.0]; (width * view.height) as usize];
        let distances = vec![distance; pixels.len()];
        Painted { sprite: Sprite { x, y: 0, width, height: view.height, pixels }, distances }
    }

    #[test]
    fn a_layer_goes_on_beyond_the_edge_of_the_picture() {
        let near = |a: f32, b: f32| (a - b).abs() < 1e-4;
        for (width, height) in [(64, 64), (64, 1), (1, 64), (1, 1), (3, 40)] {
            let view = View { width, height, ..view() };
            for radius in [0.0, 0.7, 5.0, 40.0] {
                let lens = lens(&view, radius);
                // It fills the view, at twice the distance in focus, and half of it.
                for distance in [4.0, 1.0] {
                    let whole = stripe(&view, 0, width, distance);
                    let blurred = blur_layer(&whole, &view, &lens);
                    assert_eq!(blurred.pixels.len(), whole.sprite.pixels.len());
                    let same = |p: &[f32; 4]| near(p[3], 1.0) && near(p[0], 0.5) && near(p[1], 0.25);
                    assert!(blurred.pixels.iter().all(same), "{width}x{height}, {radius} px");
                }
            }
        }
        // A stripe is blurred across, and alike from the top to the bottom.
        let view = view();
        let blurred = blur_layer(&stripe(&view, 20, 24, 4.0), &view, &lens(&view, 12.0));
        for x in 0..64 {
            let middle = blurred.at(x, 32)[3];
            assert!((0..64).all(|y| near(blurred.at(x, y)[3], middle)), "column {x}");
        }
        assert!(near(blurred.at(32, 0)[3], 1.0) && near(blurred.at(20, 0)[3] + blurred.at(19, 0)[3], 1.0));
    }
}
