#!/usr/bin/env bash
# Builds the extension and lays out an addon: integrations/godot/pack.sh OUT. Then copy OUT/addons into a Godot project.
# This machine's library, and Android's where the target aarch64-linux-android is installed and ANDROID_NDK_HOME is set.
set -euo pipefail
out=$(mkdir -p "${1:?a folder to write to}" && cd "$1" && pwd)
cd "$(dirname "$0")"
addon=$out/addons/foresound
target=${CARGO_TARGET_DIR:-target}
mkdir -p "$addon"
cargo build --release --locked
case "$(uname -s)-$(uname -m)" in
Linux-x86_64) folder=linux library=libforesound_godot.so ;;
Linux-aarch64) folder=linux-arm64 library=libforesound_godot.so ;;
Darwin-*) folder=macos library=libforesound_godot.dylib ;;
*) folder=windows library=foresound_godot.dll ;;
esac
mkdir -p "$addon/$folder"
cp "$target/release/$library" "$addon/$folder/"
android=aarch64-linux-android
if [ -n "${ANDROID_NDK_HOME:-}" ] && [ -d "$(rustc --print sysroot)/lib/rustlib/$android/lib" ]; then
    tools=$(echo "$ANDROID_NDK_HOME"/toolchains/llvm/prebuilt/*/bin)
    # The engine's Oboe is C++; 24 is the least API level of Godot 4.
    export CARGO_TARGET_AARCH64_LINUX_ANDROID_LINKER=$tools/${android}24-clang
    export CC_aarch64_linux_android=$tools/${android}24-clang CXX_aarch64_linux_android=$tools/${android}24-clang++
    export AR_aarch64_linux_android=$tools/llvm-ar
    cargo build --release --locked --target $android
    mkdir -p "$addon/android"
    cp "$target/$android/release/libforesound_godot.so" "$addon/android/"
else
    echo "no Android library: install the target $android and set ANDROID_NDK_HOME"
fi
cp addon/foresound.gdextension ../../NOTICE ../../LICENSE-MIT ../../LICENSE-APACHE "$addon/"
echo 'gdext (https://github.com/godot-rust/gdext) is under the Mozilla Public License 2.0; it is unchanged.' >"$addon/GDEXT-NOTICE"
find "$addon" -type f -printf '%s %P\n'
