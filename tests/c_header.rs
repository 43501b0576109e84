//! `include/foresound.h`, `Native.java` and `Native.cs` are written from the tables of `src/bridge`, and are up to date.

#[path = "c_header/csharp.rs"]
mod csharp;

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use cbindgen::{
    Builder, Config, DocumentationStyle, EnumConfig, ExportConfig, FunctionConfig, ItemType,
    Language, RenameRule, Style,
};
use foresound::bridge::VERSION;
use foresound::bridge::enumeration::constant_case;
use foresound::bridge::interface::{
    Function, Parameter, camel_case, enumerations, functions, structures,
};
use foresound::bridge::pose::POSE_BYTES;

const PREAMBLE: &str = "\
/* Foresound: real-time ray-traced sound. The C interface, for C, C++ and engines with C bindings.
 *
 * Written from src/bridge by `FORESOUND_WRITE_HEADER=1 cargo test --test c_header`; do not edit.
 *
 * Handles. Engines, renderers, scenes, clips, streams and outputs are 64-bit numbers, never 0, closed with
 * foresound_close. A closed handle, another kind's or an arbitrary number is an error and never undefined behaviour.
 *
 * Threads. The audio thread is the one that renders. Any other thread is a control thread; control functions wait for
 * each other if they use the same handle. Functions for the audio thread say so (foresound_render, foresound_stream_write):
 * they never wait and never allocate.
 *
 * Units. Metres, seconds, Hz, linear gain; right-handed coordinates, +y up. An audio frame is one sample a channel; a
 * graphics frame is the app's tick. Sources and instances have 32-bit ids, never 0.
 *
 * Pointers. A pointer is the address of a variable of its type, or of an array with the length of the parameter after it.
 * It need not be valid after the call. Texts are UTF-8 with a terminating zero. Null is an error (FORESOUND_STATUS_NULL)
 * except for an array of length 0 and where the function's description allows it.
 *
 * Errors. Functions return a ForesoundStatus; foresound_last_error has the message. After a failure, results are 0, which is
 * no handle and no id. These can come from every function, and its description does not repeat them; it says what else can:
 *
 *     FORESOUND_STATUS_NULL            a pointer is null that needs a value
 *     FORESOUND_STATUS_BAD_ARGUMENT    a value is outside its stated range or not finite, a `size` or text is invalid
 *     FORESOUND_STATUS_CLOSED          a handle was closed or is none
 *     FORESOUND_STATUS_WRONG_KIND      a handle is of another kind
 *     FORESOUND_STATUS_STALE_SOURCE    a source was removed, or a one-shot has ended
 *     FORESOUND_STATUS_STALE_INSTANCE  an instance was removed
 *     FORESOUND_STATUS_BUSY            functions of the audio thread: another thread uses the handle
 *     FORESOUND_STATUS_FULL            functions that give a handle: 4,096 of its kind are open
 *     FORESOUND_STATUS_PANIC           a defect of the library; close the handle
 *
 * Structures. A structure begins with its size in this header; the library reads and writes no more than that:
 *
 *     ForesoundOptions options = FORESOUND_OPTIONS_INIT;
 *
 * The initialiser has the size and this header's defaults; foresound_..._default has the library's, for languages without
 * macros: set `size` before. A newer library uses its defaults for fields that an older caller's header lacks; an older
 * library ignores a newer caller's further fields, and sets them to 0 where it writes. Elements of arrays (ForesoundPose,
 * ForesoundShownPath) have no size; functions take it beside the array: pass sizeof. stability.md says what may change.
 */";

/// What stands before the declarations.
const EXPORT: &str = "
/* Exported from the shared library. Define FORESOUND_STATIC before this header if the library is linked statically. */
#ifndef FORESOUND_API
#if defined(_WIN32) && !defined(FORESOUND_STATIC)
#define FORESOUND_API __declspec(dllimport)
#elif defined(__GNUC__)
#define FORESOUND_API __attribute__((visibility(\"default\")))
#else
#define FORESOUND_API
#endif
#endif";

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The shared functions and the structures as Rust declarations, which cbindgen reads: it does not expand macros.
fn declarations() -> String {
    let mut text = String::from("use std::ffi::c_char;\n");
    for enumeration in enumerations() {
        let _ = writeln!(text, "{}", enumeration.source);
    }
    for structure in structures() {
        let _ = writeln!(text, "{}", structure.source);
    }
    let [shared, _] = functions();
    for function in shared {
        for line in function.docs {
            let _ = writeln!(text, "///{line}");
        }
        let mut parameters = String::new();
        for Parameter { name, count, c, .. } in &function.parameters {
            let _ = write!(parameters, "{name}: {c}, ");
            if let Some(count) = count {
                let _ = write!(parameters, "{count}: usize, ");
            }
        }
        if let Some(Parameter { name, c, .. }) = &function.result {
            let _ = write!(parameters, "{name}: *mut {c}");
        }
        let name = function.name;
        let _ = writeln!(
            text,
            "#[unsafe(no_mangle)] pub extern \"C\" fn {name}({parameters}) -> Status {{}}"
        );
    }
    text
}

/// The macros that initialise structures.
fn initializers() -> String {
    let mut text = String::from(
        "/* Initial values of structures: their size and this header's defaults. */\n",
    );
    for structure in structures() {
        if let Some(values) = structure.initializer {
            let name = constant_case(structure.name);
            let line = format!("#define FORESOUND_{name}_INIT {values}");
            let mut length = 0;
            for word in line.split_inclusive(' ') {
                if length + word.len() > 116 {
                    text += "\\\n    ";
                    length = 4;
                }
                text += word;
                length += word.len();
            }
            text += "\n";
        }
    }
    text
}

fn header() -> String {
    let names = enumerations()
        .into_iter()
        .map(|enumeration| enumeration.name);
    let config = Config {
        language: Language::C,
        header: Some(PREAMBLE.into()),
        include_guard: Some("FORESOUND_H".into()),
        cpp_compat: true,
        documentation_style: DocumentationStyle::C99,
        style: Style::Both,
        usize_is_size_t: true,
        no_includes: true,
        sys_includes: vec!["stddef.h".into(), "stdint.h".into()],
        after_includes: Some(format!(
            "\n/* The version of this header, for foresound_engine_create. */\n#define FORESOUND_API_VERSION {VERSION:#010x}u\n{EXPORT}\n\n{}",
            initializers()
        )),
        line_length: 120,
        export: ExportConfig {
            prefix: Some("Foresound".into()),
            item_types: vec![
                ItemType::Enums,
                ItemType::Structs,
                ItemType::Typedefs,
                ItemType::Functions,
            ],
            // Sums of bits are plain numbers, which name no enumeration.
            include: names.map(str::to_owned).collect(),
            ..ExportConfig::default()
        },
        function: FunctionConfig {
            prefix: Some("FORESOUND_API".into()),
            ..FunctionConfig::default()
        },
        enumeration: EnumConfig {
            rename_variants: RenameRule::ScreamingSnakeCase,
            prefix_with_name: true,
            ..EnumConfig::default()
        },
        ..Config::default()
    };
    let folder = tempfile::tempdir().expect("a folder");
    let declared = folder.path().join("declarations.rs");
    fs::write(&declared, declarations()).expect("is written");
    let bridge = root().join("src/bridge");
    let mut bytes = Vec::new();
    Builder::new()
        .with_config(config)
        .with_src(bridge.join("error.rs"))
        .with_src(bridge.join("pose.rs"))
        .with_src(declared)
        // Its modules are followed.
        .with_src(bridge.join("capi/mod.rs"))
        .generate()
        .expect("the sources parse")
        .write(&mut bytes);
    let text = String::from_utf8(bytes).expect("is text");
    // The section for readers of the Rust code: the preamble has its content.
    let unsafety = "//\n// # Safety\n// Pointers are null or valid as the header says";
    text.replace(&format!("{unsafety}.\n"), "")
        .replace(&format!("{unsafety}; "), "//\n// ")
}

fn native(function: &Function, documented: bool) -> String {
    let mut text = String::new();
    if documented {
        let docs: String = function.docs.concat();
        let _ = writeln!(text, "\n    /**{docs} */");
    }
    let result = function.result.as_ref().map_or("void", |r| r.java[0]);
    let parameters = function.parameters.iter();
    let parameters: Vec<String> = parameters
        .map(|p| format!("{} {}", p.java[0], camel_case(p.name)))
        .collect();
    let name = function.java_name();
    let line = format!(
        "    static native {result} {name}({});",
        parameters.join(", ")
    );
    let broken = line.replace('(', "(\n            ");
    let _ = writeln!(text, "{}", if line.len() > 120 { broken } else { line });
    text
}

fn native_java() -> String {
    let mut text = format!(
        "\
package dev.foresound;

import java.nio.ByteBuffer;

/**
 * The natives of libforesound, registered by its JNI_OnLoad; the Kotlin classes of this package are the public interface.
 * Written from src/bridge by `FORESOUND_WRITE_HEADER=1 cargo test --test c_header`; do not edit.
 *
 * <p>Functions without a comment are those of foresound.h. A failed call throws. Structures are lists of doubles, indexed
 * by the constants of the nested classes; null options are the defaults. Buffers are direct, in native order.
 */
final class Native {{
    /** Bytes of a pose in a frame: the source's id, three floats of position, four of orientation. */
    static final int POSE_BYTES = {POSE_BYTES};
    /** The version of the interface, for engineCreate. */
    static final int VERSION = {VERSION:#010x};

    /** Why the library is missing; null if it is loaded. */
    private static final Throwable MISSING = NativeLibrary.load();

    private Native() {{}}

    /** Throws {{@link UnavailableException}} if the library is missing. */
    static void require() {{
        NativeLibrary.require(MISSING);
    }}

"
    );
    let [shared, java] = functions();
    for function in &shared {
        text += &native(function, false);
    }
    for function in &java {
        text += &native(function, true);
    }
    for structure in structures() {
        let _ = write!(
            text,
            "\n    static final class {} {{\n        static final int LENGTH = {};\n",
            structure.name, structure.length
        );
        for (field, index) in structure.fields {
            let field = field.to_uppercase();
            let _ = writeln!(text, "        static final int {field} = {index};");
        }
        text += "    }\n";
    }
    for enumeration in enumerations() {
        let _ = writeln!(text, "\n    static final class {} {{", enumeration.name);
        for (member, value) in enumeration.members {
            let member = constant_case(member);
            let _ = writeln!(text, "        static final int {member} = {value};");
        }
        text += "    }\n";
    }
    text + "}\n"
}

fn is_up_to_date(file: PathBuf, made: &str) {
    if std::env::var_os("FORESOUND_WRITE_HEADER").is_some() {
        fs::write(&file, made).expect("its folder exists");
    }
    let kept = fs::read_to_string(&file).unwrap_or_default();
    assert!(
        made == kept,
        "{} is out of date: run FORESOUND_WRITE_HEADER=1 cargo test --test c_header",
        file.display()
    );
}

#[test]
fn the_header_is_up_to_date() {
    is_up_to_date(root().join("include/foresound.h"), &header());
}

#[test]
fn the_natives_are_up_to_date() {
    let file = "android/foresound/src/main/java/dev/foresound/Native.java";
    is_up_to_date(root().join(file), &native_java());
}

#[test]
fn the_bindings_of_unity_are_up_to_date() {
    let made = csharp::native_cs(&header(), foresound::bridge::VERSION);
    is_up_to_date(
        root().join("android/unity/Runtime/Interop/Native.cs"),
        &made,
    );
}

/// The header declares every function of the table and of the folder `capi`.
#[test]
fn the_header_has_every_exported_function() {
    let [shared, _] = functions();
    let mut names: Vec<String> = shared.iter().map(|f| f.name.to_owned()).collect();
    assert!(names.len() > 25, "{} functions in the table", names.len());
    for entry in fs::read_dir(root().join("src/bridge/capi")).expect("exists") {
        let text = fs::read_to_string(entry.expect("readable").path()).expect("text");
        let parts = text.split("extern \"C\" fn foresound_").skip(1);
        names.extend(parts.map(|part| {
            let end = part.split('(').next().unwrap_or_default();
            format!("foresound_{end}")
        }));
    }
    assert!(names.len() > 35, "{} functions", names.len());
    let made = header();
    for name in names {
        assert!(
            made.contains(&format!(" {name}(")) || made.contains(&format!("*{name}(")),
            "{name} is missing"
        );
    }
}

/// Names that `<windows.h>` and the headers that it includes define as macros, with or without a value.
const WINDOWS_MACROS: [&str; 36] = [
    "interface",
    "near",
    "far",
    "small",
    "hyper",
    "cdecl",
    "pascal",
    "min",
    "max",
    "far",
    "huge",
    "IN",
    "OUT",
    "OPTIONAL",
    "CONST",
    "VOID",
    "CALLBACK",
    "APIENTRY",
    "ERROR",
    "NO_ERROR",
    "DELETE",
    "STRICT",
    "TRUE",
    "FALSE",
    "INFINITE",
    "THIS",
    "UNICODE",
    "PASCAL",
    "NEAR",
    "FAR",
    "EXTERN_C",
    "rad1",
    "rad2",
    "grp1",
    "DOMAIN",
    "OVERFLOW",
];

/// No identifier of the header is one that a macro of `<windows.h>` or `<math.h>` replaces.
#[test]
fn no_identifier_is_a_macro_of_windows() {
    let header = header();
    let after_preamble = header.split("*/").skip(1).collect::<String>();
    let code: String = after_preamble
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default())
        .collect::<Vec<_>>()
        .join("\n");
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let words = code.split(|c| !is_part(c));
    let clashes: Vec<&str> = words.filter(|word| WINDOWS_MACROS.contains(word)).collect();
    assert!(clashes.is_empty(), "{clashes:?}");
    assert!(code.contains("uint32_t size;"));
}
