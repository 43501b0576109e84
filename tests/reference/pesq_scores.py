#!/usr/bin/env python3
"""Scores of the ITU's program (PyPI pesq 0.0.4) for the degradations of tests/pesq.rs, which does the same arithmetic.

Usage: pesq_scores.py assets/speech     Needs: pip install numpy scipy pesq
"""
import sys

import numpy as np
from pesq import pesq
from scipy.io import wavfile
from scipy.signal import lfilter, resample_poly


def noise(count):
    state, out = np.uint64(1), np.empty(count)
    for n in range(count):
        state = (state * np.uint64(1664525) + np.uint64(1013904223)) & np.uint64(0xFFFFFFFF)
        out[n] = float(state) / 2.0**31 - 1.0
    return out


def vary(x, depth, hz, rate):
    n = np.arange(len(x))
    at = n - depth * (1 - np.cos(2 * np.pi * hz * n / rate))
    low = np.floor(at).astype(int)
    pick = lambda i: np.where((i >= 0) & (i < len(x)), x[np.clip(i, 0, len(x) - 1)], 0)
    return pick(low) + (at - low) * (pick(low + 1) - pick(low))


def delayed(x, count):
    return np.concatenate([np.zeros(count), x[:-count]])


def degradations(x, rate):
    hiss = noise(len(x)) * np.sqrt(np.mean(x**2)) * np.sqrt(3)
    gate = (np.arange(len(x)) // (rate // 50)) % 10 != 9
    low = lfilter([0.25], [1, -0.75], x)
    return {
        "identical": x,
        "half": 0.5 * x,
        "noise_30_db": x + hiss * 10 ** (-30 / 20),
        "noise_15_db": x + hiss * 10 ** (-15 / 20),
        "noise_5_db": x + hiss * 10 ** (-5 / 20),
        "low_pass": low,
        "high_pass": x - low,
        "clipped": np.clip(x, -0.1, 0.1),
        "coarse": np.round(x * 64) / 64,
        "delayed": delayed(x, 1000),
        "echo": x + 0.5 * delayed(x, 4000),
        "lost": x * gate,
        "slow_delay": vary(x, 40, 0.5, rate),
    }


folder = sys.argv[1]
for voice in ("voice01", "voice05"):
    rate, data = wavfile.read(f"{folder}/{voice}.wav")
    x = data[: 4 * rate].astype(np.float64) / 32768.0
    for name, y in degradations(x, rate).items():
        r, e = (resample_poly(s, 160, 441) for s in (x, y))
        peak = np.abs(r).max()
        score = pesq(16000, (r / peak * 0.8).astype(np.float32), (e / peak * 0.8).astype(np.float32), "wb")
        print(f'    ("{voice}", "{name}", {score:.4f}),')
