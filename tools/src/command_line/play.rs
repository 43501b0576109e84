//! `play`: a benchmark scene on the sound device, live; the listener walks by the keyboard. Feature `play`.
//!
//! The main thread is the app: it reads keys, ticks sixty times a second, polls the device and draws the meter.

use std::io::{IsTerminal, Write, stderr, stdin};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use crossterm::event::{Event, KeyCode, KeyEvent, KeyModifiers, poll, read};
use crossterm::terminal::{disable_raw_mode, enable_raw_mode, size};
use foresound::extrapolation::PredictorKind;
use foresound::runtime::device::{CpalBackend, DeviceState, NullDeviceSettings, Supervisor};
use foresound::runtime::{
    Controller, Engine, EngineSchedule, EngineSettings, EngineState, TraceLog,
};
use foresound::scene::ListenerPose;
use foresound::{Error, Result};
use glam::Vec3;

use crate::inputs::{
    LoadedScene, SceneArguments, load_scene, predictor_named, print_notes, voice, within,
};
use crate::traces::write_trace;
use crate::walker::{Pressed, Walker};

/// The app's graphics frame.
const GRAPHICS_FRAME: Duration = Duration::from_micros(16_667);
/// Graphics frames between two drawings of the meter.
const METER_FRAMES: u64 = 12;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Scene: a benchmark scene's name or a mesh file with a layout beside it.
    #[arg(long, default_value = "concert_hall")]
    scene: PathBuf,
    /// Speaking sources, 1 to 256; more than sixteen share slots.
    #[arg(long, default_value_t = 4)]
    sources: usize,
    /// Predictor: hold, linear or best.
    #[arg(long, default_value = "best")]
    predictor: String,
    /// Longest propagation update in milliseconds; detail is reduced to keep it.
    #[arg(long, value_name = "MS")]
    update_ms: Option<f64>,
    /// Share of a core that propagation and sound may take.
    #[arg(long, value_name = "SHARE")]
    core_share: Option<f64>,
    /// Audio frames a block.
    #[arg(long, default_value_t = 256)]
    block: usize,
    /// Length in seconds; without it until a key ends it.
    #[arg(long)]
    seconds: Option<f64>,
    /// Write a trace of all threads' work for Perfetto.
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
}

/// The terminal without line buffering, until this is dropped.
struct RawTerminal(bool);

impl RawTerminal {
    fn begin() -> Self {
        Self(stdin().is_terminal() && enable_raw_mode().is_ok())
    }
}

impl Drop for RawTerminal {
    fn drop(&mut self) {
        if self.0 {
            let _given_back = disable_raw_mode();
        }
    }
}

struct Session {
    controller: Controller,
    device: Supervisor<CpalBackend>,
    heard: DeviceState,
    walker: Walker,
    log: TraceLog,
    schedule: EngineSchedule,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let mut session = Session::open(arguments)?;
    let terminal = RawTerminal::begin();
    if terminal.0 {
        eprint!(
            "walk: W A S D or arrows, Q E turn; 1 2 3 hold linear best, B baseline, space pauses, X ends\r\n"
        );
    } else {
        eprintln!("no terminal for keys: the listener takes the scene's own walk");
    }
    let result = session.keep_going(arguments, terminal.0);
    drop(terminal);
    eprintln!();
    result?;
    match &arguments.trace {
        Some(file) => write_trace(file, &session.log),
        None => Ok(()),
    }
}

impl Session {
    fn open(arguments: &Arguments) -> Result<Self> {
        within("--sources", arguments.sources as f64, 1.0..=256.0, "")?;
        // A rate that has a built-in HRTF set.
        let rate_hz = match CpalBackend::preferred_rate_hz() {
            Some(48_000) => 48_000,
            _ => 44_100,
        };
        let mut settings = EngineSettings::default();
        settings.generation.rate_hz = rate_hz;
        settings.generation.max_sources = arguments.sources.min(16);
        settings.max_sources = Some(arguments.sources);
        settings.predictor = predictor_named(&arguments.predictor)?;
        settings.budget.update_s = arguments.update_ms.map(|ms| 1e-3 * ms);
        settings.budget.core_share = arguments.core_share;
        settings.block_frames = arguments.block;
        settings.trace_spans = if arguments.trace.is_some() {
            1 << 14
        } else {
            0
        };
        let loaded = load_scene(Path::new(&arguments.scene), &SceneArguments::default())?;
        print_notes(&loaded.notes);
        let null_device = NullDeviceSettings {
            rate_hz,
            block_frames: settings.block_frames,
            affinity: settings.affinity,
        };
        let (mut controller, mut renderer) = Engine::new(settings)?;
        controller.set_scene(Arc::clone(&loaded.scene))?;
        add_voices(&mut controller, &loaded, arguments.sources, rate_hz)?;
        let fill = move |block: &mut [f32]| {
            renderer.render(block);
        };
        Ok(Self {
            controller,
            device: Supervisor::new(CpalBackend::new(rate_hz), fill, Some(null_device)),
            heard: DeviceState::Playing,
            walker: Walker::new(&loaded),
            log: TraceLog::default(),
            schedule: EngineSchedule::Asynchronous,
        })
    }

    #[expect(clippy::disallowed_methods, reason = "an app keeps time")]
    fn keep_going(&mut self, arguments: &Arguments, by_keys: bool) -> Result<()> {
        let began = Instant::now();
        let mut due = began;
        for frame in 0u64.. {
            let time_s = began.elapsed().as_secs_f64();
            if arguments.seconds.is_some_and(|end_s| time_s >= end_s) {
                break;
            }
            if by_keys && !self.keys()? {
                break;
            }
            let listener = match by_keys {
                true => self.walker.step(GRAPHICS_FRAME.as_secs_f32()),
                false => self.walker.follow(time_s),
            };
            self.controller.tick(listener, &[])?;
            if self.controller.state() == EngineState::PropagationFailed {
                self.controller.restart()?;
            }
            self.poll_device(time_s);
            if arguments.trace.is_some() {
                self.controller.collect_spans(&mut self.log);
            }
            if frame % METER_FRAMES == 0 {
                self.draw(listener);
            }
            due += GRAPHICS_FRAME;
            let rest = due.saturating_duration_since(Instant::now());
            if rest.is_zero() {
                due = Instant::now();
            }
            thread::sleep(rest);
        }
        Ok(())
    }

    /// Reports when the device is lost or found.
    fn poll_device(&mut self, time_s: f64) {
        let state = self.device.poll(time_s);
        let same = std::mem::discriminant(&state) == std::mem::discriminant(&self.heard);
        match &state {
            DeviceState::Waiting { because, .. } if !same => {
                eprint!("\r\x1b[Kno sound: {because}; waiting for a device\r\n");
            }
            DeviceState::Playing if !same => eprint!("\r\x1b[Kthe device is playing\r\n"),
            _ => {}
        }
        self.heard = state;
    }

    /// Takes the keys pressed since last time; false to end.
    fn keys(&mut self) -> Result<bool> {
        let failed = |error: std::io::Error| {
            Error::engine(
                format!("no keys: {error}"),
                "give --seconds and no terminal",
            )
        };
        while poll(Duration::ZERO).map_err(failed)? {
            let Event::Key(key) = read().map_err(failed)? else {
                continue;
            };
            if !self.key(key)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn key(&mut self, key: KeyEvent) -> Result<bool> {
        let ends = key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL);
        let pressed = match key.code {
            _ if ends => return Ok(false),
            KeyCode::Char('x') | KeyCode::Esc => return Ok(false),
            KeyCode::Char('w') | KeyCode::Up => Pressed::Ahead,
            KeyCode::Char('s') | KeyCode::Down => Pressed::Back,
            KeyCode::Char('a') => Pressed::Left,
            KeyCode::Char('d') => Pressed::Right,
            KeyCode::Char('q') | KeyCode::Left => Pressed::TurnLeft,
            KeyCode::Char('e') | KeyCode::Right => Pressed::TurnRight,
            KeyCode::Char(digit @ '1'..='3') => {
                let number = digit as usize - '1' as usize;
                self.controller.set_predictor(PredictorKind::ALL[number]);
                return Ok(true);
            }
            KeyCode::Char('b') => {
                self.schedule = match self.schedule {
                    EngineSchedule::Asynchronous => EngineSchedule::Synchronous,
                    EngineSchedule::Synchronous => EngineSchedule::Asynchronous,
                };
                self.controller.set_schedule(self.schedule)?;
                return Ok(true);
            }
            KeyCode::Char(' ') => {
                match self.controller.state() {
                    EngineState::Paused => self.controller.resume(),
                    _ => self.controller.pause(),
                }
                return Ok(true);
            }
            _ => return Ok(true),
        };
        self.walker.press(pressed);
        Ok(true)
    }

    fn draw(&self, listener: ListenerPose) {
        let statistics = self.controller.statistics();
        let settings = self.controller.settings();
        let period_s = settings.block_frames as f64 / f64::from(settings.generation.rate_hz);
        let Vec3 { x, y, z } = listener.position;
        let meter = format!(
            "{:5.1} FPS  T_SPS {:6.2} ms  L {:2}  quality {}  {:4} paths  block {:3.0} % (worst {:3.0} %)  {} missed  {:6}  at {x:.1} {y:.1} {z:.1}",
            1.0 / statistics.graphics_frame_s.max(1e-3),
            1e3 * statistics.propagation_s,
            statistics.extrapolation_level,
            statistics.quality_level.0,
            statistics.paths,
            100.0 * statistics.block.p50_s / period_s,
            100.0 * statistics.block.worst_s / period_s,
            statistics.missed_deadlines,
            settings.predictor.name(),
        );
        // A line that wraps could not be drawn over.
        let columns = size().map_or(80, |(columns, _)| usize::from(columns));
        let shown: String = meter.chars().take(columns.saturating_sub(1)).collect();
        eprint!("\r\x1b[K{shown}");
        let _drawn = stderr().flush();
    }
}

/// Adds speaking sources at the layout's positions; further ones are beside these.
fn add_voices(
    controller: &mut Controller,
    loaded: &LoadedScene,
    count: usize,
    rate_hz: u32,
) -> Result<()> {
    let positions = loaded.sources();
    if positions.is_empty() {
        let advice = "give a layout beside it (TOML), or a benchmark scene";
        return Err(Error::setting(
            "--scene",
            "the scene names no sources",
            advice,
        ));
    }
    let voices = (0..count.min(16)).map(|number| Ok(voice(number, rate_hz)?.samples.into()));
    let voices = voices.collect::<Result<Vec<Arc<[f32]>>>>()?;
    for number in 0..count {
        let round = (number / positions.len()) as f32;
        let beside = 0.4 * round * Vec3::new(round.cos(), 0.0, round.sin());
        let id = controller.add_source(positions[number % positions.len()] + beside)?;
        controller.play(id, Arc::clone(&voices[number % voices.len()]), true)?;
    }
    Ok(())
}
