//! The page's server: one page, a mesh, a state and sound, on the loopback interface only.
//!
//! A request of another page is refused: its `Host` or `Origin` is another one.

use std::io::Read;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::Scope;
use std::time::Duration;

use foresound::scene::Scene;
use foresound::{Error, Result};
use tiny_http::{Header, Method, Request, Response};

use super::simulation::{Input, Shared};

/// Threads that answer requests.
const THREADS: usize = 3;
/// Longest wait for a request before a thread looks whether it is to stop.
const WAIT: Duration = Duration::from_millis(100);
/// Longest request in bytes.
const MAX_REQUEST: u64 = 1 << 14;

const PAGE: &str = include_str!("page.html");
const SCRIPT: &str = include_str!("page.js");
const REVERB: &str = include_str!("reverb.js");

/// An open port.
pub(crate) struct Server {
    http: tiny_http::Server,
    address: SocketAddr,
    mesh: Vec<u8>,
    shared: Arc<Shared>,
}

type Answer = Response<std::io::Cursor<Vec<u8>>>;

impl Server {
    /// Listens on 127.0.0.1.
    pub(crate) fn open(port: u16, scene: Arc<Scene>, shared: Arc<Shared>) -> Result<Self> {
        let failed = |problem: String| Error::engine(problem, "give another --port, or 0");
        let http = tiny_http::Server::http(("127.0.0.1", port))
            .map_err(|error| failed(format!("no page on port {port}: {error}")))?;
        let address = http.server_addr().to_ip();
        let address = address.ok_or_else(|| failed("no address of the page".into()))?;
        Ok(Self {
            http,
            address,
            mesh: mesh_bytes(&scene),
            shared,
        })
    }

    /// The page's address.
    pub(crate) fn url(&self) -> String {
        format!("http://{}/", self.address)
    }

    /// Answers requests on threads of a scope until `stop` is set.
    pub(crate) fn answer<'s>(&'s self, scope: &'s Scope<'s, '_>, stop: &'s AtomicBool) {
        for _ in 0..THREADS {
            scope.spawn(move || {
                while !stop.load(Ordering::Acquire) {
                    if let Ok(Some(request)) = self.http.recv_timeout(WAIT) {
                        self.respond(request);
                    }
                }
            });
        }
    }

    fn respond(&self, mut request: Request) {
        let answer = match self.is_own(&request) {
            true => self.answer_to(&mut request),
            false => plain(403, "open this page by its own address"),
        };
        // A page that was closed takes no answer.
        let _ = request.respond(answer);
    }

    /// Whether a request is of the page itself or of the address bar.
    fn is_own(&self, request: &Request) -> bool {
        let port = self.address.port();
        let hosts = [format!("127.0.0.1:{port}"), format!("localhost:{port}")];
        request.headers().iter().all(|header| {
            let value = header.value.as_str();
            let host = match () {
                () if header.field.equiv("Host") => value,
                () if header.field.equiv("Origin") => value.trim_start_matches("http://"),
                () => return true,
            };
            hosts.iter().any(|own| own == host)
        })
    }

    fn answer_to(&self, request: &mut Request) -> Answer {
        let url = request.url().to_owned();
        let (path, query) = url.split_once('?').unwrap_or((&url, ""));
        match (request.method(), path) {
            (Method::Get, "/") => typed(PAGE.into(), "text/html; charset=utf-8"),
            (Method::Get, "/page.js") => typed(SCRIPT.into(), "text/javascript; charset=utf-8"),
            (Method::Get, "/reverb.js") => typed(REVERB.into(), "text/javascript; charset=utf-8"),
            (Method::Get, "/mesh") => typed(self.mesh.clone(), "application/octet-stream"),
            (Method::Get, "/sound") => {
                let from = query.strip_prefix("from=").and_then(|n| n.parse().ok());
                typed(self.sound(from.unwrap_or(0)), "application/octet-stream")
            }
            (Method::Post, "/step") => self.step(request),
            _ => plain(
                404,
                "there is /, /page.js, /reverb.js, /mesh, /sound and /step",
            ),
        }
    }

    /// Takes the page's input and answers with the state.
    fn step(&self, request: &mut Request) -> Answer {
        let mut text = String::new();
        let mut body = request.as_reader().take(MAX_REQUEST);
        if body.read_to_string(&mut text).is_err() {
            return plain(400, "the request is no text");
        }
        match serde_json::from_str::<Input>(&text) {
            Ok(input) => {
                self.shared.push(input);
                typed(self.shared.state().into_bytes(), "application/json")
            }
            Err(error) => plain(400, &format!("the request is no input: {error}")),
        }
    }

    /// Sample rate, number of the first audio frame, then interleaved 16-bit samples; little-endian.
    fn sound(&self, from: u64) -> Vec<u8> {
        let heard = &self.shared.heard;
        let (first, samples) = heard.since(from);
        let mut bytes = Vec::with_capacity(12 + 2 * samples.len());
        bytes.extend(heard.rate_hz().to_le_bytes());
        bytes.extend(first.to_le_bytes());
        bytes.extend(samples.iter().flat_map(|sample| sample.to_le_bytes()));
        bytes
    }
}

/// Each triangle's corners in metres and its material's number, as ten floats; little-endian.
fn mesh_bytes(scene: &Scene) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (number, corners) in scene.triangles().enumerate() {
        let surface = scene.surface(scene.surface_of(number as u32));
        for corner in corners {
            bytes.extend(corner.to_array().into_iter().flat_map(f32::to_le_bytes));
        }
        bytes.extend((surface.material as f32).to_le_bytes());
    }
    bytes
}

fn typed(bytes: Vec<u8>, kind: &str) -> Answer {
    let mut answer = Response::from_data(bytes);
    for (field, value) in [("Content-Type", kind), ("Cache-Control", "no-store")] {
        if let Ok(header) = Header::from_bytes(field, value) {
            answer.add_header(header);
        }
    }
    answer
}

fn plain(status: u16, text: &str) -> Answer {
    Response::from_string(text).with_status_code(status)
}
