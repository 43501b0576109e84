#!/usr/bin/env python3
"""Makes the AAR from the parts that check.sh has built, and checks its contents.

usage: aar.py make AAR WORK LAYOUT              AAR from WORK's classes, libraries and prefab package
       aar.py prefab AAR FOLDER                 unpacks it into FOLDER and checks the prefab package
       aar.py maven AAR PUBLICATION REPOSITORY  checks the POM and lays out a Maven repository

LAYOUT and PUBLICATION are written by the Gradle scripts' stand-ins. The last line says what was found.
"""
import hashlib
import json
import pathlib
import shutil
import sys
import tomllib
import xml.etree.ElementTree as xml
import zipfile

DATE = (1981, 1, 1, 0, 0, 0)
MODULE = pathlib.Path("android/foresound")


def put(archive, name, data):
    entry = zipfile.ZipInfo(name, DATE)
    entry.external_attr = 0o644 << 16
    entry.compress_type = zipfile.ZIP_DEFLATED
    archive.writestr(entry, data)


def jar(path, files):
    with zipfile.ZipFile(path, "w") as archive:
        for name, file in sorted(files.items()):
            put(archive, name, file.read_bytes())


def sources():
    return {
        file.relative_to(folder).as_posix(): file
        for folder in (MODULE / "src/main/java", MODULE / "src/main/kotlin")
        for file in folder.rglob("*.*")
    }


def make(out, work, layout):
    work = pathlib.Path(work)
    folder = work / "library-classes"
    classes = {file.relative_to(folder).as_posix(): file for file in folder.rglob("*.class")}
    metadata = folder / "META-INF/main.kotlin_module"
    if metadata.exists():
        classes["META-INF/main.kotlin_module"] = metadata
    jar(work / "classes.jar", classes)
    manifest = (MODULE / "src/main/AndroidManifest.xml").read_text()
    manifest = manifest.replace("<manifest", '<manifest package="dev.foresound"', 1)
    with zipfile.ZipFile(out, "w") as archive:
        put(archive, "AndroidManifest.xml", manifest)
        put(archive, "classes.jar", (work / "classes.jar").read_bytes())
        put(archive, "R.txt", "")
        put(archive, "proguard.txt", (MODULE / "consumer-rules.pro").read_text())
        for library in sorted((work / "jniLibs").glob("*/*.so")):
            put(archive, f"jni/{library.parent.name}/{library.name}", library.read_bytes())
        for line in pathlib.Path(layout).read_text().splitlines():
            kind, *words = line.split(" ", 2)
            if kind != "aar":
                continue
            into, what = words[0], pathlib.Path(words[1])
            if what.name == "prefab":
                # Gradle's build folder; check.sh has its own.
                what = work / "prefab"
            files = [what] if what.is_file() else sorted(f for f in what.rglob("*") if f.is_file())
            assert files, f"nothing in {what}"
            for file in files:
                inside = file.name if file == what else file.relative_to(what).as_posix()
                put(archive, f"{into}/{inside}", file.read_bytes())
    print(f"{out}: {pathlib.Path(out).stat().st_size} bytes, {len(classes)} classes")


def cargo():
    return tomllib.loads(pathlib.Path("Cargo.toml").read_text())["workspace"]["package"]


def prefab(aar, folder):
    folder = pathlib.Path(folder)
    shutil.rmtree(folder, ignore_errors=True)
    with zipfile.ZipFile(aar) as archive:
        archive.extractall(folder)
    root = folder / "prefab"
    package = json.loads((root / "prefab.json").read_text())
    assert package == {"schema_version": 2, "name": "foresound", "version": cargo()["version"], "dependencies": []}, package
    assert [path.name for path in (root / "modules").iterdir()] == ["foresound"]
    module = root / "modules/foresound"
    described = json.loads((module / "module.json").read_text())
    assert described == {"export_libraries": [], "library_name": "libforesound"}, described
    header = pathlib.Path("include/foresound.h").read_bytes()
    assert (module / "include/foresound.h").read_bytes() == header, "another header"
    recipe = tomllib.loads(pathlib.Path("cargo-ndk.toml").read_text())["library"]
    ndk = tomllib.loads((MODULE.parent / "gradle/libs.versions.toml").read_text())["versions"]["ndk"]
    abis = []
    for libraries in sorted((module / "libs").iterdir()):
        abi = libraries.name.removeprefix("android.")
        assert abi in recipe["targets"], f"{abi} is not built"
        told = json.loads((libraries / "abi.json").read_text())
        wanted = {"abi": abi, "api": recipe["platform"], "ndk": int(ndk.split(".")[0]), "stl": "none", "static": False}
        assert told == wanted, told
        library = (libraries / "libforesound.so").read_bytes()
        assert library == (folder / f"jni/{abi}/libforesound.so").read_bytes(), "not the library of jni/"
        abis.append(abi)
    assert "arm64-v8a" in abis
    missing = sorted(set(recipe["targets"]) - set(abis))
    print(f"prefab.json, module.json, header, {', '.join(abis)}" + (f" ({', '.join(missing)} not built here)" if missing else ""))


def maven(aar, publication, repository):
    publication, package = pathlib.Path(publication), cargo()
    pom = xml.parse(publication / "pom.xml").getroot()
    # What Maven Central asks of every artifact.
    for wanted in ("groupId", "artifactId", "version", "packaging", "name", "description", "url", "licenses/license/name",
                   "licenses/license/url", "developers/developer/name", "scm/url"):
        assert (pom.findtext(wanted) or "").strip(), f"the POM has no {wanted}"
    assert pom.findtext("version") == package["version"] and pom.findtext("url") == package["homepage"]
    licences = [licence.findtext("name") for licence in pom.iter("license")]
    assert " OR ".join(licences) == package["license"], licences
    versions = tomllib.loads((MODULE.parent / "gradle/libs.versions.toml").read_text())["versions"]
    dependencies = {(d.findtext("artifactId"), d.findtext("version"), d.findtext("scope")) for d in pom.iter("dependency")}
    expected = {(f"kotlinx-coroutines-{part}", versions["coroutines"], scope) for part, scope in (("core", "compile"), ("android", "runtime"))}
    assert dependencies == expected, dependencies
    jars = [line.split()[1] for line in (publication / "layout.txt").read_text().splitlines() if line.startswith("jar ")]
    assert jars == ["sources", "javadoc"], jars

    group, name, version = (pom.findtext(key) for key in ("groupId", "artifactId", "version"))
    folder = pathlib.Path(repository, *group.split("."), name, version)
    shutil.rmtree(repository, ignore_errors=True)
    folder.mkdir(parents=True)
    shutil.copy(aar, folder / f"{name}-{version}.aar")
    shutil.copy(publication / "pom.xml", folder / f"{name}-{version}.pom")
    jar(folder / f"{name}-{version}-sources.jar", sources())
    for file in list(folder.iterdir()):
        for digest in ("md5", "sha1"):
            pathlib.Path(f"{file}.{digest}").write_text(hashlib.new(digest, file.read_bytes()).hexdigest())
    with zipfile.ZipFile(aar) as archive:
        names = set(archive.namelist())
    for wanted in ("AndroidManifest.xml", "classes.jar", "proguard.txt", "R.txt", "META-INF/NOTICE", "prefab/prefab.json"):
        assert wanted in names, f"the AAR has no {wanted}"
    print(f"{group}:{name}:{version}, {pathlib.Path(aar).stat().st_size} bytes, POM, {len(sources())} sources; "
          "the Javadoc jar is the Android plugin's")


if __name__ == "__main__":
    {"make": make, "prefab": prefab, "maven": maven}[sys.argv[1]](*sys.argv[2:])
