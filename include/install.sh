#!/usr/bin/env bash
# Builds the C library and installs it for pkg-config: the shared library with its version and links, the static library, the
# header, foresound.pc. Linux and other systems with ELF libraries.
# Usage: include/install.sh [--prefix DIR] [--libdir DIR] [--destdir DIR]; DIR of --destdir is put before every path.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
prefix=/usr/local libdir='' destdir=''
while [ $# -gt 0 ]; do
    case $1 in
    --prefix | --libdir | --destdir)
        [ $# -gt 1 ] || { echo "$1 needs a folder" >&2 && exit 2; }
        printf -v "${1#--}" %s "$2"
        shift 2
        ;;
    *) echo "unknown option $1; see the first lines of $0" >&2 && exit 2 ;;
    esac
done
: "${libdir:=$prefix/lib}"
target=${CARGO_TARGET_DIR:-$root/target}/install

# The version of the interface, as the header has it.
hexadecimal=$(sed -n 's/^#define FORESOUND_API_VERSION 0x\([0-9a-f]*\)u$/\1/p' "$root/include/foresound.h")
number=$((16#$hexadecimal))
major=$((number >> 16)) version=$((number >> 16)).$((number >> 8 & 255)).$((number & 255))

cargo rustc --manifest-path "$root/Cargo.toml" --target-dir "$target" --release --locked --lib --crate-type cdylib,staticlib \
    --no-default-features --features builtin-hrtf,capi -- -C link-arg=-Wl,-soname,libforesound.so.$major

lib=$destdir$libdir include=$destdir$prefix/include
install -d "$lib/pkgconfig" "$include"
install -m 755 "$target/release/libforesound.so" "$lib/libforesound.so.$version"
ln -sf "libforesound.so.$version" "$lib/libforesound.so.$major"
ln -sf "libforesound.so.$major" "$lib/libforesound.so"
install -m 644 "$target/release/libforesound.a" "$lib/libforesound.a"
install -m 644 "$root/include/foresound.h" "$include/foresound.h"
cat >"$lib/pkgconfig/foresound.pc" <<PC
prefix=$prefix
libdir=$libdir
includedir=\${prefix}/include

Name: foresound
Description: Real-time ray-traced sound
Version: $version
Libs: -L\${libdir} -lforesound
Libs.private: -lm -lpthread -ldl -lrt
Cflags: -I\${includedir}
PC
echo "installed $lib/libforesound.so.$version"
