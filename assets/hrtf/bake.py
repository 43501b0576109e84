#!/usr/bin/env python3
"""Bakes the MIT KEMAR responses into the compact form that the binaural renderer reads.

Takes   MIT_KEMAR_normal_pinna.sofa (Debian libmysofa1), numpy, scipy, h5py.
Gives   kemar_44100.hrtf and kemar_48000.hrtf, and on standard output the error tables.
Promise both ears are exact mirror images, so a source in the median plane reaches them alike;
        every response is a delay and a sum of K basis filters, nothing added.

    python3 assets/hrtf/bake.py MIT_KEMAR_normal_pinna.sofa [--out assets/hrtf]

Source: Gardner and Martin 1994 (data). The split into delay and minimum phase is that of
Kistler and Wightman 1992, their principal components adapted: linear filters instead of
logarithmic magnitudes, so that components add in the signal path.
"""

import argparse
import pathlib
import struct

import h5py
import numpy as np
from scipy.interpolate import CubicSpline

MAGIC = b"FSHRTF1\0"
TAPS = 128
COMPONENTS = 16
AZIMUTHS = 72
ELEVATIONS = 37
FFT = 4096
# The measurements carry little below: 512 taps resolve 86 Hz and the loudspeaker rolls off.
# From here down to 0 Hz the level in dB falls linearly to 0, where the head casts no shadow.
LOW_HZ = 200.0
# Between these the level goes over to its mean from HELD_FROM_HZ to HIGH_HZ, which holds from
# there up: the anti-alias filter of the measurement begins, its inverse would only raise noise.
HELD_FROM_HZ, BLEND_HZ, HIGH_HZ = 14_000.0, 16_000.0, 18_000.0
# Delays are estimated below this, where the shadowed ear still has signal.
DELAY_LOW_PASS_HZ = 3_000.0
DELAY_OVERSAMPLING = 16
# Standard deviation of the kernel that smooths delays over the sphere: about the spacing of
# the measurement.
DELAY_SMOOTHING_DEG = 5.0
# The shadowed ear is up to 25 dB quieter. Rows are weighted by energy to this power (in
# addition to area), so that the basis serves it too; 0 would minimise the absolute error.
ENERGY_EXPONENT = -0.5
FLOOR = 1e-5
LN_TO_DB = 20 / np.log(10)

AZIMUTH_DEG = np.arange(AZIMUTHS) * 5.0
ELEVATION_DEG = np.arange(ELEVATIONS) * 5.0 - 90.0


def read_left_ear(path):
    """Directions (azimuth to the left, elevation, in degrees) and left ear responses [taps].

    The right ear's response is folded in from the mirrored direction.
    """
    with h5py.File(path) as sofa:
        position = sofa["SourcePosition"][...]
        response = sofa["Data.IR"][...]
        rate_hz = float(sofa["Data.SamplingRate"][0])
        if sofa["ReceiverPosition"][0, 1, 0] <= 0:
            raise SystemExit("the first receiver is not the left ear")
    azimuth, elevation = position[:, 0] % 360, position[:, 1]
    mirrored = []
    for a, e in zip(azimuth, elevation):
        distance = np.abs((azimuth + a + 180) % 360 - 180) + np.abs(elevation - e)
        mirrored.append(np.argmin(distance))
        if distance.min() > 0.01:
            raise SystemExit(f"no mirror image of azimuth {a}, elevation {e}")
    left, right = response[:, 0], response[mirrored, 1]
    print(f"left and right differ by at most {np.abs(left - right).max():.2g} before averaging")
    return azimuth, elevation, (left + right) / 2, rate_hz


def minimum_phase(log_magnitude, taps):
    """Minimum-phase responses of natural-log magnitudes [..., FFT/2 + 1], by the cepstrum."""
    cepstrum = np.fft.irfft(log_magnitude, FFT)
    cepstrum[..., 1 : FFT // 2] *= 2
    cepstrum[..., FFT // 2 + 1 :] = 0
    response = np.fft.irfft(np.exp(np.fft.rfft(cepstrum)), FFT)[..., :taps]
    fade = taps // 4
    response[..., -fade:] *= 0.5 + 0.5 * np.cos(np.pi * (np.arange(fade) + 0.5) / fade)
    return response


def onset_delay_s(response, rate_hz):
    """Delay of each response behind its own minimum-phase version, by cross-correlation."""
    spectrum = np.fft.rfft(response, FFT)
    log_magnitude = np.log(np.maximum(np.abs(spectrum), FLOOR))
    reference = np.fft.rfft(minimum_phase(log_magnitude, response.shape[1]), FFT)
    frequency_hz = np.fft.rfftfreq(FFT, 1 / rate_hz)
    low_pass = 1 / (1 + (frequency_hz / DELAY_LOW_PASS_HZ) ** 8)
    padded = FFT * DELAY_OVERSAMPLING
    correlation = np.fft.irfft(spectrum * reference.conj() * low_pass, padded)[:, : padded // 8]
    peak = np.argmax(correlation, axis=1)
    rows = np.arange(len(peak))
    before, at, after = (correlation[rows, peak + step] for step in (-1, 0, 1))
    fraction = 0.5 * (before - after) / (before - 2 * at + after)
    return (peak + fraction) / (rate_hz * DELAY_OVERSAMPLING)


def align_rings(azimuth, elevation, delay_s):
    """Takes out what differs between rings for both ears alike: the loudspeaker's distance.

    A source in the median plane is as far from the ears as from the centre between them, give
    or take an offset of the ears to the front or back, which front and back together cancel.
    """
    aligned = delay_s.copy()
    for ring in np.unique(np.round(elevation)):
        chosen = np.round(elevation) == ring
        median = np.interp([0, 180], azimuth[chosen], delay_s[chosen], period=360)
        aligned[chosen] -= median.mean()
        print(f"elevation {ring:+3.0f}: median plane at {1e6 * median.mean():.0f} us")
    return aligned


def log_magnitude(response, rate_hz, out_rate_hz):
    """Natural-log magnitude at the FFT frequencies of another rate, by direct transform.

    What lies beyond HIGH_HZ is held, so the band between two Nyquist limits is filled.
    """
    frequency_hz = np.fft.rfftfreq(FFT, 1 / out_rate_hz)
    phase = -2j * np.pi / rate_hz * np.outer(np.arange(response.shape[1]), frequency_hz)
    level = np.log(np.maximum(np.abs(response @ np.exp(phase)), FLOOR))
    averaged = (frequency_hz >= HELD_FROM_HZ) & (frequency_hz < HIGH_HZ)
    held = level[:, averaged].mean(axis=1, keepdims=True)
    share = np.clip((frequency_hz - BLEND_HZ) / (HIGH_HZ - BLEND_HZ), 0, 1)
    return level + share * (held - level)


def to_grid(azimuth, elevation, value):
    """Interpolates values [direction, ...] to [ELEVATIONS, AZIMUTHS, ...].

    Around a ring by a periodic cubic, between rings linearly. Below the lowest ring the
    deviation from its mean shrinks with the cosine of the elevation, as the distance of a
    point of the sphere from the vertical axis does.
    """
    rings = np.unique(np.round(elevation))
    on_ring = []
    for ring in rings:
        chosen = np.flatnonzero(np.round(elevation) == ring)
        chosen = chosen[np.argsort(azimuth[chosen])]
        if len(chosen) == 1:
            on_ring.append(np.repeat(value[chosen], AZIMUTHS, axis=0))
            continue
        knots = np.append(azimuth[chosen], azimuth[chosen[0]] + 360)
        closed = np.concatenate([value[chosen], value[chosen[:1]]])
        on_ring.append(CubicSpline(knots, closed, bc_type="periodic")(AZIMUTH_DEG))
    grid = np.empty((ELEVATIONS, *on_ring[0].shape))
    lowest_mean = on_ring[0].mean(axis=0)
    for row, e in enumerate(ELEVATION_DEG):
        if e <= rings[0]:
            share = np.cos(np.radians(e)) / np.cos(np.radians(rings[0]))
            grid[row] = lowest_mean + share * (on_ring[0] - lowest_mean)
            continue
        above = np.searchsorted(rings, e)
        share = (e - rings[above - 1]) / (rings[above] - rings[above - 1])
        grid[row] = (1 - share) * on_ring[above - 1] + share * on_ring[above]
    grid[0] = grid[0].mean(axis=0)
    return grid


def cell_area():
    """Share of the sphere that each grid point stands for; the sum is 1."""
    edges = np.radians(np.clip(np.append(ELEVATION_DEG - 2.5, 92.5), -90, 90))
    band = np.diff(np.sin(edges)) / 2
    return np.repeat(band[:, None] / AZIMUTHS, AZIMUTHS, axis=1)


def smooth_over_sphere(grid):
    """Convolves values [ELEVATIONS, AZIMUTHS] with a Gaussian of DELAY_SMOOTHING_DEG."""
    e, a = np.meshgrid(np.radians(ELEVATION_DEG), np.radians(AZIMUTH_DEG), indexing="ij")
    point = np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], -1).reshape(-1, 3)
    cosine = np.clip(point @ point.T, -1, 1)
    kernel = np.exp((cosine - 1) / np.radians(DELAY_SMOOTHING_DEG) ** 2) * cell_area().ravel()
    return (kernel @ grid.ravel() / kernel.sum(axis=1)).reshape(grid.shape)


def mirror(left):
    """The right ear's grid of a left ear's grid."""
    return left[:, (-np.arange(AZIMUTHS)) % AZIMUTHS]


def equalise(level, rate_hz):
    """Makes the power average over the sphere flat and the low end transparent."""
    area = cell_area()[..., None]
    level = level - 0.5 * np.log((area * np.exp(2 * level)).sum(axis=(0, 1)))
    frequency_hz = np.fft.rfftfreq(FFT, 1 / rate_hz)
    low = np.searchsorted(frequency_hz, LOW_HZ)
    level[..., :low] = level[..., low : low + 1] * (frequency_hz[:low] / frequency_hz[low])
    return level - 0.5 * np.log((area * np.exp(2 * level)).sum(axis=(0, 1)))


def factor(response, components):
    """Basis [K, TAPS] and weights [ELEVATIONS, AZIMUTHS, K] of responses [.., .., TAPS]."""
    flat = response.reshape(-1, TAPS)
    energy = (flat**2).sum(axis=1)
    row_weight = np.sqrt(cell_area().ravel() * energy**ENERGY_EXPONENT)
    _, _, basis = np.linalg.svd(flat * row_weight[:, None], full_matrices=False)
    basis = basis[:components]
    return basis, (flat @ basis.T).reshape(*response.shape[:2], components)


def bands(rate_hz):
    """Names and bins of the octave bands, and of two spans."""
    frequency_hz = np.fft.rfftfreq(FFT, 1 / rate_hz)
    span = {f"{centre:g}": (centre / 2**0.5, centre * 2**0.5) for centre in 62.5 * 2.0 ** np.arange(1, 9)}
    span["80 to 16 k"] = (80, 16_000)
    return {name: (frequency_hz >= low) & (frequency_hz < high) for name, (low, high) in span.items()}


def spectrum_db(response):
    return LN_TO_DB * np.log(np.maximum(np.abs(np.fft.rfft(response, FFT)), FLOOR))


def print_errors(response, rate_hz):
    """Errors in dB of K components against the full responses, in Markdown."""
    full = spectrum_db(response)
    area = cell_area()
    print(f"\n### {rate_hz} Hz\n")
    names = bands(rate_hz)
    print("| K | measure | " + " | ".join(names) + " |")
    print("|---|---|" + "---|" * len(names))
    for components in (8, 12, 16, 20, 24, 32):
        basis, weights = factor(response, components)
        short = spectrum_db(weights @ basis)
        mean, level, worst = [], [], []
        for bins in names.values():
            bin_error = np.abs(short[..., bins] - full[..., bins])
            power = [np.log10((10 ** (s[..., bins] / 10)).sum(axis=-1)) * 10 for s in (short, full)]
            mean.append((area * bin_error.mean(axis=-1)).sum())
            level.append(np.abs(power[0] - power[1]).max())
            worst.append(bin_error.max())
        for label, row in (("mean", mean), ("max, band level", level), ("max, one bin", worst)):
            print(f"| {components} | {label} | " + " | ".join(f"{x:.2f}" for x in row) + " |")


def write(path, rate_hz, basis, weights, delay_s):
    """Little endian; see README.md beside this file."""
    right_weights, right_delay_s = mirror(weights), mirror(delay_s)
    body = np.stack(
        [
            np.concatenate([delay_s[..., None], weights], axis=-1),
            np.concatenate([right_delay_s[..., None], right_weights], axis=-1),
        ],
        axis=2,
    )
    with open(path, "wb") as out:
        out.write(MAGIC + struct.pack("<5I", rate_hz, TAPS, len(basis), AZIMUTHS, ELEVATIONS))
        out.write(basis.astype("<f4").tobytes())
        out.write(body.astype("<f4").tobytes())


def check(path):
    """Reads a baked file back and states what a listener would notice."""
    data = path.read_bytes()
    rate_hz, taps, components, azimuths, elevations = struct.unpack_from("<5I", data, 8)
    basis = np.frombuffer(data, "<f4", components * taps, 28).reshape(components, taps)
    body = np.frombuffer(data, "<f4", -1, 28 + 4 * components * taps)
    body = body.reshape(elevations, azimuths, 2, components + 1)
    delay_s, response = body[..., 0], body[..., 1:] @ basis
    power = (np.abs(np.fft.rfft(response, FFT)) ** 2).mean(axis=2)
    diffuse_db = 10 * np.log10((cell_area()[..., None] * power).sum(axis=(0, 1)))
    horizon = elevations // 2
    side, front = azimuths // 4, 0
    energy_db = 10 * np.log10((response**2).sum(axis=-1))
    print(f"\n{path.name}: {len(data)} bytes, {components} components")
    print(f"  delay {delay_s.min():.6f} to {delay_s.max():.6f} s, ahead {delay_s[horizon, front, 0]:.6f} s")
    print(f"  azimuth 90: right behind left by {1e3 * (delay_s[horizon, side, 1] - delay_s[horizon, side, 0]):.3f} ms,"
          f" quieter by {energy_db[horizon, side, 0] - energy_db[horizon, side, 1]:.1f} dB")
    print(f"  ahead: ears equal {np.array_equal(body[horizon, front, 0], body[horizon, front, 1])}")
    for name, bins in bands(rate_hz).items():
        print(f"  diffuse field {name:>10s} Hz: mean {diffuse_db[bins].mean():+.2f} dB,"
              f" {diffuse_db[bins].min():+.2f} to {diffuse_db[bins].max():+.2f}")


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("sofa", type=pathlib.Path)
    arguments.add_argument("--out", type=pathlib.Path, default=pathlib.Path(__file__).parent)
    given = arguments.parse_args()

    azimuth, elevation, measured, rate_hz = read_left_ear(given.sofa)
    delay_s = smooth_over_sphere(
        to_grid(azimuth, elevation, align_rings(azimuth, elevation, onset_delay_s(measured, rate_hz)))
    )
    delay_s -= delay_s.min()
    for out_rate_hz in (44_100, 48_000):
        level = to_grid(azimuth, elevation, log_magnitude(measured, rate_hz, out_rate_hz))
        response = minimum_phase(equalise(level, out_rate_hz), TAPS)
        print_errors(response, out_rate_hz)
        path = given.out / f"kemar_{out_rate_hz}.hrtf"
        write(path, out_rate_hz, *factor(response, COMPONENTS), delay_s)
        check(path)


if __name__ == "__main__":
    main()
