#!/usr/bin/env bash
# Makes a folder that replaces the NDK's compilers and system libraries, for CHECK BUILDS ONLY: its output has never run
# with bionic. Usage: make-toolchain.sh FOLDER
#
# Libraries are stubs, one for every name in bionic.sym: the symbols of Android at API 26. With `-z defs` any symbol
# outside that list fails the link. C++ (Oboe) is compiled against Debian's libc++ and musl headers and the few stand-ins
# of `standin/`.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
out=${1:?folder to make}
target=aarch64-linux-android26
rm -rf "$out"
mkdir -p "$out/lib" "$out/bin"

for word in $(awk '!/^#/ && NF { print $1 }' "$here/bionic.sym" | sort -u); do
    name=${word#static:}
    awk -v word="$word" '$1 == word && NF > 1 {
        printf ".globl %s\n.type %s,%%function\n%s:\n brk #1\n.size %s,4\n", $2, $2, $2, $2 }' \
        "$here/bionic.sym" >"$out/lib/$name.s"
    clang-22 --target=$target -c "$out/lib/$name.s" -o "$out/lib/$name.o"
    case $word in
    static:*) llvm-ar-22 rcs "$out/lib/lib$name.a" "$out/lib/$name.o" ;;
    *)
        version=LIB$(echo "$name" | tr '[:lower:]' '[:upper:]')
        case $name in c | m | dl) version=LIBC ;; esac
        echo "$version { global: *; };" >"$out/lib/$name.map"
        ld.lld-22 -shared -soname "lib$name.so" --version-script "$out/lib/$name.map" "$out/lib/$name.o" \
            -o "$out/lib/lib$name.so"
        ;;
    esac
    rm -f "$out/lib/$name".{s,o,map}
done

common="--target=$target -fuse-ld=lld -nostdlib -nostartfiles -L$out/lib -Wno-unused-command-line-argument"
include="-nostdlibinc -isystem $here/standin -isystem /usr/include/aarch64-linux-musl"
include="$include -include $here/standin/android/api-level.h"
include="$include -D__ANDROID_NDK__=1 -DOBOE_NO_INCLUDE_AAUDIO -mno-outline-atomics"
cxx="-nostdinc++ -isystem $here/standin/cxx -isystem /usr/lib/llvm-22/include/c++/v1"
# The linker driver's name has to end in clang, gcc or cc.
printf '#!/bin/sh\nexec clang-22 %s -Wl,-z,text -Wl,--build-id=sha1 "$@"\n' "$common" >"$out/bin/android-clang"
printf '#!/bin/sh\nexec clang-22 %s %s "$@"\n' "$common" "$include" >"$out/bin/android-cc"
printf '#!/bin/sh\nexec clang++-22 %s %s %s "$@"\n' "$common" "$cxx" "$include" >"$out/bin/android-c++"
chmod +x "$out"/bin/*
