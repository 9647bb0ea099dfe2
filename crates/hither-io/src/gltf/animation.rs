//! Animations of the scene's nodes: translation, rotation and scale, in all three interpolations.
//!
//! A channel that cannot be played is told of and left out; one of a node outside the scene, or of no node, is left out.

use super::accessor::Elements;
use super::buffers::Buffers;
use super::fault::{Fault, Oddities, malformed, part, quoted};
use super::json;
use super::node::Hierarchy;
use glam::Vec4;
use hither::scene::{Animation, Channel, Interpolation, Property, Transform};

/// Reads all animations that move anything in the scene.
pub(super) fn read(buffers: &Buffers, hierarchy: &Hierarchy, oddities: &mut Oddities) -> Vec<Animation> {
    let mut animations = Vec::new();
    for (index, source) in buffers.document().animations.iter().enumerate() {
        let mut channels = Vec::new();
        for (c, channel) in source.channels.iter().enumerate() {
            let here = || format!("{}, channel {c}", part("animation", index, &source.name));
            let Some(target) = channel.target.node else { continue };
            let Some(place) = hierarchy.place.get(target.at()) else {
                let there = hierarchy.place.len();
                let why = format!("it moves node {}, but there are {there}; it is left out", target.0);
                oddities.note(here(), why);
                continue;
            };
            let Some(node) = *place else { continue };
            let Some(property) = property(&channel.target.path) else {
                let path = quoted(&channel.target.path);
                oddities.note(here(), format!("it moves {path}, which is left out"));
                continue;
            };
            if matches!(hierarchy.group.nodes[node as usize].local, Transform::Affine(_)) {
                oddities.note(here(), "it moves a node that is placed by a matrix; it is left out");
                continue;
            }
            match sampler(buffers, source, channel, property) {
                Ok((interpolation, times, values)) => {
                    channels.push(Channel { node, property, interpolation, times, values });
                }
                Err(fault) => oddities.note(here(), format!("{}; it is left out", fault.message())),
            }
        }
        if !channels.is_empty() {
            animations.push(Animation { name: source.name.clone(), channels });
        }
    }
    animations
}

fn property(path: &str) -> Option<Property> {
    match path {
        "translation" => Some(Property::Translation),
        "rotation" => Some(Property::Rotation),
        "scale" => Some(Property::Scale),
        _ => None,
    }
}

type Keys = (Interpolation, Vec<f32>, Vec<Vec4>);

fn sampler(
    buffers: &Buffers,
    animation: &json::Animation,
    channel: &json::Channel,
    property: Property,
) -> Result<Keys, Fault> {
    let Some(sampler) = animation.samplers.get(channel.sampler.at()) else {
        let there = animation.samplers.len();
        return malformed(format!("it uses sampler {}, but there are {there}", channel.sampler.0));
    };
    let interpolation = match sampler.interpolation.as_deref() {
        None | Some("LINEAR") => Interpolation::Linear,
        Some("STEP") => Interpolation::Step,
        Some("CUBICSPLINE") => Interpolation::Cubic,
        Some(other) => return malformed(format!("its interpolation {} is unknown", quoted(other))),
    };
    let times = Elements::resolve(buffers, sampler.input)?.floats::<1>()?;
    let times: Vec<f32> = times.into_iter().map(|[t]| t).collect();
    if times.is_empty() || times.iter().any(|t| !t.is_finite()) || times.windows(2).any(|w| w[0] >= w[1]) {
        return malformed("its times do not increase");
    }
    let output = Elements::resolve(buffers, sampler.output)?;
    // Sixteen bytes a value, four of which `floats` does not know of.
    buffers.spend((output.count() as u64).saturating_mul(16))?;
    let values: Vec<Vec4> = match property {
        Property::Rotation => output.floats::<4>()?.into_iter().map(Vec4::from_array).collect(),
        _ => output.floats::<3>()?.into_iter().map(|[x, y, z]| Vec4::new(x, y, z, 0.0)).collect(),
    };
    let per_key = if interpolation == Interpolation::Cubic { 3 } else { 1 };
    if values.len() != per_key * times.len() {
        let (times, values) = (times.len(), values.len());
        return malformed(format!("its {times} times and {values} values disagree in number"));
    }
    if values.iter().any(|v| !v.is_finite()) {
        return malformed("a value in it is not a finite number");
    }
    Ok((interpolation, times, values))
}
