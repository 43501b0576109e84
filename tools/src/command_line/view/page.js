// The page of `foresound view`: draws the scene and the paths, sends keys and drags, plays and shows the sound.
"use strict";

const ORDER_COLOURS = [
  [1.0, 0.84, 0.25, "direct"],
  [0.35, 0.78, 1.0, "1 reflection"],
  [0.45, 0.9, 0.5, "2 reflections"],
  [0.85, 0.55, 1.0, "3 reflections"],
  [0.95, 0.5, 0.55, "4 and more"],
  [1.0, 0.6, 0.15, "around edges"],
];
const QUIETEST_DB = -60;
const STEP_MS = 33;
const SOUND_MS = 100;

const canvas = document.getElementById("view");
const gl = canvas.getContext("webgl2", { antialias: true });
const shown = ORDER_COLOURS.map(() => true);
const held = new Set();
const camera = { yaw: 0.6, pitch: 0.75, distance_m: 18, own_eyes: false };
let state = null;
let dragged = { sources: new Map(), doors: new Map() };

// Vectors and matrices, column by column.
const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => { const n = Math.hypot(...a) || 1; return a.map((x) => x / n); };

function multiply(a, b) {
  const c = new Float32Array(16);
  for (let j = 0; j < 4; j++) for (let i = 0; i < 4; i++) for (let k = 0; k < 4; k++) c[4 * j + i] += a[4 * k + i] * b[4 * j + k];
  return c;
}

function perspective(height_rad, aspect, near, far) {
  const f = 1 / Math.tan(height_rad / 2), d = near - far;
  return new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / d, -1, 0, 0, 2 * far * near / d, 0]);
}

function look(eye, at) {
  const back = unit(add(eye, at, -1)), right = unit(cross([0, 1, 0], back)), up = cross(back, right);
  return new Float32Array([right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
    -dot(right, eye), -dot(up, eye), -dot(back, eye), 1]);
}

function program(vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, "#version 300 es\nprecision highp float;\n" + text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.bindAttribLocation(made, 0, "position");
  gl.bindAttribLocation(made, 1, "colour");
  gl.linkProgram(made);
  return made;
}

const solid = program(
  "in vec3 position; in vec4 colour; uniform mat4 camera; out vec3 at; out vec4 tint;" +
  "void main() { at = position; tint = colour; gl_Position = camera * vec4(position, 1.0); }",
  "in vec3 at; in vec4 tint; uniform float cut; out vec4 seen;" +
  "void main() { if (at.y > cut) discard; vec3 n = normalize(cross(dFdx(at), dFdy(at)));" +
  "float light = 0.45 + 0.35 * abs(n.y) + 0.2 * abs(dot(n, normalize(vec3(0.6, 0.2, 0.4))));" +
  "seen = vec4(tint.rgb * light, 1.0); }");
const flat = program(
  "in vec3 position; in vec4 colour; uniform mat4 camera; out vec4 tint;" +
  "void main() { tint = colour; gl_Position = camera * vec4(position, 1.0); gl_PointSize = 9.0; }",
  "in vec4 tint; out vec4 seen; void main() { seen = tint; }");

// A buffer of positions and colours: seven floats a vertex.
function batch() {
  const array = gl.createVertexArray(), buffer = gl.createBuffer();
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  for (const [index, size, offset] of [[0, 3, 0], [1, 4, 12]]) {
    gl.enableVertexAttribArray(index);
    gl.vertexAttribPointer(index, size, gl.FLOAT, false, 28, offset);
  }
  return { array, buffer, count: 0 };
}

function fill(batch, values, use = gl.DYNAMIC_DRAW) {
  gl.bindBuffer(gl.ARRAY_BUFFER, batch.buffer);
  gl.bufferData(gl.ARRAY_BUFFER, values, use);
  batch.count = values.length / 7;
}

const mesh = batch(), lines = batch(), objects = batch();

// A muted colour of a material's number.
function material_colour(number) {
  const hue = (number * 0.618034) % 1, wave = (shift) => 0.5 + 0.5 * Math.cos(2 * Math.PI * (hue + shift));
  return [0, 1 / 3, 2 / 3].map((shift) => 0.24 + 0.16 * wave(shift));
}

async function load_mesh() {
  const values = new Float32Array(await (await fetch("mesh")).arrayBuffer());
  const out = new Float32Array(values.length / 10 * 21);
  for (let t = 0, o = 0; t < values.length; t += 10) {
    const colour = material_colour(values[t + 9]);
    for (let c = 0; c < 3; c++, o += 7) out.set([values[t + 3 * c], values[t + 3 * c + 1], values[t + 3 * c + 2], ...colour, 1], o);
  }
  fill(mesh, out, gl.STATIC_DRAW);
}

function colour_of(path) {
  return path.edges > 0 ? ORDER_COLOURS.length - 1 : Math.min(path.order, ORDER_COLOURS.length - 2);
}

// The quietest first: a louder path covers it, and many quiet ones do not add up to a bright spot.
function draw_paths() {
  const values = [];
  for (const path of [...state.paths].sort((a, b) => a.db - b.db)) {
    const kind = colour_of(path);
    if (!shown[kind]) continue;
    const strength = Math.max(0.2, Math.min(1, 1 - path.db / QUIETEST_DB)) ** 2.5;
    const [r, g, b] = ORDER_COLOURS[kind];
    for (let i = 3; i < path.corners.length; i += 3) {
      values.push(...path.corners.slice(i - 3, i), r, g, b, strength, ...path.corners.slice(i, i + 3), r, g, b, strength);
    }
  }
  fill(lines, new Float32Array(values));
}

// An octahedron.
function marker(values, at, size, colour) {
  const tips = [[1, 0, 0], [0, 0, 1], [-1, 0, 0], [0, 0, -1]];
  for (let i = 0; i < 4; i++) for (const up of [1, -1]) {
    for (const corner of [[0, up, 0], tips[i], tips[(i + 1) % 4]]) values.push(...add(at, corner, size), ...colour, 1);
  }
}

function door_end(door) {
  const z = state.door_m[2];
  return add(door.hinge, [z * Math.sin(door.angle), 0, z * Math.cos(door.angle)]);
}

function draw_objects() {
  const values = [];
  for (const at of state.sources) marker(values, at, 0.22, [1, 0.84, 0.25]);
  for (const door of state.doors) {
    const foot = door.hinge, end = door_end(door), up = [0, state.door_m[1], 0];
    for (const corner of [foot, end, add(end, up), foot, add(end, up), add(foot, up)]) values.push(...corner, 0.6, 0.42, 0.25, 1);
  }
  if (!camera.own_eyes) {
    marker(values, state.listener, 0.16, [0.95, 0.95, 0.95]);
    const ahead = state.ahead, side = cross(ahead, [0, 1, 0]), tip = add(state.listener, ahead, 0.7);
    for (const corner of [tip, add(state.listener, side, 0.14), add(state.listener, side, -0.14)]) values.push(...corner, 0.95, 0.95, 0.95, 1);
  }
  fill(objects, new Float32Array(values));
}

function camera_now() {
  const aspect = canvas.width / canvas.height, lens = perspective(1.0, aspect, 0.05, 2000);
  if (camera.own_eyes) {
    const eye = state.listener;
    return { eye, matrix: multiply(lens, look(eye, add(eye, state.ahead))) };
  }
  const flat = Math.cos(camera.pitch) * camera.distance_m;
  const eye = add(state.listener, [flat * Math.sin(camera.yaw), Math.sin(camera.pitch) * camera.distance_m, flat * Math.cos(camera.yaw)]);
  return { eye, matrix: multiply(lens, look(eye, state.listener)) };
}

function draw() {
  requestAnimationFrame(draw);
  const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((n) => Math.round(n * devicePixelRatio));
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  gl.viewport(0, 0, width, height);
  gl.clearColor(0.08, 0.09, 0.11, 1);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  if (!state) return;
  draw_paths();
  draw_objects();
  const { matrix } = camera_now();
  const cut = camera.own_eyes ? 1e9 : state.listener[1] + Number(document.getElementById("cut").value);
  gl.enable(gl.DEPTH_TEST);
  gl.disable(gl.BLEND);
  gl.useProgram(solid);
  gl.uniformMatrix4fv(gl.getUniformLocation(solid, "camera"), false, matrix);
  gl.uniform1f(gl.getUniformLocation(solid, "cut"), cut);
  gl.bindVertexArray(mesh.array);
  gl.drawArrays(gl.TRIANGLES, 0, mesh.count);
  gl.disable(gl.DEPTH_TEST);
  gl.enable(gl.BLEND);
  gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  gl.useProgram(flat);
  gl.uniformMatrix4fv(gl.getUniformLocation(flat, "camera"), false, matrix);
  gl.bindVertexArray(lines.array);
  gl.drawArrays(gl.LINES, 0, lines.count);
  // Before the lines, as they can be dragged; behind walls.
  gl.enable(gl.DEPTH_TEST);
  gl.disable(gl.BLEND);
  gl.useProgram(solid);
  gl.uniform1f(gl.getUniformLocation(solid, "cut"), 1e9);
  gl.bindVertexArray(objects.array);
  gl.drawArrays(gl.TRIANGLES, 0, objects.count);
}

// Where a pixel's line of sight meets a height.
function at_height(event, height) {
  const { eye, matrix } = camera_now();
  const [x, y] = [2 * event.clientX / canvas.clientWidth - 1, 1 - 2 * event.clientY / canvas.clientHeight];
  const aspect = canvas.width / canvas.height, t = Math.tan(0.5);
  const to = camera.own_eyes ? add(eye, state.ahead) : state.listener;
  const back = unit(add(eye, to, -1)), right = unit(cross([0, 1, 0], back)), up = cross(back, right);
  const ray = add(add(back.map((v) => -v), right, x * t * aspect), up, y * t);
  const along = (height - eye[1]) / ray[1];
  return { point: along > 0 && along < 500 ? add(eye, ray, along) : null, matrix };
}

function pixel_of(matrix, at) {
  const v = [0, 1, 2, 3].map((i) => matrix[i] * at[0] + matrix[4 + i] * at[1] + matrix[8 + i] * at[2] + matrix[12 + i]);
  if (v[3] <= 0) return null;
  return [(v[0] / v[3] + 1) / 2 * canvas.clientWidth, (1 - v[1] / v[3]) / 2 * canvas.clientHeight];
}

// The source or door within 24 pixels.
function grabbed(event) {
  const { matrix } = camera_now();
  let best = null, nearest = 24;
  const offer = (kind, number, at) => {
    const pixel = pixel_of(matrix, at);
    const distance = pixel ? Math.hypot(pixel[0] - event.clientX, pixel[1] - event.clientY) : Infinity;
    if (distance < nearest) [nearest, best] = [distance, { kind, number }];
  };
  state.sources.forEach((at, number) => offer("source", number, at));
  state.doors.forEach((door, number) => {
    for (const up of [0.5, 1, 1.5]) offer("door", number, add(door_end(door), [0, up, 0]));
  });
  return best;
}

let grip = null;
canvas.addEventListener("pointerdown", (event) => {
  canvas.setPointerCapture(event.pointerId);
  grip = (state && grabbed(event)) || { kind: "camera" };
});
canvas.addEventListener("pointerup", () => { grip = null; });
canvas.addEventListener("pointermove", (event) => {
  if (!grip || !state) return;
  if (grip.kind === "camera") {
    camera.yaw -= 0.006 * event.movementX;
    camera.pitch = Math.max(-1.5, Math.min(1.5, camera.pitch + 0.006 * event.movementY));
  } else if (grip.kind === "source") {
    const height = state.sources[grip.number][1], { point } = at_height(event, height);
    if (point) dragged.sources.set(grip.number, [point[0], height, point[2]]);
  } else {
    const door = state.doors[grip.number], { point } = at_height(event, door.hinge[1] + 1);
    if (point) dragged.doors.set(grip.number, Math.atan2(point[0] - door.hinge[0], point[2] - door.hinge[2]));
  }
});
canvas.addEventListener("wheel", (event) => {
  camera.distance_m = Math.max(1.5, Math.min(400, camera.distance_m * Math.exp(0.001 * event.deltaY)));
  event.preventDefault();
}, { passive: false });
addEventListener("keydown", (event) => {
  const key = event.key.toLowerCase();
  if (key === "v" && !event.repeat) camera.own_eyes = !camera.own_eyes;
  held.add({ arrowup: "w", arrowdown: "s", arrowleft: "q", arrowright: "e" }[key] || key);
});
addEventListener("keyup", (event) => {
  const key = event.key.toLowerCase();
  held.delete({ arrowup: "w", arrowdown: "s", arrowleft: "q", arrowright: "e" }[key] || key);
});
addEventListener("blur", () => held.clear());

function show_figures() {
  const rows = [
    ["Paths", state.all_paths], ["Update", `${state.update_ms.toFixed(1)} ms`], ["Rays an update", state.rays],
    ["Extrapolation level", state.level], ["Quality level", state.quality], ["Predictor", state.predictor],
    ["Block, median", `${state.block_percent.toFixed(1)} %`], ["Block, worst", `${state.worst_percent.toFixed(0)} %`],
    ["Missed blocks", state.missed], ["Ears at", state.listener.map((x) => x.toFixed(1)).join(", ")],
  ];
  const table = document.querySelector("#figures table");
  while (table.rows.length < rows.length) { const row = table.insertRow(); row.insertCell(); row.insertCell(); }
  rows.forEach(([name, value], i) => {
    table.rows[i].cells[0].textContent = name;
    table.rows[i].cells[1].textContent = value;
  });
}

async function step() {
  const keys = [..."wasdqe"].filter((key) => held.has(key)).join("");
  const body = JSON.stringify({ keys, sources: [...dragged.sources], doors: [...dragged.doors] });
  dragged = { sources: new Map(), doors: new Map() };
  const lost = document.getElementById("lost");
  try {
    const answer = await fetch("step", { method: "POST", body });
    const fresh = await answer.json();
    if (fresh.listener) { state = fresh; show_figures(); show_reverb(state); }
    lost.hidden = true;
  } catch { lost.hidden = false; }
  setTimeout(step, STEP_MS);
}

function show_orders() {
  const panel = document.getElementById("orders");
  ORDER_COLOURS.forEach(([r, g, b, name], number) => {
    const label = document.createElement("label"), box = document.createElement("input"), swatch = document.createElement("span");
    box.type = "checkbox";
    box.checked = true;
    box.addEventListener("change", () => { shown[number] = box.checked; });
    swatch.className = "swatch";
    swatch.style.background = `rgb(${[r, g, b].map((x) => Math.round(255 * x))})`;
    label.append(box, " ", swatch, name);
    panel.append(label);
  });
}

// Sound: fetched in pieces, shown as a spectrogram, played by the browser where asked for.
const FFT = 1024;
const spectrogram = document.getElementById("spectrogram").getContext("2d", { willReadFrequently: true });
const levels = document.getElementById("levels").getContext("2d");
let next_frame = 0, audio = null, play_at = 0, waiting = new Float32Array(0);

function spectrum(samples) {
  const re = new Float32Array(FFT), im = new Float32Array(FFT);
  for (let i = 0, j = 0; i < FFT; i++) {
    re[j] = samples[i] * (0.5 - 0.5 * Math.cos(2 * Math.PI * i / FFT));
    let bit = FFT >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j |= bit;
  }
  for (let n = 2; n <= FFT; n <<= 1) {
    for (let k = 0; k < n / 2; k++) {
      const wr = Math.cos(2 * Math.PI * k / n), wi = -Math.sin(2 * Math.PI * k / n);
      for (let a = k; a < FFT; a += n) {
        const b = a + n / 2, xr = re[b] * wr - im[b] * wi, xi = re[b] * wi + im[b] * wr;
        [re[b], im[b]] = [re[a] - xr, im[a] - xi];
        [re[a], im[a]] = [re[a] + xr, im[a] + xi];
      }
    }
  }
  return re.map((x, i) => 10 * Math.log10((x * x + im[i] * im[i]) / (FFT * FFT / 16) + 1e-12));
}

// A column from 50 Hz to 16 kHz, by octaves.
function draw_column(samples, rate_hz) {
  const { width, height } = spectrogram.canvas, power = spectrum(samples);
  spectrogram.drawImage(spectrogram.canvas, -1, 0);
  for (let y = 0; y < height; y++) {
    const hz = 50 * (320 ** (1 - y / height)), db = power[Math.round(hz / rate_hz * FFT)];
    const x = Math.max(0, Math.min(1, (db + 95) / 75));
    spectrogram.fillStyle = `rgb(${255 * Math.min(1, 2 * x)}, ${255 * Math.max(0, 1.6 * x - 0.6)}, ${160 * x * (1 - x) * 4})`;
    spectrogram.fillRect(width - 1, y, 1, 1);
  }
}

function draw_levels(ears) {
  const { width } = levels.canvas;
  levels.clearRect(0, 0, width, 10);
  ears.forEach((samples, ear) => {
    const power = samples.reduce((sum, x) => sum + x * x, 0) / Math.max(1, samples.length);
    const share = Math.max(0, 1 + 10 * Math.log10(power + 1e-9) / 70);
    levels.fillStyle = share > 0.93 ? "#e05050" : "#50b070";
    levels.fillRect(0, 5 * ear, share * width, 4);
  });
}

async function hear() {
  try {
    const bytes = await (await fetch(`sound?from=${next_frame}`)).arrayBuffer();
    const header = new DataView(bytes), rate_hz = header.getUint32(0, true);
    const first = Number(header.getBigUint64(4, true)), samples = new Int16Array(bytes, 12);
    const frames = samples.length / 2, ears = [new Float32Array(frames), new Float32Array(frames)];
    for (let i = 0; i < frames; i++) for (let e = 0; e < 2; e++) ears[e][i] = samples[2 * i + e] / 32767;
    next_frame = first + frames;
    if (frames > 0) {
      draw_levels(ears);
      const all = new Float32Array(waiting.length + frames);
      all.set(waiting);
      for (let i = 0; i < frames; i++) all[waiting.length + i] = 0.5 * (ears[0][i] + ears[1][i]);
      let at = Math.max(0, all.length - 16 * FFT);
      for (; at + FFT <= all.length; at += FFT / 2) draw_column(all.subarray(at, at + FFT), rate_hz);
      waiting = all.slice(at);
      if (audio) {
        const piece = audio.createBuffer(2, frames, rate_hz);
        ears.forEach((values, ear) => piece.copyToChannel(values, ear));
        const node = audio.createBufferSource();
        node.buffer = piece;
        node.connect(audio.destination);
        if (play_at < audio.currentTime) play_at = audio.currentTime + 0.15;
        node.start(play_at);
        play_at += frames / rate_hz;
      }
    }
  } catch { /* `step` shows it. */ }
  setTimeout(hear, SOUND_MS);
}

document.getElementById("cut").addEventListener("change", (event) => event.target.blur());
document.getElementById("listen").addEventListener("click", (event) => {
  if (audio) { audio.close(); audio = null; } else { audio = new AudioContext(); play_at = 0; }
  event.target.textContent = audio ? "Sound off" : "Sound on";
});

show_orders();
load_mesh();
step();
hear();
draw();
