//! Nodes: the hierarchy of one scene becomes one group, depth-first. Linear, and without recursion.
//!
//! Cycles, nodes with several parents and references that lead nowhere are refused. Nodes outside the
//! scene are not looked at further.

use super::accessor::Elements;
use super::buffers::Buffers;
use super::fault::{Fault, Oddities, malformed, part};
use super::json::{self, Document, Index};
use glam::{DAffine3, DMat4, DQuat, DVec3};
use hither::scene::{Content, Group, Node, Transform};

/// A scene's nodes. Content refers to the document's meshes, still by their index there.
pub(super) struct Hierarchy {
    /// The scene's name.
    pub(super) name: String,
    /// All its nodes.
    pub(super) group: Group,
    /// For each of the document's nodes its place in the group, if the scene has it.
    pub(super) place: Vec<Option<u32>>,
}

/// Reads the nodes of the scene that the document shows by default; all, if it has no scenes.
pub(super) fn read(buffers: &Buffers, oddities: &mut Oddities) -> Result<Hierarchy, Fault> {
    let document = buffers.document();
    let parents = parents(document)?;
    let (name, roots) = match document.scenes.get(document.scene.unwrap_or_default().at()) {
        Some(scene) => (scene.name.clone(), scene.nodes.clone()),
        None if document.scenes.is_empty() && document.scene.is_none() => {
            let orphans = parents.iter().enumerate().filter(|(_, p)| p.is_none());
            (String::new(), orphans.map(|(i, _)| Index(i as u32)).collect())
        }
        None => {
            let (asked, there) = (document.scene.unwrap_or_default().0, document.scenes.len());
            return malformed(format!("it shows scene {asked}, but there are {there}"));
        }
    };
    let mut hierarchy = Hierarchy { name, group: Group::default(), place: vec![None; document.nodes.len()] };
    let mut open: Vec<(Index, Option<u32>)> = roots.iter().rev().map(|&root| (root, None)).collect();
    while let Some((index, parent)) = open.pop() {
        let Some(source) = document.nodes.get(index.at()) else {
            let there = document.nodes.len();
            return malformed(format!("the scene refers to node {}, but there are {there}", index.0));
        };
        let here = || part("node", index.at(), &source.name);
        if hierarchy.place[index.at()].is_some() {
            return malformed(format!("{} is in the scene twice: a node has one place only", here()));
        }
        let content = match source.mesh {
            Some(mesh) if mesh.at() < document.meshes.len() => Content::Mesh(mesh.0),
            Some(mesh) => {
                let there = document.meshes.len();
                return malformed(format!("{} shows mesh {}, but there are {there}", here(), mesh.0));
            }
            None => Content::Nothing,
        };
        if source.skin.is_some() {
            oddities.note(here(), "is bent by a skin, which is left out; it is drawn in its rest pose");
        }
        let local = transform(source, &here, oddities);
        let instancing = source.extensions.instancing.as_ref().filter(|_| source.mesh.is_some());
        let own = if instancing.is_some() { Content::Nothing } else { content };
        let at = hierarchy.group.push(Node { name: source.name.clone(), parent, local, content: own });
        hierarchy.place[index.at()] = Some(at);
        if let Some(instancing) = instancing {
            let places = instances(buffers, instancing, &source.name).map_err(|f| f.at(here()))?;
            for (i, local) in places.into_iter().enumerate() {
                let name = instance_name(&source.name, i);
                hierarchy.group.push(Node { name, parent: Some(at), local, content });
            }
        }
        open.extend(source.children.iter().rev().map(|&child| (child, Some(at))));
    }
    check_reach(document, &hierarchy)?;
    Ok(hierarchy)
}

/// The parent of every node. Refuses nodes with several, and cycles.
fn parents(document: &Document) -> Result<Vec<Option<u32>>, Fault> {
    let nodes = &document.nodes;
    let name = |i: u32| part("node", i as usize, &nodes[i as usize].name);
    let mut parents: Vec<Option<u32>> = vec![None; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        let i = i as u32;
        for &child in &node.children {
            match parents.get_mut(child.at()) {
                Some(parent @ None) => *parent = Some(i),
                Some(&mut Some(other)) => {
                    let child = name(child.0);
                    return malformed(format!(
                        "{child} is a child of both {} and {}: a node has one parent only",
                        name(other),
                        name(i)
                    ));
                }
                None => {
                    let there = nodes.len();
                    return malformed(format!(
                        "{} has child {}, but there are {there} nodes",
                        name(i),
                        child.0
                    ));
                }
            }
        }
    }
    // With one parent each, what cannot be reached from a node without parent is in or below a cycle.
    let mut reached = vec![false; nodes.len()];
    let mut open: Vec<u32> = (0..nodes.len() as u32).filter(|&i| parents[i as usize].is_none()).collect();
    while let Some(i) = open.pop() {
        reached[i as usize] = true;
        open.extend(nodes[i as usize].children.iter().map(|c| c.0));
    }
    match reached.iter().position(|r| !r) {
        Some(lost) => malformed(cycle_text(&parents, lost as u32, name)),
        None => Ok(parents),
    }
}

/// Names the cycle that `start` is in or below.
fn cycle_text(parents: &[Option<u32>], start: u32, name: impl Fn(u32) -> String) -> String {
    const SHOWN: usize = 5;
    let up = |i: u32| parents[i as usize].unwrap_or(i);
    // After as many steps as there are nodes, one is on the cycle itself.
    let on_cycle = (0..parents.len()).fold(start, |i, _| up(i));
    let mut members = vec![on_cycle];
    while up(members[members.len() - 1]) != on_cycle {
        members.push(up(members[members.len() - 1]));
    }
    members.reverse();
    let first = members.iter().enumerate().min_by_key(|(_, i)| **i).map_or(0, |(at, _)| at);
    members.rotate_left(first);
    let mut steps: Vec<String> = members.iter().take(SHOWN).map(|&i| name(i)).collect();
    if members.len() > SHOWN {
        steps.push("…".into());
    }
    steps.push(name(members[0]));
    format!("its nodes form a cycle: {}", steps.join(" → "))
}

fn transform(source: &json::Node, here: &dyn Fn() -> String, oddities: &mut Oddities) -> Transform {
    if let Some(matrix) = &source.matrix {
        if [matrix[3], matrix[7], matrix[11], matrix[15]] != [0.0, 0.0, 0.0, 1.0] {
            oddities.note(here(), "its matrix is not affine; its last row is ignored");
        }
        if source.translation.is_some() || source.rotation.is_some() || source.scale.is_some() {
            oddities
                .note(here(), "has a matrix besides its translation, rotation or scale; the matrix counts");
        }
        return Transform::Affine(DAffine3::from_mat4(DMat4::from_cols_array(matrix)));
    }
    let rotation = source.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    Transform::Trs {
        translation: DVec3::from_array(source.translation.unwrap_or_default()),
        rotation: unit(DQuat::from_array(rotation)).unwrap_or_else(|| {
            oddities.note(here(), "its rotation is no unit quaternion; it is ignored");
            DQuat::IDENTITY
        }),
        scale: DVec3::from_array(source.scale.unwrap_or([1.0; 3])),
    }
}

/// The rotation that `q` means. One that is unit to within rounding keeps its bits.
fn unit(q: DQuat) -> Option<DQuat> {
    let length = q.length();
    if (length - 1.0).abs() < 1e-14 {
        return Some(q);
    }
    (length.is_finite() && length > 1e-300).then(|| q / length).filter(|q| q.is_finite())
}

/// How instance `i` of the node called `name` is called. It takes no more memory than it has letters.
fn instance_name(name: &str, i: usize) -> String {
    if name.is_empty() { String::new() } else { [name, "[", &i.to_string(), "]"].concat() }
}

/// The transforms of `EXT_mesh_gpu_instancing`. Its nodes and their names, which repeat `name`, are paid for.
fn instances(buffers: &Buffers, from: &json::Instancing, name: &str) -> Result<Vec<Transform>, Fault> {
    let resolve = |name: &'static str| -> Result<Option<Elements>, Fault> {
        match from.attributes.get(name) {
            Some(&index) => Elements::resolve(buffers, index).map(Some).map_err(|f| f.at(name)),
            None => Ok(None),
        }
    };
    let (translations, rotations, scales) =
        (resolve("TRANSLATION")?, resolve("ROTATION")?, resolve("SCALE")?);
    let all = [&translations, &rotations, &scales];
    let count = all.into_iter().flatten().map(Elements::count).max().unwrap_or(1);
    if all.into_iter().flatten().any(|e| e.count() != count) {
        return malformed("its instances' attributes differ in number");
    }
    let each = size_of::<Node>() + instance_name(name, count).len();
    buffers.spend((count as u64).saturating_mul(each as u64))?;
    let translations = translations.map(|e| e.floats::<3>()).transpose()?;
    let rotations = rotations.map(|e| e.floats::<4>()).transpose()?;
    let scales = scales.map(|e| e.floats::<3>()).transpose()?;
    let vector = |from: &Option<Vec<[f32; 3]>>, i: usize, other: f64| match from {
        Some(all) => DVec3::from_array(all[i].map(f64::from)),
        None => DVec3::splat(other),
    };
    let place = |i: usize| Transform::Trs {
        translation: vector(&translations, i, 0.0),
        rotation: match &rotations {
            Some(all) => unit(DQuat::from_array(all[i].map(f64::from))).unwrap_or_default(),
            None => DQuat::IDENTITY,
        },
        scale: vector(&scales, i, 1.0),
    };
    Ok((0..count).map(place).collect())
}

/// Refuses places that are beyond all numbers, which many scales in a row can lead to.
fn check_reach(document: &Document, hierarchy: &Hierarchy) -> Result<(), Fault> {
    let worlds = hierarchy.group.world_transforms();
    let Some(lost) = worlds.iter().position(|w| !w.is_finite()) else { return Ok(()) };
    // Instances come after their node; the name is theirs.
    let index = hierarchy.place.iter().position(|&p| p == Some(lost as u32));
    let place = match index {
        Some(i) => part("node", i, &document.nodes[i].name),
        None => format!("an instance of {}", part("node", lost, &hierarchy.group.nodes[lost].name)),
    };
    malformed(format!("{place}: its place in the world is not a finite number"))
}
