#!/usr/bin/env bash
# Checks the C and Java interfaces and the Android library without a device: prints a line with a figure for each check.
# Usage: check.sh [--all] [--json] [NAME...]; names select checks. --all adds the slow ones. --json prints one object at the
# end instead. Exits non-zero if a check fails; a missing package is a SKIP line (install.sh installs the packages).
set -uo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(dirname "$here")
cd "$root" || exit 1
work=${CARGO_TARGET_DIR:-$root/target}/android-check
mkdir -p "$work"
all=0 json=0 only=()
for argument in "$@"; do
    case $argument in
    --all) all=1 ;;
    --json) json=1 ;;
    -*) echo "unknown option $argument; see the first lines of $0" >&2 && exit 2 ;;
    *) only+=("$argument") ;;
    esac
done

rows=() failed=0
report() { # status, name, figure
    [ "$json" = 1 ] || printf '%-4s %-12s %s\n' "$1" "$2" "$3"
    local figure=${3//\\/\\\\}
    rows+=("$(printf '{"proof":"%s","status":"%s","figure":"%s"}' "$2" "$1" "${figure//\"/\\\"}")")
}
wanted() {
    [ ${#only[@]} = 0 ] && return 0
    local name
    for name in "${only[@]}"; do [ "$name" = "$1" ] && return 0; done
    return 1
}
# Runs a function whose last line of output is its figure. Exit 77 is a skip.
prove() {
    local name=$1
    wanted "$name" || return 0
    ("prove_$name") >"$work/$name.log" 2>&1
    local code=$? figure
    figure=$(grep -av '^$' "$work/$name.log" | tail -n 1)
    case $code in
    0) report ok "$name" "$figure" ;;
    77) report SKIP "$name" "$figure" ;;
    *)
        failed=1
        report FAIL "$name" "see $work/$name.log: $figure"
        [ "$json" = 1 ] || tail -n 15 "$work/$name.log"
        ;;
    esac
}
need() { # tools
    local tool
    for tool in "$@"; do
        command -v "$tool" >/dev/null || { echo "no $tool; run android/install.sh" && exit 77; }
    done
}
recipe() { # key of cargo-ndk.toml: its value without quotes and brackets, lists with commas
    sed -n "s/^$1 *= *//p" cargo-ndk.toml | sed 's/#.*//' | tr -d '[]" '
}
flags() { # the recipe as cargo's flags
    printf -- '--profile\n%s\n--features\n%s\n' "$(recipe profile)" "$(recipe features)"
    [ "$(recipe default-features)" = false ] && echo --no-default-features
}

# --- the host's library -------------------------------------------------------------------------------------------

host=$work/host
mapfile -t cargo_flags < <(flags)

# The library exports the header's functions and JNI_OnLoad, and nothing else.
exports() { # nm, library
    grep -oE '\bforesound_[a-z_]+\(' include/foresound.h | tr -d '(' | sort -u >"$work/wanted.txt"
    echo JNI_OnLoad >>"$work/wanted.txt"
    sort -o "$work/wanted.txt" "$work/wanted.txt"
    "$1" -D --defined-only "$2" | awk '{ print $3 }' | sed 's/@.*//' | sort >"$work/exported.txt"
    diff "$work/wanted.txt" "$work/exported.txt" || { echo "exports differ from the header" && return 1; }
}
prove_library() {
    need nm
    CARGO_TARGET_DIR=$host cargo rustc --locked --lib --crate-type cdylib "${cargo_flags[@]}" || return 1
    exports nm "$host/release/libforesound.so" || return 1
    echo "exports $(wc -l <"$work/exported.txt") bytes $(stat -c %s "$host/release/libforesound.so")"
}
prove_reference() {
    cargo run --release --locked --example bridge_reference -- assets/scenes/doorway.obj "$work/rust.raw" "$work/rust.txt" || return 1
    echo "bytes $(stat -c %s "$work/rust.raw") paths $(wc -l <"$work/rust.txt")"
}
same() { # file: the same bits as the Rust walk, and no silence
    [ -s "$work/rust.raw" ] || { echo "no Rust walk; run the proof reference" && return 1; }
    cmp "$work/rust.raw" "$1" || return 1
    [ "$(tr -d '\0' <"$1" | wc -c)" -gt 100000 ] || { echo "both are silent" && return 1; }
}
prove_c() {
    need gcc g++
    gcc -std=c99 -O2 -ffp-contract=off -Wall -Wextra -Wpedantic -Werror -Iinclude android/c/walk.c -o "$work/walk" \
        -L"$host/release" -lforesound -Wl,-rpath,"$host/release" || return 1
    g++ -std=c++11 -Wall -Wextra -Wpedantic -Werror -fsyntax-only -x c++ include/foresound.h || return 1
    "$work/walk" assets/scenes/doorway.obj "$work/c.raw" || return 1
    same "$work/c.raw" || return 1
    # The guide's program.
    gcc -std=c99 -O2 -Wall -Wextra -Wpedantic -Werror -Iinclude android/c/first.c -o "$work/first" \
        -L"$host/release" -lforesound -Wl,-rpath,"$host/release" || return 1
    "$work/first" assets/scenes/doorway.obj assets/speech/voice01.wav "$work/first.raw" || return 1
    [ "$(tr -d '\0' <"$work/first.raw" | wc -c)" -gt 100000 ] || { echo "the guide's program is silent" && return 1; }
    gcc -std=c99 -O2 -Wall -Wextra -Wpedantic -Werror -Iinclude android/c/path_numbers.c -o "$work/path_numbers" \
        -L"$host/release" -lforesound -Wl,-rpath,"$host/release" || return 1
    "$work/path_numbers" assets/scenes/doorway.obj || return 1
    gcc -std=c99 -O2 -Wall -Wextra -Wpedantic -Werror -Iinclude android/c/per_source_bus.c -o "$work/per_source_bus" \
        -L"$host/release" -lforesound -lm -Wl,-rpath,"$host/release" || return 1
    "$work/per_source_bus" assets/scenes/doorway.obj || return 1
    gcc -std=c99 -O2 -Wall -Wextra -Wpedantic -Werror -Iinclude android/c/split_screen.c -o "$work/split_screen" \
        -L"$host/release" -lforesound -lm -Wl,-rpath,"$host/release" || return 1
    "$work/split_screen" assets/scenes/doorway.obj || return 1
    echo "C99 and C++11 compile; 90 frames with the bits of Rust"
}

prove_c_abuse() {
    need gcc
    gcc -std=c99 -O1 -Wall -Wextra -Werror -Iinclude android/c/abuse.c -o "$work/abuse" -L"$host/release" -lforesound \
        -Wl,-rpath,"$host/release" || return 1
    "$work/abuse"
}

# The installed library: its version, and programs built with pkg-config against the shared and the static library.
prove_install() {
    need gcc pkg-config readelf
    local to=$work/installed
    rm -rf "$to"
    include/install.sh --prefix "$to" || return 1
    local shared static version
    shared=$(PKG_CONFIG_PATH=$to/lib/pkgconfig pkg-config --cflags --libs foresound) || return 1
    static="$(PKG_CONFIG_PATH=$to/lib/pkgconfig pkg-config --cflags foresound) $to/lib/libforesound.a -lm -lpthread -ldl"
    version=$(PKG_CONFIG_PATH=$to/lib/pkgconfig pkg-config --modversion foresound)
    readelf -d "$to/lib/libforesound.so" | grep "SONAME.*libforesound.so.${version%%.*}\]" >/dev/null || return 1
    [ -e "$to/lib/libforesound.so.$version" ] || return 1
    # shellcheck disable=SC2086 # Lists of flags.
    gcc -std=c99 -O2 android/c/walk.c -o "$to/shared" $shared -Wl,-rpath,"$to/lib" || return 1
    # shellcheck disable=SC2086
    gcc -std=c99 -O2 android/c/walk.c -o "$to/static" $static || return 1
    readelf -d "$to/shared" | grep "NEEDED.*libforesound.so.${version%%.*}\]" >/dev/null || return 1
    local program
    for program in shared static; do
        "$to/$program" assets/scenes/doorway.obj "$to/$program.raw" || return 1
        [ -s "$to/$program.raw" ] || return 1
    done
    cmp "$to/shared.raw" "$to/static.raw" || return 1
    echo "libforesound.so.$version, $(stat -c %s "$to/lib/libforesound.so.$version") bytes; shared and static programs sound alike"
}

# --- Java -----------------------------------------------------------------------------------------------------------

classes=$work/classes
natives=$(echo android/foresound/src/main/java/dev/foresound/*.java)
# The heap is touched at once: later growth is not Java's.
java_run() { # part, arguments
    java -Xcheck:jni -XX:+UseSerialGC -Xms32m -Xmx32m -XX:+AlwaysPreTouch -Djava.library.path="$host/release" -cp "$classes" dev.foresound.Bridge "$@" \
        >"$work/java-$1.out" 2>&1
    local code=$?
    cat "$work/java-$1.out"
    [ $code = 0 ] || return 1
    # A message of -Xcheck:jni is a failure.
    ! grep -E '^(WARNING|FATAL)' "$work/java-$1.out" | grep -v 'native access'
}
compile_java() {
    need javac java
    mkdir -p "$classes"
    javac --release 17 -d "$classes" $natives android/jvm/Bridge.java
}
prove_java_walk() {
    compile_java || return 1
    java_run walk assets/scenes/doorway.obj "$work/java.raw" || return 1
    same "$work/java.raw" || return 1
    echo "90 frames with the bits of Rust; $(tail -n 1 "$work/java-walk.out")"
}
prove_java_abuse() { compile_java && java_run abuse; }
prove_java_missing() {
    compile_java || return 1
    mkdir -p "$work/nothing"
    java -Djava.library.path="$work/nothing" -cp "$classes" dev.foresound.Bridge missing
}
prove_java_cycles() { compile_java && java_run cycles 100000; }
prove_java_threads() { compile_java && java_run threads; }
prove_java_tick() {
    # Times are the library's, not those of the checking layer.
    compile_java || return 1
    java -XX:+UseSerialGC -Djava.library.path="$host/release" -cp "$classes" dev.foresound.Bridge tick
}

# --- Kotlin ---------------------------------------------------------------------------------------------------------

kernel=kotlin-jupyter-kernel==0.19.0.944
# Sets compiler and standard.
find_kotlin() {
    need javac java python3 unzip
    local jars=$work/kotlin/run_kotlin_kernel/jars
    if [ ! -d "$jars" ]; then
        # A current compiler with coroutines, in a package that a registry has.
        mkdir -p "$work/kotlin"
        python3 -m pip download -q --no-deps -d "$work/kotlin" "$kernel" ||
            { echo "no Kotlin compiler: pip gave no $kernel" && exit 77; }
        unzip -qo "$work"/kotlin/*.whl -d "$work/kotlin"
        [ -d "$jars" ] || jars=$(dirname "$(find "$work/kotlin" -name 'kotlin-jupyter-kernel-*-all.jar' | head -n 1)")
    fi
    compiler=$(find "$jars" -name 'kotlin-jupyter-kernel-*-all.jar' | head -n 1)
    standard=$(find "$jars" -name 'kotlin-stdlib-[0-9]*.jar' | head -n 1)
}
kotlin_compile() { # folder of classes, sources
    local out=$1
    shift
    java -Xmx1g -cp "$compiler:$standard" org.jetbrains.kotlin.cli.jvm.K2JVMCompiler -no-stdlib -no-reflect \
        -jvm-target 17 -Werror -cp "$compiler:$standard:$out" -d "$out" "$@"
}
prove_kotlin() {
    find_kotlin
    local out=$work/kotlin-classes
    rm -rf "$out"
    mkdir -p "$out"
    javac --release 17 -d "$out" $natives $(find android/jvm/stubs -name '*.java') || return 1
    kotlin_compile "$out" android/foresound/src/main/kotlin/dev/foresound/*.kt android/jvm/Api.kt android/jvm/FirstSound.kt \
        android/app/src/main/kotlin/dev/foresound/demo/*.kt android/jvm/Demo.kt || return 1
    java -Xcheck:jni -XX:+UseSerialGC -Djava.library.path="$host/release" -cp "$out:$compiler:$standard" \
        dev.foresound.ApiKt assets >"$work/api.out" 2>&1 || { cat "$work/api.out" && return 1; }
    cat "$work/api.out"
    ! grep -E '^(WARNING|FATAL)' "$work/api.out" || return 1
    javac --release 17 -cp "$out:$standard:$compiler" -d "$out" android/jvm/OpenHandles.java android/jvm/FromJava.java || return 1
    java -Xcheck:jni -XX:+UseSerialGC -Djava.library.path="$host/release" -cp "$out:$compiler:$standard" FromJava assets \
        >"$work/from-java.out" 2>&1 || { cat "$work/from-java.out" && return 1; }
    ! grep -E '^(WARNING|FATAL)' "$work/from-java.out" || return 1
    java -XX:+UseSerialGC -Djava.library.path="$host/release" -cp "$out:$compiler:$standard" dev.foresound.DemoKt assets \
        assets/paper/paper_table_4.csv >"$work/demo.json" || return 1
    python3 -c 'import json, sys; assert len(json.load(open(sys.argv[1]))["rows"]) == 4' "$work/demo.json" || return 1
    echo "library module and demo compile without warnings; every Kotlin function and the benchmark run; $(tail -n 1 "$work/api.out"); $(tail -n 1 "$work/from-java.out")"
}
# The build scripts compiled against stand-ins, and the command they make.
prove_scripts() {
    find_kotlin
    # The published checksum of gradle-wrapper.jar 9.1.0, and of the archive that it fetches.
    local wrapper=android/gradle/wrapper
    echo "76805e32c009c0cf0dd5d206bddc9fb22ea42e84db904b764f3047de095493f3 $wrapper/gradle-wrapper.jar" | sha256sum -c - || return 1
    grep -q '/gradle-9.1.0-bin.zip$' $wrapper/gradle-wrapper.properties || return 1
    grep -qx 'distributionSha256Sum=a17ddd85a26b6a7f5ddb71ff8b05fc5104c0202c6e64782429790c933686c806' \
        $wrapper/gradle-wrapper.properties || return 1
    # It starts, and asks for that archive; offline it gets no further.
    GRADLE_USER_HOME=$work/gradle timeout 60 android/gradlew -p android --version >"$work/wrapper.out" 2>&1 ||
        grep -q 'Downloading .*/gradle-9.1.0-bin.zip' "$work/wrapper.out" || { cat "$work/wrapper.out" && return 1; }
    rm -rf "$work/scripts" "$work/script-classes"
    mkdir -p "$work/script-classes"
    python3 android/check/gradle/assemble.py "$work/scripts" || return 1
    kotlin_compile "$work/script-classes" android/check/gradle/*.kt "$work"/scripts/*.kt || return 1
    java -cp "$work/script-classes:$standard" CatalogKt >"$work/scripts.out" || return 1
    local target words="cargo ndk -P $(recipe platform) -o $(recipe output)"
    for target in $(recipe targets | tr ',' ' '); do words+=" -t $target"; done
    words+=" rustc --profile $(recipe profile) --locked --lib --crate-type cdylib --features $(recipe features) --no-default-features"
    [ "$(head -n 1 "$work/scripts.out")" = "$words" ] || { cat "$work/scripts.out" && echo "not: $words" && return 1; }
    echo "4 scripts compile against stand-ins and make: $words"
}

# --- Unity ----------------------------------------------------------------------------------------------------------

unity=$work/unity
mono_compile() { # target, output, arguments: all warnings are errors
    local target=$1 out=$2
    shift 2
    mcs -unsafe -warnaserror -warn:4 -target:"$target" -out:"$unity/$out" "$@"
}
unity_part() { # part, arguments: its last line is its figure
    LD_LIBRARY_PATH=$host/release timeout 900 mono "$unity/Foresound.Check.exe" "$@" >"$unity/part.out" 2>&1
    local code=$?
    cat "$unity/part.out"
    [ $code = 0 ] || return 1
    figures+="; $(tail -n 1 "$unity/part.out")"
}
# The package against stand-ins of Unity's types, and the library really called.
prove_unity() {
    need mcs mono
    local own=android/check/unity package=$unity/package stand=() own_sources=() name figures=
    rm -rf "$unity"
    mkdir -p "$unity"
    # What is compiled is what a game gets: the unpacked tarball.
    android/pack-unity.sh "$unity" "linux=$host/release/libforesound.so" || return 1
    tar -C "$unity" -xzf "$unity"/*.tgz || return 1
    for name in "" LICENSE.md Runtime/Plugins/Linux/x86_64/libforesound.so; do
        [ -e "$package/$name" ] && { [ -z "$name" ] || [ -f "$package/$name.meta" ]; } || { echo "the package lacks $name" && return 1; }
    done
    for name in UnityEngine UnityEditor Foresound Foresound.Editor Foresound.FirstSound; do stand+=("-r:$unity/$name.dll"); done
    for name in "$own"/*.cs; do case $name in */Maths.cs | */Objects.cs | */Assets.cs | */EditorStandIns.cs) ;; *) own_sources+=("$name") ;; esac; done
    mono_compile library UnityEngine.dll $own/Maths.cs $own/Objects.cs $own/Assets.cs || return 1
    mono_compile library UnityEditor.dll $own/EditorStandIns.cs "${stand[0]}" || return 1
    mono_compile library Foresound.dll $(find $package/Runtime -name '*.cs') "${stand[0]}" || return 1
    mono_compile library Foresound.Editor.dll $(find $package/Editor -name '*.cs') "${stand[@]:0:3}" || return 1
    mono_compile library Foresound.FirstSound.dll $package/Samples~/*/*.cs "${stand[@]:0:3}" || return 1
    mono_compile exe Foresound.Check.exe "${own_sources[@]}" "${stand[@]}" || return 1
    unity_part walk assets/scenes/doorway.obj "$work/unity.raw" || return 1
    same "$work/unity.raw" || return 1
    unity_part components assets/scenes/doorway.obj "$work/unity-components.raw" || return 1
    same "$work/unity-components.raw" || return 1
    for name in coordinates geometry editor audio abuse "cycles 10000" tick; do
        # shellcheck disable=SC2086
        unity_part $name || return 1
    done
    echo "$(basename "$unity"/*.tgz) has $(stat -c %s "$unity"/*.tgz) bytes; six assemblies compile without warnings; bindings and components have the bits of Rust$figures"
}

# --- aarch64-linux-android ------------------------------------------------------------------------------------------

debian_rust() {
    [ -x /usr/bin/rustc ] || { echo "no Debian rustc; run android/install.sh" && exit 77; }
    export RUSTC=/usr/bin/rustc RUSTDOC=/usr/bin/rustdoc
}
# Sets cargo's settings for the stand-in of the NDK.
for_android() {
    need clang-22 ld.lld-22 llvm-readelf-22 llvm-nm-22 llvm-strip-22
    debian_rust
    [ -d /usr/lib/rustlib/src/rust/library ] || [ -d "$(/usr/bin/rustc --print sysroot)/lib/rustlib/src/rust/library" ] ||
        { echo "no rust-web-src; run android/install.sh" && exit 77; }
    [ -d /usr/include/aarch64-linux-musl ] || { echo "no musl-dev:arm64; run android/install.sh" && exit 77; }
    [ "$(recipe platform)" = 26 ] || { echo "cargo-ndk.toml says API $(recipe platform), bionic.sym 26" && return 1; }
    local chain=$work/toolchain
    [ "$chain/bin/android-c++" -nt android/check/native/bionic.sym ] ||
        android/check/native/make-toolchain.sh "$chain" || return 1
    # The size is that of the profile which ships, whatever the environment makes of it.
    unset "${!CARGO_PROFILE_RELEASE_@}"
    export RUSTC_BOOTSTRAP=1 CARGO_TARGET_DIR=$work/android
    export CARGO_TARGET_AARCH64_LINUX_ANDROID_LINKER=$chain/bin/android-clang
    export CC_aarch64_linux_android=$chain/bin/android-cc CXX_aarch64_linux_android=$chain/bin/android-c++
    export AR_aarch64_linux_android=llvm-ar-22
}
prove_android() {
    rm -f "$work/libforesound-arm64.so"
    for_android || return 1
    cargo rustc -Zbuild-std=std,panic_unwind --locked --target aarch64-linux-android --lib --crate-type cdylib \
        "${cargo_flags[@]}" || return 1
    local library=$CARGO_TARGET_DIR/aarch64-linux-android/release/libforesound.so
    exports llvm-nm-22 "$library" || return 1
    llvm-strip-22 --strip-unneeded -o "$work/libforesound-arm64.so" "$library"
    android/check/native/check-library.sh "$library"
}
# The same with AAudio by ndk instead of Oboe: it needs neither a C++ compiler nor libc++.
prove_aaudio() {
    for_android || return 1
    export CXX_aarch64_linux_android=/bin/false
    local words=" ${cargo_flags[*]} "
    # shellcheck disable=SC2206 # A list of flags.
    local aaudio=(${words/oboe/aaudio})
    cargo rustc -Zbuild-std=std,panic_unwind --locked --target aarch64-linux-android --lib --crate-type cdylib \
        "${aaudio[@]}" || return 1
    local library=$CARGO_TARGET_DIR/aarch64-linux-android/release/libforesound.so
    exports llvm-nm-22 "$library" || return 1
    llvm-nm-22 -D --undefined-only "$library" | grep ' AAudioStreamBuilder_openStream' >/dev/null || return 1
    ! llvm-readelf-22 -dW "$library" | grep 'NEEDED.*OpenSLES' || return 1
    android/check/native/check-library.sh "$library"
}

# --- AAR and Maven artifact -------------------------------------------------------------------------------------------

. android/check/package.sh

# --- APK ------------------------------------------------------------------------------------------------------------

# Manifest, assets and the library in a signed APK. Without classes.dex: the build machines have no dexer.
prove_apk() {
    need aapt apksigner zipalign keytool python3
    local frame=/usr/share/android-framework-res/framework-res.apk apk=$work/apk
    [ -f "$frame" ] || { echo "no android-framework-res; run android/install.sh" && exit 77; }
    [ -f "$work/libforesound-arm64.so" ] || { echo "no library for Android; the proof android was skipped or failed" && exit 77; }
    rm -rf "$apk"
    mkdir -p "$apk"
    # Gradle's additions to the manifest: package and API levels.
    local name library
    name=$(sed -n 's/^ *applicationId = "\(.*\)"/\1/p' android/app/build.gradle.kts)
    library=$(sed -n 's/^ *namespace = "\(.*\)"/\1/p' android/foresound/build.gradle.kts)
    sed "1s/<manifest/<manifest package=\"$name\"/" android/app/src/main/AndroidManifest.xml >"$apk/AndroidManifest.xml"
    mkdir "$apk/library"
    sed "1s/<manifest/<manifest package=\"$library\"/" android/foresound/src/main/AndroidManifest.xml \
        >"$apk/library/AndroidManifest.xml"
    aapt package -f -M "$apk/library/AndroidManifest.xml" -I "$frame" -F "$apk/library.apk" || return 1
    aapt package -f -M "$apk/AndroidManifest.xml" -I "$frame" --min-sdk-version "$(recipe platform)" --target-sdk-version 29 \
        --version-code 1 --version-name check -F "$apk/base.apk" || return 1
    local file entries=()
    for file in assets/scenes/* assets/speech/*.wav assets/paper/*; do entries+=("assets/$(basename "$file")=$file"); done
    python3 android/check/apk/pack.py "$apk/base.apk" "$apk/packed.apk" \
        "lib/arm64-v8a/libforesound.so=$work/libforesound-arm64.so" "${entries[@]}" || return 1
    keytool -genkeypair -keystore "$apk/key.p12" -storetype PKCS12 -storepass foresound -alias check -keyalg RSA -keysize 2048 \
        -validity 30 -dname CN=check || return 1
    apksigner sign --ks "$apk/key.p12" --ks-pass pass:foresound --ks-key-alias check --min-sdk-version "$(recipe platform)" \
        --out "$apk/signed.apk" "$apk/packed.apk" || return 1
    apksigner verify --verbose --min-sdk-version "$(recipe platform)" "$apk/signed.apk" | tee "$apk/verify.txt" || return 1
    grep -q 'v2 scheme.*: true' "$apk/verify.txt" || return 1
    zipalign -c 4 "$apk/signed.apk" || return 1
    aapt dump badging "$apk/signed.apk" | tee "$apk/badging.txt" || return 1
    local wanted
    for wanted in "package: name='$name'" "launchable-activity: name='$name.MainActivity'" "native-code: 'arm64-v8a'" \
        "sdkVersion:'$(recipe platform)'"; do
        grep -q "$wanted" "$apk/badging.txt" || { echo "the APK does not say $wanted" && return 1; }
    done
    unzip -p "$apk/signed.apk" lib/arm64-v8a/libforesound.so | cmp - "$work/libforesound-arm64.so" || return 1
    local lies
    lies=$(python3 android/check/apk/pack.py --check "$apk/signed.apk") || { echo "$lies" && return 1; }
    echo "signed and verified, $(stat -c %s "$apk/signed.apk") bytes, $lies; no classes.dex: no dexer to be had"
}

# --- aarch64-unknown-linux-gnu, emulated ----------------------------------------------------------------------------

# Sets cross, and cargo's settings for it.
for_arm64() {
    need qemu-aarch64 aarch64-linux-gnu-gcc python3
    debian_rust
    [ -d "$(/usr/bin/rustc --print sysroot)/lib/rustlib/aarch64-unknown-linux-gnu" ] ||
        { echo "no libstd-rust-web-dev:arm64; run android/install.sh --all" && exit 77; }
    export CARGO_TARGET_DIR=$work/arm64
    export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
    local runner=qemu-aarch64
    # With the cross package alone qemu needs the path of the C library; with the real one it must not have it.
    [ -e /lib/ld-linux-aarch64.so.1 ] || runner="qemu-aarch64 -L /usr/aarch64-linux-gnu"
    export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER=$runner
    cross=(--release --locked --target aarch64-unknown-linux-gnu --no-default-features --features builtin-hrtf,capi)
}
# Two walks on both machines: the same paths, and nearly the same bits.
prove_arm64() {
    for_arm64
    cargo run "${cross[@]}" --example bridge_reference -- assets/scenes/doorway.obj "$work/arm64.raw" "$work/arm64.txt" ||
        return 1
    [ -s "$work/rust.raw" ] || { echo "no walk of this machine; run the proof reference too" && return 1; }
    local hall=assets/scenes/concert_hall.obj
    (unset RUSTC RUSTDOC CARGO_TARGET_DIR &&
        cargo run --release --locked --example bridge_reference -- $hall "$work/hall.raw" "$work/hall.txt") || return 1
    cargo run "${cross[@]}" --example bridge_reference -- $hall "$work/hall-arm64.raw" "$work/hall-arm64.txt" || return 1
    python3 android/check/compare.py "$work/hall.raw" "$work/hall-arm64.raw" 80 "$work/hall.txt" "$work/hall-arm64.txt" 1e-4 \
        >"$work/hall-compared.txt" || { cat "$work/hall-compared.txt" && return 1; }
    python3 android/check/compare.py "$work/rust.raw" "$work/arm64.raw" 80 "$work/rust.txt" "$work/arm64.txt" 1e-4 \
        >"$work/doorway-compared.txt" || { cat "$work/doorway-compared.txt" && return 1; }
    echo "doorway: $(cat "$work/doorway-compared.txt"); hall: $(cat "$work/hall-compared.txt")"
}
# The same laws, by NEON; emulated, an hour and more.
prove_arm64_tests() {
    for_arm64
    cross=(--release --locked --target aarch64-unknown-linux-gnu)
    local test tests=(--lib)
    for test in propagation_bits one_answer watertight laws_of_propagation instances generation band_filter; do
        tests+=(--test "$test")
    done
    cargo test "${cross[@]}" "${tests[@]}" || return 1
    awk '/^test result: ok/ { passed += $4 } END { print passed " tests passed, NEON by emulation" }' "$work/arm64_tests.log"
}
prove_arm64_count() {
    for_arm64
    TARGET_DIR=$CARGO_TARGET_DIR benches/count-aarch64.sh --updates >"$work/count.txt" || return 1
    paste -sd ';' "$work/count.txt"
}

prove library
prove reference
prove c
prove c_abuse
prove install
prove java_walk
prove java_abuse
prove java_missing
prove java_cycles
prove java_threads
prove java_tick
prove kotlin
prove scripts
prove unity
prove android
prove aaudio
prove prefab
prove maven
prove notice
prove apk
for name in arm64 arm64_count arm64_tests; do
    if [ $all = 1 ] || [ ${#only[@]} != 0 ]; then prove $name; else report SKIP $name "slow; run with --all"; fi
done
if [ $json = 1 ]; then
    printf '{"proofs":[%s]}\n' "$(IFS=,; echo "${rows[*]}")"
fi
exit $failed
