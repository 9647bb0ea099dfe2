//! Animations as they are written. Channels with the same times share them.

use super::binary::{Binary, Purpose, Use};
use super::document::{AnimationEntry, AnimationSampler, ChannelEntry, ChannelTarget};
use super::expand::Expanded;
use glam::Vec4;
use hither::scene::{Animation, Channel, Interpolation, Property, Scene, Transform};
use std::collections::HashMap;

/// All animations that move anything.
pub(super) fn animations<'a>(
    scene: &'a Scene,
    expanded: &Expanded,
    binary: &mut Binary,
) -> Vec<AnimationEntry<'a>> {
    let mut known_times = HashMap::new();
    let mut entries = Vec::new();
    for animation in &scene.animations {
        let mut entry = AnimationEntry { name: &animation.name, channels: vec![], samplers: vec![] };
        for channel in played(scene, animation) {
            let bits: Vec<u32> = channel.times.iter().map(|t| t.to_bits()).collect();
            let input = *known_times.entry(bits).or_insert_with(|| {
                binary.floats(channel.times.iter().map(|&t| [t]), Purpose::Bounded(Use::Times))
            });
            let (path, output) = values(channel, binary);
            let interpolation = match channel.interpolation {
                Interpolation::Step => "STEP",
                Interpolation::Linear => "LINEAR",
                Interpolation::Cubic => "CUBICSPLINE",
            };
            let target = ChannelTarget { node: expanded.of_root_node(channel.node), path };
            entry.channels.push(ChannelEntry { sampler: entry.samplers.len() as u32, target });
            entry.samplers.push(AnimationSampler { input, interpolation, output });
        }
        if !entry.channels.is_empty() {
            entries.push(entry);
        }
    }
    entries
}

/// The channels that have an effect: none of nodes placed by a matrix, and of several that move the same
/// property of a node the last.
fn played<'a>(scene: &Scene, animation: &'a Animation) -> Vec<&'a Channel> {
    let nodes = &scene.root_group().nodes;
    let mut last: HashMap<(u32, u8), usize> = HashMap::new();
    let key = |channel: &Channel| (channel.node, channel.property as u8);
    for (i, channel) in animation.channels.iter().enumerate() {
        if matches!(nodes[channel.node as usize].local, Transform::Trs { .. }) {
            last.insert(key(channel), i);
        }
    }
    let kept = animation.channels.iter().enumerate().filter(|(i, c)| last.get(&key(c)) == Some(i));
    kept.map(|(_, channel)| channel).collect()
}

fn values(channel: &Channel, binary: &mut Binary) -> (&'static str, u32) {
    let vectors = |binary: &mut Binary| {
        binary.floats(channel.values.iter().map(|v| v.truncate().to_array()), Purpose::Values)
    };
    match channel.property {
        Property::Translation => ("translation", vectors(binary)),
        Property::Scale => ("scale", vectors(binary)),
        Property::Rotation => {
            let cubic = channel.interpolation == Interpolation::Cubic;
            let unit = |(i, v): (usize, &Vec4)| {
                // Of a spline's triple only the middle is a rotation; the others are tangents.
                let is_rotation = !cubic || i % 3 == 1;
                if is_rotation && !v.is_normalized() { v.normalize_or(Vec4::W) } else { *v }.to_array()
            };
            ("rotation", binary.floats(channel.values.iter().enumerate().map(unit), Purpose::Values))
        }
    }
}
