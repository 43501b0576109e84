//! Validity and paths of a source's candidates.

use glam::DVec3;

use super::UpdateContext;
use crate::acoustics::{BANDS, BandArray};
use crate::propagation::amplitude;
use crate::propagation::diffraction::{NearEdges, reflection_gain};
use crate::propagation::endpoints::Endpoints;
use crate::propagation::image_source::image_path::{ImagePath, UnfoldedPath};
use crate::propagation::image_source::nearby_gate::NearbyGate;
use crate::propagation::image_source::occluder_cache::{Occluder, OccluderCache};
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::validation_queue::Unvalidated;
use crate::propagation::path::{MAX_DIFFRACTION_ORDER, MAX_ORDER, Path};
use crate::scene::Scene;

/// Shared input of the validation of a source's candidates.
#[derive(Debug, Clone, Copy)]
pub(super) struct SourceQuery<'a> {
    pub(super) context: &'a UpdateContext<'a>,
    pub(super) endpoints: Endpoints,
    /// Source and listener in local coordinates.
    pub(super) ends: [DVec3; 2],
    pub(super) near_edges: &'a NearEdges,
}

impl SourceQuery<'_> {
    /// Whether an unfolded candidate is unoccluded and its points lie on its surfaces. The last occluder is tested first: it
    /// most likely blocks again, and the test is cheaper than that of the points.
    pub(super) fn is_valid(
        &self,
        candidate: &Unvalidated,
        last: Option<Occluder>,
        occluders: &mut OccluderCache,
        rays: &mut u64,
    ) -> bool {
        let (scene, unfolded) = (self.context.scene, &candidate.unfolded);
        let legs = unfolded.legs();
        !last.is_some_and(|occluder| occluder.blocks(scene, legs, self.ends))
            && unfolded.lies_on_surfaces(scene)
            && occluders.is_clear(scene, candidate.hash, legs, self.ends, rays)
    }

    /// A valid path: a single reflection has the waves of the edges beside it.
    pub(super) fn valid_path(&self, sequence: &Sequence, unfolded: &mut UnfoldedPath) -> Path {
        let mut path = self.path(sequence, unfolded, amplitude::reflected);
        if path.order == 1 {
            let (scene, edges) = (self.context.scene, self.near_edges.reflections.edges());
            let gain = reflection_gain(scene, &self.endpoints, path.surfaces[0], edges);
            for (value, gain) in path.amplitude.iter_mut().zip(gain.unwrap_or([1.0; BANDS])) {
                *value *= gain;
            }
        }
        path
    }

    /// A nearby path: without occlusion and as if surfaces had no ends. `reflected` is the energy that its reflections leave, if it is
    /// known. `None` if the gate leaves it out, else its estimated energy is added to `estimates`.
    pub(super) fn nearby_path(
        &self,
        sequence: &Sequence,
        unfolded: &mut UnfoldedPath,
        reflected: Option<f32>,
        (gate, estimates): (NearbyGate, &mut Vec<f32>),
    ) -> Option<Path> {
        let square_m2 = self.ends[0].distance_squared(unfolded.listener_image()) as f32;
        let (energies, scene) = (self.context.energies, self.context.scene);
        let reflected = reflected.unwrap_or_else(|| energies.reflected(scene, sequence));
        gate.passes(reflected, square_m2).then(|| {
            estimates.push(reflected / square_m2);
            self.path(sequence, unfolded, amplitude::reflected_unbounded)
        })
    }

    /// The path of the source along an unfolded sequence.
    fn path(
        &self,
        sequence: &Sequence,
        unfolded: &mut UnfoldedPath,
        amplitude: impl Fn(&Scene, &ImagePath, f64) -> BandArray,
    ) -> Path {
        let Self {
            context,
            ref endpoints,
            ..
        } = *self;
        let (scene, source) = (context.scene, self.ends[0]);
        let path = unfolded.finish(scene, [source, unfolded.listener_image()]);
        let pose = &endpoints.source;
        let mut amplitude = amplitude(scene, path, endpoints.min_distance_m);
        // Those beyond the path's order are of other candidates.
        let mut points = [scene.to_world(DVec3::ZERO); MAX_ORDER];
        let mut surfaces = [0; MAX_ORDER];
        for step in 0..path.order {
            points[step] = scene.to_world(path.points[step]);
            surfaces[step] = path.surfaces[step];
        }
        let departure = (path.points[0] - source).as_vec3();
        amplitude::apply_directivity(&mut amplitude, pose, departure);
        Path {
            id: sequence.path_id(scene, pose.id),
            source: pose.id,
            order: path.order as u8,
            diffraction_order: 0,
            surfaces,
            edges: [0; MAX_DIFFRACTION_ORDER],
            points,
            image: scene.to_world(path.image),
            length_m: path.length_m as f32,
            amplitude,
        }
    }
}
