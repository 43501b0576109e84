//! ERRORS.md knows every error: those that can be made here are made, through the command line and the library, and looked
//! up; and every advice that stands in the sources stands there too.

use std::path::Path;
use std::process::Command;
use std::sync::Arc;

use foresound::Error;
use foresound::evaluation::clip::{load_clip, load_clip_within};
use foresound::evaluation::listener_path::ListenerPath;
use foresound::generation::{GeneratorSettings, Hrtf};
use foresound::runtime::{Budget, Engine, EngineSettings, FrameTime, NullDevice, SoundThread};
use foresound::scene::{
    ListenerPose, MaterialTable, ObjOptions, Scene, SceneLayout, SceneSettings, SourceId,
    SourcePose, TriangleMesh, load_obj, procedural,
};
use glam::{Quat, Vec3};

/// A row: what is said and what is advised, with `…` for what varies.
struct Row {
    says: String,
    advises: String,
}

fn table() -> Vec<Row> {
    let text = include_str!("../ERRORS.md");
    let cells = |line: &str| -> Option<Row> {
        let inner = line.strip_prefix("| ")?.strip_suffix(" |")?;
        let [says, _because, advises] =
            inner.split(" | ").collect::<Vec<_>>()[..].try_into().ok()?;
        (says != "It says").then(|| Row {
            says: said(says),
            advises: said(advises),
        })
    };
    let rows: Vec<Row> = text.lines().filter_map(cells).collect();
    assert!(rows.len() > 100, "{} rows", rows.len());
    rows
}

fn said(cell: &str) -> String {
    cell.to_owned()
}

/// Whether a text is a pattern's, of which each `…` is anything.
fn fits(pattern: &str, text: &str) -> bool {
    let parts: Vec<&str> = pattern.split('…').collect();
    let (Some(first), Some(last)) = (parts.first(), parts.last()) else {
        return false;
    };
    let Some(mut rest) = text.strip_prefix(first) else {
        return false;
    };
    if parts.len() == 1 {
        return rest.is_empty();
    }
    for part in &parts[1..parts.len() - 1] {
        let Some(at) = rest.find(part) else {
            return false;
        };
        rest = &rest[at + part.len()..];
    }
    rest.ends_with(last)
}

/// That a line of the form `thing: problem; advice` has a row.
fn look_up(rows: &[Row], line: &str) {
    assert_eq!(line.lines().count(), 1, "{line:?}");
    let found = rows.iter().any(|row| {
        let wanted = format!("{}; {}", row.says, row.advises);
        // Before what it says stand the file and line, the setting or the handle.
        line.match_indices(": ")
            .map(|(at, colon)| &line[at + colon.len()..])
            .chain([line])
            .any(|text| fits(&wanted, text))
    });
    assert!(found, "ERRORS.md has no row for: {line}");
}

#[test]
fn patterns_are_told_apart() {
    assert!(fits("a … of …", "a piece of cake"));
    assert!(fits("…", "anything"));
    assert!(!fits("a … of …", "the piece of cake"));
    assert!(!fits("no rows", "no rows at all"));
}

fn materials(text: &str) -> Option<Error> {
    MaterialTable::parse(Path::new("m.toml"), text).err()
}

fn layout(text: &str) -> Option<Error> {
    SceneLayout::parse(Path::new("l.toml"), text).err()
}

/// Whatever of the two went wrong, or that nothing did.
fn push<T>(errors: &mut Vec<Option<Error>>, result: Result<T, Error>) {
    errors.push(result.err());
}

#[test]
fn errors_of_files_are_in_the_table() {
    let rows = table();
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        path
    };
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    let mut errors = Vec::new();
    let long = format!("f {}\n", "1 ".repeat(1 << 20));
    for text in [
        "\0",
        &long,
        "v 1 x 2\nf 1 1 1\n",
        "v 1 1 1 0\nf 1 1 1\n",
        &format!("{square}f 1 2\n"),
        &format!("{square}f 0 1 2\n"),
        &format!("{square}f 1 2 3000000000\n"),
        &format!("{square}f 1 2 7\n"),
        &format!("{square}f 1 2 x\n"),
        &format!("v 1e9 0 0\n{square}f 1 2 3\n"),
        &format!("v nan 0 0\n{square}f 1 2 3\n"),
        &format!("{square}{}", "f 1 2 3\n".repeat(40)),
        &"v 0 0 0\n".repeat(200),
        square,
    ] {
        let options = ObjOptions {
            most_triangles: 30,
            ..ObjOptions::default()
        };
        push(
            &mut errors,
            load_obj(&file("a.obj", text.as_bytes()), &options),
        );
    }
    let options = ObjOptions {
        scale: 0.0,
        ..ObjOptions::default()
    };
    push(&mut errors, load_obj(&file("b.obj", b""), &options));
    push(&mut errors, load_obj(folder.path(), &ObjOptions::default()));
    push(
        &mut errors,
        load_obj(Path::new("gone.obj"), &ObjOptions::default()),
    );
    push(&mut errors, MaterialTable::load(folder.path()));
    push(
        &mut errors,
        MaterialTable::load(&file("u.toml", &[0xff, 0xfe])),
    );
    for text in [
        "a = ",
        "[metals.a]\n",
        "materials = 3\n",
        "[materials.a]\nabsorption = nan\n",
        "[materials.a]\nscattering = 0.1\n",
        "[materials.a]\nabsorption = 0.5\ntransmission = 0.1\ntransmission_loss_db = 3\n",
        "[materials.a]\nabsorption = 0.1\ntransmission = 0.2\n",
        "[materials.a]\nabsorption = 2\n",
        "[materials.a]\nabsorption = 0.5\ntransmission_loss_db = -2\n",
        "[materials.a]\nabsorption = [0.1, 0.2]\n",
    ] {
        errors.push(Some(materials(text).expect(text)));
    }
    let source = "[[sources]]\nname = \"a\"\nposition = [1, 2, 3]\n";
    for text in [
        "[[sources]]\nname = \"a\"\n",
        "sources = 3\n",
        "[[sources]]\nname = \"a\"\nposition = [1, 2]\n",
        "[[sources]]\nname = \"a\"\nposition = [1, 2, 1e9]\n",
        &format!("{source}{source}"),
        &format!("{source}facing = [0, 0, 0]\n"),
        &format!("{source}radius_m = -1\n"),
        &format!("{source}without = \"late\"\n"),
        &format!("{source}without = [\"none\"]\n"),
    ] {
        errors.push(Some(layout(text).expect(text)));
    }
    for text in [
        "t,x,y,z\n",
        "t,x,y,z\n0,nan,1,1\n",
        "t,x,y,z\n0,1e9,1,1\n",
        "t,x,y,z\n1,1,1,1\n1,1,1,1\n",
        "t,x,y,z\n0,1,one,1\n",
        "a,b\n1,2\n",
    ] {
        push(
            &mut errors,
            ListenerPath::from_csv(Path::new("w.csv"), text.as_bytes()),
        );
    }
    push(
        &mut errors,
        ListenerPath::from_csv(Path::new("w.csv"), b"t,x,y,z\n0,\xff,1,1\n"),
    );
    push(&mut errors, ListenerPath::parse("1,2,x"));
    push(&mut errors, ListenerPath::parse("1,2,1e9"));
    push(&mut errors, ListenerPath::parse("gone.csv"));
    push(
        &mut errors,
        ListenerPath::parse(&folder.path().to_string_lossy()),
    );
    let wav = |name: &str, channels: u16, rate_hz: u32, bits: u16, count: usize| {
        let path = folder.path().join(name);
        let spec = hound::WavSpec {
            channels,
            sample_rate: rate_hz,
            bits_per_sample: bits,
            sample_format: hound::SampleFormat::Int,
        };
        let mut writer = hound::WavWriter::create(&path, spec).expect("a file");
        (0..count).for_each(|_| writer.write_sample(1i8).expect("written"));
        writer.finalize().expect("written");
        path
    };
    push(
        &mut errors,
        load_clip(wav("two.wav", 2, 44_100, 16, 4), 44_100),
    );
    push(
        &mut errors,
        load_clip(wav("slow.wav", 1, 10, 16, 4), 44_100),
    );
    push(
        &mut errors,
        load_clip(wav("eight.wav", 1, 44_100, 8, 4), 44_100),
    );
    push(
        &mut errors,
        load_clip(wav("none.wav", 1, 44_100, 16, 0), 44_100),
    );
    push(
        &mut errors,
        load_clip_within(wav("long.wav", 1, 44_100, 16, 9), 44_100, 8),
    );
    push(&mut errors, load_clip(wav("good.wav", 1, 44_100, 16, 9), 7));
    push(
        &mut errors,
        load_clip(file("text.wav", b"no sound at all"), 44_100),
    );
    push(&mut errors, load_clip(file("cut.wav", b"RIFF"), 44_100));
    push(&mut errors, load_clip("gone.wav", 44_100));
    for (number, error) in errors.iter().enumerate() {
        let error = error.as_ref();
        let error = error.unwrap_or_else(|| panic!("case {number} is no error"));
        look_up(&rows, &error.to_string());
    }
}

#[test]
fn errors_of_meshes_settings_and_engines_are_in_the_table() {
    let rows = table();
    let mut errors = Vec::new();
    let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    push(
        &mut errors,
        TriangleMesh::from_slices(&corners, &[0, 1], &[], &[]),
    );
    push(
        &mut errors,
        TriangleMesh::from_slices(&corners, &[0, 1, 3], &[], &[]),
    );
    push(
        &mut errors,
        TriangleMesh::from_slices(&corners, &[0, 1, 2], &["a"], &[1]),
    );
    push(
        &mut errors,
        TriangleMesh::from_slices(&corners, &[0, 1, 2], &["a"], &[0, 0]),
    );
    let materials = MaterialTable::built_in();
    let commit =
        |mesh: &TriangleMesh, settings: &SceneSettings| Scene::commit(mesh, &materials, settings);
    let room = procedural::shoebox(Vec3::new(4.0, 3.0, 5.0), "concrete");
    let mut far = room.clone();
    far.vertices[0] = Vec3::splat(1e6);
    push(&mut errors, commit(&far, &SceneSettings::default()));
    let mut flat = room.clone();
    flat.vertices.fill(Vec3::ONE);
    push(&mut errors, commit(&flat, &SceneSettings::default()));
    let mut settings = SceneSettings {
        most_triangles: 3,
        ..SceneSettings::default()
    };
    push(&mut errors, commit(&room, &settings));
    settings = SceneSettings::default();
    settings.medium.temperature_c = -300.0;
    push(&mut errors, commit(&room, &settings));

    let good = EngineSettings {
        generation: GeneratorSettings {
            rate_hz: 16_000,
            max_sources: 1,
            max_delay_s: 0.05,
            ..GeneratorSettings::default()
        },
        hrtf: Some(Arc::new(Hrtf::omnidirectional(16_000).expect("a head"))),
        ..EngineSettings::default()
    };
    let with = |change: &dyn Fn(&mut EngineSettings)| {
        let mut settings = good.clone();
        change(&mut settings);
        Engine::new(settings).map(drop)
    };
    push(&mut errors, with(&|s| s.block_frames = 1));
    push(&mut errors, with(&|s| s.generation.max_voices = 0));
    push(&mut errors, with(&|s| s.propagation.nearest_m = 0.0));
    push(&mut errors, with(&|s| s.frame_time = FrameTime::Fixed(9.0)));
    push(&mut errors, with(&|s| s.generation.rate_hz = 48_000));
    push(
        &mut errors,
        with(&|s| {
            s.budget = Budget {
                update_s: Some(f64::NAN),
                ..Budget::default()
            }
        }),
    );
    push(&mut errors, Hrtf::builtin(8000));
    push(&mut errors, Hrtf::parse(b"no head", "a head"));
    push(&mut errors, Hrtf::omnidirectional(1));
    let policy = foresound::runtime::AffinityPolicy::None;
    push(&mut errors, NullDevice::start(0, 0, policy, |_| ()));

    let (mut controller, renderer) = Engine::new(good).expect("an engine");
    push(&mut errors, SoundThread::start(renderer, 0));
    let id = controller.add_source(Vec3::ONE).expect("a slot");
    push(&mut errors, controller.add_source(Vec3::ONE));
    push(&mut errors, controller.remove_source(SourceId::new(7, 7)));
    push(&mut errors, controller.set_source_gain(id, -1.0));
    push(&mut errors, controller.move_source(id, Vec3::NAN));
    push(&mut errors, controller.stream(id, 0));
    let turned = |orientation: Quat| ListenerPose {
        orientation,
        ..ListenerPose::default()
    };
    push(
        &mut errors,
        controller.tick(turned(Quat::from_xyzw(0.0, 0.0, 0.0, 0.0)), &[]),
    );
    let pose = SourcePose {
        orientation: Quat::from_xyzw(f32::NAN, 0.0, 0.0, 0.0),
        ..SourcePose::at(id, Vec3::ONE)
    };
    push(
        &mut errors,
        controller.tick(ListenerPose::default(), &[pose]),
    );
    let part = Arc::new(commit(&room, &SceneSettings::default()).expect("a part"));
    let at = foresound::scene::InstancePose::at(
        foresound::scene::InstanceId::default(),
        glam::DVec3::NAN,
    );
    push(&mut errors, controller.add_instance(part, &at));
    push(
        &mut errors,
        controller.remove_instance(foresound::scene::InstanceId::default()),
    );
    for (number, error) in errors.iter().enumerate() {
        let error = error.as_ref();
        let error = error.unwrap_or_else(|| panic!("case {number} is no error"));
        look_up(&rows, &error.to_string());
    }
}

#[test]
fn errors_of_the_command_line_are_in_the_table() {
    let rows = table();
    let render = [
        "render",
        "--scene",
        "doorway",
        "--listener",
        "0,1,0",
        "--source",
    ];
    let with = |more: &[&'static str]| [&render[..], more].concat();
    let sound = "1,1,1=gone.wav";
    for arguments in [
        vec!["inspect", "gone.obj"],
        vec!["inspect", "doorway", "--up", "w"],
        vec!["inspect", "doorway", "--scale", "0"],
        with(&["1,2,3", "--out", "o.wav"]),
        with(&["1,2,x=a.wav", "--out", "o.wav"]),
        with(&["nobody=a.wav", "--out", "o.wav"]),
        with(&[sound, "--out", "o.wav"]),
        with(&[sound, "--out", "o.wav", "--schedule", "later"]),
        with(&[sound, "--out", "o.wav", "--predictor", "oracle"]),
        with(&[sound, "--out", "o.wav", "--rate", "7"]),
        vec!["validate", "--law", "murphy"],
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_foresound"))
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .args(&arguments)
            .output()
            .expect("the program runs");
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        let line = text.lines().last().expect("a line");
        look_up(&rows, line.strip_prefix("error: ").expect("an error"));
    }
}

/// Beginnings of advice.
const VERBS: [&str; 34] = [
    "add ",
    "bake ",
    "check ",
    "choose ",
    "close ",
    "commit ",
    "convert ",
    "count ",
    "cut ",
    "end ",
    "export ",
    "free ",
    "give ",
    "keep ",
    "leave ",
    "let ",
    "load ",
    "look ",
    "make ",
    "name ",
    "plug ",
    "put ",
    "raise ",
    "refer ",
    "remove ",
    "save ",
    "simplify ",
    "take ",
    "the last good ",
    "use ",
    "write ",
    "print ",
    "stop ",
    "start ",
];

/// Sources whose advice a user of the library may meet. The command line's own arguments explain themselves; pictures and
/// scores are evaluation's.
const PLACES: [&str; 8] = [
    "scene/",
    "propagation/",
    "generation/",
    "runtime/",
    "evaluation/clip.rs",
    "evaluation/listener_path.rs",
    "output/whole_file.rs",
    "output/oboe.rs",
];

/// A literal of the sources as the table has it.
fn as_pattern(literal: &str) -> String {
    let mut pattern = String::new();
    let mut depth = 0;
    for c in literal.replace("\\\"", "\"").chars() {
        match c {
            '{' => {
                if depth == 0 {
                    pattern.push('…');
                }
                depth += 1;
            }
            '}' => depth -= 1,
            _ if depth == 0 => pattern.push(c),
            _ => {}
        }
    }
    pattern
}

#[test]
fn every_advice_of_the_sources_is_in_the_table() {
    let rows = table();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut open = vec![root.clone()];
    let (mut missing, mut seen) = (Vec::new(), 0);
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            let name = path
                .strip_prefix(&root)
                .expect("below")
                .to_string_lossy()
                .into_owned();
            if path.is_dir() {
                open.push(path);
                continue;
            }
            let wanted = PLACES.iter().any(|place| name.starts_with(place));
            if !wanted
                || name.contains("tests")
                || name.contains("procedural")
                || !name.ends_with(".rs")
            {
                continue;
            }
            let text = std::fs::read_to_string(&path).expect("text");
            let code = text.split("#[cfg(test)]").next().unwrap_or_default();
            let code: String = code
                .lines()
                .filter(|line| !line.trim_start().starts_with("//"))
                .collect::<Vec<_>>()
                .join("\n");
            // Literals are every second piece between quotes that no backslash escapes.
            let marked = code.replace("\\\"", "\u{1}").replace("'\"'", "''");
            for literal in marked.split('"').skip(1).step_by(2) {
                let literal = literal.replace('\u{1}', "\"");
                if !VERBS.iter().any(|verb| literal.starts_with(verb)) {
                    continue;
                }
                seen += 1;
                let pattern = as_pattern(&literal);
                let known = |row: &Row| fits(&row.advises, &pattern) || row.advises == pattern;
                if !rows.iter().any(known) {
                    missing.push(format!("{name}: {literal}"));
                }
            }
        }
    }
    assert!(seen > 60, "only {seen} found");
    assert!(missing.is_empty(), "ERRORS.md lacks: {missing:#?}");
}
