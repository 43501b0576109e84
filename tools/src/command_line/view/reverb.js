// The late reverb on the page: where its energy comes from, as a map of the sphere around the listener, and its level and decay
// by band.
"use strict";

const BAND_NAMES = ["63", "125", "250", "500", "1k", "2k", "4k", "8k"];
const SILENCE_DB = -110;
// Levels that the map's colours span, around the mean of all directions.
const SPAN_DB = 4;

const sphere = document.getElementById("reverb_sphere");
const band_bars = document.getElementById("reverb_bands");
const band_choice = document.getElementById("reverb_band");
["all bands", ...BAND_NAMES.map((name) => `${name} Hz`)].forEach((name, number) => band_choice.add(new Option(name, number - 1)));

const energy_of = (db) => (db <= SILENCE_DB ? 0 : 10 ** (db / 10));
const level_of = (energy) => (energy > 0 ? 10 * Math.log10(energy) : -Infinity);

// Blue below the mean, grey at it, orange above.
function level_colour(relative_db) {
  const x = Math.max(-1, Math.min(1, relative_db / SPAN_DB)), low = [38, 70, 140], middle = [78, 82, 90], high = [250, 150, 50];
  const to = x < 0 ? low : high;
  return middle.map((from, i) => from + (to[i] - from) * Math.abs(x));
}

// The direction of a point of the map: the listener's zenith in the middle, the horizon at 1/√2, the nadir all around; ahead is
// up, areas are true (Lambert's azimuthal projection).
function direction_of(x, y) {
  const r = Math.hypot(x, y);
  if (r > 1) return null;
  const up = 1 - 2 * r * r, flat = Math.sqrt(Math.max(0, 1 - up * up));
  return r > 0 ? [flat * x / r, up, flat * y / r] : [0, 1, 0];
}

function point_of(right, up, ahead) {
  const flat = Math.hypot(right, ahead), r = Math.sqrt((1 - up) / 2);
  return flat > 0 ? [r * right / flat, -r * ahead / flat] : [0, 0];
}

// Energies of the twelve directions in the chosen band, and the directions in the listener's horizontal axes.
function around(state) {
  const { directions, levels_db } = state.reverb, band = Number(band_choice.value);
  const flat = Math.hypot(state.ahead[0], state.ahead[2]) || 1;
  const ahead = [state.ahead[0] / flat, state.ahead[2] / flat];
  return directions.map(([x, y, z], i) => ({
    // Ahead is (ax, az), to the right of it (-az, ax).
    right: -ahead[1] * x + ahead[0] * z, up: y, ahead: ahead[0] * x + ahead[1] * z,
    // Of all bands the mean, as a path's level.
    energy: band < 0 ? levels_db[i].reduce((sum, db) => sum + energy_of(db), 0) / levels_db[i].length : energy_of(levels_db[i][band]),
  }));
}

// The twelve energies spread over the sphere: each weighs cos⁴ of the angle, up to 90 degrees.
function energy_towards(lobes, right, up, ahead) {
  let sum = 0, weights = 0;
  for (const lobe of lobes) {
    const cosine = Math.max(0, lobe.right * right + lobe.up * up + lobe.ahead * ahead), weight = cosine ** 4;
    sum += weight * lobe.energy;
    weights += weight;
  }
  return sum / weights;
}

function draw_sphere(lobes, mean) {
  const context = sphere.getContext("2d"), size = sphere.width, half = size / 2, radius = half - 14;
  const cells = 64, image = new ImageData(cells, cells);
  for (let row = 0; row < cells; row++) for (let column = 0; column < cells; column++) {
    const [x, y] = [column, row].map((n) => ((n + 0.5) / cells * 2 - 1) * half / radius), at = direction_of(x, y);
    if (!at || mean <= 0) continue;
    const level = level_of(energy_towards(lobes, at[0], at[1], -at[2]) / mean);
    image.data.set([...level_colour(level), 255], 4 * (row * cells + column));
  }
  const small = new OffscreenCanvas(cells, cells);
  small.getContext("2d").putImageData(image, 0, 0);
  context.clearRect(0, 0, size, size);
  context.save();
  context.beginPath();
  context.arc(half, half, radius, 0, 2 * Math.PI);
  context.clip();
  context.drawImage(small, 0, 0, size, size);
  context.restore();
  context.strokeStyle = "#8a909a";
  for (const r of [radius, radius / Math.SQRT2]) {
    context.beginPath();
    context.arc(half, half, r, 0, 2 * Math.PI);
    context.stroke();
  }
  context.fillStyle = "#d8dce2";
  context.font = "11px system-ui, sans-serif";
  context.textAlign = "center";
  context.fillText("ahead", half, 10);
  context.fillText("behind", half, size - 3);
  for (const [text, x] of [["left", 24], ["right", size - 26]]) context.fillText(text, x, half - radius * 0.72);
  for (const lobe of lobes) {
    const [x, y] = point_of(lobe.right, lobe.up, lobe.ahead), level = level_of(lobe.energy);
    const [px, py] = [half + x * radius, half + y * radius];
    context.fillStyle = "#fff";
    context.beginPath();
    context.arc(px, py, 2, 0, 2 * Math.PI);
    context.fill();
    if (Number.isFinite(level)) context.fillText(level.toFixed(0), px, py - 5);
  }
}

// Level of all directions together, and decay time, by band.
function draw_bands({ levels_db, decay_s }) {
  const context = band_bars.getContext("2d"), { width, height } = band_bars, step = width / BAND_NAMES.length;
  context.clearRect(0, 0, width, height);
  context.font = "10px system-ui, sans-serif";
  context.textAlign = "center";
  BAND_NAMES.forEach((name, b) => {
    const level = level_of(levels_db.reduce((sum, bands) => sum + energy_of(bands[b]), 0));
    const share = Math.max(0, Math.min(1, (level + 60) / 60)), x = b * step;
    context.fillStyle = Number(band_choice.value) === b ? "#fa9632" : "#50b070";
    context.fillRect(x + 2, 54 - 40 * share, step - 4, 40 * share);
    context.fillStyle = "#d8dce2";
    if (Number.isFinite(level)) context.fillText(level.toFixed(0), x + step / 2, 50 - 40 * share);
    context.fillText(name, x + step / 2, 66);
    context.fillText(decay_s[b] > 0 ? `${decay_s[b].toFixed(1)} s` : "-", x + step / 2, 79);
  });
}

function show_reverb(state) {
  const lobes = around(state), whole = lobes.reduce((sum, lobe) => sum + lobe.energy, 0);
  draw_sphere(lobes, whole / lobes.length);
  draw_bands(state.reverb);
  document.getElementById("reverb_text").textContent = whole > 0
    ? `${level_of(whole).toFixed(1)} dB in all; zenith in the middle, inner circle the horizon`
    : "none";
}
