//! Keyframed motion of nodes, as glTF defines it (§3.11 of its specification), evaluated at a time.

use super::{Scene, SceneError, Transform, fault};
use glam::{DQuat, DVec4, Vec4};

/// A named motion.
#[derive(Clone, Debug, Default)]
pub struct Animation {
    /// The animation's name, possibly empty.
    pub name: String,
    /// Motions of single properties; times are shared by none.
    pub channels: Vec<Channel>,
}

/// The motion of one property of one node of the root group.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Node of the root group.
    pub node: u32,
    /// What moves.
    pub property: Property,
    /// What happens between keys.
    pub interpolation: Interpolation,
    /// Key times, seconds, strictly increasing, at least one.
    pub times: Vec<f32>,
    /// One value a key; for [`Interpolation::Cubic`] three: in-tangent, value, out-tangent.
    /// Vectors leave `w` at 0; rotations are quaternions x, y, z, w.
    pub values: Vec<Vec4>,
}

/// A property that an animation sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Property {
    /// Metres.
    Translation,
    /// Unit quaternion.
    Rotation,
    /// Factors.
    Scale,
}

/// What happens between two keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// The earlier key's value.
    Step,
    /// Linear; rotations along the shorter great arc.
    Linear,
    /// Cubic Hermite spline with the file's tangents.
    Cubic,
}

impl Animation {
    /// Time of the last key, seconds.
    pub fn duration(&self) -> f64 {
        self.channels.iter().filter_map(|c| c.times.last()).fold(0.0, |d, &t| d.max(f64::from(t)))
    }
}

impl Channel {
    /// The value at `time` seconds; before the first and after the last key, theirs.
    pub fn sample(&self, time: f64) -> DVec4 {
        let key = |i: usize| {
            let at = if self.interpolation == Interpolation::Cubic { 3 * i + 1 } else { i };
            self.values[at].as_dvec4()
        };
        let next = self.times.partition_point(|&t| f64::from(t) <= time);
        let value = if next == 0 {
            key(0)
        } else if next == self.times.len() {
            key(next - 1)
        } else {
            let (t0, t1) = (f64::from(self.times[next - 1]), f64::from(self.times[next]));
            let span = t1 - t0;
            let u = (time - t0) / span;
            let (a, b) = (key(next - 1), key(next));
            match self.interpolation {
                Interpolation::Step => a,
                Interpolation::Linear if self.property == Property::Rotation => slerp(a, b, u),
                Interpolation::Linear => a + (b - a) * u,
                Interpolation::Cubic => {
                    let out = self.values[3 * (next - 1) + 2].as_dvec4() * span;
                    let into = self.values[3 * next].as_dvec4() * span;
                    hermite(a, out, b, into, u)
                }
            }
        };
        match self.property {
            Property::Rotation => value.normalize_or(DVec4::W),
            _ => value,
        }
    }
}

fn slerp(a: DVec4, b: DVec4, u: f64) -> DVec4 {
    let (a, b) = (DQuat::from_vec4(a.normalize_or(DVec4::W)), DQuat::from_vec4(b.normalize_or(DVec4::W)));
    DVec4::from(a.slerp(b, u))
}

fn hermite(p0: DVec4, m0: DVec4, p1: DVec4, m1: DVec4, u: f64) -> DVec4 {
    let (u2, u3) = (u * u, u * u * u);
    p0 * (2.0 * u3 - 3.0 * u2 + 1.0) + m0 * (u3 - 2.0 * u2 + u) + p1 * (3.0 * u2 - 2.0 * u3) + m1 * (u3 - u2)
}

impl Scene {
    /// Moves the nodes that animation `index` drives to where they are at `time` seconds.
    ///
    /// Nodes given by a matrix are not animated (glTF forbids it). Returns whether the animation exists.
    pub fn pose(&mut self, index: usize, time: f64) -> bool {
        let Some(animation) = self.animations.get(index) else { return false };
        let group = &mut self.groups[self.root as usize];
        for channel in &animation.channels {
            let value = channel.sample(time);
            let Some(node) = group.nodes.get_mut(channel.node as usize) else { continue };
            if let Transform::Trs { translation, rotation, scale } = &mut node.local {
                match channel.property {
                    Property::Translation => *translation = value.truncate(),
                    Property::Rotation => *rotation = DQuat::from_vec4(value),
                    Property::Scale => *scale = value.truncate(),
                }
            }
        }
        true
    }
}

pub(super) fn validate(scene: &Scene) -> Result<(), SceneError> {
    let nodes = scene.root_group().nodes.len();
    for (i, animation) in scene.animations.iter().enumerate() {
        for (c, channel) in animation.channels.iter().enumerate() {
            let wrong =
                |what: &str| Err(fault(format!("animation {i} (\"{}\"), channel {c}", animation.name), what));
            if channel.node as usize >= nodes {
                return wrong("it moves a node that does not exist");
            }
            let per_key = if channel.interpolation == Interpolation::Cubic { 3 } else { 1 };
            if channel.times.is_empty() || channel.values.len() != per_key * channel.times.len() {
                return wrong("its times and values disagree in number");
            }
            if channel.times.iter().any(|t| !t.is_finite()) || channel.values.iter().any(|v| !v.is_finite()) {
                return wrong("a time or value is not finite");
            }
            if channel.times.windows(2).any(|w| w[0] >= w[1]) {
                return wrong("its times do not increase");
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn channel(property: Property, interpolation: Interpolation, values: &[Vec4]) -> Channel {
        Channel { node: 0, property, interpolation, times: vec![0.0, 2.0], values: values.to_vec() }
    }

    #[test]
    fn step_holds_linear_blends_and_both_clamp() {
        let values = [Vec4::ZERO, Vec4::new(4.0, 0.0, 0.0, 0.0)];
        let step = channel(Property::Translation, Interpolation::Step, &values);
        let linear = channel(Property::Translation, Interpolation::Linear, &values);
        assert_eq!(step.sample(1.9).x, 0.0);
        assert_eq!(step.sample(2.0).x, 4.0);
        assert_eq!(linear.sample(0.5).x, 1.0);
        assert_eq!(linear.sample(-1.0).x, 0.0);
        assert_eq!(linear.sample(9.0).x, 4.0);
    }

    #[test]
    fn cubic_tangents_are_scaled_by_the_span() {
        let x = |v: f32| Vec4::new(v, 0.0, 0.0, 0.0);
        // A straight line with slope 2 per second is a Hermite spline with tangents 2.
        let values = [x(0.0), x(0.0), x(2.0), x(2.0), x(4.0), x(0.0)];
        let cubic = channel(Property::Translation, Interpolation::Cubic, &values);
        for i in 0..=8 {
            let t = f64::from(i) * 0.25;
            assert!((cubic.sample(t).x - 2.0 * t).abs() < 1e-12);
        }
    }

    #[test]
    fn rotation_takes_the_shorter_arc() {
        let half = std::f32::consts::FRAC_1_SQRT_2;
        let values = [Vec4::W, Vec4::new(0.0, -half, 0.0, -half)];
        let turn = channel(Property::Rotation, Interpolation::Linear, &values);
        let q = DQuat::from_vec4(turn.sample(1.0));
        let turned = q * DVec3::X;
        assert!((turned - DVec3::new(half.into(), 0.0, -f64::from(half))).length() < 1e-6);
    }
}
