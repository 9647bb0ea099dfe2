//! Intel's ray caster Embree, version 3 or 4, found on the machine when it is asked for.
//!
//! Set up as its manual advises for primary rays: high build quality, packets of sixteen (4 × 4 pixels), the
//! coherent flag, instances as instance geometries, no filter. (Flushing denormals, which the manual advises
//! too, made no difference on any of the worlds, so the processor's mode is left alone.) The library is
//! looked for by its usual names; the environment variable `HITHER_EMBREE` may name the file.
//!
//! This is the one file of the workspace with unsafe code: declarations of Embree's C interface as its
//! headers `rtcore_*.h` have it, behind types that own what they make and free it.

use super::{PACKET_SIDE, Peer, Rays, RowsOut, instances, only_mesh_in_place};
use glam::DAffine3;
use hither::conventions::NO_ID;
use hither::scene::{Mesh, Scene};
use libloading::Library;
use std::ffi::{CString, c_char, c_int, c_uint, c_void};
use std::ops::Range;
use std::ptr::{null, null_mut};
use std::sync::{Arc, OnceLock};

/// Why Embree cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EmbreeError {
    /// No library was found.
    #[error("Embree was not found ({0}); install libembree 3 or 4, or name its file in HITHER_EMBREE")]
    NotFound(String),
    /// The library lacks a function that this program calls.
    #[error("Embree's library lacks a function: {0}; use version 3 or 4")]
    Incompatible(String),
    /// Embree reported an error.
    #[error("Embree failed while {doing} (its error {code})")]
    Failed {
        /// What was being done.
        doing: &'static str,
        /// Number of Embree's `RTCError`.
        code: i32,
    },
}

/// Opaque handles; Embree counts references to what is behind them.
type Device = *mut c_void;
type SceneHandle = *mut c_void;
type Geometry = *mut c_void;

const GEOMETRY_TRIANGLE: c_int = 0;
const GEOMETRY_INSTANCE: c_int = 121;
const BUFFER_INDEX: c_int = 0;
const BUFFER_VERTEX: c_int = 1;
const FORMAT_UINT3: c_int = 0x5003;
const FORMAT_FLOAT3: c_int = 0x9003;
const FORMAT_FLOAT3X4_COLUMN_MAJOR: c_int = 0x9234;
const QUALITY_HIGH: c_int = 2;
const PROPERTY_VERSION: c_int = 0;
const PROPERTY_VERSION_MAJOR: c_int = 1;
const INVALID: c_uint = c_uint::MAX;
const LANES: usize = (PACKET_SIDE * PACKET_SIDE) as usize;

/// `RTCRayHit16`. Version 4.3 appends an instance-primitive number to the hit, version 3 does not; the
/// fields up to `instance` are the same, and `reserved` is room for the rest.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
struct RayHit16 {
    origin: [[f32; LANES]; 3],
    near: [f32; LANES],
    direction: [[f32; LANES]; 3],
    time: [f32; LANES],
    far: [f32; LANES],
    mask: [c_uint; LANES],
    id: [c_uint; LANES],
    flags: [c_uint; LANES],
    normal: [[f32; LANES]; 3],
    uv: [[f32; LANES]; 2],
    primitive: [c_uint; LANES],
    geometry: [c_uint; LANES],
    instance: [c_uint; LANES],
    reserved: [c_uint; LANES],
}

/// `RTCIntersectContext` of version 3.
#[repr(C)]
struct Context3 {
    flags: c_int,
    filter: *const c_void,
    instance: [c_uint; 1],
}

/// `RTCIntersectArguments` of version 4.
#[repr(C)]
struct Arguments4 {
    flags: c_int,
    feature_mask: c_int,
    context: *mut c_void,
    filter: *const c_void,
    intersect: *const c_void,
    reserved: *const c_void,
}

type Intersect3 = unsafe extern "C" fn(*const c_int, SceneHandle, *mut Context3, *mut RayHit16);
type Intersect4 = unsafe extern "C" fn(*const c_int, SceneHandle, *mut RayHit16, *mut Arguments4);

#[derive(Clone, Copy)]
enum Intersect {
    V3(Intersect3),
    V4(Intersect4),
}

/// The functions that are called.
struct Functions {
    new_device: unsafe extern "C" fn(*const c_char) -> Device,
    release_device: unsafe extern "C" fn(Device),
    device_property: unsafe extern "C" fn(Device, c_int) -> isize,
    device_error: unsafe extern "C" fn(Device) -> c_int,
    new_scene: unsafe extern "C" fn(Device) -> SceneHandle,
    release_scene: unsafe extern "C" fn(SceneHandle),
    scene_quality: unsafe extern "C" fn(SceneHandle, c_int),
    commit_scene: unsafe extern "C" fn(SceneHandle),
    attach: unsafe extern "C" fn(SceneHandle, Geometry, c_uint),
    new_geometry: unsafe extern "C" fn(Device, c_int) -> Geometry,
    release_geometry: unsafe extern "C" fn(Geometry),
    geometry_quality: unsafe extern "C" fn(Geometry, c_int),
    new_buffer: unsafe extern "C" fn(Geometry, c_int, c_uint, c_int, usize, usize) -> *mut c_void,
    commit_geometry: unsafe extern "C" fn(Geometry),
    instanced_scene: unsafe extern "C" fn(Geometry, SceneHandle),
    transform: unsafe extern "C" fn(Geometry, c_uint, c_int, *const c_void),
    intersect: Intersect,
}

impl Functions {
    /// Loads the library at the first call; it stays for good, because its worker threads outlive its last
    /// device and must not lose their code.
    fn load() -> Result<&'static Functions, EmbreeError> {
        static LOADED: OnceLock<Result<Functions, EmbreeError>> = OnceLock::new();
        LOADED.get_or_init(Functions::find).as_ref().map_err(Clone::clone)
    }

    fn find() -> Result<Functions, EmbreeError> {
        let (library, version) = open()?;
        let library: &'static Library = Box::leak(Box::new(library));
        macro_rules! function {
            ($name:literal) => {
                // SAFETY: the field's type is the declaration of this function in Embree's headers, and the
                // library that the pointer leads into is never unloaded.
                *unsafe { library.get(concat!($name, "\0").as_bytes()) }
                    .map_err(|_| EmbreeError::Incompatible($name.to_owned()))?
            };
        }
        let intersect = if version == 3 {
            Intersect::V3(function!("rtcIntersect16"))
        } else {
            Intersect::V4(function!("rtcIntersect16"))
        };
        Ok(Functions {
            new_device: function!("rtcNewDevice"),
            release_device: function!("rtcReleaseDevice"),
            device_property: function!("rtcGetDeviceProperty"),
            device_error: function!("rtcGetDeviceError"),
            new_scene: function!("rtcNewScene"),
            release_scene: function!("rtcReleaseScene"),
            scene_quality: function!("rtcSetSceneBuildQuality"),
            commit_scene: function!("rtcCommitScene"),
            attach: function!("rtcAttachGeometryByID"),
            new_geometry: function!("rtcNewGeometry"),
            release_geometry: function!("rtcReleaseGeometry"),
            geometry_quality: function!("rtcSetGeometryBuildQuality"),
            new_buffer: function!("rtcSetNewGeometryBuffer"),
            commit_geometry: function!("rtcCommitGeometry"),
            instanced_scene: function!("rtcSetGeometryInstancedScene"),
            transform: function!("rtcSetGeometryTransform"),
            intersect,
        })
    }
}

/// The library and its major version.
fn open() -> Result<(Library, isize), EmbreeError> {
    const USUAL: [&str; 6] = [
        "libembree3.so.3",
        "libembree4.so.4",
        "libembree3.3.dylib",
        "libembree4.4.dylib",
        "embree3.dll",
        "embree4.dll",
    ];
    let named = std::env::var("HITHER_EMBREE").ok();
    let names: Vec<&str> = match &named {
        Some(name) => vec![name],
        None => USUAL.to_vec(),
    };
    let mut reason = String::new();
    for name in names {
        // SAFETY: loading runs the library's initialisers; it is a system library that the user installed
        // or named, and Embree's do nothing but set up its own state.
        match unsafe { Library::new(name) } {
            Ok(library) => {
                let version = major_version(&library)?;
                return Ok((library, version));
            }
            Err(e) if reason.is_empty() => reason = e.to_string(),
            Err(_) => {}
        }
    }
    Err(EmbreeError::NotFound(reason))
}

fn major_version(library: &Library) -> Result<isize, EmbreeError> {
    let lacks = |e: libloading::Error| EmbreeError::Incompatible(e.to_string());
    type NewDevice = unsafe extern "C" fn(*const c_char) -> Device;
    type DeviceProperty = unsafe extern "C" fn(Device, c_int) -> isize;
    type ReleaseDevice = unsafe extern "C" fn(Device);
    // SAFETY: the types are those of the functions' declarations in `rtcore_device.h`, the same in versions
    // 3 and 4; the device is released once, after its last use.
    unsafe {
        let new_device = library.get::<NewDevice>(b"rtcNewDevice\0").map_err(lacks)?;
        let property = library.get::<DeviceProperty>(b"rtcGetDeviceProperty\0").map_err(lacks)?;
        let release = library.get::<ReleaseDevice>(b"rtcReleaseDevice\0").map_err(lacks)?;
        let device = new_device(null());
        if device.is_null() {
            return Err(EmbreeError::Failed { doing: "starting", code: 1 });
        }
        let version = property(device, PROPERTY_VERSION_MAJOR);
        release(device);
        match version {
            3 | 4 => Ok(version),
            other => Err(EmbreeError::Incompatible(format!("version {other}"))),
        }
    }
}

/// A device; freed with the last scene made on it.
struct Owner {
    functions: &'static Functions,
    device: Device,
}

// SAFETY: Embree's handles belong to no thread, and its reference counts are atomic.
unsafe impl Send for Owner {}
// SAFETY: as above; the functions called through a shared device are safe to call from several threads.
unsafe impl Sync for Owner {}

impl Drop for Owner {
    fn drop(&mut self) {
        // SAFETY: `device` came from `rtcNewDevice` and is released once; scenes hold references of their own.
        unsafe { (self.functions.release_device)(self.device) }
    }
}

impl Owner {
    fn check(&self, doing: &'static str) -> Result<(), EmbreeError> {
        // SAFETY: the device is alive.
        match unsafe { (self.functions.device_error)(self.device) } {
            0 => Ok(()),
            code => Err(EmbreeError::Failed { doing, code }),
        }
    }
}

/// A committed Embree scene.
struct Committed {
    owner: Arc<Owner>,
    handle: SceneHandle,
}

// SAFETY: as for its device.
unsafe impl Send for Committed {}
// SAFETY: after commit a scene is only read, and Embree's intersection functions may be called for it from
// any number of threads at once.
unsafe impl Sync for Committed {}

impl Drop for Committed {
    fn drop(&mut self) {
        // SAFETY: `handle` came from `rtcNewScene` and is released once.
        unsafe { (self.owner.functions.release_scene)(self.handle) }
    }
}

impl Committed {
    /// Makes a scene of the geometries that `attach` adds to it.
    fn new(
        owner: &Arc<Owner>,
        attach: impl FnOnce(&Owner, SceneHandle) -> Result<(), EmbreeError>,
    ) -> Result<Committed, EmbreeError> {
        let f = owner.functions;
        // SAFETY: the device is alive; a null handle is caught by the check before it is used.
        let handle = unsafe { (f.new_scene)(owner.device) };
        owner.check("making a scene")?;
        let scene = Committed { owner: owner.clone(), handle };
        // SAFETY: `handle` is a live scene that is not committed yet.
        unsafe { (f.scene_quality)(handle, QUALITY_HIGH) };
        attach(owner, handle)?;
        // SAFETY: as above; every attached geometry is committed.
        unsafe { (f.commit_scene)(handle) };
        owner.check("building its tree")?;
        Ok(scene)
    }
}

/// Adds a triangle mesh as geometry 0.
fn attach_mesh(owner: &Owner, scene: SceneHandle, mesh: &Mesh) -> Result<(), EmbreeError> {
    if mesh.triangles.is_empty() {
        return Ok(());
    }
    let f = owner.functions;
    let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
    // SAFETY: the device and the scene are alive. The buffers belong to the geometry and are as long as was
    // asked for (Embree pads them itself); they are checked for null before they are written, and exactly
    // their length is. The scene takes its own reference to the geometry, so ours is released.
    unsafe {
        let geometry = (f.new_geometry)(owner.device, GEOMETRY_TRIANGLE);
        owner.check("making a mesh")?;
        (f.geometry_quality)(geometry, QUALITY_HIGH);
        let to = (f.new_buffer)(geometry, BUFFER_VERTEX, 0, FORMAT_FLOAT3, 12, vertices).cast::<[f32; 3]>();
        let of = (f.new_buffer)(geometry, BUFFER_INDEX, 0, FORMAT_UINT3, 12, triangles).cast::<[u32; 3]>();
        if to.is_null() || of.is_null() {
            (f.release_geometry)(geometry);
            return Err(EmbreeError::Failed { doing: "allocating a mesh", code: 4 });
        }
        for (i, p) in mesh.positions.iter().enumerate() {
            to.add(i).write(p.to_array());
        }
        for (i, t) in mesh.triangles.iter().enumerate() {
            of.add(i).write(*t);
        }
        (f.commit_geometry)(geometry);
        (f.attach)(scene, geometry, 0);
        (f.release_geometry)(geometry);
    }
    owner.check("filling a mesh")
}

/// Adds an instance of a committed scene as geometry `number`.
fn attach_instance(
    owner: &Owner,
    scene: SceneHandle,
    of: &Committed,
    number: u32,
    world_from_mesh: &DAffine3,
) -> Result<(), EmbreeError> {
    let f = owner.functions;
    let columns: [f32; 12] = world_from_mesh.to_cols_array().map(|x| x as f32);
    // SAFETY: device and scenes are alive; `columns` is a 3×4 matrix in column order, which Embree copies.
    unsafe {
        let geometry = (f.new_geometry)(owner.device, GEOMETRY_INSTANCE);
        owner.check("making an instance")?;
        (f.instanced_scene)(geometry, of.handle);
        (f.transform)(geometry, 0, FORMAT_FLOAT3X4_COLUMN_MAJOR, columns.as_ptr().cast());
        (f.commit_geometry)(geometry);
        (f.attach)(scene, geometry, number);
        (f.release_geometry)(geometry);
    }
    owner.check("placing an instance")
}

/// A scene in Embree.
pub struct Embree {
    top: Committed,
    /// Kept alive while `top` refers to them.
    _meshes: Vec<Committed>,
}

impl Embree {
    /// Builds the trees of a scene in its present pose.
    pub fn build(scene: &Scene) -> Result<Embree, EmbreeError> {
        let functions = Functions::load()?;
        let settings = CString::default();
        // SAFETY: an empty string, ended by a zero, asks for the default settings.
        let device = unsafe { (functions.new_device)(settings.as_ptr()) };
        if device.is_null() {
            return Err(EmbreeError::Failed { doing: "starting", code: 1 });
        }
        let owner = Arc::new(Owner { functions, device });
        let of_mesh = |mesh| Committed::new(&owner, |o, s| attach_mesh(o, s, mesh));
        let placed = instances(scene);
        if let Some(mesh) = only_mesh_in_place(&placed) {
            let top = of_mesh(&scene.meshes[mesh as usize])?;
            return Ok(Embree { top, _meshes: Vec::new() });
        }
        let meshes = scene.meshes.iter().map(of_mesh).collect::<Result<Vec<Committed>, _>>()?;
        let top = Committed::new(&owner, |o, s| {
            for (number, (mesh, at)) in placed.iter().enumerate() {
                attach_instance(o, s, &meshes[*mesh as usize], number as u32, at)?;
            }
            Ok(())
        })?;
        Ok(Embree { top, _meshes: meshes })
    }

    /// Traces one packet; lanes outside the picture are inactive.
    fn intersect(&self, active: &[c_int; LANES], packet: &mut RayHit16) {
        // SAFETY: `RayHit16` is laid out and aligned as the version's `RTCRayHit16`, or longer; the lanes'
        // flags are 16 aligned integers; contexts outlive the call and are zero where unused; the scene is
        // committed.
        unsafe {
            match self.top.owner.functions.intersect {
                Intersect::V3(call) => {
                    const COHERENT: c_int = 1;
                    let mut context = Context3 { flags: COHERENT, filter: null(), instance: [INVALID] };
                    call(active.as_ptr(), self.top.handle, &mut context, packet);
                }
                Intersect::V4(call) => {
                    const COHERENT: c_int = 1 << 16;
                    const ALL_FEATURES: c_int = -1;
                    let mut arguments = Arguments4 {
                        flags: COHERENT,
                        feature_mask: ALL_FEATURES,
                        context: null_mut(),
                        filter: null(),
                        intersect: null(),
                        reserved: null(),
                    };
                    call(active.as_ptr(), self.top.handle, packet, &mut arguments);
                }
            }
        }
    }
}

/// Sixteen integers aligned as a packet's.
#[repr(C, align(64))]
struct Active([c_int; LANES]);

impl Peer for Embree {
    fn name(&self) -> String {
        let owner = &self.top.owner;
        // SAFETY: the device is alive.
        let version = unsafe { (owner.functions.device_property)(owner.device, PROPERTY_VERSION) };
        format!("Embree {}.{}.{}", version / 10_000, version / 100 % 100, version % 100)
    }

    fn trace_rows(&self, rays: &Rays, rows: Range<u32>, out: RowsOut<'_>) {
        let lane = |i: usize| (i as u32 % PACKET_SIDE, i as u32 / PACKET_SIDE);
        for top in rows.clone().step_by(PACKET_SIDE as usize) {
            for left in (0..rays.width).step_by(PACKET_SIDE as usize) {
                let mut active = Active([0; LANES]);
                let mut packet = empty_packet(rays);
                for i in 0..LANES {
                    let (dx, dy) = lane(i);
                    let (x, y) = (left + dx, top + dy);
                    active.0[i] = if x < rays.width && y < rows.end { -1 } else { 0 };
                    let (origin, direction) = rays.ray(x, y);
                    for axis in 0..3 {
                        packet.origin[axis][i] = origin[axis];
                        packet.direction[axis][i] = direction[axis];
                    }
                }
                self.intersect(&active.0, &mut packet);
                for i in 0..LANES {
                    if active.0[i] == 0 {
                        continue;
                    }
                    let (dx, dy) = lane(i);
                    let at = ((top + dy - rows.start) * rays.width + left + dx) as usize;
                    let hit = packet.geometry[i] != INVALID;
                    // A scene without instances names none; its mesh is instance 0.
                    let instance = if packet.instance[i] == INVALID { 0 } else { packet.instance[i] };
                    out.instance[at] = if hit { instance } else { NO_ID };
                    out.triangle[at] = if hit { packet.primitive[i] } else { NO_ID };
                    out.distance[at] = if hit { packet.far[i] } else { f32::INFINITY };
                }
            }
        }
    }
}

fn empty_packet(rays: &Rays) -> RayHit16 {
    RayHit16 {
        origin: [[0.0; LANES]; 3],
        near: [rays.near; LANES],
        direction: [[0.0; LANES]; 3],
        time: [0.0; LANES],
        far: [rays.far; LANES],
        mask: [c_uint::MAX; LANES],
        id: [0; LANES],
        flags: [0; LANES],
        normal: [[0.0; LANES]; 3],
        uv: [[0.0; LANES]; 2],
        primitive: [INVALID; LANES],
        geometry: [INVALID; LANES],
        instance: [INVALID; LANES],
        reserved: [INVALID; LANES],
    }
}
