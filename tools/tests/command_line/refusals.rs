//! Every user error ends in one line with its location and advice, with exit code 2, and leaves no partial output.

use std::fs;

use crate::harness::{Folder, refused, text};

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
        ("comma.csv", "t,x,y,z\n0,5,1,1,1\n", "comma.csv:2"),
        ("short.csv", "t,x,y,z,yaw\n0,1,1,1\n", "short.csv:2"),
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
