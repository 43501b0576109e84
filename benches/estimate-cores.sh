#!/usr/bin/env bash
# Estimates the time of a propagation update on phone cores, and the same on this machine beside the time it takes here.
# Arguments: scene and number of sources (default: concert_hall 16). Needs what count-aarch64.sh needs, qemu-x86_64, and llvm-mc and
# llvm-mca of version 19 or later (LLVM: their suffix, default -19). HOST_CORE: this machine's processor for llvm-mca (default: as
# LLVM finds it). TARGET_DIR: an existing build folder. README.md has the method.
set -euo pipefail
cd "$(dirname "$0")/.."
scene=${1:-concert_hall} sources=${2:-16}
llvm=${LLVM--19}
few=4 many=20 every=4000000 length=2000
out=$PWD/target/estimate-cores
target_dir=${TARGET_DIR:-target/count-aarch64}
mkdir -p "$out"
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=${LINKER:-aarch64-linux-gnu-gcc}
for target in '' --target=aarch64-unknown-linux-gnu; do
    cargo build --quiet --release --locked --no-default-features --features builtin-hrtf,capi $target \
        --target-dir "$target_dir" --example count_work
done
gcc -O2 -shared -fPIC -o "$out/cores.so" benches/cores.c
program() {
    local built=$target_dir
    [ "$1" = x86_64 ] || built+=/$1-unknown-linux-gnu
    echo "$built/release/examples/count_work"
}

# Emulates ARCHITECTURE UPDATES PLUGIN-OPTIONS and prints what the plugin counts.
emulated() {
    local qemu=(qemu-"$1")
    [ "$1" = aarch64 ] && [ ! -e /lib/ld-linux-aarch64.so.1 ] && qemu+=(-L /usr/aarch64-linux-gnu)
    [ "$1" = x86_64 ] && qemu+=(-cpu max)
    env -i "$(command -v "${qemu[0]}")" "${qemu[@]:1}" -plugin "$out/cores.so,$3" \
        "$(program "$1")" update "$scene" "$sources" "$2" 2>&1 >/dev/null | sed -n '/^instructions /p'
}
# A field of the plugin's line.
field() { sed -E "s/.*\b$2 ([0-9]+).*/\1/" <<<"$1"; }

# The branches of a sample go where the next line is: calls and returns have no other effect, and llvm-mca does not model them, nor
# string instructions.
plain() {
    sed -E 's/^\tbl\t/\tb\t/; s/^\tblr\t/\tbr\t/; s/^\tret$/\tbr\tx30/; s/^\tcallq\t\*/\tjmpq\t*/; s/^\tcallq\t/\tjmp\t/; s/^\tretq$/\tnop/; s/^\trep\t.*/\tnop/'
}

# Cycles a thousand instructions of the samples of ARCHITECTURE on the core that llvm-mca calls MCPU; DISPATCH instructions a cycle
# at most (0: the model's).
scheduled() {
    local cycles=0 count=0 file one
    local width=()
    [ "$3" = 0 ] || width=(-dispatch="$3")
    for file in "$out/$1".*; do
        one=$(llvm-mc$llvm --disassemble --triple="$1" --mattr=+all <"$file" 2>/dev/null | plain |
            llvm-mca$llvm -mtriple="$1" -mcpu="$2" "${width[@]}" -iterations=1 -skip-unsupported-instructions=any \
                2>/dev/null | sed -n 's/^Total Cycles: *//p')
        [ -z "$one" ] || cycles=$((cycles + one)) count=$((count + length))
    done
    echo $((cycles * 1000 / count))
}

# Per update in ARCHITECTURE, with the options of the plugin's caches: instructions, misses of the data, code and second caches,
# mispredictions. Leaves samples.
per_update() {
    local once more before name sample
    rm -f "$out/$1".*
    emulated "$1" $few "$2" >"$out/once" &
    more=$(emulated "$1" $many "$2,out=$out/$1,first=1,length=$length,every=$every")
    wait
    once=$(<"$out/once")
    # The scene's commit comes before the updates that count; of the last sample the end may be missing.
    before=$(field "$once" instructions)
    for sample in "$out/$1".*; do
        [ $((${sample##*.} * every)) -gt "$before" ] || rm "$sample"
    done
    rm "$(find "$out" -name "$1.*" | sort -V | tail -1)"
    for name in instructions data_misses code_misses second_misses mispredicted; do
        echo $((($(field "$more" $name) - $(field "$once" $name)) / (many - few)))
    done
}

# NAME ARCHITECTURE MCPU DISPATCH GHZ MISPREDICTED-CYCLES SECOND-CYCLES BEYOND-NS: prints a core's estimate from per_update's counts.
core() {
    local thousand
    thousand=$(scheduled "$2" "$3" "$4")
    awk -v name="$1" -v counts="${counts[*]}" -v thousand="$thousand" -v ghz="$5" -v wrong="$6" -v second="$7" \
        -v beyond="$8" 'BEGIN {
            split(counts, n, " ")
            scheduled = n[1] * thousand / 1000
            branches = n[5] * wrong
            waits = (n[2] + n[3] - n[4]) * second + n[4] * beyond * ghz
            printf "%-11s %.2f GHz: %.2f instructions a cycle; %.2f ms scheduled, %.2f with branches, %.2f if every miss waits\n",
                name, ghz, 1000 / thousand, scheduled / ghz / 1e6, (scheduled + branches) / ghz / 1e6,
                (scheduled + branches + waits) / ghz / 1e6 }'
}
counted() {
    mapfile -t counts < <(per_update "$1" "$2")
    printf '%s: an update of %d instructions, misses L1 data %d, L1 code %d, L2 %d, mispredicted branches %d\n' "$1" "${counts[@]}"
}

# This machine's clock: a billion additions, each of which needs the last.
cat >"$out/clock.c" <<'END'
#include <stdio.h>
#include <time.h>
int main(void) {
    double best = 1e9;
    for (int round = 0; round < 20; round++) {
        struct timespec a, b;
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &a);
        unsigned long x = 0;
        for (long i = 0; i < 10000000; i++)
            __asm__ volatile("add $1, %0\n\tadd $1, %0\n\tadd $1, %0\n\tadd $1, %0\n\tadd $1, %0" : "+r"(x));
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &b);
        double ns = (b.tv_sec - a.tv_sec) * 1e9 + (b.tv_nsec - a.tv_nsec);
        best = ns < best ? ns : best;
    }
    printf("%.3f\n", 5e7 / best);
    return 0;
}
END
gcc -O2 -o "$out/clock" "$out/clock.c"
# Least processor time of so many updates in seconds.
used() {
    for _ in 1 2 3 4 5; do
        (TIMEFORMAT=%U && time "$(program x86_64)" update "$scene" "$sources" "$1" >/dev/null 2>&1) 2>&1
    done | sort -n | head -1
}

if [ "$(uname -m)" = x86_64 ]; then
    bytes() { getconf "$1" || true; }
    l1=$(bytes LEVEL1_DCACHE_SIZE) l2=$(bytes LEVEL2_CACHE_SIZE)
    counted x86_64 "arm=0,l1=${l1:-32768},l1_ways=8,l2=${l2:-1048576},l2_ways=8"
    core 'this one' x86_64 "${HOST_CORE:-native}" 0 "$("$out/clock")" 13 10 15
    awk -v a="$(used $few)" -v b="$(used 84)" -v few=$few 'BEGIN { printf "this one, measured: %.2f ms\n", (b - a) / (84 - few) * 1000 }'
fi
counted aarch64 arm=1,l1=65536,l1_ways=4,l2=524288,l2_ways=8
core Cortex-A76 aarch64 neoverse-n1 4 2.4 12 7 40
core Cortex-A78 aarch64 neoverse-n1 6 2.4 11 7 40
core Cortex-X1 aarch64 neoverse-v1 8 2.84 11 7 40
