#!/usr/bin/env bash
# Counts executed aarch64 instructions: per ray, by scene and set, and per propagation update in the hall.
# Arguments: scenes (default: all three), or --updates for the updates alone. Needs qemu-aarch64, gcc,
# aarch64-linux-gnu-gcc and a rustc with a standard library for aarch64-unknown-linux-gnu (RUSTC). The count is the
# difference between twice the work and once the work, on one thread: it repeats exactly.
# TARGET_DIR: an existing build folder with these features.
set -euo pipefail
cd "$(dirname "$0")/.."
scenes=("$@")
[ $# -gt 0 ] || scenes=(concert_hall bootcamp angrybot)
[ "${1:-}" != --updates ] || scenes=()
target=aarch64-unknown-linux-gnu
out=target/count-aarch64
mkdir -p "$out"
target_dir=${TARGET_DIR:-$out}
for scene in "${scenes[@]}"; do
    (unset RUSTC && cargo run --quiet --release -- bench rays --scene "$scene" --rounds 1 --dump "$out") >"$out/$scene.txt"
done
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=${LINKER:-aarch64-linux-gnu-gcc}
cargo build --quiet --release --locked --no-default-features --features builtin-hrtf,capi --target "$target" \
    --target-dir "$target_dir" --example count_work
gcc -O2 -shared -fPIC -o "$out/icount.so" benches/icount.c
# The cross package needs the path of the C library; a native C library must not have it.
qemu=(qemu-aarch64)
[ -e /lib/ld-linux-aarch64.so.1 ] || qemu+=(-L /usr/aarch64-linux-gnu)
instructions() {
    local output
    output=$(env -i "$(command -v "${qemu[0]}")" "${qemu[@]:1}" -plugin "$PWD/$out/icount.so" \
        "$target_dir/$target/release/examples/count_work" "$@" 2>&1) || { echo "$output" >&2 && return 1; }
    sed -n 's/^instructions //p' <<<"$output"
}
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
    few=$(instructions update concert_hall "$sources" 4)
    many=$(instructions update concert_hall "$sources" 20)
    # The mean of sixteen updates, one per ray rotation, in tenths of a million.
    tenths=$(((many - few) / 1600000))
    printf 'concert_hall, %d sources: %d.%d million instructions an update\n' "$sources" $((tenths / 10)) $((tenths % 10))
done
