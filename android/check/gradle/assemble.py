#!/usr/bin/env python3
"""Makes Kotlin sources of the build scripts, to be compiled with StandIns.kt: each script a function, the version catalog
an object with the names that Gradle would give it, and a main that prints the commands of its tasks and writes what would
be published.

usage: assemble.py OUT_FOLDER, from the repository's root; the folder publication in it gets what would be published
"""
import pathlib
import sys
import tomllib

root, out = pathlib.Path("android"), pathlib.Path(sys.argv[1])
out.mkdir(parents=True, exist_ok=True)
catalog = tomllib.loads((root / "gradle/libs.versions.toml").read_text())


def tree(entries):
    nodes = {}
    for key, value in entries.items():
        *folders, last = key.replace("_", "-").split("-")
        node = nodes
        for folder in folders:
            node = node.setdefault(folder, {})
        node[last] = value
    return nodes


def kotlin(nodes):
    for name, value in nodes.items():
        if isinstance(value, dict):
            yield f"object {name} {{"
            yield from kotlin(value)
            yield "}"
        else:
            yield f"val {name} = {value}"


def version(entry):
    reference = entry["version"]
    return catalog["versions"][reference["ref"]] if isinstance(reference, dict) else reference


quoted = '"{}"'.format
libraries = {key: quoted(f"{entry['module']}:{version(entry)}") for key, entry in catalog["libraries"].items()}
plugins = {
    key: f"Value(Plugin({quoted(entry['id'])}, {quoted(version(entry))}))" for key, entry in catalog["plugins"].items()
}
versions = {key: f"Value({quoted(value)})" for key, value in catalog["versions"].items()}
lines = ["object libs {", *kotlin(tree(libraries)), "object versions {", *kotlin(tree(versions)), "}"]
lines += ["object plugins {", *kotlin(tree(plugins)), "}", "}"]
scripts = ["settings.gradle.kts", "build.gradle.kts", "foresound/build.gradle.kts", "app/build.gradle.kts"]
for number, name in enumerate(scripts):
    # Gradle makes a class of each script: its declarations are visible below only. It imports this package by itself.
    (out / f"Script{number}.kt").write_text(f"import java.io.*\n\nfun script{number}() {{\n{(root / name).read_text()}\n}}\n")
lines += ["fun main() {"]
for number, name in enumerate(scripts):
    lines += [f"script{number}()"]
    if name.startswith("foresound/"):
        lines += [f'writePublication(java.io.File("{out.as_posix()}/publication"), scopes.toList())']
lines += ['executed.forEach { println(it.command.joinToString(" ")) }', "}"]
(out / "Catalog.kt").write_text("\n".join(lines) + "\n")
