#!/usr/bin/env bash
# The extension in a running Godot 4.3 or newer, without a window and without a sound device: integrations/godot/check.sh
# GODOT names the program and its first arguments; `godot` on the path will do. The library is that of `cargo build`.
set -euo pipefail
cd "$(dirname "$0")"
read -ra godot <<<"${GODOT:-godot}"
version=$("${godot[@]}" --headless --version 2>/dev/null | tail -n 1 || true)
[[ $version =~ ^4\.([0-9]+) && ${BASH_REMATCH[1]} -ge 3 ]] ||
    { echo "SKIP Godot ${version:-is not there}: 4.3 or newer is needed (GODOT=...)" && exit 0; }
echo "Godot $version"
cargo build --locked
# Godot writes beside what it imports.
project=$(mktemp -d)
trap 'rm -rf "$project"' EXIT
cp -r project/. "$project"
mkdir -p "$project/addons/foresound/linux"
cp addon/foresound.gdextension "$project/addons/foresound/"
cp "${CARGO_TARGET_DIR:-target}/debug/libforesound_godot.so" "$project/addons/foresound/linux/"
cp ../../assets/speech/voice01.wav "$project/voice.wav"
log=$project/log
# As the editor leaves it: a headless Godot that finds an extension for the first time falls at its end (godotengine/godot#111048).
mkdir "$project/.godot"
echo res://addons/foresound/foresound.gdextension >"$project/.godot/extension_list.cfg"
# It is Godot's editor that speaks here: a machine without a desktop gives messages of its own.
timeout 600 "${godot[@]}" --headless --path "$project" --import >"$log" 2>&1 || { cat "$log" && exit 1; }
failed=0
timeout 600 "${godot[@]}" --headless --path "$project" --script check.gd >"$log" 2>&1 || failed=1
cat "$log"
if [ $failed = 1 ] || grep -qE 'ERROR|WARNING|leaked|panicked' "$log"; then
    echo 'FAIL the extension in Godot' && exit 1
fi
