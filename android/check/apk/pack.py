#!/usr/bin/env python3
"""Packs an APK in Android's layout, and checks the layout of one.

usage: pack.py BASE.apk OUT.apk NAME=FILE...    BASE's entries and files under their names
       pack.py --check APK                      the last line says how libraries and resources lie

Libraries are stored and begin at a multiple of 16 KiB, so that they are mapped from the APK on devices with such pages;
their entry carries the extra field 0xd935 with that number, which keeps signing tools from moving them. Resources are
stored at a multiple of 4.
"""
import struct
import sys
import zipfile

PAGE = 16384
ALIGNMENT_FIELD = 0xD935
LOCAL_HEADER = 30


def is_library(name):
    return name.startswith("lib/") and name.endswith(".so")


def begins_at(file, entry):
    file.seek(entry.header_offset + 26)
    name, extra = struct.unpack("<HH", file.read(4))
    return entry.header_offset + LOCAL_HEADER + name + extra


def add(out, name, data):
    entry = zipfile.ZipInfo(name, (1981, 1, 1, 0, 0, 0))
    entry.external_attr = 0o644 << 16
    entry.compress_type = zipfile.ZIP_DEFLATED
    align = PAGE if is_library(name) else 4 if name == "resources.arsc" else 0
    if align:
        entry.compress_type = zipfile.ZIP_STORED
        begin = out.fp.tell() + LOCAL_HEADER + len(name.encode()) + 6
        padding = -begin % align
        entry.extra = struct.pack("<HHH", ALIGNMENT_FIELD, 2 + padding, align) + bytes(padding)
    out.writestr(entry, data)


def pack(base, target, files):
    with zipfile.ZipFile(base) as source, zipfile.ZipFile(target, "w") as out:
        for name in source.namelist():
            if not name.endswith("/"):
                add(out, name, source.read(name))
        for name, path in files:
            with open(path, "rb") as file:
                add(out, name, file.read())


def check(path):
    libraries = 0
    with open(path, "rb") as file, zipfile.ZipFile(path) as archive:
        if archive.testzip():
            sys.exit(f"{archive.testzip()} is damaged")
        for entry in archive.infolist():
            align = PAGE if is_library(entry.filename) else 4 if entry.filename == "resources.arsc" else 0
            if not align:
                continue
            libraries += align == PAGE
            begin = begins_at(file, entry)
            if entry.compress_type != zipfile.ZIP_STORED or begin % align:
                sys.exit(f"{entry.filename} is compressed or begins at {begin}, no multiple of {align}")
    if not libraries:
        sys.exit("no library in the APK")
    print(f"{libraries} libraries stored at multiples of {PAGE}")


if sys.argv[1] == "--check":
    check(sys.argv[2])
else:
    pack(sys.argv[1], sys.argv[2], [argument.split("=", 1) for argument in sys.argv[3:]])
