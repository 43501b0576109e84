//! Throw-away: where `best` differs from the reference.
use std::collections::HashMap;
use std::sync::Arc;

use foresound::evaluation::cells::{self, Platform};
use foresound::evaluation::clip::load_clip;
use foresound::evaluation::{si_snr, talk};
use foresound::extrapolation::{BestSettings, FramePath, PredictorKind};
use foresound::generation::{GeneratorSettings, Hrtf};
use foresound::propagation::PropagationSettings;
use foresound::runtime::{Latency, OfflineRenderer, OfflineSettings, Poses, Schedule};
use foresound::scene::layout::Walk;
use foresound::scene::{ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, procedural};

const WEIGHT: [f64; 8] = [0.3, 1.0, 1.0, 1.0, 0.4, 0.1, 0.05, 0.02];
const HZ: [f64; 8] = [62.5, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0];

fn energy(p: &FramePath) -> f64 {
    (0..8).map(|b| WEIGHT[b] * f64::from(p.amplitude[b]).powi(2)).sum()
}

fn difference(a: &FramePath, b: &FramePath) -> (f64, f64) {
    let tau = a.delay_s - b.delay_s;
    let mut level = 0.0;
    let mut delay = 0.0;
    for i in 0..8 {
        let (x, y) = (f64::from(a.amplitude[i]), f64::from(b.amplitude[i]));
        level += WEIGHT[i] * (x - y).powi(2);
        delay += WEIGHT[i] * x * x * (2.0 - 2.0 * (std::f64::consts::TAU * HZ[i] * tau).cos());
    }
    let turn = (a.arrival - b.arrival).length_squared();
    (level, delay + f64::from(turn) * energy(a))
}

#[derive(Default, Clone)]
struct Sum {
    missing: f64,
    missing_n: u64,
    extra: f64,
    extra_n: u64,
    level: f64,
    delay: f64,
    total: f64,
    n: u64,
    flicker: f64,
    gap: f64,
}

fn env(name: &str, or: u64) -> u64 { std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(or) }

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let name = args[0].as_str();
    let count: usize = args[1].parse()?;
    let seconds: f64 = args[2].parse()?;
    let platform = if args.get(3).is_some_and(|p| p == "mobile") { Platform::Mobile } else { Platform::Workstation };
    let mut settings = BestSettings::FULL;
    if let Some(rays) = args.get(4) { settings.rays_per_source = rays.parse()?; }
    settings.nearby = env("NEARBY", 1) == 1;
    if env("MIDDLE", 0) == 1 { settings.lead = foresound::extrapolation::Lead::Middle; }
    settings.remembered_updates = env("REMEMBER", 8) as u32;
    let verbose = args.get(5).is_some();
    let benchmark = procedural::by_name(name).ok_or("scene")?;
    let scene = Arc::new(Scene::commit(&benchmark.mesh, &MaterialTable::built_in(), &SceneSettings::default())?);
    let pace = cells::pace(platform, name, count);
    let walk = Walk { from: benchmark.walk.from, to: benchmark.walk.to, speed_m_s: f64::from(benchmark.walk.speed_m_s), standing: benchmark.walk.standing };
    let clips: Vec<_> = (1..=count).map(|v| load_clip(std::path::Path::new(&format!("assets/speech/voice{v:02}.wav")), 44100).map(|c| c.0)).collect::<Result<_, _>>()?;
    let hrtf = Arc::new(Hrtf::builtin(44100)?);
    let make = |schedule, predictor| {
        let settings = OfflineSettings {
            graphics_rate_hz: pace.graphics_rate_hz,
            block_frames: 1024,
            schedule,
            predictor,
            propagation: PropagationSettings { seed: 1, guide_rays: env("GUIDE", 1024) as u32, cache_updates: env("CACHE", 16), ..Default::default() },
            generation: GeneratorSettings { rate_hz: 44100, max_sources: count, late: false, ..Default::default() },
        };
        OfflineRenderer::new(Arc::clone(&scene), Arc::clone(&hrtf), settings)
    };
    let mut reference = make(Schedule::Synchronous, PredictorKind::Hold)?;
    let mut best = make(Schedule::Asynchronous { level: pace.level, latency: Latency::Modelled }, PredictorKind::Best(settings))?;
    let mut kinds: HashMap<u64, (u8, u8)> = HashMap::new();
    let mut ears = [[Vec::new(), Vec::new()], [Vec::new(), Vec::new()]];
    let mut sums: HashMap<(u8, u8), Sum> = HashMap::new();
    let mut all_r: Vec<Vec<FramePath>> = Vec::new();
    let mut all_b: Vec<Vec<FramePath>> = Vec::new();
    let frames = (seconds * pace.graphics_rate_hz).ceil() as u64;
    let mut poses = Poses::default();
    for _ in 0..frames {
        poses.listener = ListenerPose::facing(walk.position_at(reference.time_s(), 0.0), 0.0);
        poses.sources.clear();
        for (slot, (_, place)) in (0u16..).zip(benchmark.sources.iter().take(count)) {
            poses.sources.push(SourcePose::at(SourceId::new(slot, 0), *place));
        }
        for (renderer, ears) in [&mut reference, &mut best].into_iter().zip(&mut ears) {
            renderer.next_frame(&poses, &mut |slot, from, samples| talk::spoken(&clips[slot], from, samples), &mut |block| {
                for s in block.chunks_exact(2) { ears[0].push(s[0]); ears[1].push(s[1]); }
                Ok(())
            })?;
            for p in &renderer.paths().paths { kinds.insert(p.id.0, (p.order, p.bends)); }
        }
        all_r.push(reference.frame_paths().paths.clone());
        all_b.push(best.frame_paths().paths.clone());
    }
    let snr = |i: usize, j: usize, a: usize, b: usize| si_snr::si_snr_ears_db([&ears[i][0][a..b], &ears[i][1][a..b]], [&ears[j][0][a..b], &ears[j][1][a..b]]);
    let length = ears[0][0].len();
    println!("SI-SNR {:.2} dB; dropped {} {}", snr(0, 1, 0, length), reference.report().dropped_paths, best.report().dropped_paths);
    let mut eps = best.report().extrapolation.clone(); eps.sort();
    let rays: u64 = 0;
    let _ = rays;
    println!("eps p50 {:?}  mean paths ref {} best {}", eps[eps.len() / 2], all_r.iter().map(Vec::len).sum::<usize>() / all_r.len(), all_b.iter().map(Vec::len).sum::<usize>() / all_b.len());
    // life of reference paths
    let mut alive: HashMap<u64, Vec<bool>> = HashMap::new();
    for (f, paths) in all_r.iter().enumerate() {
        for p in paths { alive.entry(p.id.0).or_insert_with(|| vec![false; all_r.len()])[f] = true; }
    }
    let mut total = 0.0;
    let mut by_frame = vec![0.0; all_r.len()];
    let mut born_ago: Vec<(f64, u64)> = vec![(0.0, 0); 64];
    let mut dead_ago: Vec<(f64, u64)> = vec![(0.0, 0); 64];
    for f in 0..all_r.len() {
        let r: HashMap<u64, &FramePath> = all_r[f].iter().map(|p| (p.id.0, p)).collect();
        let b: HashMap<u64, &FramePath> = all_b[f].iter().map(|p| (p.id.0, p)).collect();
        for (id, p) in &r {
            let kind = *kinds.get(id).unwrap_or(&(9, 9));
            let s = sums.entry(kind).or_default();
            let e = energy(p);
            total += e; s.total += e; s.n += 1;
            let mut err = 0.0;
            match b.get(id) {
                None => {
                    s.missing += e; s.missing_n += 1; err = e;
                    let life = &alive[id];
                    let since = (0..=f).rev().take_while(|&g| life[g]).count();
                    let ahead = (f..all_r.len()).take_while(|&g| life[g]).count();
                    if since + ahead < 5 { s.flicker += e; }
                    born_ago[since.min(63)].0 += e; born_ago[since.min(63)].1 += 1;
                }
                Some(q) => { let (l, d) = difference(p, q); s.level += l; s.delay += d; err += l + d; }
            }
            by_frame[f] += err;
        }
        for (id, p) in &b {
            if r.contains_key(id) { continue; }
            let kind = *kinds.get(id).unwrap_or(&(9, 9));
            let s = sums.entry(kind).or_default();
            let e = energy(p);
            s.extra += e; s.extra_n += 1; by_frame[f] += e;
            if let Some(life) = alive.get(id) {
                let since = (0..f).rev().take_while(|&g| !life[g]).count() + 1;
                let ahead = (f..all_r.len()).take_while(|&g| !life[g]).count();
                if since <= f && since + ahead < 6 { s.gap += e; }
                let k = if since > f { 63 } else { since.min(62) };
                dead_ago[k].0 += e; dead_ago[k].1 += 1;
            } else { dead_ago[0].0 += e; dead_ago[0].1 += 1; }
        }
    }
    let db = |e: f64| if e > 0.0 { 10.0 * (e / total).log10() } else { -999.0 };
    let mut list: Vec<_> = sums.iter().collect();
    list.sort_by(|a, b| a.0.cmp(b.0));
    println!("(order,bends)   total     missing(n)   extra(n)  level  delay flicker gap   [dB re all]");
    for (kind, s) in list {
        println!("{kind:?} {:7.1} {:8} | miss {:7.1} {:7} extra {:7.1} {:7} | level {:7.1} delay {:7.1} | flick {:7.1} gap {:7.1}", db(s.total), s.n, db(s.missing), s.missing_n, db(s.extra), s.extra_n, db(s.level), db(s.delay), db(s.flicker), db(s.gap));
    }
    let sum = |f: &dyn Fn(&Sum) -> f64| db(sums.values().map(f).sum());
    println!("ALL miss {:.1} extra {:.1} level {:.1} delay {:.1} flick {:.1} gap {:.1}", sum(&|s| s.missing), sum(&|s| s.extra), sum(&|s| s.level), sum(&|s| s.delay), sum(&|s| s.flicker), sum(&|s| s.gap));
    if verbose { println!("missing by frames since birth: {}", born_ago.iter().enumerate().filter(|(_, e)| e.1 > 0).map(|(i, e)| format!("{i}:{:.0}({})", db(e.0), e.1)).collect::<Vec<_>>().join(" "));
    println!("extra by frames since death (0: never in reference, 63: before birth): {}", dead_ago.iter().enumerate().filter(|(_, e)| e.1 > 0).map(|(i, e)| format!("{i}:{:.0}({})", db(e.0), e.1)).collect::<Vec<_>>().join(" ")); }
    let step = all_r.len().div_ceil(40);
    println!("per frame NSR: {}", by_frame.chunks(step).map(|c| format!("{:.0}", 10.0 * (c.iter().sum::<f64>() / (total * c.len() as f64 / all_r.len() as f64)).max(1e-12).log10())).collect::<Vec<_>>().join(" "));
    println!("per frame SNR: {}", (0..40).map(|i| format!("{:.0}", snr(0, 1, i * length / 40, (i + 1) * length / 40))).collect::<Vec<_>>().join(" "));
    if verbose {
        // worst single events: id, kind, runs
        let mut events: HashMap<(u64, bool), (f64, Vec<usize>)> = HashMap::new();
        for f in 0..all_r.len() {
            let r: HashMap<u64, &FramePath> = all_r[f].iter().map(|p| (p.id.0, p)).collect();
            let b: HashMap<u64, &FramePath> = all_b[f].iter().map(|p| (p.id.0, p)).collect();
            for (id, p) in &r { if !b.contains_key(id) { let e = events.entry((*id, false)).or_default(); e.0 += energy(p); e.1.push(f); } }
            for (id, p) in &b { if !r.contains_key(id) { let e = events.entry((*id, true)).or_default(); e.0 += energy(p); e.1.push(f); } }
        }
        let mut list: Vec<_> = events.into_iter().collect();
        list.sort_by(|a, b| b.1.0.total_cmp(&a.1.0));
        for ((id, extra), (e, frames)) in list.iter().take(40) {
            let life: String = match alive.get(id) { Some(l) => { let mut out = String::new(); let mut f = 0; while f < l.len() { if l[f] { let s = f; while f < l.len() && l[f] { f += 1; } out += &format!("{s}-{} ", f - 1); } f += 1; } out } None => "never".into() };
            let mut runs = String::new(); let mut i = 0; while i < frames.len() { let s = i; while i + 1 < frames.len() && frames[i + 1] == frames[i] + 1 { i += 1; } runs += &format!("{}-{} ", frames[s], frames[i]); i += 1; }
            println!("{:?} {} {:.1} dB at {} | alive {}", kinds.get(id), if *extra { "extra" } else { "missing" }, db(*e), runs, life);
        }
    }
    Ok(())
}
