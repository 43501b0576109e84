//! The result of an update, from those of its sources.

use super::Propagator;
use crate::propagation::diffraction::{MAX_DIRECT_EDGES, MAX_REFLECTED_EDGE_PATHS};
use crate::propagation::diffuse::late_directions::set_directions;
use crate::propagation::path::{Path, PathSet};
use crate::propagation::source_task::SourceTask;
use crate::scene::SourcePose;

impl Propagator {
    /// Merges the results of the tasks.
    pub(super) fn collect(&mut self, sources: &[SourcePose], result: &mut PathSet) {
        let (tasks, order) = (&self.tasks[..sources.len()], &mut self.order);
        collect_sorted(tasks, |task| &task.paths, order, &mut result.paths);
        collect_sorted(tasks, |task| &task.nearby, order, &mut result.nearby);
        result.direct_edges.clear();
        result.direct_edges.reserve(tasks.len() * MAX_DIRECT_EDGES);
        result.reflection_edges.clear();
        let most = tasks.len() * MAX_REFLECTED_EDGE_PATHS;
        result.reflection_edges.reserve(most);
        result.edge_limits.clear();
        result.edge_limits.reserve(tasks.len());
        for (pose, task) in sources.iter().zip(tasks) {
            let edges = task.near_edges.direct.as_slice().iter();
            let edges = edges.map(|edge| (pose.id, *edge));
            result.direct_edges.extend(edges);
            let edges = task.near_edges.reflections.edges();
            let edges = edges.map(|edge| (pose.id, edge));
            result.reflection_edges.extend(edges);
            let limits = (pose.id, task.near_edges.limits);
            result.edge_limits.push(limits);
        }
        result.late.clear();
        let late = || tasks.iter().filter_map(|task| task.latest_late.as_ref());
        result.late.extend(late().map(|late| late.energy));
        result.late_groups = self.listener_field.groups;
        set_directions(&mut result.late_groups, late().map(|late| &late.directions));
        result.predicted_groups.clear();
        result.predicted_positions.clear();
        result.predicted_late.clear();
        result.predicted_sources.clear();
        let count = self.predicted.len();
        let is_complete = tasks.iter().all(|t| t.predicted_late.len() == count);
        let predicted = self.predicted.iter().filter(|_| is_complete);
        for (index, there) in predicted.enumerate() {
            result.predicted_positions.push(there.position);
            let late = || tasks.iter().map(|task| &task.predicted_late[index]);
            result.predicted_late.extend(late().map(|late| late.energy));
            let mut groups = there.field.groups;
            set_directions(&mut groups, late().map(|late| &late.directions));
            result.predicted_groups.push(groups);
            let position = |(index, pose): (usize, &SourcePose)| {
                there.sources.get(index).copied().unwrap_or(pose.position)
            };
            let positions = sources.iter().enumerate().map(position);
            result.predicted_sources.extend(positions);
        }
        result.instances.clear();
        result.instances.extend(self.scene.instance_poses());
        result.sources.clear();
        result.sources.extend_from_slice(sources);
        let guide_rays: u64 = self.shares.iter().map(|share| share.rays).sum();
        result.rays = guide_rays + tasks.iter().map(|task| task.rays).sum::<u64>();
    }
}

/// Parts of the identities, a power of two.
const BUCKETS: usize = 256;

/// Merges one list of all tasks, sorted by identity. `order` is scratch memory: identity, task and index of each path as one number,
/// which is compared faster than three.
fn collect_sorted(
    tasks: &[SourceTask],
    list: impl Fn(&SourceTask) -> &Vec<Path>,
    order: &mut Vec<u128>,
    result: &mut Vec<Path>,
) {
    // Identities are hashes, so parts of a few paths have the same first bits, and sorting those takes a third of sorting all.
    let bucket = |path: &Path| (path.id.0 >> (u64::BITS - BUCKETS.ilog2())) as usize % BUCKETS;
    let mut ends = [0; BUCKETS];
    for path in tasks.iter().flat_map(&list) {
        ends[bucket(path)] += 1;
    }
    let mut count = 0;
    for end in &mut ends {
        count += std::mem::replace(end, count);
    }
    order.clear();
    order.resize(count, 0);
    for (number, task) in (0u128..).zip(tasks) {
        for (index, path) in (0u128..).zip(list(task)) {
            let end = &mut ends[bucket(path)];
            order[*end] = u128::from(path.id.0) << 64 | number << 32 | index;
            *end += 1;
        }
    }
    let mut start = 0;
    for end in ends {
        order[start..end].sort_unstable();
        start = end;
    }
    result.clear();
    // Engines have half a dozen sets. A quarter more: a walking listener seldom causes an allocation.
    if result.capacity() < order.len() {
        result.reserve_exact(order.len() + order.len() / 4);
    }
    let path = |key: &u128| list(&tasks[(*key >> 32) as u32 as usize])[*key as u32 as usize];
    result.extend(order.iter().map(path));
}
