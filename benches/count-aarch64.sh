#!/usr/bin/env bash
# Executed aarch64 instructions: a ray, by scene and set, and a whole propagation update in the hall.
# Arguments: scenes (all three if none are given). Needs qemu-aarch64, gcc, aarch64-linux-gnu-gcc, libc6:arm64 and a rustc
# with a standard library for aarch64-unknown-linux-gnu (RUSTC names it). Twice the work less once the work is what is
# counted, on one thread, so figures repeat exactly.
set -euo pipefail
cd "$(dirname "$0")/.."
scenes=("$@")
[ $# -gt 0 ] || scenes=(concert_hall bootcamp angrybot)
target=aarch64-unknown-linux-gnu
out=target/count-aarch64
mkdir -p "$out"
for scene in "${scenes[@]}"; do
    (unset RUSTC && cargo run --quiet --release -- bench rays --scene "$scene" --rounds 1 --dump "$out") >"$out/$scene.txt"
done
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=${LINKER:-aarch64-linux-gnu-gcc}
cargo build --quiet --release --no-default-features --target "$target" --target-dir "$out" --example count_work
gcc -O2 -shared -fPIC -o "$out/icount.so" benches/icount.c
instructions() {
    env -i qemu-aarch64 -plugin "$out/icount.so" "$out/$target/release/examples/count_work" "$@" 2>&1 |
        sed -n 's/^instructions //p'
}
printf '%-14s %-11s %s\n' scene set 'instructions a ray'
for scene in "${scenes[@]}"; do
    for set in guide source visibility; do
        rays=$(($(stat -c %s "$out/$scene-$set.f32") / 28))
        once=$(instructions rays "$out" "$scene" "$set" 1)
        twice=$(instructions rays "$out" "$scene" "$set" 2)
        printf '%-14s %-11s %d\n' "$scene" "$set" $(((twice - once) / rays))
    done
done
for sources in 1 16; do
    once=$(instructions update concert_hall "$sources" 1)
    twice=$(instructions update concert_hall "$sources" 2)
    printf 'concert_hall, %d sources: %d million instructions an update\n' "$sources" $(((twice - once) / 1000000))
done
