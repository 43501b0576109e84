//! The page of `foresound view`, by its requests.

#![expect(
    clippy::disallowed_methods,
    reason = "a test of a program in real time waits for it"
)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// Longest wait for a state in which something has happened.
const PATIENCE: Duration = Duration::from_secs(60);

/// The running program, ended when dropped.
struct View {
    program: Child,
    address: String,
}

impl Drop for View {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

impl View {
    fn open(arguments: &[&str]) -> Self {
        let mut program = Command::new(env!("CARGO_BIN_EXE_foresound"))
            .args(["view", "doorway", "--sources", "2", "--port", "0", "--json"])
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        let mut line = String::new();
        let output = program.stdout.take().expect("a pipe");
        BufReader::new(output)
            .read_line(&mut line)
            .expect("an address");
        let printed: Value = serde_json::from_str(&line).expect("JSON");
        let url = printed["url"].as_str().expect("an address");
        let address = url.trim_start_matches("http://").trim_end_matches('/');
        Self {
            address: address.to_owned(),
            program,
        }
    }

    /// The status and body of an answer.
    fn ask(&self, method: &str, path: &str, headers: &str, body: &str) -> (u32, Vec<u8>) {
        let mut stream = TcpStream::connect(&self.address).expect("a connection");
        let (address, length) = (&self.address, body.len());
        let host = match headers.contains("Host:") {
            true => String::new(),
            false => format!("Host: {address}\r\n"),
        };
        write!(
            stream,
            "{method} {path} HTTP/1.1\r\n{host}{headers}Connection: close\r\nContent-Length: {length}\r\n\r\n{body}"
        )
        .expect("a request");
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).expect("an answer");
        let split = answer.windows(4).position(|four| four == b"\r\n\r\n");
        let split = split.expect("a head and a body");
        let head = String::from_utf8_lossy(&answer[..split]).into_owned();
        let status = head.split(' ').nth(1).and_then(|n| n.parse().ok());
        (status.expect("a status"), answer[split + 4..].to_vec())
    }

    fn step(&self, input: &Value) -> Value {
        let (status, body) = self.ask("POST", "/step", "", &input.to_string());
        assert_eq!(status, 200, "{}", String::from_utf8_lossy(&body));
        serde_json::from_slice(&body).expect("JSON")
    }

    /// Sends an input until the state is as expected.
    fn step_until(&self, input: &Value, is_so: impl Fn(&Value) -> bool) -> Value {
        let began = Instant::now();
        loop {
            let state = self.step(input);
            if is_so(&state) {
                return state;
            }
            assert!(began.elapsed() < PATIENCE, "{state}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

#[test]
fn the_listener_walks_and_sources_and_doors_are_dragged() {
    let view = View::open(&["--door", "8.1,0,3.07"]);
    let state = view.step_until(&json!({}), |state| {
        state["paths"]
            .as_array()
            .is_some_and(|paths| !paths.is_empty())
    });
    assert_eq!(state["sources"].as_array().map(Vec::len), Some(2));
    for path in state["paths"].as_array().into_iter().flatten() {
        let numbers = |key: &str| path[key].as_u64().expect("a number");
        let corners = path["corners"].as_array().expect("a list").len() as u64;
        assert_eq!(corners, 3 * (numbers("order") + numbers("edges") + 2));
    }
    // Twelve directions of length 1, with eight levels each; the late reverb is heard from some of them.
    let reverb = &view.step_until(&json!({}), |state| {
        let levels = state["reverb"]["levels_db"].as_array();
        levels.is_some_and(|levels| levels.iter().any(|bands| bands[4].as_f64() > Some(-100.0)))
    })["reverb"];
    let list = |value: &Value| value.as_array().expect("a list").clone();
    let directions = list(&reverb["directions"]);
    assert_eq!(
        (directions.len(), list(&reverb["levels_db"]).len()),
        (12, 12)
    );
    for (direction, bands) in directions.iter().zip(list(&reverb["levels_db"])) {
        let squares = list(direction)
            .into_iter()
            .map(|x| x.as_f64().expect("a number").powi(2));
        assert!((squares.sum::<f64>() - 1.0).abs() < 1e-5);
        assert_eq!(list(&bands).len(), 8);
    }
    assert_eq!(list(&reverb["decay_s"]).len(), 8);
    // A key stops the scene's own walk.
    let first = view.step_until(&json!({ "keys": "w" }), |state| state["ahead"][2] == -1.0);
    view.step_until(&json!({ "keys": "w" }), |state| {
        state["listener"][2].as_f64() < first["listener"][2].as_f64()
    });
    let dragged = json!({ "sources": [[1, [5.0, 1.25, 2.0]]], "doors": [[0, 1.5]] });
    view.step_until(&dragged, |state| {
        state["sources"][1] == json!([5.0, 1.25, 2.0]) && state["doors"][0]["angle"] == 1.5
    });
}

#[test]
fn page_mesh_and_sound_are_served() {
    let view = View::open(&[]);
    for (path, part) in [
        ("/", "page.js"),
        ("/page.js", "getContext(\"webgl2\""),
        ("/reverb.js", "show_reverb"),
    ] {
        let (status, body) = view.ask("GET", path, "", "");
        assert_eq!(status, 200);
        assert!(String::from_utf8_lossy(&body).contains(part));
    }
    let (_, mesh) = view.ask("GET", "/mesh", "", "");
    assert_eq!(mesh.len(), 218 * 10 * 4, "ten floats a triangle");
    let began = Instant::now();
    let is_heard = || {
        let (_, sound) = view.ask("GET", "/sound?from=0", "", "");
        sound[12..].iter().any(|&byte| byte != 0)
    };
    while !is_heard() {
        assert!(began.elapsed() < PATIENCE);
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn what_is_no_request_of_the_page_is_refused() {
    let view = View::open(&[]);
    let status = |method, path, headers, body| view.ask(method, path, headers, body).0;
    assert_eq!(
        status("POST", "/step", "Origin: http://elsewhere\r\n", "{}"),
        403
    );
    assert_eq!(status("GET", "/", "Host: elsewhere\r\n", ""), 403);
    assert_eq!(status("GET", "/../Cargo.toml", "", ""), 404);
    for body in [
        "",
        "{\"keys\":3}",
        "{\"sources\":[[0,[1,2]]]}",
        "{\"other\":1}",
    ] {
        assert_eq!(status("POST", "/step", "", body), 400, "{body:?}");
    }
    let long = format!("{{\"keys\":\"{}\"}}", "w".repeat(1 << 15));
    assert_eq!(status("POST", "/step", "", &long), 400);
    // Numbers and positions that there are not change nothing.
    let before = view.step_until(&json!({}), |state| state["sources"].is_array());
    let wrong =
        json!({ "sources": [[7, [0.0, 0.0, 0.0]], [0, [1e30, 0.0, 0.0]]], "doors": [[0, 1.0]] });
    view.step(&wrong);
    std::thread::sleep(Duration::from_millis(200));
    assert_eq!(view.step(&json!({}))["sources"], before["sources"]);
}
