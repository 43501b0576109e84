#!/usr/bin/env bash
# Installs check.sh's packages from Debian, as root. check.sh works without any of them and prints what it skips.
# Usage: install.sh [--all]; --all adds what `check.sh --all` needs.
set -euo pipefail
packages=(gcc g++ libc6-dev openjdk-17-jdk-headless)
# Linking for Android without an NDK: standard library's source, a rustc that it fits, clang, C++ headers for Oboe.
packages+=(rustc-web rust-web-src clang-22 lld-22 llvm-22 libc++-22-dev musl-dev:arm64)
# The Unity package, without Unity.
packages+=(mono-mcs mono-runtime)
# The Kotlin compiler comes from a registry; the APK.
packages+=(python3-pip unzip aapt apksigner zipalign android-framework-res)
if [ "${1:-}" = --all ]; then
    # Tests on 64-bit ARM, emulated.
    packages+=(gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user libstd-rust-web-dev:arm64)
fi
if [ "$(id -u)" != 0 ]; then
    echo "not root; install as root: ${packages[*]}" >&2
    exit 1
fi
dpkg --add-architecture arm64
apt-get update -qq
for package in "${packages[@]}"; do
    # One at a time: if a release lacks one, the others are still installed.
    apt-get install -y -qq --no-install-recommends "$package" >/dev/null || echo "not to be had: $package" >&2
done
