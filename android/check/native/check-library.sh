#!/usr/bin/env bash
# Checks of an Android library without a device: machine, pages, relocations, needed libraries, size.
# Usage: check-library.sh LIBRARY; the last line is the figures.
set -euo pipefail
library=${1:?library}
# HRTF sets are data of this many bytes; the limit is for the code, against growth that nobody notices. It was 3 MiB before SOFA
# files were read (hdf5-pure and rustfft: 0.8 MB), which is still the aim.
most_bytes=$((4 * 1024 * 1024 + 512 * 1024))
here=$(cd "$(dirname "$0")" && pwd)
hrtf_bytes=$(cat "$here"/../../../assets/hrtf/*.hrtf | wc -c)
bad=0
fail() { echo "FAIL $*" && bad=1; }

header=$(llvm-readelf-22 -h "$library")
grep -q 'Machine:.*AArch64' <<<"$header" || fail "not for AArch64"
segments=$(llvm-readelf-22 -lW "$library")
alignments=$(awk '$1 == "LOAD" { print $NF }' <<<"$segments" | sort -u)
[ "$alignments" = 0x4000 ] || fail "segments are aligned to $alignments, not 16 KiB"
grep -qE 'LOAD.* RWE' <<<"$segments" && fail "a segment is writable and executable"
grep -qE 'GNU_STACK.* RWE' <<<"$segments" && fail "the stack is executable"
grep -q 'GNU_RELRO' <<<"$segments" || fail "no read-only relocations"
dynamic=$(llvm-readelf-22 -dW "$library")
grep -q TEXTREL <<<"$dynamic" && fail "text relocations"
needed=$(sed -n 's/.*NEEDED.*\[\(.*\)\]/\1/p' <<<"$dynamic" | sort)
for name in $needed; do
    case $name in
    libc.so | libm.so | libdl.so | liblog.so | libandroid.so | libaaudio.so | libOpenSLES.so) ;;
    *) fail "needs $name, which API 26 does not have" ;;
    esac
done
stripped=$(mktemp)
trap 'rm -f "$stripped"' EXIT
llvm-strip-22 --strip-unneeded -o "$stripped" "$library"
bytes=$(stat -c %s "$stripped")
code=$((bytes - hrtf_bytes))
[ "$code" -le "$most_bytes" ] || fail "$code bytes without HRTF sets, more than $most_bytes"
echo "stripped $bytes bytes, $code without HRTF sets; 16 KiB segments; no text relocations; needs $(xargs <<<"$needed")"
exit $bad
