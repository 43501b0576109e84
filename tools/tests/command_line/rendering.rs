//! `render`: files of users, paths of sources and listeners, layouts, and what is said about the result.

use std::path::Path;

use std::fs;

use crate::harness::{Folder, foresound, text};

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
fn any_mesh_has_a_demo() {
    let folder = Folder::new();
    // Two storeys of a hall, 12 m by 9 m, in millimetres, z upward, without a layout beside it.
    let mut mesh = String::new();
    for height in [0, 3_000, 6_000] {
        for (x, y) in [(0, 0), (12_000, 0), (12_000, 9_000), (0, 9_000)] {
            mesh.push_str(&format!("v {x} {y} {height}\n"));
        }
    }
    mesh.push_str("usemtl plaster\nf 1 2 3 4\nf 5 6 7 8\nf 9 10 11 12\n");
    for side in 0..4 {
        let [a, b] = [side + 1, (side + 1) % 4 + 1];
        mesh.push_str(&format!("f {a} {b} {} {}\n", b + 8, a + 8));
    }
    let (scene, out) = (folder.write("two storeys.obj", &mesh), folder.path("demo"));
    let arguments = [
        "demo",
        "--scene",
        text(&scene),
        "--scale",
        "0.001",
        "--up",
        "z",
    ];
    let short = ["--seconds", "1", "--json", "--out", text(&out)];
    let output = foresound(&[&arguments[..], &short].concat());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    assert!(said.contains("4 sources laid out in open space"), "{said}");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(json["scene"], "two_storeys", "{json}");
    assert!(json["paths_p50"].as_f64() > Some(10.0), "{json}");
    for file in [
        "synchronous.wav",
        "asynchronous.wav",
        "spectrograms.png",
        "top_view.png",
    ] {
        assert!(out.join(file).is_file(), "{file}");
    }
}
