//! Reflections of wide sources: the mean level and the image of their points' mirror images.
//!
//! Audio side; allocates nothing; some ten operations a point and reflected path. Own.
//!
//! A reflected path is that of the source's centre. The mirror images of the points are as far from the listener as the points are
//! from the mirrored listener, who is on the path's departure at its length: so the mean level needs no surface, at any order.
//! Directions do; of one reflection the surface is normal to the line from the source to its image (of a curved surface its tangent
//! plane). Later reflections are farther away and have the centre's direction. Visibility is the centre's at every order: tests of each point would multiply an update's rays
//! by the points.

use std::f32::consts::PI;

use glam::Vec3;

use super::frame::{FramePath, PathKind, WideArrival};
use crate::propagation::diffraction::PointImage;
use crate::scene::{MAX_EXTENT_POINTS, SourcePose};

/// Most reflections of a source that have an image of their own width: the floor and two walls. The nearest count.
pub(crate) const MAX_WIDE_REFLECTIONS: usize = 3;

/// Mean semi-axis over distance from which an image is wider than what listeners can tell from a point ahead: 2 degrees.
const LEAST_WIDTH: f32 = 0.035;

/// A wide source in a graphics frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct WideSource<'a> {
    pose: &'a SourcePose,
    /// From the centre to each point.
    offsets: [Vec3; MAX_EXTENT_POINTS],
    count: usize,
    /// Distance in metres below which the level of a point source of these settings is constant.
    min_distance_m: f32,
    speed_m_s: f64,
    listener: Vec3,
}

impl<'a> WideSource<'a> {
    /// A source with points, for a listener.
    pub(super) fn new(
        pose: &'a SourcePose,
        points: &PointImage,
        listener: Vec3,
        [min_distance_m, speed_m_s]: [f64; 2],
    ) -> Self {
        let (mut offsets, mut count) = ([Vec3::ZERO; MAX_EXTENT_POINTS], 0);
        for (offset, (point, _)) in offsets.iter_mut().zip(points.points()) {
            *offset = point - pose.position;
            count += 1;
        }
        Self {
            pose,
            offsets,
            count,
            min_distance_m: min_distance_m as f32,
            speed_m_s,
            listener,
        }
    }

    /// Gives the source's reflections the mean level of all points, and the nearest ones their width; returns their number.
    pub(super) fn widen(&self, paths: &mut [FramePath], wide: &mut Vec<WideArrival>) -> usize {
        let mut widened = 0;
        for index in 0..paths.len() {
            if !self.has_reflection(&paths[index]) {
                continue;
            }
            widened += 1;
            let gain = self.gain(&paths[index]);
            let path = &mut paths[index];
            path.amplitude = path.amplitude.map(|amplitude| gain * amplitude);
            if path.order == 1 && self.is_among_nearest(&paths[index], paths) {
                wide.extend(self.arrival(&paths[index]));
            }
        }
        widened
    }

    fn has_reflection(&self, path: &FramePath) -> bool {
        path.source == self.pose.id && path.kind == PathKind::Reflected
    }

    fn length_m(&self, path: &FramePath) -> f32 {
        (path.delay_s * self.speed_m_s) as f32
    }

    fn offsets(&self) -> &[Vec3] {
        &self.offsets[..self.count]
    }

    /// Mean semi-axis in metres.
    fn mean_m(&self) -> f32 {
        self.pose.settings.extent.semi_axes_m.element_sum() / 3.0
    }

    /// Amplitude of the points' mean energy over that of the centre. As in the direct field, levels are constant nearer to a point
    /// than half of the distance between points.
    fn gain(&self, path: &FramePath) -> f32 {
        let length_m = self.length_m(path);
        let listener_image = path.departure * length_m;
        let count = self.count as f32;
        let least_m = self.min_distance_m.max(self.mean_m() * (PI / count).sqrt());
        let least_square = least_m * least_m;
        let mut sum = 0.0;
        for offset in self.offsets() {
            sum += 1.0 / offset.distance_squared(listener_image).max(least_square);
        }
        let mean = sum / count;
        let gain = mean.sqrt() * length_m.max(self.min_distance_m);
        if gain.is_finite() { gain } else { 1.0 }
    }

    /// Whether fewer than [`MAX_WIDE_REFLECTIONS`] single reflections of the source are nearer.
    fn is_among_nearest(&self, path: &FramePath, paths: &[FramePath]) -> bool {
        let is_nearer = |other: &&FramePath| {
            let order = other.delay_s.total_cmp(&path.delay_s);
            other.order == 1
                && self.has_reflection(other)
                && order.then(other.id.cmp(&path.id)).is_lt()
        };
        paths.iter().filter(is_nearer).count() < MAX_WIDE_REFLECTIONS
    }

    /// Directions of the mirror images of the points; `None` for an image as narrow as a point.
    fn arrival(&self, path: &FramePath) -> Option<WideArrival> {
        let length_m = self.length_m(path);
        if self.mean_m() < LEAST_WIDTH * length_m {
            return None;
        }
        let image = self.listener + path.arrival * length_m;
        let normal = (image - self.pose.position).try_normalize()?;
        let mirrored = self.offsets().iter().map(|&offset| {
            let position = image + offset - 2.0 * offset.dot(normal) * normal;
            let squared = position.distance_squared(self.listener);
            (position, squared.max(self.min_distance_m.powi(2)).recip())
        });
        WideArrival::of(path.id, mirrored, self.listener)
    }
}
