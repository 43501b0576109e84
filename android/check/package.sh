# Proofs of the Android package, for check.sh, which has their tools: the AAR is put together from what the Gradle scripts
# say (proof scripts), the classes of the proof kotlin and the library of the proof android, then unpacked and used.
# shellcheck shell=bash

aar=$work/foresound.aar
publication=$work/scripts/publication

# The module's own classes, without stubs, demo and test programs.
library_classes() {
    find_kotlin
    rm -rf "$work/library-classes" "$work/stub-classes"
    mkdir -p "$work/library-classes" "$work/stub-classes"
    javac --release 17 -d "$work/stub-classes" $(find android/jvm/stubs -name '*.java') || return 1
    javac --release 17 -cp "$work/stub-classes" -d "$work/library-classes" $natives || return 1
    compile_against "$work/stub-classes" "$work/library-classes" android/foresound/src/main/kotlin/dev/foresound/*.kt
}
compile_against() { # class path, folder of classes, sources
    local path=$1 out=$2
    shift 2
    java -Xmx1g -cp "$compiler:$standard" org.jetbrains.kotlin.cli.jvm.K2JVMCompiler -no-stdlib -no-reflect -jvm-target 17 \
        -Werror -cp "$compiler:$standard:$path:$out" -d "$out" "$@"
}

# The AAR as the Android plugin lays it out, with what our scripts add.
make_aar() {
    [ -f "$work/libforesound-arm64.so" ] || { echo "no library for Android; the proof android was skipped or failed" && exit 77; }
    [ -f "$publication/layout.txt" ] || { echo "no scripts; the proof scripts was skipped or failed" && exit 77; }
    library_classes || return 1
    local libraries=$work/jniLibs
    rm -rf "$libraries" "$work/prefab"
    mkdir -p "$libraries/arm64-v8a"
    cp "$work/libforesound-arm64.so" "$libraries/arm64-v8a/libforesound.so"
    # The task's own command, with this machine's folders.
    local words
    read -ra words < <(sed -n 2p "$work/scripts.out")
    [ "${words[1]}" = package/Prefab.java ] || { echo "no command for prefab in scripts.out" && return 1; }
    (cd android/foresound && "${words[0]}" "${words[1]}" "$work/prefab" "$root/include" "$libraries" "${words[@]:5}") || return 1
    python3 android/check/aar.py make "$aar" "$work" "$publication/layout.txt"
}
prove_prefab() {
    need java python3 clang-22
    make_aar || return 1
    local unpacked=$work/aar figure
    figure=$(python3 android/check/aar.py prefab "$aar" "$unpacked") || { echo "$figure" && return 1; }
    # A program for the phone links with what find_package(foresound) would give it. As a library: bionic is not here.
    local module=$unpacked/prefab/modules/foresound chain=$work/toolchain/bin missing
    "$chain/android-cc" -std=c99 -Wall -Wextra -Werror -fPIC -I"$module/include" -c android/c/walk.c -o "$work/walk-arm64.o" &&
        "$chain/android-clang" -shared "$work/walk-arm64.o" -L"$module/libs/android.arm64-v8a" -lforesound \
            -Wl,--as-needed -o "$work/libwalk-arm64.so" || return 1
    llvm-readelf-22 -d "$work/libwalk-arm64.so" | grep -q 'NEEDED.*libforesound.so' ||
        { echo "the program needs no libforesound.so" && return 1; }
    missing=$(comm -23 <(llvm-nm-22 -u "$work/walk-arm64.o" | grep -o 'foresound_.*' | sort) \
        <(llvm-nm-22 -D --defined-only "$module/libs/android.arm64-v8a/libforesound.so" | grep -o 'foresound_.*' | sort))
    [ -z "$missing" ] || { echo "the library lacks $missing" && return 1; }
    echo "$figure; a C program for Android links with it"
}
prove_maven() {
    need java javac python3
    [ -f "$aar" ] || make_aar || return 1
    local figure
    figure=$(python3 android/check/aar.py maven "$aar" "$publication" "$work/maven") || { echo "$figure" && return 1; }
    # What the AAR holds is enough for the guide's program.
    find_kotlin
    rm -rf "$work/consumer" "$work/consumer-classes"
    mkdir -p "$work/consumer-classes"
    unzip -qo "$aar" classes.jar -d "$work/consumer"
    compile_against "$work/stub-classes:$work/consumer/classes.jar" "$work/consumer-classes" android/jvm/FirstSound.kt || return 1
    echo "$figure; a Kotlin program compiles against it"
}
prove_notice() {
    need python3
    [ -f "$aar" ] || make_aar || return 1
    unzip -p "$aar" META-INF/NOTICE | cmp - NOTICE || return 1
    cargo test --release --locked --test notice || return 1
    grep -q 'authors are cited' NOTICE || return 1
    echo "$(grep -cE '^[a-z0-9_-]+ [0-9]+\.[0-9].* \(.*\)$' NOTICE) crates, KEMAR's and Oboe's terms, in the AAR"
}
