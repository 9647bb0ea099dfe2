//! Small scenes and views that lean towards trouble: slivers, shared edges, coplanar and copied surfaces,
//! vertices on pixel centres, surfaces seen edge-on, around, behind and through the eye, mirrored and
//! nested instances, masks, two-sided and blended materials. Everything follows from a seed.

use crate::conventions::{Projection, View};
use crate::scene::{
    AlphaMode, Content, Filter, Group, Material, Mesh, Node, Primitive, Scene, Texture, TextureRef,
    Transform, Wrap,
};
use glam::{DAffine2, DAffine3, DQuat, DVec3, Vec2, Vec3, Vec4};

/// A sequence of numbers that depends on the seed alone (SplitMix64).
pub struct Random(u64);

impl Random {
    /// Starts a sequence.
    pub fn new(seed: u64) -> Random {
        Random(seed)
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Between `low` and `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// A whole number below `n`, which is not 0.
    pub fn below(&mut self, n: u32) -> u32 {
        (self.bits() % u64::from(n)) as u32
    }

    /// True once in `n` times.
    pub fn one_in(&mut self, n: u32) -> bool {
        self.below(n) == 0
    }

    /// A point with coordinates between −`reach` and `reach`.
    pub fn point(&mut self, reach: f64) -> DVec3 {
        DVec3::new(self.between(-reach, reach), self.between(-reach, reach), self.between(-reach, reach))
    }

    fn rotation(&mut self) -> DQuat {
        let axis = self.point(1.0).normalize_or(DVec3::Y);
        DQuat::from_axis_angle(axis, self.between(-3.2, 3.2))
    }
}

/// A valid scene of a few hundred triangles within some ten metres of the origin.
pub fn scene(seed: u64) -> Scene {
    let random = &mut Random::new(seed);
    let mut scene = Scene::new(format!("trouble {seed}"));
    scene.textures.push(holes(random));
    scene.materials = materials();
    scene.groups = vec![Group::default(), Group::default()];
    scene.root = 1;
    for _ in 0..1 + random.below(4) {
        let mesh = mesh(random);
        scene.meshes.push(mesh);
    }
    let meshes = scene.meshes.len() as u32;
    for _ in 0..1 + random.below(4) {
        let content = Content::Mesh(random.below(meshes));
        let node = node(random, content);
        scene.groups[0].push(node);
    }
    for i in 0..1 + random.below(5) {
        let content = match random.below(4) {
            0 => Content::Group(0),
            1 => Content::Nothing,
            _ => Content::Mesh(random.below(meshes)),
        };
        let mut node = node(random, content);
        node.parent = (i > 0 && random.one_in(3)).then(|| i - 1);
        scene.groups[1].push(node.clone());
        if random.one_in(4) {
            // An exact copy in the same place: every pixel of it is a tie.
            scene.groups[1].push(node);
            return scene;
        }
    }
    scene
}

/// A view of such a scene: from outside, inside, on a grid, or parallel.
pub fn view(seed: u64) -> View {
    let random = &mut Random::new(seed ^ 0x5555_5555_5555_5555);
    let size = (1 + random.below(48), 1 + random.below(48));
    let near = [0.01, 0.1, 1.0][random.below(3) as usize];
    let reach = [12.0, 3.0, 0.5][random.below(3) as usize];
    let eye = if random.one_in(5) { random.point(reach).round() } else { random.point(reach) };
    let target = if random.one_in(5) { eye + DVec3::NEG_Z } else { random.point(2.0) };
    let projection = if random.one_in(4) {
        // Where a pixel is a power of two of a metre, whole coordinates fall on corners of pixels.
        let half_height = if random.one_in(2) { f64::from(size.1) / 8.0 } else { random.between(0.5, 8.0) };
        Projection::Orthographic { half_height, near: random.between(-5.0, 1.0), far: 8.0 }
    } else {
        Projection::Perspective { fov_y: random.between(0.3, 2.6), near }
    };
    View::look_at(eye, target, DVec3::Y, projection, size)
}

fn materials() -> Vec<Material> {
    let masked = TextureRef {
        texture: 0,
        transform: DAffine2::IDENTITY,
        wrap: [Wrap::Repeat, Wrap::Mirror],
        filter: Filter::Linear,
    };
    let plain = Material::default;
    vec![
        plain(),
        Material { double_sided: true, ..plain() },
        Material { alpha: AlphaMode::Mask { cutoff: 0.5 }, texture: Some(masked), ..plain() },
        Material {
            alpha: AlphaMode::Mask { cutoff: 0.5 },
            texture: Some(TextureRef { filter: Filter::Nearest, ..masked }),
            double_sided: true,
            ..plain()
        },
        Material {
            alpha: AlphaMode::Blend,
            base_color: Vec4::new(0.8, 0.2, 0.1, 0.5),
            double_sided: true,
            ..plain()
        },
    ]
}

fn holes(random: &mut Random) -> Texture {
    let texels = (0..16).map(|_| [255, 255, 255, (random.below(2) * 255) as u8]).collect();
    Texture { name: "holes".to_owned(), width: 4, height: 4, texels }
}

fn node(random: &mut Random, content: Content) -> Node {
    let local = match random.below(5) {
        0 => Transform::default(),
        1 => Transform::from_translation(random.point(3.0).round()),
        2 => Transform::Trs {
            translation: random.point(4.0),
            rotation: random.rotation(),
            scale: DVec3::splat(random.between(0.2, 2.0)),
        },
        3 => Transform::Trs {
            translation: random.point(4.0),
            rotation: random.rotation(),
            scale: DVec3::new(-1.0, random.between(0.2, 2.0), random.between(0.2, 2.0)),
        },
        _ => {
            let shear = DAffine3::from_cols(
                DVec3::new(1.0, random.between(-1.0, 1.0), 0.0),
                DVec3::new(0.0, random.between(0.1, 1.0), random.between(-1.0, 1.0)),
                DVec3::Z,
                random.point(3.0),
            );
            Transform::Affine(shear)
        }
    };
    Node { content, local, ..Node::default() }
}

/// Triangles of several kinds, with texture coordinates and a material each.
fn mesh(random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    for _ in 0..1 + random.below(4) {
        match random.below(8) {
            0 => soup(random, &mut mesh),
            1 => slivers(random, &mut mesh),
            2 => sheet(random, &mut mesh),
            3 => stack(random, &mut mesh),
            4 => cuboid(random, &mut mesh),
            5 => specks(random, &mut mesh),
            6 => fan(random, &mut mesh),
            _ => giants(random, &mut mesh),
        }
        let end = mesh.triangles.len() as u32;
        let start = mesh.primitives.last().map_or(0, |p| p.triangles.end);
        let material = (!random.one_in(3)).then(|| random.below(5));
        mesh.primitives.push(Primitive { triangles: start..end, material });
    }
    mesh.uvs = mesh.positions.iter().map(|p| Vec2::new(p.x + 0.37 * p.z, p.y - 0.21 * p.z)).collect();
    mesh
}

fn push(mesh: &mut Mesh, corners: [DVec3; 3]) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(corners.map(|c| c.as_vec3()));
    mesh.triangles.push([first, first + 1, first + 2]);
}

fn soup(random: &mut Random, mesh: &mut Mesh) {
    let reach = random.between(0.5, 6.0);
    for _ in 0..30 {
        push(mesh, [random.point(reach), random.point(reach), random.point(reach)]);
    }
}

/// Nearly or exactly degenerate.
fn slivers(random: &mut Random, mesh: &mut Mesh) {
    for _ in 0..30 {
        let (a, b) = (random.point(4.0), random.point(4.0));
        let off = [0.0, 1e-7, 1e-4, 1e-2][random.below(4) as usize];
        let between = a.lerp(b, random.between(-0.2, 1.2)) + random.point(off);
        push(mesh, [a, b, between]);
    }
}

/// A bumpy sheet whose triangles share edges and vertices.
fn sheet(random: &mut Random, mesh: &mut Mesh) {
    const SIDE: u32 = 7;
    let first = mesh.positions.len() as u32;
    let bump = [0.0, 0.1, 1.5][random.below(3) as usize];
    let step = [0.25, 0.5, 1.0][random.below(3) as usize];
    for i in 0..SIDE * SIDE {
        let (x, z) = (f64::from(i % SIDE) - 3.0, f64::from(i / SIDE) - 3.0);
        let y = random.between(-bump, bump) - 0.5;
        mesh.positions.push(DVec3::new(x * step, y, z * step).as_vec3());
    }
    for i in 0..(SIDE - 1) * (SIDE - 1) {
        let a = first + i / (SIDE - 1) * SIDE + i % (SIDE - 1);
        let (b, c, d) = (a + 1, a + SIDE, a + SIDE + 1);
        mesh.triangles.extend([[a, c, b], [b, c, d]]);
    }
}

/// Coplanar, overlapping, some of them copies of each other.
fn stack(random: &mut Random, mesh: &mut Mesh) {
    let z = random.between(-3.0, 3.0).round();
    for _ in 0..12 {
        let mut corner = || {
            let p = random.point(3.0);
            DVec3::new((p.x * 4.0).round() / 4.0, (p.y * 4.0).round() / 4.0, z)
        };
        let corners = [corner(), corner(), corner()];
        push(mesh, corners);
        if random.one_in(2) {
            push(mesh, corners);
        }
    }
}

/// A closed box on whole coordinates, facing outwards; the eye may be inside.
fn cuboid(random: &mut Random, mesh: &mut Mesh) {
    let a = random.point(4.0).round();
    let b = a + DVec3::ONE + random.point(2.0).abs().round();
    let first = mesh.positions.len() as u32;
    for k in 0..8 {
        let pick = |axis: usize| if k >> axis & 1 == 0 { a[axis] } else { b[axis] };
        mesh.positions.push(DVec3::new(pick(0), pick(1), pick(2)).as_vec3());
    }
    for q in [[0u32, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
        let q = q.map(|v| first + v);
        mesh.triangles.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
    }
}

/// Smaller than a pixel from most places.
fn specks(random: &mut Random, mesh: &mut Mesh) {
    let size = [1e-3, 1e-2, 1e-1][random.below(3) as usize];
    for _ in 0..60 {
        let at = random.point(3.0);
        push(mesh, [at, at + random.point(size), at + random.point(size)]);
    }
}

/// Triangles around one vertex.
fn fan(random: &mut Random, mesh: &mut Mesh) {
    const BLADES: u32 = 12;
    let hub = random.point(2.0);
    let radius = random.between(0.2, 4.0);
    let turn = random.rotation();
    let first = mesh.positions.len() as u32;
    mesh.positions.push(hub.as_vec3());
    for k in 0..BLADES {
        let angle = f64::from(k) * std::f64::consts::TAU / f64::from(BLADES);
        let rim = turn * DVec3::new(angle.cos() * radius, angle.sin() * radius, 0.0);
        mesh.positions.push((hub + rim).as_vec3());
    }
    for k in 0..BLADES {
        mesh.triangles.push([first, first + 1 + k, first + 1 + (k + 1) % BLADES]);
    }
}

/// Far larger than the view; some pass through it or through the eye.
fn giants(random: &mut Random, mesh: &mut Mesh) {
    for _ in 0..4 {
        let reach = [20.0, 1e3, 1e6][random.below(3) as usize];
        let through = random.point(2.0);
        let (a, b) = (random.point(reach), random.point(reach));
        push(mesh, [through + a, through + b, through - a - b]);
    }
    mesh.positions.push(Vec3::ZERO);
}
