#!/usr/bin/env bash
# Counts executed aarch64 instructions: per ray, by scene and set, per propagation update in the hall, and per block of sound.
# Arguments: scenes (default: all three), --updates for the updates alone, or --blocks [SOURCES [BLOCKS]] for the blocks
# alone (default: 16, 10,000). Needs qemu-aarch64, gcc, aarch64-linux-gnu-gcc and a standard library for
# aarch64-unknown-linux-gnu (`rustup target add`, or another compiler by RUSTC). A count of rays or updates is the difference
# between twice the work and once the work; a block's is that of Renderer::render. On one thread counts repeat exactly.
# TARGET_DIR: an existing build folder with these features.
set -euo pipefail
cd "$(dirname "$0")/.."
scenes=("$@")
[ $# -gt 0 ] || scenes=(concert_hall bootcamp angrybot)
case ${1:-} in --updates | --blocks) scenes=() ;; esac
target=aarch64-unknown-linux-gnu
out=target/count-aarch64
mkdir -p "$out"
target_dir=${TARGET_DIR:-$out}
for scene in "${scenes[@]}"; do
    (unset RUSTC && cargo run --quiet --release -- bench rays --scene "$scene" --rounds 1 --dump "$out") >"$out/$scene.txt"
done
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=${LINKER:-aarch64-linux-gnu-gcc}
cargo build --quiet --release --locked --no-default-features --features builtin-hrtf,capi --target "$target" \
    --target-dir "$target_dir" --example count_work --example count_blocks
gcc -O2 -shared -fPIC -o "$out/icount.so" benches/icount.c
# The cross package needs the path of the C library; a native C library must not have it.
qemu=(qemu-aarch64)
[ -e /lib/ld-linux-aarch64.so.1 ] || qemu+=(-L /usr/aarch64-linux-gnu)
emulated() {
    env -i "$(command -v "${qemu[0]}")" "${qemu[@]:1}" -plugin "$PWD/$out/icount.so" "$target_dir/$target/release/examples/$@"
}
instructions() {
    local output
    output=$(emulated count_work "$@" 2>&1) || { echo "$output" >&2 && return 1; }
    sed -n 's/^instructions //p' <<<"$output"
}
# The counts of all blocks, sorted, in a file: shares of them, and what happened meanwhile.
blocks() {
    local sources=${1:-16} blocks=${2:-10000} counts=$out/blocks.txt
    emulated count_blocks "$sources" "$blocks" 2>"$out/blocks.log"
    sed -n 's/^block //p' "$out/blocks.log" | sort -n >"$counts"
    grep swaps "$out/blocks.log"
    awk '{ count[NR] = $1; sum += $1 }
        function at(share) { return count[int(1 + share * (NR - 1))] }
        END { printf "instructions a block: mean %.0f, median %d, 99 %% %d, 99.9 %% %d, worst %d (%.2f of the median)\n",
            sum / NR, at(0.5), at(0.99), at(0.999), at(1), at(1) / at(0.5) }' "$counts"
}
if [ "${1:-}" = --blocks ]; then
    shift
    blocks "$@"
    exit
fi
[ ${#scenes[@]} = 0 ] || printf '%-14s %-11s %s\n' scene set 'instructions a ray'
for scene in "${scenes[@]}"; do
    for set in guide source visibility; do
        rays=$(($(stat -c %s "$out/$scene-$set.f32") / 28))
        once=$(instructions rays "$out" "$scene" "$set" 1)
        twice=$(instructions rays "$out" "$scene" "$set" 2)
        printf '%-14s %-11s %d\n' "$scene" "$set" $(((twice - once) / rays))
    done
done
for sources in 1 4 16; do
    for motion in standing update walking moving; do
        # Where all are at rest, updates are kept from the seventeenth without new rays on.
        first=4
        [ $motion != standing ] || first=24
        few=$(instructions $motion concert_hall "$sources" $first)
        many=$(instructions $motion concert_hall "$sources" $((first + 16)))
        # The mean of sixteen updates, one per ray rotation, in tenths of a million.
        tenths=$(((many - few) / 1600000))
        case $motion in standing) name='and the listener at rest' ;; update) name='at rest' ;; *) name=$motion ;; esac
        printf 'concert_hall, %d sources %s: %d.%d million instructions an update\n' \
            "$sources" "$name" $((tenths / 10)) $((tenths % 10))
    done
done
