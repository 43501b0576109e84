//! `view`: a scene in the browser, live. One page on the loopback interface: walk by keys, drag sources and doors, see paths
//! by order and level and the late reverb by direction, hear the engine.
//!
//! Three kinds of threads: the app's, which ticks the engine sixty times a second ([`simulation`]); the engine's own; and a
//! few that answer the page's requests ([`server`]).

mod heard;
mod server;
mod simulation;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use foresound::Result;
use foresound_tools::listener_path::parse_position;
use glam::Vec3;

use crate::inputs::{SceneArguments, load_scene, predictor_named, print_notes, within};
use server::Server;
use simulation::{Simulation, Wanted};

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Scene: a benchmark scene's name or a mesh file, with or without a layout beside it.
    #[arg(default_value = "concert_hall")]
    scene: PathBuf,
    #[command(flatten)]
    intake: SceneArguments,
    /// Speaking sources, 1 to 16; those of the layout, or around the middle of the scene.
    #[arg(long, default_value_t = 4)]
    sources: usize,
    /// A door of 0.9 x 2.06 m: the foot of its hinge, x,y,z. Closed, it lies along +z; may be given several times.
    #[arg(long = "door", value_name = "X,Y,Z")]
    doors: Vec<String>,
    /// Predictor: hold, linear or best.
    #[arg(long, default_value = "best")]
    predictor: String,
    /// Port of the page on 127.0.0.1; 0 takes a free one.
    #[arg(long, default_value_t = 8033)]
    port: u16,
    /// Length in seconds; without it until Ctrl-C.
    #[arg(long)]
    seconds: Option<f64>,
    /// Print the page's address as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    within("--sources", arguments.sources as f64, 1.0..=16.0, "")?;
    let doors = arguments.doors.iter();
    let doors = doors.map(|text| parse_position("--door", text));
    let doors = doors.collect::<Result<Vec<Vec3>>>()?;
    let loaded = load_scene(&arguments.scene, &arguments.intake)?;
    print_notes(&loaded.notes);
    let wanted = Wanted {
        sources: arguments.sources,
        doors,
        predictor: predictor_named(&arguments.predictor)?,
    };
    let (simulation, shared) = Simulation::new(&loaded, &wanted)?;
    let server = Server::open(arguments.port, Arc::clone(&loaded.scene), shared)?;
    if arguments.json {
        outln!("{}", serde_json::json!({ "url": server.url() }));
    } else {
        outln!("{}", server.url());
        eprintln!("open it in a browser; Ctrl-C ends");
    }
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        server.answer(scope, &stop);
        let length = arguments
            .seconds
            .map(|seconds| Duration::from_secs_f64(seconds.clamp(0.0, 1e6)));
        let result = simulation.keep_going(length);
        stop.store(true, Ordering::Release);
        result
    })
}
