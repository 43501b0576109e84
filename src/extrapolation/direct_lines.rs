//! The direct field in the graphics frames that do not compute its edge waves.
//!
//! Audio side; one ray a source, and two for each edge at most. Edge waves in eight bands are most of the cost of a source's
//! direct field, and change little from one graphics frame to the next. The sources take turns: one frame of
//! [`super::GeometricSettings::exact_every`] computes a source's field, and the others extrapolate its paths linearly, as long as
//! source and listener move little. The straight path keeps its exact delay and direction in every frame, and whatever begins or
//! ceases to block it, or an edge, is seen at once.

use glam::Vec3;

use crate::acoustics::BANDS;
use crate::extrapolation::frame::FramePath;
use crate::extrapolation::geometric::JUMP_M;
use crate::extrapolation::line_extrapolation::{ExtrapolationReach, FrameTime, PathEnds, PathLine};
use crate::propagation::diffraction::{DirectField, MAX_DIRECT_EDGES, boundary_sides};
use crate::propagation::endpoints::Endpoints;
use crate::propagation::transmission::{is_blocked, unoccluded_path};
use crate::scene::{ListenerPose, Scene};

/// Greatest number of paths of a source's direct field: the straight one and edge waves.
pub(crate) const MAX_DIRECT_PATHS: usize = 1 + MAX_DIRECT_EDGES;

/// The field of one source where it was last computed.
#[derive(Debug, Clone)]
struct SourceField {
    /// Source and listener of the frame in which this field was last used.
    endpoints: Endpoints,
    used: u64,
    field: DirectField,
    /// [`boundary_sides`] of its edges.
    sides: [u32; MAX_DIRECT_EDGES],
    lines: [Option<PathLine>; MAX_DIRECT_PATHS],
}

/// The last computed fields of all sources, in the order of the frame's sources.
#[derive(Debug, Default)]
pub(super) struct DirectLines {
    fields: Vec<Option<SourceField>>,
    /// Scratch: the lines of the field before.
    before: Vec<PathLine>,
    now: FrameTime,
    reach: ExtrapolationReach,
}

impl DirectLines {
    /// Reserves capacity for this many sources. Control side.
    pub(super) fn reserve(&mut self, sources: usize) {
        self.fields.reserve(sources);
        self.before.reserve(MAX_DIRECT_PATHS);
    }

    /// Begins or resumes a graphics frame, which computes the fields of one source in [`ExtrapolationReach::every`].
    pub(super) fn begin(&mut self, sources: usize, reach: ExtrapolationReach, time_s: f64) {
        (self.reach, self.now.time_s) = (reach, time_s);
        match reach.every > 1 {
            true => self.fields.resize(sources, None),
            false => self.fields.clear(),
        }
    }

    /// Ends the graphics frame.
    pub(super) fn end(&mut self) {
        self.now.frame += 1;
    }

    /// Appends the paths of the source at `index` to `paths` and returns its field, or `None` if this frame has to compute it.
    pub(super) fn extrapolate<E: Iterator<Item = (u32, f64)>>(
        &mut self,
        index: usize,
        endpoints: &Endpoints,
        (scene, listener): (&Scene, &ListenerPose),
        listed: impl FnOnce() -> E,
        rays: &mut u64,
        paths: &mut Vec<FramePath>,
    ) -> Option<DirectField> {
        let own = self.fields.get_mut(index)?.as_mut()?;
        let frame = self.now.frame;
        let is_turn = frame
            .wrapping_add(index as u64)
            .is_multiple_of(self.reach.every.into());
        if is_turn || !own.continues(endpoints, frame) {
            return None;
        }
        // A wave that has changed its sign is not on the line through what it was.
        if own.sides != boundary_sides(scene, endpoints, &own.field.edges) {
            return None;
        }
        let reach = self.reach.frames(&own.endpoints, endpoints);
        (own.endpoints, own.used) = (*endpoints, frame);
        let is_blocked = is_blocked(scene, endpoints.from, endpoints.to, rays);
        if is_blocked == (own.field.through == [1.0; BANDS]) {
            return None;
        }
        if !own.field.seen.are_seen(scene, endpoints, listed(), rays) {
            return None;
        }
        let first = paths.len();
        let ends = PathEnds::of(endpoints, scene);
        for line in own.lines.iter().flatten() {
            let Some(mut path) = line.ahead((self.now, ends), reach) else {
                paths.truncate(first);
                return None;
            };
            if path.kind.is_straight() {
                let Endpoints { source, from, .. } = endpoints;
                let at = (*from, endpoints.to);
                let line = unoccluded_path(scene, source.id, at.0, at.1, endpoints.min_distance_m);
                let exact = FramePath::of(&line, *from, listener, scene);
                let amplitude = path.amplitude;
                path = FramePath { amplitude, ..exact };
            }
            paths.push(path);
        }
        Some(DirectField {
            waves: 0,
            ..own.field
        })
    }

    /// Stores the field of the source at `index` and its paths, which this frame has computed.
    pub(super) fn store(
        &mut self,
        (index, scene): (usize, &Scene),
        endpoints: &Endpoints,
        field: &DirectField,
        paths: &[FramePath],
    ) {
        let Some(own) = self.fields.get_mut(index) else {
            return;
        };
        let (now, every) = (self.now, self.reach.every.into());
        let frame = now.frame;
        let sides = boundary_sides(scene, endpoints, &field.edges);
        let is_before = |before: &&SourceField| {
            before.field.through == field.through
                && before.is_on_sides(field, &sides)
                && before.continues(endpoints, frame)
        };
        let before = own.as_ref().filter(is_before);
        let lines = before.into_iter().flat_map(|before| before.lines.iter());
        self.before.clear();
        self.before.extend(lines.flatten());
        // In place: a field is two kilobytes, most of them for edges that few sources are near.
        let own = own.get_or_insert_with(|| SourceField {
            endpoints: *endpoints,
            used: frame,
            field: *field,
            sides,
            lines: [None; MAX_DIRECT_PATHS],
        });
        (own.endpoints, own.used) = (*endpoints, frame);
        (own.field, own.sides) = (*field, sides);
        let ends = PathEnds::of(endpoints, scene);
        for (n, line) in own.lines.iter_mut().enumerate() {
            *line = paths.get(n).map(|path| {
                let before = self.before.iter().find(|line| line.id() == path.id);
                PathLine::through((path, 0), (now, ends), before, every)
            });
        }
    }
}

impl SourceField {
    /// Whether no edge that this field and a later one have in common has another side.
    fn is_on_sides(&self, later: &DirectField, sides: &[u32; MAX_DIRECT_EDGES]) -> bool {
        let own = self.field.edges.as_slice().iter().zip(&self.sides);
        let mut pairs = own.filter_map(|(edge, own)| {
            let index = later.edges.as_slice().iter().position(|new| new == edge)?;
            Some((own, sides[index]))
        });
        pairs.all(|(own, new)| *own == new)
    }

    /// Whether source and listener are those of the frame before, unchanged but for their motion and the mix.
    fn continues(&self, endpoints: &Endpoints, frame: u64) -> bool {
        let (own, new) = (&self.endpoints.source, &endpoints.source);
        let (a, b) = (&own.settings, &new.settings);
        let is_near = |a: Vec3, b: Vec3| a.distance_squared(b) <= JUMP_M * JUMP_M;
        own.id == new.id
            && (a.effects, a.directivity, a.radius_m) == (b.effects, b.directivity, b.radius_m)
            && frame <= self.used + 1
            && is_near(own.position, endpoints.from)
            && is_near(self.endpoints.to, endpoints.to)
    }
}
