//! The needed part of Embree's C interface, versions 3 and 4, opened at run time: no headers, no linking.
//!
//! Scenes are of high build quality, on one thread. Denormal numbers are flushed while rays run, as Embree advises.

use std::error::Error;
use std::ffi::{CString, c_char, c_int, c_uint, c_void};

use foresound::geometry::Ray;
use glam::Vec3;

type Handle = *mut c_void;
type Query = unsafe extern "C" fn(Handle, Handle, Handle);

const VERSION: c_int = 0;
const TRIANGLES: c_int = 0;
const INDICES: c_int = 0;
const VERTICES: c_int = 1;
const THREE_U32: c_int = 0x5003;
const THREE_F32: c_int = 0x9003;
const HIGH_QUALITY: c_int = 2;
const ROBUST: c_int = 1 << 2;

/// An Embree library and a device of it.
pub struct Library {
    library: libloading::Library,
    device: Handle,
    version: isize,
    configuration: String,
}

/// Triangles to trace.
pub struct Scene {
    scene: Handle,
    intersect: Query,
    occluded: Query,
    is_third: bool,
}

/// A ray and its hit, padded beyond what any version writes.
#[repr(C, align(16))]
struct RayHit {
    origin: [f32; 3],
    near: f32,
    direction: [f32; 3],
    time: f32,
    far: f32,
    mask: u32,
    id: u32,
    flags: u32,
    normal: [f32; 3],
    barycentric: [f32; 2],
    triangle: u32,
    geometry: u32,
    instances: [u32; 13],
}

/// Version 3's context of a call: an incoherent ray without filter or instances.
#[repr(C)]
struct Context {
    flags: c_int,
    filter: Handle,
    instances: [u32; 8],
}

impl Library {
    /// Opens `PATH` or `PATH@CONFIGURATION` (`isa=avx2`).
    pub fn open(argument: &str) -> Result<Self, Box<dyn Error>> {
        let (path, configuration) = argument.split_once('@').unwrap_or((argument, ""));
        let comma = if configuration.is_empty() { "" } else { "," };
        let full = CString::new(format!("threads=1{comma}{configuration}"))?;
        // SAFETY: a library that the caller has chosen to run.
        let library = unsafe { libloading::Library::new(path)? };
        // SAFETY: the signature is that of versions 3 and 4.
        let new_device = unsafe {
            *library.get::<unsafe extern "C" fn(*const c_char) -> Handle>(b"rtcNewDevice")?
        };
        // SAFETY: a string that ends in zero.
        let device = unsafe { new_device(full.as_ptr()) };
        if device.is_null() {
            return Err(format!("{argument}: no device").into());
        }
        // SAFETY: as above.
        let property = unsafe {
            *library.get::<unsafe extern "C" fn(Handle, c_int) -> isize>(b"rtcGetDeviceProperty")?
        };
        Ok(Self {
            // SAFETY: a device, and a property that all versions have.
            version: unsafe { property(device, VERSION) },
            library,
            device,
            configuration: configuration.to_owned(),
        })
    }

    /// Version and configuration.
    pub fn name(&self) -> String {
        let (major, minor) = (self.version / 10_000, self.version / 100 % 100);
        format!("{major}.{minor}{}", self.configuration)
    }

    /// Commits triangles.
    pub fn scene(
        &self,
        vertices: &[Vec3],
        triangles: &[[u32; 3]],
        robust: bool,
    ) -> Result<Scene, Box<dyn Error>> {
        type One = unsafe extern "C" fn(Handle);
        type Set = unsafe extern "C" fn(Handle, c_int);
        type Buffer =
            unsafe extern "C" fn(Handle, c_int, c_uint, c_int, usize, usize) -> *mut c_void;
        // SAFETY: signatures are those of versions 3 and 4, handles come from the library itself, and buffers are as
        // large as requested.
        unsafe {
            let lib = &self.library;
            let scene =
                lib.get::<unsafe extern "C" fn(Handle) -> Handle>(b"rtcNewScene")?(self.device);
            if robust {
                lib.get::<Set>(b"rtcSetSceneFlags")?(scene, ROBUST);
            }
            lib.get::<Set>(b"rtcSetSceneBuildQuality")?(scene, HIGH_QUALITY);
            let geometry = lib
                .get::<unsafe extern "C" fn(Handle, c_int) -> Handle>(b"rtcNewGeometry")?(
                self.device,
                TRIANGLES,
            );
            lib.get::<Set>(b"rtcSetGeometryBuildQuality")?(geometry, HIGH_QUALITY);
            let buffer = lib.get::<Buffer>(b"rtcSetNewGeometryBuffer")?;
            let to: *mut f32 = buffer(geometry, VERTICES, 0, THREE_F32, 12, vertices.len()).cast();
            for (i, value) in vertices.iter().flat_map(Vec3::to_array).enumerate() {
                to.add(i).write(value);
            }
            let to: *mut u32 = buffer(geometry, INDICES, 0, THREE_U32, 12, triangles.len()).cast();
            for (i, value) in triangles.iter().flatten().enumerate() {
                to.add(i).write(*value);
            }
            lib.get::<One>(b"rtcCommitGeometry")?(geometry);
            lib.get::<unsafe extern "C" fn(Handle, Handle) -> c_uint>(b"rtcAttachGeometry")?(
                scene, geometry,
            );
            lib.get::<One>(b"rtcCommitScene")?(scene);
            Ok(Scene {
                scene,
                intersect: *lib.get::<Query>(b"rtcIntersect1")?,
                occluded: *lib.get::<Query>(b"rtcOccluded1")?,
                is_third: self.version < 40_000,
            })
        }
    }
}

impl Scene {
    /// Traces all rays; returns the number of hits.
    pub fn trace(&self, rays: &[Ray], any: bool) -> usize {
        let flushing: u32 = 0x9fc0;
        let mut before: u32 = 0;
        // SAFETY: reads and writes the control register of this thread, which is put back below.
        unsafe {
            std::arch::asm!("stmxcsr [{}]", "ldmxcsr [{}]", in(reg) &mut before, in(reg) &flushing);
        }
        let hits = rays.iter().filter(|ray| self.hits(ray, any)).count();
        // SAFETY: as above.
        unsafe {
            std::arch::asm!("ldmxcsr [{}]", in(reg) &before);
        }
        hits
    }

    #[inline(always)]
    fn hits(&self, ray: &Ray, any: bool) -> bool {
        let mut query = RayHit {
            origin: ray.origin.to_array(),
            near: 0.0,
            direction: ray.direction.to_array(),
            time: 0.0,
            far: ray.t_max,
            mask: u32::MAX,
            id: 0,
            flags: 0,
            normal: [0.0; 3],
            barycentric: [0.0; 2],
            triangle: u32::MAX,
            geometry: u32::MAX,
            instances: [u32::MAX; 13],
        };
        let mut context = Context {
            flags: 0,
            filter: std::ptr::null_mut(),
            instances: [u32::MAX; 8],
        };
        let ray: Handle = (&raw mut query).cast();
        // Version 3 takes scene, context, ray; version 4 scene, ray, arguments.
        let (second, third) = if self.is_third {
            ((&raw mut context).cast(), ray)
        } else {
            (ray, std::ptr::null_mut())
        };
        let function = if any { self.occluded } else { self.intersect };
        // SAFETY: a committed scene of the library, which stays loaded as long as the program runs, and structures as
        // large as it writes.
        unsafe { function(self.scene, second, third) };
        if any {
            query.far < 0.0
        } else {
            query.geometry != u32::MAX
        }
    }
}
