#!/usr/bin/env bash
# Packs the Unity package with its libraries: OUT/dev.foresound.unity-VERSION.tgz, for "Add package from tarball".
# Usage: pack-unity.sh OUT PLATFORM=LIBRARY...; platforms: android, linux, windows, macos. Without a library: linux, built here.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)/unity
root=$(dirname "$(dirname "$here")")
[ $# -ge 1 ] || { sed -n '2,3p' "$0" >&2 && exit 2; }
out=$1
shift
if [ $# = 0 ]; then
    (cd "$root" && cargo rustc --release --locked --lib --crate-type cdylib --no-default-features --features builtin-hrtf,capi)
    set -- "linux=${CARGO_TARGET_DIR:-$root/target}/release/libforesound.so"
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
package=$work/package
mkdir -p "$package" "$out"
tar -C "$here" --exclude=./Packed~ -cf - . | tar -C "$package" -xf -
{ printf '# Licence\n\nMIT or Apache 2.0, as you prefer.\n\n'; cat "$root/LICENSE-MIT"; printf '\n'; cat "$root/LICENSE-APACHE"; } >"$package/LICENSE.md"
cp "$here/Packed~/LICENSE.md.meta" "$package/"
cp "$here/Packed~/Runtime/Plugins.meta" "$package/Runtime/"
for pair in "$@"; do
    case ${pair%%=*} in
    android) path=Android/arm64-v8a/libforesound.so ;;
    linux) path=Linux/x86_64/libforesound.so ;;
    windows) path=Windows/x86_64/foresound.dll ;;
    macos) path=macOS/libforesound.dylib ;;
    *) echo "unknown platform ${pair%%=*}" >&2 && exit 2 ;;
    esac
    mkdir -p "$package/Runtime/Plugins/$(dirname "$path")"
    cp "${pair#*=}" "$package/Runtime/Plugins/$path"
    # The file's meta and its folders'.
    while [ "$path" != . ]; do
        cp "$here/Packed~/Runtime/Plugins/$path.meta" "$package/Runtime/Plugins/$path.meta"
        path=$(dirname "$path")
    done
done
version=$(sed -n 's/.*"version": "\(.*\)".*/\1/p' "$here/package.json")
tar -C "$work" -czf "$out/dev.foresound.unity-$version.tgz" package
echo "$out/dev.foresound.unity-$version.tgz"
