//! Every user error ends in one line with its location and advice, with exit code 2, and leaves no partial
//! output.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use hound::{SampleFormat, WavSpec, WavWriter};

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, text).expect("written");
        path
    }

    /// A tetrahedron, around the point (0.5, 0.5, 0.5).
    fn room(&self) -> PathBuf {
        let text = "usemtl plaster\nv 0 0 0\nv 6 0 0\nv 0 6 0\nv 0 0 6\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n";
        self.write("room.obj", text)
    }

    fn wav(&self, name: &str, channels: u16, bits_per_sample: u16) -> PathBuf {
        let spec = WavSpec {
            channels,
            sample_rate: 44_100,
            bits_per_sample,
            sample_format: SampleFormat::Int,
        };
        let mut writer = WavWriter::create(self.path(name), spec).expect("a WAV");
        for n in 0..4410 * i32::from(channels) {
            writer.write_sample((n * 37 % 199) - 99).expect("a sample");
        }
        writer.finalize().expect("a whole WAV");
        self.path(name)
    }
}

fn foresound(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_foresound"))
        .args(arguments)
        .output()
        .expect("the program runs")
}

/// Exit code 2, nothing on standard output, and a last line on standard error that has all `parts`.
fn refused(arguments: &[&str], parts: &[&str]) {
    let output = foresound(arguments);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
    assert!(
        output.stdout.is_empty(),
        "{arguments:?}: {}",
        String::from_utf8_lossy(&output.stdout)
    );
    let errors: Vec<&str> = text
        .lines()
        .filter(|line| !line.starts_with("note: "))
        .collect();
    assert_eq!(errors.len(), 1, "{arguments:?}: {text}");
    for part in parts {
        assert!(
            errors[0].contains(part),
            "{arguments:?}: {:?} lacks {part:?}",
            errors[0]
        );
    }
    assert!(!text.contains("panicked"), "{text}");
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

#[test]
fn an_invalid_scene_is_refused_with_its_location() {
    let folder = Folder::new();
    refused(
        &["inspect", text(&folder.path("gone.obj"))],
        &["gone.obj", ";"],
    );
    refused(
        &["inspect", text(folder.0.path())],
        &[text(folder.0.path()), ";"],
    );
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    for (name, body, location) in [
        ("broken.obj", "v 0 zero 0\nf 1 2 3\n", "broken.obj:1"),
        (
            "index.obj",
            &*format!("{vertices}f 1 2 3\nf 1 2 9\n"),
            "index.obj:6",
        ),
        ("zero.obj", &*format!("{vertices}f 0 1 2\n"), "zero.obj:5"),
        (
            "nan.obj",
            &*format!("v nan 0 0\n{vertices}f 1 2 3\nf 2 3 4\n"),
            "nan.obj:1",
        ),
        ("empty.obj", "", "empty.obj"),
        ("faceless.obj", vertices, "faceless.obj"),
        ("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "one.obj"),
        (
            "far.obj",
            "v 0 0 0\nv 1e9 0 0\nv 0 1e9 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n",
            "far.obj",
        ),
        ("binary.obj", "\0\u{1}\u{2}v 1", "binary.obj"),
    ] {
        let path = folder.write(name, body);
        refused(&["inspect", text(&path)], &[location, ";"]);
    }
    let room = folder.room();
    for (option, value) in [
        ("--scale", "0"),
        ("--scale", "nan"),
        ("--scale", "-1"),
        ("--up", "w"),
    ] {
        refused(&["inspect", text(&room), option, value], &[";"]);
    }
}

#[test]
fn invalid_materials_are_refused_with_their_line() {
    let folder = Folder::new();
    let room = folder.room();
    for (name, body, location) in [
        ("syntax.toml", "[materials.plaster\n", "syntax.toml:1"),
        (
            "seven.toml",
            "[materials.plaster]\nabsorption = [0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1]\n",
            "seven.toml:2",
        ),
        (
            "range.toml",
            "[materials.plaster]\nabsorption = 1.5\n",
            "range.toml:2",
        ),
        (
            "nan.toml",
            "[materials.plaster]\nabsorption = nan\n",
            "nan.toml:2",
        ),
        (
            "key.toml",
            "[materials.plaster]\nabsorbtion = 0.1\n",
            "key.toml",
        ),
    ] {
        let path = folder.write(name, body);
        refused(
            &["inspect", text(&room), "--materials", text(&path)],
            &[location, ";"],
        );
    }
    refused(
        &[
            "inspect",
            text(&room),
            "--materials",
            text(&folder.path("gone.toml")),
        ],
        &["gone.toml", ";"],
    );
}

#[test]
fn invalid_sounds_listeners_and_outputs_are_refused() {
    let folder = Folder::new();
    let room = folder.room();
    let voice = folder.wav("voice.wav", 1, 16);
    let out = folder.path("out.wav");
    let good = format!("0.5,0.5,0.5={}", text(&voice));
    let render = |source: &str, listener: &str, more: &[&str], parts: &[&str]| {
        let mut arguments = vec![
            "render",
            "--scene",
            text(&room),
            "--source",
            source,
            "--listener",
            listener,
            "--out",
            text(&out),
        ];
        arguments.extend(more);
        refused(&arguments, parts);
        assert!(!out.exists(), "{arguments:?} left a file");
    };
    for source in [
        "voice.wav",
        "1,2=voice.wav",
        "1,2,x=voice.wav",
        "1,2,nan=voice.wav",
        "1,2,3=",
    ] {
        render(source, "1,1,1", &[], &["--source", ";"]);
    }
    for (name, channels, bits) in [("stereo.wav", 2, 16), ("eight.wav", 1, 8)] {
        let sound = folder.wav(name, channels, bits);
        render(
            &format!("1,1,1={}", text(&sound)),
            "1,1,1",
            &[],
            &[name, ";"],
        );
    }
    let noise = folder.write("noise.wav", "this is no sound");
    render(
        &format!("1,1,1={}", text(&noise)),
        "1,1,1",
        &[],
        &["noise.wav", ";"],
    );
    render(
        &format!("1,1,1={}", text(&folder.path("gone.wav"))),
        "1,1,1",
        &[],
        &["gone.wav", ";"],
    );
    render(&good, "1,1", &[], &[";"]);
    render(&good, "1,inf,1", &[], &["--listener", ";"]);
    for (name, body, location) in [
        ("columns.csv", "a,b\n1,2\n", "columns.csv:2"),
        ("order.csv", "t,x,y,z\n1,1,1,1\n0,1,1,1\n", "order.csv:3"),
        (
            "thrice.csv",
            "t,x,y,z\n0,1,1,1\n0,2,1,1\n0,2,1,1\n",
            "thrice.csv:4",
        ),
        ("case.csv", "t,x,y,z,Yaw\n0,1,1,1,90\n", "case.csv:1"),
        ("roll.csv", "t,x,y,z,roll\n0,1,1,1,5\n", "roll.csv:1"),
        ("word.csv", "t,x,y,z\n0,1,1,one\n", "word.csv:2"),
        ("nan.csv", "t,x,y,z\n0,1,nan,1\n", "nan.csv:2"),
        ("none.csv", "t,x,y,z\n", "none.csv"),
    ] {
        let path = folder.write(name, body);
        render(&good, text(&path), &[], &[location, ";"]);
    }
    for (option, value) in [
        ("--schedule", "later"),
        ("--predictor", "oracle"),
        ("--rate", "8000"),
        ("--graphics-rate", "0"),
        ("--seconds", "-1"),
        ("--seconds", "nan"),
        ("--level", "5000"),
        ("--level", "few"),
    ] {
        render(&good, "1,1,1", &[option, value], &[";"]);
    }
    let inside_a_file = format!("{}/out.wav", text(&voice));
    refused(
        &[
            "render",
            "--scene",
            text(&room),
            "--source",
            &good,
            "--listener",
            "1,1,1",
            "--out",
            &inside_a_file,
        ],
        &["voice.wav", "folder"],
    );
    for inputs in [[text(&room), text(&voice)], [text(&voice), text(&room)]] {
        // An output that is an input, by any name.
        let dotted = folder
            .path("./")
            .join(inputs[0].rsplit('/').next().unwrap_or_default());
        for name in [inputs[0], text(&dotted)] {
            let before = fs::read(name).expect("is there");
            let render = ["render", "--scene", text(&room), "--source", &good];
            let rest = ["--listener", "1,1,1", "--out", name];
            refused(&[&render[..], &rest].concat(), &["is an input", ";"]);
            assert_eq!(fs::read(name).expect("is there"), before);
        }
    }
    let new_folder = format!("{}/", text(&folder.path("new")));
    let wall_clock = std::time::SystemTime::now();
    refused(
        &[
            "render",
            "--scene",
            "concert_hall",
            "--source",
            &good,
            "--listener",
            "1,1,1",
            "--seconds",
            "30000",
            "--out",
            &new_folder,
        ],
        &["is a folder", ";"],
    );
    // Hours of sound would take hours.
    assert!(
        wall_clock
            .elapsed()
            .is_ok_and(|passed| passed.as_secs() < 120)
    );
    for (path, problem) in [
        ("voice", "no path"),
        ("2=a.csv", "\"2\""),
        ("a=a.csv", "\"a\""),
    ] {
        render(
            &good,
            "1,1,1",
            &["--source-path", path],
            &["--source-path", problem, ";"],
        );
    }
    refused(&["demo", "--out", &inside_a_file], &["voice.wav", "folder"]);
    refused(&["validate", "--law", "murphy"], &["murphy", "shoebox"]);
    refused(&["sing"], &["sing"]);
    refused(&["render"], &["--scene"]);
}

#[test]
fn user_files_are_rendered() {
    let folder = Folder::new();
    let (room, voice, out) = (
        folder.room(),
        folder.wav("voice.wav", 1, 16),
        folder.path("new/out.wav"),
    );
    let walk = folder.write(
        "walk.csv",
        "t, x, y, z, yaw\n0, 0.5, 0.5, 0.5, 0\n0.3, 1.0, 0.8, 0.6, 90\n",
    );
    let source = format!("1.2,1.1,0.9={}", text(&voice));
    let arguments = [
        "render",
        "--scene",
        text(&room),
        "--source",
        &source,
        "--listener",
        text(&walk),
    ];
    let output = foresound(&[&arguments[..], &["--out", text(&out), "--json"]].concat());
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert!(
        json["paths_p50"].as_u64().is_some_and(|paths| paths > 1),
        "{json}"
    );
    let reader = hound::WavReader::open(&out).expect("a WAV");
    assert_eq!(
        (reader.spec().channels, reader.spec().sample_rate),
        (2, 44_100)
    );
    let loudest = reader
        .into_samples::<f32>()
        .map(|s| s.expect("a sample").abs())
        .fold(0.0, f32::max);
    assert!(loudest > 1e-4 && loudest <= 1.0, "{loudest}");
    assert_eq!(
        fs::read_dir(folder.path("new")).expect("a folder").count(),
        1,
        "no partial file is left"
    );
}

/// Loudness of each quarter of a rendering of one second.
fn quarters(folder: &Folder, arguments: &[&str]) -> [f64; 4] {
    let out = folder.path("moved.wav");
    let common = [
        "--seconds",
        "1",
        "--loop",
        "--schedule",
        "synchronous",
        "--out",
        text(&out),
    ];
    let output = foresound(&[&["render"], arguments, &common].concat());
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let reader = hound::WavReader::open(&out).expect("a WAV");
    let samples = reader.into_samples::<f32>();
    let samples: Vec<f32> = samples.map(|s| s.expect("a sample")).collect();
    std::array::from_fn(|k| {
        let part = &samples[k * samples.len() / 4..(k + 1) * samples.len() / 4];
        let energy: f64 = part.iter().map(|s| f64::from(*s).powi(2)).sum();
        (energy / part.len() as f64).sqrt()
    })
}

/// A source that moves away by its path is as one from which the listener moves away, but for the time of emission; rows of one
/// time are a jump of either.
#[test]
fn sources_and_listeners_move_and_jump_by_their_paths() {
    let folder = Folder::new();
    // The ground alone: what is heard is the distance.
    let field = folder.write(
        "field.obj",
        "usemtl acoustic_ceiling\nv -90 0 -90\nv 90 0 -90\nv 90 0 90\nv -90 0 90\nf 1 2 3\nf 1 3 4\n",
    );
    let voice = folder.wav("voice.wav", 1, 16);
    let [near, far] = ["1,1.6,0", "30,1.6,0"];
    let jump = folder.write(
        "jump.csv",
        "t,x,y,z\n0,30,1.6,0\n0.5,30,1.6,0\n0.5,1,1.6,0\n1,1,1.6,0\n",
    );
    let walk = folder.write("walk.csv", "t,x,y,z\n0,1,1.6,0\n1,30,1.6,0\n");
    let at = |position: &str| format!("{position}={}", text(&voice));
    let heard = |source: &str, listener: &str, path: Option<&Path>| {
        let source = at(source);
        let given = [
            "--scene",
            text(&field),
            "--source",
            &source,
            "--listener",
            listener,
        ];
        let path = path.map(|path| format!("1={}", text(path)));
        let moves = path.iter().flat_map(|path| ["--source-path", path]);
        quarters(&folder, &given.into_iter().chain(moves).collect::<Vec<_>>())
    };
    let origin = "0,1.6,0";
    let [standing, distant] = [heard(near, origin, None), heard(far, origin, None)];
    assert!(standing[3] > 15.0 * distant[3], "{standing:?} {distant:?}");
    for jumped in [
        heard(near, origin, Some(&jump)),
        heard(origin, text(&jump), None),
    ] {
        // Whole before and after; a block and the delay lie between.
        let [first, _, _, last] = jumped;
        assert!(
            (first / distant[0] - 1.0).abs() < 0.05,
            "{jumped:?} {distant:?}"
        );
        assert!(
            (last / standing[3] - 1.0).abs() < 0.05,
            "{jumped:?} {standing:?}"
        );
    }
    let walked = heard(near, origin, Some(&walk));
    let fled = heard(origin, text(&walk), None);
    // The sound of a source that recedes was emitted nearer by.
    let nearer = 1.0 + 29.0 / 343.4;
    for k in 0..4 {
        assert!(
            (walked[k] / (nearer * fled[k]) - 1.0).abs() < 0.05,
            "{walked:?} {fled:?}"
        );
    }
    assert!(
        walked[0] > 2.0 * walked[1] && walked[1] > walked[3],
        "{walked:?}"
    );
}

#[test]
fn bounds_have_no_rounding_dust() {
    let folder = Folder::new();
    let mesh = folder.write(
        "dust.obj",
        "v -2.1191e-15 0 -0.0\nv 6 0 0\nv 0 6 -1e-12\nv 0 0 6\nf 1 2 3\nf 1 3 4\n",
    );
    for more in [&[][..], &["--json"]] {
        let output = foresound(&[&["inspect", text(&mesh)], more].concat());
        let printed = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(
            !printed.contains("-0") && !printed.contains("e-"),
            "{printed}"
        );
    }
    let output = foresound(&["inspect", text(&mesh)]);
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(printed.contains("[0, 0, 0] to [6, 6, 6] m"), "{printed}");
}

#[test]
fn unknown_materials_are_reported() {
    let folder = Folder::new();
    let room = folder.write(
        "odd.obj",
        "usemtl unobtainium\nv 0 0 0\nv 6 0 0\nv 0 6 0\nv 0 0 6\nf 1 2 3\nf 1 3 4\n",
    );
    let output = foresound(&["inspect", text(&room), "--json"]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("unobtainium"));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(json["defaulted_materials"][0], "unobtainium");
    assert_eq!(
        (json["triangles"].as_u64(), json["surfaces"].as_u64()),
        (Some(2), Some(2))
    );
    assert_eq!(
        (json["edges"].as_u64(), json["closed"].as_bool()),
        (Some(5), Some(false))
    );
}

#[test]
fn a_saved_scene_is_read_like_its_mesh() {
    let folder = Folder::new();
    let room = folder.room();
    let saved = folder.path("saved.fscene");
    let output = foresound(&["commit", text(&room), "--out", text(&saved), "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(json["triangles"], 4);
    assert_eq!(json["bytes"], fs::metadata(&saved).expect("a file").len());
    let inspected = |file: &Path| {
        let output = foresound(&["inspect", text(file), "--json"]);
        assert!(output.status.success());
        output.stdout
    };
    assert_eq!(inspected(&saved), inspected(&room));
    let own = [": is a saved scene, whose scale, axis and materials are settled;"];
    refused(&["inspect", text(&saved), "--scale", "2"], &own);
    refused(
        &["commit", text(&room), "--out", text(&room)],
        &["is an input of this command"],
    );
    let half = folder.path("half.fscene");
    let bytes = fs::read(&saved).expect("read");
    fs::write(&half, &bytes[..bytes.len() / 2]).expect("written");
    refused(
        &["inspect", text(&half)],
        &["half.fscene: the saved scene is damaged or cut off;"],
    );
    let other = folder.write("model.fbx", "Kaydara FBX Binary  ");
    refused(
        &["inspect", text(&other)],
        &["model.fbx: is an FBX file, which is not read;"],
    );
}

#[test]
fn a_wall_with_two_doors_has_the_area_of_its_outline() {
    let folder = Folder::new();
    // 6 by 3 m without two doors of 0.9 by 2.1 m.
    let outline = "v 1 0 0\nv 1 2.1 0\nv 1.9 2.1 0\nv 1.9 0 0\nv 4 0 0\nv 4 2.1 0\nv 4.9 2.1 0\nv 4.9 0 0\n\
                   v 6 0 0\nv 6 3 0\nv 0 3 0\nv 0 0 0\n";
    let corners: Vec<usize> = (1..=12).collect();
    for first in 0..12 {
        let mut face = corners.clone();
        face.rotate_left(first);
        let face: Vec<String> = face.iter().map(usize::to_string).collect();
        let path = folder.write("wall.obj", &format!("{outline}f {}\n", face.join(" ")));
        let output = foresound(&["inspect", text(&path), "--json"]);
        let value: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let area_m2 = value["area_m2"].as_f64().expect("an area");
        let expected_m2 = 6.0 * 3.0 - 2.0 * 0.9 * 2.1;
        assert!(
            (area_m2 - expected_m2).abs() < 1e-5,
            "{area_m2} m²: {face:?}"
        );
    }
}

#[test]
fn a_soak_reports_its_findings() {
    let output = foresound(&["soak", "--minutes", "0.02", "--sources", "2", "--json"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{output:?}");
    let found: serde_json::Value = serde_json::from_str(&text).expect("one JSON object");
    for key in [
        "blocks",
        "missed",
        "p50_share",
        "p999_share",
        "worst_share",
        "swaps",
        "sources_added",
        "rss_mb_start",
        "rss_mb_end",
    ] {
        assert!(found[key].is_number(), "{key} in {text}");
    }
    assert_eq!(found["allocations"], 0);
    refused(&["soak", "--minutes", "nan"], &["--minutes"]);
    for count in ["0", "257"] {
        refused(&["soak", "--sources", count], &["--sources", "1 to 256"]);
    }
    for count in ["4097", "100000"] {
        let update = ["bench", "update", "--scene", "doorway", "--sources", count];
        refused(&update, &["--sources", "4096"]);
    }
}

#[test]
fn a_speed_bench_prints_all_keys_and_writes_a_valid_trace() {
    let folder = Folder::new();
    let trace = folder.path("trace.json");
    let output = foresound(&[
        "bench",
        "speed",
        "--scene",
        "doorway",
        "--sources",
        "2",
        "--seconds",
        "0.1",
        "--json",
        "--trace",
        text(&trace),
    ]);
    assert!(output.status.success(), "{output:?}");
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert!(found["machine"].is_object());
    let row = &found["rows"][0];
    for key in [
        "/graphics_ms",
        "/sync_fps",
        "/async_fps",
        "/speedup",
        "/sps_ms/p50",
        "/sps_ms/p95",
        "/eps_us/p50",
        "/sgs_us/p50",
        "/direct_us/p50",
        "/level/p50",
        "/level/p95",
        "/paths_p50",
        "/rays_per_update",
        "/sps_two_threads_ms/p50",
        "/rays_alone_ms",
        "/moving_sources_ms/p50",
        "/moving_sources_two_threads_ms/p50",
        "/update_to_rays",
    ] {
        let value = row.pointer(key).and_then(serde_json::Value::as_f64);
        assert!(value.is_some_and(f64::is_finite), "{key} of {row}");
    }
    let traced = std::fs::read_to_string(&trace).expect("is there");
    let traced: serde_json::Value = serde_json::from_str(&traced).expect("JSON");
    let events = traced["traceEvents"].as_array().expect("events");
    for name in ["tick", "update (SPS)", "block"] {
        assert!(events.iter().any(|event| event["name"] == name), "{name}");
    }
    refused(&["bench", "speed", "--load", "0"], &["--load"]);
    refused(&["bench", "speed", "--level", "deep"], &["--level"]);
    refused(
        &["bench", "speed", "--predictor", "magic"],
        &["--predictor"],
    );
}

/// Standard output of a command that succeeds.
fn printed(arguments: &[&str]) -> String {
    let output = foresound(arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {said}");
    String::from_utf8(output.stdout).expect("text")
}

#[test]
fn an_impulse_response_has_named_bands_a_broadband_row_and_a_picture() {
    let folder = Folder::new();
    let (room, out, plot) = (
        folder.room(),
        folder.path("rir.wav"),
        folder.path("decay.png"),
    );
    let places = ["--source", "1,1,1", "--listener", "1.5,1,1"];
    let arguments = [
        &[
            "rir",
            "--scene",
            text(&room),
            "--out",
            text(&out),
            "--seconds",
            "3",
            "--plot",
            text(&plot),
        ],
        &places[..],
    ]
    .concat();
    let table = printed(&arguments);
    for word in ["  125 ", " 1000 ", "T20", "T30", "broadband"] {
        assert!(table.contains(word), "{table} lacks {word:?}");
    }
    assert!(fs::read(&plot).expect("a picture").starts_with(b"\x89PNG"));
    let json = printed(&[&arguments[..], &["--json"]].concat());
    let value: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(
        value["bands_hz"],
        serde_json::json!([63, 125, 250, 500, 1000, 2000, 4000, 8000])
    );
    for key in ["t20_s", "t30_s", "edt_s", "c50_db", "c80_db", "d50"] {
        assert_eq!(value[key].as_array().expect(key).len(), 8);
        assert!(!value["broadband"][key].is_null(), "{key}: {json}");
    }
}

#[test]
fn materials_are_listed_and_near_names_suggested() {
    assert!(printed(&["materials"]).contains("wood_panel"));
    let json = printed(&["materials", "concrete", "--json"]);
    let value: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(
        value["materials"][0]["absorption"]
            .as_array()
            .expect("a list")
            .len(),
        8
    );
    refused(
        &["materials", "WoodPanel"],
        &["WoodPanel", "wood_panel is near"],
    );
    refused(&["materials", "xyzzy"], &["foresound materials"]);
    let folder = Folder::new();
    let mesh = folder.write(
        "panels.obj",
        "usemtl WoodPanel\nv 0 0 0\nv 6 0 0\nv 0 6 0\nv 0 0 6\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n",
    );
    let output = foresound(&["inspect", text(&mesh)]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("wood_panel is near"), "{said}");
    let quiet = foresound(&["inspect", text(&mesh), "--quiet"]);
    assert!(quiet.stderr.is_empty() && quiet.stdout == output.stdout);
    let verbose = foresound(&["--verbose", "inspect", text(&mesh)]);
    let said = String::from_utf8_lossy(&verbose.stderr);
    assert!(said.contains("4 triangles"), "{said}");
    let shown = String::from_utf8_lossy(&output.stdout);
    assert!(shown.contains("kB") && !shown.contains("0.0 MB"), "{shown}");
}

#[test]
fn outputs_that_are_no_wav_file_are_refused() {
    let folder = Folder::new();
    let room = folder.room();
    let voice = folder.wav("voice.wav", 1, 16);
    let source = format!("1,1,1={}", text(&voice));
    for out in [
        "-",
        text(&folder.path("out.flac")),
        text(&folder.path("out.mp3")),
    ] {
        let files = [
            "--scene",
            text(&room),
            "--listener",
            "1.5,1,1",
            "--out",
            out,
        ];
        refused(
            &[&["render", "--source", &*source][..], &files].concat(),
            &[".wav"],
        );
        refused(
            &[&["rir", "--source", "1,1,1"][..], &files].concat(),
            &[".wav"],
        );
    }
}

#[test]
fn a_rendering_tells_its_peak_and_places_without_sound() {
    let folder = Folder::new();
    let (room, out) = (folder.room(), folder.path("out.wav"));
    let voice = folder.wav("voice.wav", 1, 16);
    let render = |source: &str| {
        let source = format!("{source}={}", text(&voice));
        let arguments = [
            "render",
            "--scene",
            text(&room),
            "--source",
            &source,
            "--listener",
            "1.5,1,1",
            "--out",
            text(&out),
            "--seconds",
            "0.3",
            "--loop",
            "--json",
        ];
        let output = foresound(&arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let value: serde_json::Value = serde_json::from_slice(&output.stdout).expect(&said);
        (value, said)
    };
    let (within, said) = render("1,1,1");
    assert!(!said.contains("note:"), "{said}");
    let samples = hound::WavReader::open(&out)
        .expect("a WAV")
        .into_samples::<f32>();
    let peak = samples
        .map(|sample| sample.expect("a sample").abs())
        .fold(0.0, f32::max);
    let told_db = within["peak_db"].as_f64().expect("a number");
    assert!(
        (told_db - 20.0 * f64::from(peak).log10()).abs() < 1e-6,
        "{told_db} {peak}"
    );
    assert_eq!(within["clipped_samples"], 0);
    assert_eq!(
        (&within["layout"], &within["channels"]),
        (&"binaural".into(), &2.into())
    );
    let (_, said) = render("-3,1,1");
    assert!(
        said.contains("outside the scene") && said.contains("closed surface"),
        "{said}"
    );
}

#[test]
fn a_rendering_has_the_channels_of_its_layout() {
    let folder = Folder::new();
    let (room, out) = (folder.room(), folder.path("out.wav"));
    let source = format!("1,1,1={}", text(&folder.wav("voice.wav", 1, 16)));
    let render = |layout: &str| {
        foresound(&[
            "render",
            "--scene",
            text(&room),
            "--source",
            &source,
            "--listener",
            "1.5,1,1",
            "--out",
            text(&out),
            "--seconds",
            "0.3",
            "--loop",
            "--layout",
            layout,
            "--json",
        ])
    };
    let masks = [3, 3, 4, 0x3f, 0x63f, 0x2d63f, 0, 0, 0];
    for (layout, mask) in foresound::Layout::ALL.iter().zip(masks) {
        let output = render(layout.name());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let told: serde_json::Value = serde_json::from_slice(&output.stdout).expect(&said);
        assert_eq!(told["layout"], layout.name());
        assert_eq!(told["channels"], layout.channels());
        assert!(
            told["peak_db"].is_f64() && told["energy_db"].is_f64(),
            "{told}"
        );
        let bytes = std::fs::read(&out).expect("a file");
        // The format's tag, the channels and their positions.
        assert_eq!(bytes[20..22], [0xfe, 0xff]);
        assert_eq!(bytes[22..24], (layout.channels() as u16).to_le_bytes());
        assert_eq!(bytes[40..44], u32::to_le_bytes(mask), "{layout}");
        let read = hound::WavReader::open(&out).expect("a WAV");
        assert_eq!(usize::from(read.spec().channels), layout.channels());
    }
    let refused = render("9.1");
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(
        !refused.status.success() && said.contains("7.1.4"),
        "{said}"
    );
}

#[test]
fn completions_and_manual_name_the_commands() {
    for shell in ["bash", "zsh", "fish"] {
        assert!(printed(&["completions", shell]).contains("materials"));
    }
    assert!(printed(&["manual"]).contains(".TH"));
    let folder = Folder::new();
    printed(&["manual", "--folder", text(&folder.path("man"))]);
    assert!(folder.path("man").join("foresound-rir.1").is_file());
    if cfg!(not(feature = "play")) {
        refused(&["play", "--scene", "doorway"], &["features play"]);
    }
}

/// From another folder, with nothing but its own file.
#[test]
fn an_installed_program_finds_its_scenes() {
    let folder = Folder::new();
    for _ in 0..2 {
        let output = Command::new(env!("CARGO_BIN_EXE_foresound"))
            .args(["inspect", "doorway", "--json"])
            .current_dir(&folder.0)
            .env("XDG_CACHE_HOME", folder.path("cache"))
            .output()
            .expect("runs");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let value: serde_json::Value = serde_json::from_slice(&output.stdout).expect(&said);
        assert!(value["triangles"].as_u64() > Some(100), "{value}");
        assert_eq!(value["defaulted_materials"], serde_json::json!([]));
    }
}
