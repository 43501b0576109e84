#!/usr/bin/env bash
# Times propagation updates of this library and of Steam Audio in the same scenes, alternating, one process each.
# STEAM_AUDIO: a folder with include/phonon.h and lib/libphonon.so; without it only our own times are printed.
# EMBREE=1: also with Embree, which the library must contain. SCENES, SOURCES (lists), THREADS (1 or 2), ROUNDS (3), SECONDS_A_ROW (2) in
# each round; PIN: processors for taskset, such as 0,1. A figure is the least of all rounds, in wall milliseconds: run it while
# nothing else runs.
set -euo pipefail
cd "$(dirname "$0")/.."
out=$PWD/target/steam-audio
mkdir -p "$out"
rounds=${ROUNDS:-3} seconds=${SECONDS_A_ROW:-2} threads=${THREADS:-1}
pinned=()
[ -z "${PIN:-}" ] || pinned=(taskset -c "$PIN")
cargo build --quiet --release --bin foresound
foresound=${CARGO_TARGET_DIR:-target}/release/foresound
"$foresound" scenes --out "$out" >/dev/null
theirs=()
if [ -n "${STEAM_AUDIO:-}" ]; then
    gcc -O2 -Wall -Wextra -I"$STEAM_AUDIO/include" -o "$out/steam-audio" benches/steam-audio.c \
        -L"$STEAM_AUDIO/lib" -Wl,-rpath,"$(realpath "$STEAM_AUDIO/lib")" -lphonon -lm
    theirs=('default parametric' 'default convolution')
    [ -z "${EMBREE:-}" ] || theirs+=('embree parametric' 'embree convolution')
else
    echo 'STEAM_AUDIO is not set: only our own times.'
fi

# The walk's ends and the sources of a scene, a position a line.
positions() {
    local numbers='s/.*\[(.*)\].*/\1/; s/,//g'
    sed -nE "/^(from|to) = /{$numbers; p}" "$1"
    sed -nE "/^position = /{$numbers; p}" "$1"
}
# The value of a key of `bench speed`'s row.
value() { sed -E "s/.*\"$2\":([0-9.e-]+).*/\1/" <<<"$1"; }
# The lesser one of two numbers, of which the first may be missing.
least() { awk -v a="$1" -v b="$2" 'BEGIN { print (a == "" || b + 0 < a + 0) ? b : a }'; }

printf '%-14s %7s  ours, all moving  ours, at rest' scene sources
for kind in "${theirs[@]}"; do printf '  theirs, %s (direct, one ray, sphere us)' "$kind"; done
echo
infix=
[ "$threads" = 1 ] || infix=two_threads_
for scene in ${SCENES:-concert_hall bootcamp angrybot}; do
    positions "$out/$scene.toml" >"$out/$scene.positions"
    for sources in ${SOURCES:-1 4 16}; do
        moving= rest=
        declare -A best=()
        for _ in $(seq "$rounds"); do
            # One thread or two in our own benchmark as well; it measures both side by side.
            row=$("${pinned[@]}" "$foresound" bench speed --scene "$scene" --sources "$sources" --seconds "$seconds" --json)
            moving=$(least "$moving" "$(value "$row" "moving_sources_${infix}best_ms")")
            rest=$(least "$rest" "$(value "$row" "sps_${infix}best_ms")")
            for kind in "${theirs[@]}"; do
                read -r tracer effect <<<"$kind"
                read -r wall _ _ _ ray sphere < <("${pinned[@]}" "$out/steam-audio" "$out/$scene.obj" \
                    "$out/$scene.positions" "$sources" "$threads" "$tracer" "$effect" "$seconds")
                for name in wall ray sphere; do
                    best[$kind $name]=$(least "${best[$kind $name]:-}" "${!name}")
                done
            done
        done
        printf '%-14s %7d  %16.2f  %13.2f' "$scene" "$sources" "$moving" "$rest"
        for kind in "${theirs[@]}"; do
            printf '  %.2f (%.2f, %.2f)' "${best[$kind wall]}" "${best[$kind ray]}" "${best[$kind sphere]}"
        done
        echo
    done
done
