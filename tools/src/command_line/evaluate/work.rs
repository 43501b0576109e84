//! All units' results, on as many threads as the machine has cores.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;

use foresound::Result;
use foresound_tools::cells::RendererKind;

use super::plan::Unit;
use super::stage::{Props, Stage};
use super::unit::{self, UnitResult};
use crate::progress::Progress;

/// Results of all units in their order. The longest are started first to keep all threads busy to the end. No
/// result depends on the others or on the threads.
pub(super) fn all_results(
    units: &[Unit],
    stages: &BTreeMap<String, Stage>,
    props: &Props,
) -> Result<Vec<UnitResult>> {
    let is_real = |index: &usize| units[*index].renderer == RendererKind::EngineReal;
    let (real, mut order): (Vec<usize>, Vec<usize>) = (0..units.len()).partition(is_real);
    order.sort_by_key(|&index| (std::cmp::Reverse(units[index].weight()), index));
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    let next = AtomicUsize::new(0);
    let stop = AtomicBool::new(false);
    let mut results: Vec<Option<UnitResult>> = vec![None; units.len()];
    let total = units.iter().map(Unit::weight).sum();
    let mut progress = Progress::new("evaluate", total);
    std::thread::scope(|scope| -> Result<()> {
        let (sender, receiver) = mpsc::channel();
        for _ in 0..workers.min(order.len()) {
            let (sender, next, stop, order) = (sender.clone(), &next, &stop, &order);
            scope.spawn(move || {
                while !stop.load(Ordering::Relaxed) {
                    let turn = next.fetch_add(1, Ordering::Relaxed);
                    let Some(&index) = order.get(turn) else {
                        break;
                    };
                    let unit = &units[index];
                    let Some(stage) = stages.get(&unit.scene) else {
                        break;
                    };
                    let result = unit::result(unit, stage, props);
                    if sender.send((index, result)).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        for (index, result) in receiver {
            if result.is_err() {
                stop.store(true, Ordering::Relaxed);
            }
            let (result, kept) = result?;
            results[index] = Some(result);
            progress.advance(units[index].weight(), kept);
        }
        Ok(())
    })?;
    // The engine by the clock has the machine to itself.
    for index in real {
        let unit = &units[index];
        if let Some(stage) = stages.get(&unit.scene) {
            let (result, kept) = unit::result(unit, stage, props)?;
            results[index] = Some(result);
            progress.advance(unit.weight(), kept);
        }
    }
    Ok(results.into_iter().flatten().collect())
}
