#!/usr/bin/env python3
"""Compares the output of bridge_reference on two machines: sounds by scale-invariant signal-to-noise ratio, paths by their
sets and amplitudes.

usage: compare.py SOUND OTHER_SOUND LEAST_DB PATHS OTHER_PATHS LARGEST_DIFFERENCE
"""
import array
import math
import sys


def floats(path):
    values = array.array("f")
    with open(path, "rb") as file:
        values.frombytes(file.read())
    return values


def paths(path):
    found = {}
    with open(path) as file:
        for line in file:
            update, identity, order, *numbers = line.split()
            found[update, identity, order] = [float(n) for n in numbers]
    return found


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
mine, theirs = paths(sys.argv[4]), paths(sys.argv[5])
if mine.keys() != theirs.keys() or not mine:
    sys.exit(f"{len(mine)} and {len(theirs)} paths, {len(mine.keys() ^ theirs.keys())} on one side only")
apart = max(abs(a - b) for key in mine for a, b in zip(mine[key][1:], theirs[key][1:]))
print(f"{len(mine)} paths in both, amplitudes within {apart:.1e}; SI-SNR {ratio_db:.1f} dB, largest difference {largest:.3g} of {max(map(abs, reference)):.3g}, "
      f"{sum(a != b for a, b in zip(reference, other))} of {len(reference)} samples differ")
if not apart <= float(sys.argv[6]):
    sys.exit(f"amplitudes differ by {apart}")
if not ratio_db >= least_db:
    sys.exit(f"SI-SNR {ratio_db:.1f} dB is below {least_db} dB")
