//! One step of propagation at run time: newest orders, newest poses, one update, off to the renderer.
//!
//! Runs on whichever thread calls [`Worker::step`]: the propagation thread alone, or the app's and its helpers in the
//! synchronous schedule. Allocates while a scene is new; frees what the renderer has retired.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use crossbeam_utils::atomic::AtomicCell;

use super::messages::{Delivery, WorldFrame};
use super::statistics::{Meters, add};
use crate::extrapolation::{Continuation, Extrapolator, PredictorKind};
use crate::propagation::{Path, Propagator};
use crate::runtime::clock::{nanoseconds, now};
use crate::runtime::handover::{Receiver, Sender};
use crate::runtime::workers::Threads;

/// The newest propagator that the controller wants used: for another scene, or with other settings.
pub(super) type Orders = Arc<AtomicCell<Option<Box<Propagator>>>>;

/// Propagation with its ends of the handovers.
pub(super) struct Worker {
    pub(super) propagator: Box<Propagator>,
    pub(super) orders: Orders,
    pub(super) world: Receiver<WorldFrame>,
    pub(super) deliveries: Sender<Delivery>,
    pub(super) meters: Arc<Meters>,
    pub(super) max_paths: usize,
    pub(super) synchronous: bool,
    /// Who traces, besides the thread that steps.
    pub(super) tracers: Threads,
    pub(super) before_update: Option<fn(u64)>,
    /// The poses in use.
    pub(super) newest: Option<Box<WorldFrame>>,
    /// The predictor that the renderer has or will have got.
    pub(super) predictor: PredictorKind,
    /// Extrapolation for a new scene, waiting for its first update.
    pub(super) extrapolator: Option<Box<Extrapolator>>,
    pub(super) update: u64,
}

/// Extrapolation for a propagator's scene, with room for as many paths as there may be.
pub(super) fn extrapolator_for(
    propagator: &Propagator,
    kind: PredictorKind,
    max_paths: usize,
) -> Box<Extrapolator> {
    let nearest_m = propagator.settings().nearest_m;
    let mut extrapolator = Extrapolator::new(Arc::clone(propagator.scene()), kind, nearest_m);
    extrapolator.reserve(max_paths);
    Box::new(extrapolator)
}

impl Worker {
    /// Computes an update if there are new poses or a new order; tells whether it did.
    pub(super) fn step(&mut self) -> bool {
        let ordered = self.take_order();
        let posed = self.take_poses();
        let Some(world) = self.newest.take_if(|_| ordered || posed) else {
            return false;
        };
        if let Some(before_update) = self.before_update {
            before_update(self.update);
        }
        let mut delivery = self.deliveries.blank(Delivery::default);
        let started = now();
        self.propagator.update_with(
            &self.tracers,
            &world.listener,
            &world.sources,
            world.time_s,
            &mut delivery.paths,
        );
        let spent = started.elapsed();
        let trimmed = keep_loudest(&mut delivery.paths.paths, self.max_paths);
        delivery.propagation_s = spent.as_secs_f64();
        delivery.synchronous = self.synchronous;
        delivery.extrapolator = self.extrapolator.take();
        delivery.predictor = (world.predictor != self.predictor)
            .then(|| Continuation::with_room(world.predictor, self.max_paths));
        self.predictor = world.predictor;
        self.newest = Some(world);
        self.update += 1;
        self.meters.propagation.record(spent);
        add(&self.meters.trimmed_paths, trimmed as u64);
        let latest_ns = nanoseconds(spent);
        self.meters
            .propagation_ns
            .store(latest_ns, Ordering::Relaxed);
        self.send(delivery);
        true
    }

    fn take_order(&mut self) -> bool {
        let Some(ordered) = self.orders.take() else {
            return false;
        };
        let before = std::mem::replace(&mut self.propagator, ordered);
        let same_scene = Arc::ptr_eq(before.scene(), self.propagator.scene())
            && before.settings().nearest_m == self.propagator.settings().nearest_m;
        if !same_scene {
            let kind = self.predictor;
            self.extrapolator = Some(extrapolator_for(&self.propagator, kind, self.max_paths));
        }
        true
    }

    fn take_poses(&mut self) -> bool {
        let Some(world) = self.world.take() else {
            return false;
        };
        if let Some(old) = self.newest.replace(world) {
            self.world.give_back(old);
        }
        true
    }

    /// Sends an update, with what an earlier one that nobody took had brought along.
    fn send(&mut self, mut delivery: Box<Delivery>) {
        if let Some(mut missed) = self.deliveries.recall() {
            if delivery.extrapolator.is_none() {
                delivery.extrapolator = missed.extrapolator.take();
            }
            if delivery.predictor.is_none() {
                delivery.predictor = missed.predictor.take();
            }
            self.deliveries.keep(missed);
        }
        self.deliveries.send(delivery);
    }
}

/// Drops the quietest paths beyond a limit, keeps the order, and gives the number dropped.
fn keep_loudest(paths: &mut Vec<Path>, most: usize) -> usize {
    let dropped = paths.len().saturating_sub(most);
    if dropped > 0 {
        let energy = |path: &Path| path.amplitude.iter().map(|a| a * a).sum::<f32>();
        paths.select_nth_unstable_by(most, |a, b| {
            energy(b)
                .total_cmp(&energy(a))
                .then_with(|| a.id.cmp(&b.id))
        });
        paths.truncate(most);
        paths.sort_unstable_by_key(|path| path.id);
    }
    dropped
}
