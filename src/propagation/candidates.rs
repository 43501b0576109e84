//! Candidates made ready for all sources: a look at eight of them at once that few survive without a path.
//!
//! Unfolded, a path is one straight line from the source to the listener's image, and every surface on it a window that
//! the line has to pass: the surface's bounds, seen in the mirrors before it. Images and windows are the same for every
//! source, and whether a line passes a window costs a few products in single precision. Where reflections commute the
//! line itself says which mirror comes first; the window is then the hull of what it is in any order. Own. Refuses
//! nothing that [`super::image_source::unfold`] accepts: rounding is allowed for.

use glam::{DMat3, DVec3};

use super::image_source::{MARGIN_M, mirror_listener};
use super::path::MAX_ORDER;
use super::sequence::{Order, Sequence};
use crate::scene::{Scene, Surface};

/// Sequences that are looked at together.
const LANES: usize = 8;

/// Rounding of a sum of three products of single precision, relative to its largest term, four times over.
const ROUNDING: f64 = 16.0 * f32::EPSILON as f64;

/// Distance of an image from a plane below which no path goes there, in metres; keeps quotients finite.
const LEAST_DISTANCE_M: f64 = 1e-7;

type Lanes = [f32; LANES];

/// Eight surfaces, each seen from its sequence's image.
///
/// With D the line from image to source, `q = towards · D` is how far that leads beyond the plane, in units of the way to
/// it and negative if the plane lies between; the point in the plane is at `D / −q`.
#[derive(Debug, Clone, Copy)]
struct Windows {
    /// Unit normal over the image's distance from the plane.
    towards: [Lanes; 3],
    /// Axes that the window's bounds are parallel to.
    across: [[Lanes; 3]; 2],
    /// From the lower bounds to the image along these axes.
    low: [Lanes; 2],
    /// From the upper bounds to the image.
    high: [Lanes; 2],
    /// What rounding may do, as a share of image's and source's distance; infinite where there is no window.
    slack: Lanes,
}

impl Windows {
    /// Every line passes.
    const OPEN: Self = Self {
        towards: [[0.0; LANES]; 3],
        across: [[[0.0; LANES]; 3]; 2],
        low: [[0.0; LANES]; 2],
        high: [[0.0; LANES]; 2],
        slack: [f32::INFINITY; LANES],
    };

    /// Which lines pass, one a bit. `size` is the distance that rounding counts in.
    #[inline(always)]
    fn passed(&self, line: &[Lanes; 3], size: &Lanes) -> u32 {
        let mut passes = [0u32; LANES];
        for l in 0..LANES {
            let along = |axis: &[Lanes; 3]| {
                axis[0][l] * line[0][l] + axis[1][l] * line[1][l] + axis[2][l] * line[2][l]
            };
            let q = along(&self.towards);
            let [u, v] = [along(&self.across[0]), along(&self.across[1])];
            let slack = self.slack[l] * size[l];
            let inside = (q + 1.0 <= slack)
                & (u - self.low[0][l] * q >= -slack)
                & (u - self.high[0][l] * q <= slack)
                & (v - self.low[1][l] * q >= -slack)
                & (v - self.high[1][l] * q <= slack);
            passes[l] = u32::from(inside) << l;
        }
        passes.iter().fold(0, |all, bit| all | bit)
    }

    fn set(&mut self, lane: usize, window: &Window) {
        let put = |lanes: &mut [Lanes; 3], value: DVec3| {
            for (lanes, value) in lanes.iter_mut().zip(value.to_array()) {
                lanes[lane] = value as f32;
            }
        };
        put(&mut self.towards, window.towards);
        for k in 0..2 {
            put(&mut self.across[k], window.across[k]);
            self.low[k][lane] = window.low[k] as f32;
            self.high[k][lane] = window.high[k] as f32;
        }
        self.slack[lane] = window.slack as f32;
    }
}

/// A window of one sequence.
struct Window {
    towards: DVec3,
    across: [DVec3; 2],
    low: [f64; 2],
    high: [f64; 2],
    slack: f64,
}

/// A sequence's mirrors, and where the listener is seen in them.
struct Mirrors<'a> {
    surfaces: [&'a Surface; MAX_ORDER],
    /// Of each place those that come before it in every order, one a bit; and those that may come before or after.
    before: [u8; MAX_ORDER],
    aside: [u8; MAX_ORDER],
    image: DVec3,
    /// By how much commuting planes are not perpendicular.
    tilt: f64,
}

impl<'a> Mirrors<'a> {
    fn of(scene: &'a Scene, sequence: &Sequence, image: DVec3) -> Option<Self> {
        let first = scene.surface(*sequence.surfaces().first()?);
        let mut surfaces = [first; MAX_ORDER];
        for (slot, &surface) in surfaces.iter_mut().zip(sequence.surfaces()) {
            *slot = scene.surface(surface);
        }
        let order = Order::of(scene, sequence);
        let mut tilt = 0.0;
        for place in 1..sequence.len() {
            for earlier in 0..place {
                if order.commute(earlier, place) {
                    let (a, b) = (surfaces[earlier].normal, surfaces[place].normal);
                    tilt += a.dot(b).abs();
                }
            }
        }
        let before = order.before();
        Some(Self {
            surfaces,
            aside: order.aside(&before),
            before,
            image,
            tilt,
        })
    }

    /// The window at a place, seen through the mirrors that stand before it in every order. `view` is the last place's.
    fn window(&self, place: usize, view: &mut View) -> Window {
        let surface = self.surfaces[place];
        let main = main_axis(surface.normal);
        let [u, v] = [(main + 1) % 3, (main + 2) % 3];
        let before = self.before[place];
        if view.through & !before != 0 {
            *view = View::of(self.image);
        }
        // What the view lacks may come last: it is none of the others' mirrors.
        for mirror in 0..place {
            if (before & !view.through) >> mirror & 1 == 1 {
                view.add(mirror, self.surfaces[mirror]);
            }
        }
        let View { image, turned, .. } = *view;
        let (mut low, mut high) = (surface.bounds_min.as_dvec3(), surface.bounds_max.as_dvec3());
        if self.aside[place] != 0 {
            for mirror in (0..MAX_ORDER).rev() {
                if self.aside[place] >> mirror & 1 == 1 {
                    (low, high) = with_image(self.surfaces[mirror], low, high);
                }
            }
        }
        let distance_m = surface.distance_m(image);
        let distance_m = distance_m.abs().max(LEAST_DISTANCE_M).copysign(distance_m);
        let (low, high) = (image - low + MARGIN_M, image - high - MARGIN_M);
        let (low, high) = ([low[u], low[v]], [high[u], high[v]]);
        let widest = low[0]
            .abs()
            .max(low[1].abs())
            .max(high[0].abs().max(high[1].abs()));
        Window {
            towards: turned * surface.normal / distance_m,
            across: [turned.col(u), turned.col(v)],
            low,
            high,
            slack: (ROUNDING + 8.0 * self.tilt) * (1.0 + (1.0 + widest) / distance_m.abs()),
        }
    }
}

/// What is seen through some mirrors.
#[derive(Clone, Copy)]
struct View {
    /// Places of the mirrors, one a bit.
    through: u8,
    /// The listener's image on this side of them.
    image: DVec3,
    /// From directions on this side of them to the source's.
    turned: DMat3,
}

impl View {
    fn of(image: DVec3) -> Self {
        Self {
            through: 0,
            image,
            turned: DMat3::IDENTITY,
        }
    }

    fn add(&mut self, place: usize, mirror: &Surface) {
        self.through |= 1 << place;
        self.image = mirror.mirror(self.image);
        let n = mirror.normal;
        let normal = self.turned * n;
        self.turned.x_axis -= 2.0 * n.x * normal;
        self.turned.y_axis -= 2.0 * n.y * normal;
        self.turned.z_axis -= 2.0 * n.z * normal;
    }
}

/// Index of the component of largest size.
fn main_axis(normal: DVec3) -> usize {
    let n = normal.abs();
    if n.x >= n.y && n.x >= n.z {
        0
    } else if n.y >= n.z {
        1
    } else {
        2
    }
}

/// Bounds that hold a box and its mirror image.
fn with_image(mirror: &Surface, low: DVec3, high: DVec3) -> (DVec3, DVec3) {
    let middle = mirror.mirror(0.5 * (low + high));
    let half = 0.5 * (high - low);
    // |1 − 2 n nᵀ| times the half lengths: how far the mirrored box reaches along each axis.
    let n = mirror.normal;
    let row = |axis: DVec3, along: f64| (axis - 2.0 * along * n).abs().dot(half);
    let reach = DVec3::new(row(DVec3::X, n.x), row(DVec3::Y, n.y), row(DVec3::Z, n.z));
    (low.min(middle - reach), high.max(middle + reach))
}

/// Eight sequences.
#[derive(Debug, Clone)]
struct Pack {
    image: [Lanes; 3],
    /// The image's distance from the centre, roughly.
    size: Lanes,
    /// Windows of the longest sequence.
    depth: usize,
    windows: [Windows; MAX_ORDER],
}

impl Pack {
    const EMPTY: Self = Self {
        image: [[0.0; LANES]; 3],
        size: [0.0; LANES],
        depth: 0,
        windows: [Windows::OPEN; MAX_ORDER],
    };

    /// Sequences that may have a path from `source`, one a bit.
    #[inline]
    fn seen_from(&self, source: [f32; 3], source_size: f32) -> u32 {
        let mut line = [[0.0; LANES]; 3];
        let mut size = [0.0; LANES];
        for l in 0..LANES {
            for axis in 0..3 {
                line[axis][l] = source[axis] - self.image[axis][l];
            }
            size[l] = self.size[l] + source_size;
        }
        let mut left = (1 << LANES) - 1;
        for windows in &self.windows[..self.depth] {
            left &= windows.passed(&line, &size);
            if left == 0 {
                break;
            }
        }
        left
    }
}

/// A share of the guide rays' sequences, ready for every source.
#[derive(Debug)]
pub(super) struct Candidates {
    first: usize,
    images: Vec<DVec3>,
    packs: Vec<Pack>,
}

impl Candidates {
    /// Room for `capacity` sequences.
    pub(super) fn with_capacity(capacity: usize) -> Self {
        Self {
            first: 0,
            images: Vec::with_capacity(capacity),
            packs: Vec::with_capacity(capacity.div_ceil(LANES)),
        }
    }

    /// Makes sequences ready, the first of which is number `first` of all.
    pub(super) fn prepare(
        &mut self,
        scene: &Scene,
        sequences: &[Sequence],
        first: usize,
        ear: DVec3,
    ) {
        self.first = first;
        self.images.clear();
        self.packs.clear();
        for eight in sequences.chunks(LANES) {
            let mut pack = Pack::EMPTY;
            for (lane, sequence) in eight.iter().enumerate() {
                let image = mirror_listener(scene, sequence, ear);
                self.images.push(image);
                let Some(mirrors) = Mirrors::of(scene, sequence, image) else {
                    continue;
                };
                for (lanes, value) in pack.image.iter_mut().zip(image.to_array()) {
                    lanes[lane] = value as f32;
                }
                pack.size[lane] = size_m(image);
                pack.depth = pack.depth.max(sequence.len());
                let mut view = View::of(image);
                for place in 0..sequence.len() {
                    pack.windows[place].set(lane, &mirrors.window(place, &mut view));
                }
            }
            self.packs.push(pack);
        }
    }

    /// Calls `look` with the number and the listener's image of every sequence that may have a path from `source`.
    #[inline]
    pub(super) fn of_source(&self, source: DVec3, mut look: impl FnMut(usize, DVec3)) {
        let size = size_m(source);
        let from = source.as_vec3().to_array();
        for (pack, (number, images)) in self.packs.iter().zip(self.images.chunks(LANES).enumerate())
        {
            let mut left = pack.seen_from(from, size) & ((1 << images.len()) - 1);
            while left != 0 {
                let lane = left.trailing_zeros() as usize;
                left &= left - 1;
                look(self.first + number * LANES + lane, images[lane]);
            }
        }
    }
}

/// Metres that rounding of a place counts in; never nothing.
fn size_m(place: DVec3) -> f32 {
    1.0 + place.abs().element_sum() as f32
}

/// The listener's image of a sequence that only one source tries, if it may have a path from there.
pub(super) fn image_for_one(
    scene: &Scene,
    sequence: &Sequence,
    source: DVec3,
    ear: DVec3,
) -> Option<DVec3> {
    let image = mirror_listener(scene, sequence, ear);
    let surfaces = sequence.surfaces().iter().enumerate();
    let mut leads = surfaces.filter(|(place, _)| *place == 0 || sequence.can_lead(scene, *place));
    leads
        .any(|(_, &surface)| may_be_first(scene.surface(surface), source, image))
        .then_some(image)
}

/// Whether a flight from `source` to the image may meet this surface first.
fn may_be_first(surface: &Surface, source: DVec3, image: DVec3) -> bool {
    let (here, there) = (surface.distance_m(source), surface.distance_m(image));
    if here * there >= 0.0 {
        return false;
    }
    let point = source + (image - source) * (here / (here - there));
    super::image_source::near_bounds(surface, point)
}
