//! The Unity package has the layout that the package manager and the asset database expect: names, versions, and a `.meta`
//! file beside each file and folder, which this test writes (`FORESOUND_WRITE_HEADER=1`).

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

/// Libraries of the packed package: path, importer's platform, its name there, its CPU, the editor's operating system.
const PLUGINS: [(&str, &str, &str, &str, Option<&str>); 4] = [
    (
        "Android/arm64-v8a/libforesound.so",
        "Android",
        "Android",
        "ARM64",
        None,
    ),
    (
        "Linux/x86_64/libforesound.so",
        "Standalone",
        "Linux64",
        "x86_64",
        Some("Linux"),
    ),
    (
        "Windows/x86_64/foresound.dll",
        "Standalone",
        "Win64",
        "x86_64",
        Some("Windows"),
    ),
    (
        "macOS/libforesound.dylib",
        "Standalone",
        "OSXUniversal",
        "AnyCPU",
        Some("OSX"),
    ),
];

fn package() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("android/unity")
}

fn json(path: &str) -> Value {
    let text = fs::read_to_string(package().join(path)).expect(path);
    serde_json::from_str(&text).expect(path)
}

/// The guid of a path in the package: FNV-1a, twice. References in users' scenes are guids: a script that moves keeps its old
/// path here.
fn guid(path: &str) -> String {
    let hash = |start: u64| {
        path.bytes().fold(start, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
        })
    };
    format!(
        "{:016x}{:016x}",
        hash(0xcbf2_9ce4_8422_2325),
        hash(0x6c62_272e_07bb_0142)
    )
}

/// The import settings of a library: one platform with one CPU, and the editor of that system.
fn plugin(platform: &str, name: &str, cpu: &str, editor: Option<&str>) -> String {
    let entry = |first: &str, enabled: u8, settings: &[(&str, &str)]| {
        let mut text =
            format!("  - first:\n      {first}\n    second:\n      enabled: {enabled}\n");
        if settings.is_empty() {
            return text + "      settings: {}\n";
        }
        text += "      settings:\n";
        for (key, value) in settings {
            text += &format!("        {key}: {value}\n");
        }
        text
    };
    let mut data = entry("Any: ", 0, &[]);
    data += &match editor {
        Some(system) => entry(
            "Editor: Editor",
            1,
            &[
                ("CPU", cpu),
                ("DefaultValueInitialized", "true"),
                ("OS", system),
            ],
        ),
        None => entry("Editor: Editor", 0, &[("DefaultValueInitialized", "true")]),
    };
    data += &entry(&format!("{platform}: {name}"), 1, &[("CPU", cpu)]);
    format!(
        "PluginImporter:\n  externalObjects: {{}}\n  serializedVersion: 2\n  iconMap: {{}}\n  executionOrder: {{}}\n  \
         defineConstraints: []\n  isPreloaded: 0\n  isOverridable: 0\n  isExplicitlyReferenced: 0\n  validateReferences: 1\n  \
         platformData:\n{data}"
    )
}

/// The `.meta` file of a path.
fn meta(path: &str, is_folder: bool) -> String {
    let simple = |importer: &str| format!("{importer}:\n  externalObjects: {{}}\n");
    let library = PLUGINS.iter().find(|(library, ..)| path.ends_with(library));
    let importer = match (library, path.rsplit('.').next()) {
        (Some((_, platform, name, cpu, editor)), _) => plugin(platform, name, cpu, *editor),
        _ if is_folder => format!("folderAsset: yes\n{}", simple("DefaultImporter")),
        (_, Some("cs")) => format!(
            "{}  serializedVersion: 2\n  defaultReferences: []\n  executionOrder: 0\n  icon: {{instanceID: 0}}\n",
            simple("MonoImporter")
        ),
        (_, Some("asmdef")) => simple("AssemblyDefinitionImporter"),
        (_, Some("json")) => simple("PackageManifestImporter"),
        _ => simple("TextScriptImporter"),
    };
    let end = "  userData: \n  assetBundleName: \n  assetBundleVariant: \n";
    format!(
        "fileFormatVersion: 2\nguid: {}\n{importer}{end}",
        guid(path)
    )
}

/// Files and folders below a folder, with their paths in the package; folders that Unity ignores are left out.
fn assets(folder: &Path, prefix: &str, found: &mut BTreeMap<String, bool>) {
    for entry in fs::read_dir(folder).expect("is a folder") {
        let entry = entry.expect("readable");
        let name = entry.file_name().into_string().expect("UTF-8");
        let is_folder = entry.path().is_dir();
        if name.ends_with('~') || name.starts_with('.') || name.ends_with(".meta") {
            continue;
        }
        let path = format!("{prefix}{name}");
        if is_folder {
            assets(&entry.path(), &format!("{path}/"), found);
        }
        found.insert(path, is_folder);
    }
}

/// Paths of `.meta` files below a folder, without the ending.
fn metas(folder: &Path, prefix: &str, found: &mut BTreeSet<String>) {
    for entry in fs::read_dir(folder).expect("is a folder") {
        let entry = entry.expect("readable");
        let name = entry.file_name().into_string().expect("UTF-8");
        if entry.path().is_dir() && !name.ends_with('~') {
            metas(&entry.path(), &format!("{prefix}{name}/"), found);
        } else if let Some(name) = name.strip_suffix(".meta") {
            found.insert(format!("{prefix}{name}"));
        }
    }
}

/// Each part of the package that is imported on its own: its folder, and what it has without being in this repository.
fn parts() -> Vec<(PathBuf, String, BTreeMap<String, bool>)> {
    let part = |folder: &str, prefix: &str, added: &[(&str, bool)]| {
        let root = package().join(folder);
        let mut found = BTreeMap::new();
        assets(&root, prefix, &mut found);
        found.extend(
            added
                .iter()
                .map(|(path, is_folder)| ((*path).to_owned(), *is_folder)),
        );
        (root, prefix.to_owned(), found)
    };
    // What pack.sh adds: the licence and the libraries. `Packed~/Runtime` is the package's own.
    let mut packed = part("Packed~", "", &[("LICENSE.md", false)]);
    packed.2.remove("Runtime");
    for (library, ..) in PLUGINS {
        packed.2.insert(format!("Runtime/Plugins/{library}"), false);
    }
    vec![
        part("", "", &[]),
        packed,
        part("Samples~/FirstSound", "FirstSound/", &[]),
    ]
}

#[test]
fn every_asset_has_its_meta_file() {
    let mut guids = BTreeMap::new();
    for (root, prefix, assets) in parts() {
        let mut kept = BTreeSet::new();
        for (path, is_folder) in &assets {
            let relative = path.strip_prefix(&prefix).expect("its prefix");
            let file = root.join(format!("{relative}.meta"));
            let made = meta(path, *is_folder);
            if std::env::var_os("FORESOUND_WRITE_HEADER").is_some() {
                fs::create_dir_all(file.parent().expect("a folder")).expect("is made");
                fs::write(&file, &made).expect("is written");
            }
            let found = fs::read_to_string(&file).unwrap_or_default();
            assert!(
                found == made,
                "{} is out of date: run FORESOUND_WRITE_HEADER=1 cargo test --test unity_package",
                file.display()
            );
            assert_eq!(
                guids.insert(guid(path), path.clone()),
                None,
                "{path} has another's guid"
            );
            kept.insert(path.clone());
        }
        let mut all = BTreeSet::new();
        metas(&root, &prefix, &mut all);
        assert_eq!(
            all,
            kept,
            "meta files without an asset in {}",
            root.display()
        );
    }
    assert!(guids.len() > 40, "{} assets", guids.len());
}

#[test]
fn the_manifest_names_what_is_there() {
    let manifest = json("package.json");
    assert_eq!(manifest["name"], "dev.foresound.unity");
    assert_eq!(manifest["version"], env!("CARGO_PKG_VERSION"));
    for sample in manifest["samples"].as_array().expect("samples") {
        let path = sample["path"].as_str().expect("a path");
        assert!(package().join(path).is_dir(), "{path}");
    }
}

/// Names of assemblies are file names, references are names of assemblies here.
#[test]
fn assemblies_refer_to_each_other() {
    let files = [
        "Runtime/Foresound.asmdef",
        "Editor/Foresound.Editor.asmdef",
        "Samples~/FirstSound/Foresound.FirstSound.asmdef",
    ];
    let names = files.map(|file| json(file)["name"].as_str().expect("a name").to_owned());
    for (file, name) in files.iter().zip(&names) {
        assert!(
            file.ends_with(&format!("/{name}.asmdef")),
            "{file} has the name {name}"
        );
        for reference in json(file)["references"].as_array().expect("a list") {
            assert!(
                names.iter().any(|name| reference == name),
                "{file} refers to {reference}"
            );
        }
    }
}

/// Where a component is in its file of the same name, Unity finds it.
#[test]
fn components_are_in_files_of_their_names() {
    let mut files = BTreeMap::new();
    assets(&package(), "", &mut files);
    let mut components = 0;
    for path in files.keys().filter(|path| path.ends_with(".cs")) {
        let text = fs::read_to_string(package().join(path)).expect("is text");
        let bases = ["MonoBehaviour", "ScriptableObject", "ForesoundMeshes"];
        let declared = text
            .lines()
            .filter_map(|line| line.trim().split_once("class "));
        for (_, line) in declared {
            let Some((name, base)) = line.split_once(" : ") else {
                continue;
            };
            if bases.contains(&base.split(',').next().unwrap_or_default()) {
                components += 1;
                assert!(
                    path.ends_with(&format!("/{name}.cs")),
                    "{name} is in {path}"
                );
            }
        }
    }
    assert_eq!(components, 7);
}
