#!/usr/bin/env python3
"""Compares two files of raw 32-bit floats by scale-invariant signal-to-distortion ratio.

usage: compare.py REFERENCE OTHER LEAST_DB
"""
import array
import math
import sys


def floats(path):
    values = array.array("f")
    with open(path, "rb") as file:
        values.frombytes(file.read())
    return values


reference, other = floats(sys.argv[1]), floats(sys.argv[2])
least_db = float(sys.argv[3])
if len(reference) != len(other) or not len(reference):
    sys.exit(f"{len(reference)} and {len(other)} samples")
power = math.fsum(a * a for a in reference)
if power == 0:
    sys.exit("the reference is silent")
scale = math.fsum(a * b for a, b in zip(reference, other)) / power
rest = math.fsum((b - scale * a) ** 2 for a, b in zip(reference, other))
ratio_db = 10 * math.log10(scale * scale * power / rest) if rest else math.inf
largest = max(abs(a - b) for a, b in zip(reference, other))
print(f"SI-SNR {ratio_db:.1f} dB, largest difference {largest:.3g} of {max(map(abs, reference)):.3g}, "
      f"{sum(a != b for a, b in zip(reference, other))} of {len(reference)} samples differ")
if not ratio_db >= least_db:
    sys.exit(f"SI-SNR {ratio_db:.1f} dB is below {least_db} dB")
