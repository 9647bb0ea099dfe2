//! Every machine gives the same bits: pictures, depths and verdicts of fixed scenes, as digests that are written down
//! here. Machines whose instruction sets never meet in one process are held together by them.
//!
//! Only +, −, ×, ÷ and √ of IEEE 754 make these scenes: sines differ from one C library to the next.

use fearless_simd::Level;
use glam::{DQuat, DVec3, Vec2, Vec3};
use hither::conventions::{Projection, View};
use hither::cull::{
    Ball, Boxes, CullOptions, Occluder, OcclusionBuffer, OcclusionOptions, SampledBuffer, ScreenRect,
    Verdict, cull,
};
use hither::geometry::Aabb;
use hither::index::TreeKind;
use hither::reference::trouble::Random;
use hither::render::BoxTest;
use hither::scene::{
    AlphaMode, Content, Filter, Material, Mesh, Node, Primitive, Scene, Texture, TextureRef, Transform, Wrap,
};
use hither::{Algorithm, IndexOptions, RenderOptions, SceneIndex, render};

/// The tangent of half of it is a number of f64 to a thousandth of its last bit: no library rounds it otherwise.
const FOV_Y: f64 = 1.257_812_5;

/// Ids and depths of pictures.
const PICTURES: [u64; 6] = [
    0x7074_014d_8989_e770,
    0xc35b_3db6_d52e_5486,
    0xea8d_57f2_0e9d_fc3b,
    0x4d7f_102b_9e4e_1502,
    0xaefd_ec3b_3d91_ce7f,
    0xe472_f619_967d_de4d,
];

/// Depths of occlusion buffers, and their verdicts.
const BUFFERS: [u64; 6] = [
    0x3e20_ae6b_0727_5c10,
    0x2a19_735d_835e_7648,
    0x9dbf_7d2e_f0bb_9149,
    0xb91f_09ea_eb9c_30a3,
    0x996b_6f82_1d41_f74d,
    0xabc3_1d53_7da6_b562,
];

/// Depths of sampled buffers, which occluder was drawn, and their verdicts.
const SAMPLED: [u64; 3] = [0xccec_8cfc_bdcd_8a01, 0x83ad_7fb2_0a7b_fece, 0x01af_04f5_f6c7_96ed];

/// Instances that culling finds, nearest first.
const FOUND: [u64; 6] = [
    0x5d3b_5ded_f0c8_5b5c,
    0xefff_a21f_8b41_a569,
    0xbb5c_546b_5e1e_7798,
    0xc9d4_018c_ed23_4f74,
    0xbd45_0886_40ed_e9c7,
    0x5c3c_39b5_b4f5_3c63,
];

/// A digest of numbers in their order (FNV-1a).
struct Digest(u64);

impl Digest {
    fn new() -> Digest {
        Digest(0xcbf2_9ce4_8422_2325)
    }

    fn add(&mut self, number: u32) {
        for byte in number.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

/// The best and the plainest instruction set of this machine.
fn levels() -> [Level; 2] {
    [Level::new(), Level::baseline()]
}

/// Loose triangles of any size, around the origin.
fn soup(random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..60 {
        let size = [0.02, 0.3, 4.0][i as usize % 3];
        let at = random.point(2.0);
        let corners = [at, at + random.point(size), at + random.point(size)];
        mesh.positions.extend(corners.map(|c| c.as_vec3()));
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh
}

/// A bumpy sheet across the line of sight.
fn sheet(random: &mut Random) -> Mesh {
    const SIDE: u32 = 14;
    let mut mesh = Mesh::default();
    for i in 0..SIDE * SIDE {
        let (x, y) = (f64::from(i % SIDE) / 6.5 - 1.0, f64::from(i / SIDE) / 6.5 - 1.0);
        mesh.positions.push(DVec3::new(x, y, random.between(-0.1, 0.1)).as_vec3());
    }
    for i in 0..(SIDE - 1) * (SIDE - 1) {
        let a = i / (SIDE - 1) * SIDE + i % (SIDE - 1);
        let (b, c, d) = (a + 1, a + SIDE, a + SIDE + 1);
        mesh.triangles.extend([[a, b, c], [b, d, c]]);
    }
    mesh
}

/// A box; with more than one square to a side, a ball of many faces.
fn lump(random: &mut Random, side: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for sign in [-1.0f32, 1.0] {
            let first = mesh.positions.len() as u32;
            for i in 0..(side + 1) * (side + 1) {
                let at = |k: u32| 2.0 * k as f32 / side as f32 - 1.0;
                let mut p = [sign; 3];
                (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (at(i % (side + 1)), at(i / (side + 1)));
                let p = Vec3::from(p);
                mesh.positions.push(if side == 1 { p } else { p / p.length() });
            }
            for i in 0..side * side {
                let a = first + i / side * (side + 1) + i % side;
                let (b, c, d) = (a + 1, a + side + 1, a + side + 2);
                let two = if sign > 0.0 { [[a, b, d], [a, d, c]] } else { [[a, d, b], [a, c, d]] };
                mesh.triangles.extend(two);
            }
        }
    }
    let size = random.between(0.5, 1.0) as f32;
    mesh.positions.iter_mut().for_each(|p| *p *= size);
    mesh
}

fn materials() -> Vec<Material> {
    let texture = TextureRef {
        texture: 0,
        transform: glam::DAffine2::IDENTITY,
        wrap: [Wrap::Repeat, Wrap::Mirror],
        filter: Filter::Linear,
    };
    vec![
        Material::default(),
        Material { double_sided: true, ..Material::default() },
        Material {
            alpha: AlphaMode::Mask { cutoff: 0.5 },
            texture: Some(texture),
            double_sided: true,
            ..Material::default()
        },
    ]
}

/// Asserts that the digests of scenes 0, 1, 2 and so on are those that are written down.
fn check<const N: usize>(got: [u64; N], expected: [u64; N], what: &str) {
    assert!(got == expected, "{what}: {got:#018x?}, not {expected:#018x?}");
}

/// Some forty instances within six metres of the origin, turned, stretched and mirrored.
fn scene(seed: u64) -> Scene {
    let random = &mut Random::new(seed);
    let mut scene = Scene::new("bits");
    let texels = (0..16).map(|_| [255, 255, 255, (random.below(2) * 255) as u8]).collect();
    scene.textures.push(Texture { name: "holes".to_owned(), width: 4, height: 4, texels });
    scene.materials = materials();
    scene.meshes = vec![soup(random), sheet(random), sheet(random), lump(random, 1), lump(random, 9)];
    for (i, mesh) in scene.meshes.iter_mut().enumerate() {
        let material = [None, Some(1), Some(2), Some(0), Some(0)][i];
        mesh.primitives = vec![Primitive { triangles: 0..mesh.triangles.len() as u32, material }];
        mesh.uvs = mesh.positions.iter().map(|p| Vec2::new(p.x + 0.25 * p.z, p.y - 0.5 * p.z)).collect();
    }
    for _ in 0..40 {
        let axis = random.point(1.0);
        let mirror = if random.one_in(4) { -1.0 } else { 1.0 };
        let local = Transform::Trs {
            translation: random.point(6.0),
            rotation: DQuat::from_xyzw(axis.x, axis.y, axis.z, random.between(0.1, 1.0)).normalize(),
            scale: DVec3::new(mirror, random.between(0.3, 2.0), random.between(0.3, 2.0)),
        };
        scene.groups[0].push(Node { content: Content::Mesh(random.below(5)), local, ..Node::default() });
    }
    scene
}

/// Through a pinhole for even seeds, parallel for odd ones.
fn view(seed: u64) -> View {
    let eye = Random::new(seed ^ 0xE1E).point(7.0);
    let projection = if seed.is_multiple_of(2) {
        Projection::Perspective { fov_y: FOV_Y, near: 0.125 }
    } else {
        Projection::Orthographic { half_height: 4.3, near: 0.1, far: 30.0 }
    };
    View::look_at(eye, DVec3::new(0.3, -0.2, 0.1), DVec3::Y, projection, (150, 100))
}

/// What a picture holds.
fn picture(seed: u64, options: &RenderOptions, tree: TreeKind) -> u64 {
    let view = view(seed);
    let index = SceneIndex::build(scene(seed), &IndexOptions { tree });
    let frame = render(&index, &view, options).unwrap();
    let mut digest = Digest::new();
    for (x, y) in (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y))) {
        let id = frame.id(x, y);
        digest.add(id.map_or(u32::MAX, |id| id.instance));
        digest.add(id.map_or(u32::MAX, |id| id.triangle));
        digest.add(frame.depth(x, y).to_bits());
    }
    digest.0
}

#[test]
fn pictures_have_the_same_bits_everywhere() {
    for level in levels() {
        let hzb = RenderOptions { level, ..RenderOptions::default() };
        let variants = [
            (hzb, TreeKind::Bvh),
            (RenderOptions { algorithm: Algorithm::ZBuffer, ..hzb }, TreeKind::OctreeSmallest),
            (RenderOptions { box_test: BoxTest::Definitive, ..hzb }, TreeKind::OctreePushed),
        ];
        for (options, tree) in variants {
            let got = std::array::from_fn(|seed| picture(seed as u64, &options, tree));
            check(got, PICTURES, &format!("{tree:?}, {options:?}"));
        }
    }
}

/// Boxes, balls and rectangles of the screen to ask about.
fn questions(seed: u64) -> (Boxes, Vec<Ball>, Vec<ScreenRect>) {
    let random = &mut Random::new(seed ^ 0xA5C);
    let bounds = |random: &mut Random| {
        let (at, size) = (random.point(9.0), random.point(0.6).abs());
        Aabb { min: at - size, max: at + size }
    };
    let boxes: Boxes = (0..800).map(|_| bounds(random)).collect();
    let balls: Vec<Ball> =
        (0..400).map(|_| Ball { center: random.point(9.0), radius: random.between(0.0, 0.8) }).collect();
    let rects: Vec<ScreenRect> = (0..400)
        .map(|_| {
            let (left, top) = (random.between(-5.0, 150.0), random.between(-5.0, 100.0));
            let (right, bottom) = (left + random.between(0.0, 20.0), top + random.between(0.0, 20.0));
            ScreenRect { left, top, right, bottom, depth: random.between(0.0, 0.2) as f32 }
        })
        .collect();
    (boxes, balls, rects)
}

/// Adds verdicts; returns how many are hidden.
fn add(digest: &mut Digest, verdicts: [Vec<Verdict>; 3]) -> u32 {
    let verdicts = verdicts.concat();
    verdicts.iter().for_each(|verdict| digest.add(*verdict as u32));
    verdicts.iter().filter(|verdict| **verdict == Verdict::Hidden).count() as u32
}

/// The occluders of a scene, and where each of its instances stands.
fn occluders(scene: &Scene) -> Vec<Occluder> {
    scene.meshes.iter().map(|mesh| Occluder::of_mesh(mesh, &scene.materials)).collect()
}

/// What an occlusion buffer holds and answers; and how much it calls hidden.
fn buffer(seed: u64, level: Level) -> (u64, u32) {
    let (scene, view) = (scene(seed), view(seed));
    let occluders = occluders(&scene);
    let eye_moves = if seed % 3 == 2 { 0.05 } else { 0.0 };
    let options = OcclusionOptions { eye_moves, level, ..OcclusionOptions::default() };
    let mut buffer = OcclusionBuffer::new(&view, &options).unwrap();
    for instance in scene.instances() {
        buffer.draw(&occluders[instance.mesh as usize], &instance.world_from_mesh);
    }
    let mut digest = Digest::new();
    buffer.depths().iter().for_each(|depth| digest.add(depth.to_bits()));
    let (boxes, balls, rects) = questions(seed);
    let mut verdicts = [const { Vec::new() }; 3];
    buffer.ask(&boxes, &mut verdicts[0]);
    buffer.ask_balls(&balls, &mut verdicts[1]);
    buffer.ask_rects(&rects, &mut verdicts[2]);
    let hidden = add(&mut digest, verdicts);
    (digest.0, hidden)
}

#[test]
fn occlusion_buffers_have_the_same_bits_everywhere() {
    for level in levels() {
        let got = std::array::from_fn(|seed| buffer(seed as u64, level));
        check(got.map(|g| g.0), BUFFERS, &format!("{level:?}"));
        let hidden: u32 = got.iter().map(|g| g.1).sum();
        assert!(hidden > 250, "only {hidden} were hidden");
    }
}

/// What a sampled buffer holds and answers that was merged from two; and how much it calls hidden.
fn sampled(seed: u64) -> (u64, u32) {
    let (scene, view) = (scene(seed), view(seed));
    let occluders = occluders(&scene);
    let [mut buffer, other] = [(); 2].map(|()| SampledBuffer::in_bands(&view, 3).unwrap());
    for (number, instance) in scene.instances().iter().enumerate() {
        let half = if number % 2 == 0 { &buffer } else { &other };
        half.draw(&occluders[instance.mesh as usize], &instance.world_from_mesh);
    }
    buffer.merge(&other).unwrap();
    let mut digest = Digest::new();
    for (x, y) in (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y))) {
        digest.add(buffer.depth(x, y).to_bits());
        digest.add(buffer.occluder(x, y).unwrap_or(u32::MAX));
    }
    let (boxes, balls, rects) = questions(seed);
    let mut verdicts = [const { Vec::new() }; 3];
    buffer.ask(&boxes, &mut verdicts[0]);
    buffer.ask_balls(&balls, &mut verdicts[1]);
    buffer.ask_rects(&rects, &mut verdicts[2]);
    let hidden = add(&mut digest, verdicts);
    (digest.0, hidden)
}

#[test]
fn sampled_buffers_have_the_same_bits_everywhere() {
    let got = std::array::from_fn(|seed| sampled(seed as u64));
    check(got.map(|g| g.0), SAMPLED, "sampled");
    let hidden: u32 = got.iter().map(|g| g.1).sum();
    assert!(hidden > 250, "only {hidden} were hidden");
}

#[test]
fn scenes_are_culled_alike_everywhere() {
    for level in levels() {
        let options = CullOptions { least_occluder_px: 100, level, ..CullOptions::default() };
        let got = std::array::from_fn(|seed| {
            let (index, view) =
                (SceneIndex::build(scene(seed as u64), &IndexOptions::default()), view(seed as u64));
            let mut digest = Digest::new();
            let found = cull(&index, &view, &options).unwrap().visible;
            found.into_iter().for_each(|instance| digest.add(instance));
            digest.0
        });
        check(got, FOUND, &format!("{level:?}"));
    }
}
