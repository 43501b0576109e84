//! The library as Godot loads it, up to the registration of its classes: it is opened as `foresound.gdextension` names it, and
//! initialised by a host of ours that answers every function of the interface and takes down what is registered.
//!
//! The host has no objects and no values: it shows that the library starts, and which classes, properties and methods Godot is told of.
//! What they do, only Godot can show (README.md).

use std::collections::BTreeMap;
use std::ffi::{CStr, CString, c_char, c_void};
use std::path::PathBuf;
use std::ptr;
use std::sync::{Mutex, PoisonError};

/// What was registered: the parent of each class, and its properties and methods.
static CLASSES: Mutex<BTreeMap<String, Class>> = Mutex::new(BTreeMap::new());

#[derive(Debug, Default, Clone)]
struct Class {
    parent: String,
    properties: Vec<String>,
    methods: Vec<String>,
}

/// What functions without a meaning here return: an address that is no null, whose low bytes are 0 ("false").
#[repr(align(65536))]
struct Nothing {
    _zeros: [u8; 65536],
}
static NOTHING: Nothing = Nothing { _zeros: [0; 65536] };

unsafe extern "C" fn nothing() -> *const c_void {
    ptr::from_ref(&NOTHING).cast()
}

/// What has no function to give for a type or a method gives the one that does nothing.
unsafe extern "C" fn no_function() -> *const c_void {
    nothing as *const c_void
}

/// Constructors of a type: the first makes an empty value, all others begin with one argument. The host's values are one word.
unsafe extern "C" fn constructor(_kind: u32, index: i32) -> *const c_void {
    match index {
        0 => make_empty as *const c_void,
        _ => copy_first as *const c_void,
    }
}

unsafe extern "C" fn make_empty(to: *mut *const c_void) {
    // SAFETY: room for a value.
    unsafe { to.write(ptr::null()) };
}

unsafe extern "C" fn copy_first(to: *mut *const c_void, arguments: *const *const *const c_void) {
    // SAFETY: room for a value, and a list of addresses of values.
    unsafe { to.write(**arguments) };
}

/// Conversions into a variant: all are `null`, which has the type 0.
unsafe extern "C" fn to_variant() -> *const c_void {
    make_empty as *const c_void
}

/// The method `OS.has_feature`: the one of which the host gives the result.
static HAS_FEATURE: Nothing = Nothing { _zeros: [0; 65536] };

unsafe extern "C" fn method_bind(
    _class: *const *const c_char,
    method: *const *const c_char,
    _hash: i64,
) -> *const Nothing {
    // SAFETY: a name.
    match unsafe { text(method) }.as_str() {
        "has_feature" => &raw const HAS_FEATURE,
        _ => &raw const NOTHING,
    }
}

/// Calls a method of an object. Godot's numbers are `single`; all else is "no", or nothing.
unsafe extern "C" fn call(
    method: *const Nothing,
    _object: *const c_void,
    arguments: *const *const *const c_char,
    result: *mut u8,
) {
    if method == &raw const HAS_FEATURE {
        // SAFETY: one argument, a name, and a `bool` to write.
        unsafe { result.write(u8::from(text(*arguments) == "single")) };
    }
}

/// Addresses of the host's names: a name is a C string, and a `StringName` or `String` its address.
static NAMES: Mutex<Vec<usize>> = Mutex::new(Vec::new());

fn intern(text: &[u8]) -> *const c_void {
    let text: Vec<u8> = text.iter().copied().filter(|&byte| byte != 0).collect();
    let name = CString::new(text).expect("no zeros").into_raw();
    NAMES
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .push(name as usize);
    name.cast_const().cast()
}

/// The text of a name that the library passes.
unsafe fn text(name: *const *const c_char) -> String {
    // SAFETY: the library passes addresses of names that `intern` made.
    let word = unsafe { *name };
    let own = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    assert!(own.contains(&(word as usize)), "a name of the host's");
    // SAFETY: as above; names are never freed.
    unsafe { CStr::from_ptr(word) }
        .to_string_lossy()
        .into_owned()
}

unsafe extern "C" fn name_of_c_string(to: *mut *const c_void, from: *const c_char) {
    // SAFETY: a C string, and a word to write to.
    unsafe { *to = intern(CStr::from_ptr(from).to_bytes()) };
}

unsafe extern "C" fn name_of_bytes(to: *mut *const c_void, from: *const u8, length: i64) {
    // SAFETY: that many bytes, and a word to write to.
    unsafe { *to = intern(std::slice::from_raw_parts(from, length as usize)) };
}

unsafe extern "C" fn register_class(
    _library: *const c_void,
    name: *const *const c_char,
    parent: *const *const c_char,
    _info: *const c_void,
) {
    // SAFETY: both are names.
    let (name, parent) = unsafe { (text(name), text(parent)) };
    let mut classes = CLASSES.lock().unwrap_or_else(PoisonError::into_inner);
    classes.entry(name).or_default().parent = parent;
}

/// Type, then name.
#[repr(C)]
struct PropertyInfo {
    kind: u32,
    name: *const *const c_char,
}

unsafe extern "C" fn register_property(
    _library: *const c_void,
    class: *const *const c_char,
    info: *const PropertyInfo,
    _setter: *const c_void,
    _getter: *const c_void,
) {
    // SAFETY: both are names.
    let (class, name) = unsafe { (text(class), text((*info).name)) };
    let mut classes = CLASSES.lock().unwrap_or_else(PoisonError::into_inner);
    classes.entry(class).or_default().properties.push(name);
}

/// A method's name comes first.
unsafe extern "C" fn register_method(
    _library: *const c_void,
    class: *const *const c_char,
    info: *const *const *const c_char,
) {
    // SAFETY: both are names.
    let (class, name) = unsafe { (text(class), text(*info)) };
    let mut classes = CLASSES.lock().unwrap_or_else(PoisonError::into_inner);
    classes.entry(class).or_default().methods.push(name);
}

/// The older form of the version.
#[repr(C)]
struct Version {
    numbers: [u32; 3],
    text: *const c_char,
}

/// The newer form.
#[repr(C)]
struct Version2 {
    numbers: [u32; 4],
    status: *const c_char,
    build: *const c_char,
    hash: *const c_char,
    timestamp: u64,
    text: *const c_char,
}

const VERSION: &CStr = c"Godot Engine v4.99.0.stable.host";

unsafe extern "C" fn version(to: *mut Version) {
    let numbers = [4, 99, 0];
    let text = VERSION.as_ptr();
    // SAFETY: a structure of the caller's.
    unsafe { to.write(Version { numbers, text }) };
}

unsafe extern "C" fn version2(to: *mut Version2) {
    let version = Version2 {
        numbers: [4, 99, 0, 0x04_63_00],
        status: c"stable".as_ptr(),
        build: c"host".as_ptr(),
        hash: c"".as_ptr(),
        timestamp: 0,
        text: VERSION.as_ptr(),
    };
    // SAFETY: a structure of the caller's.
    unsafe { to.write(version) };
}

/// The interface: a function for every name.
unsafe extern "C" fn address(name: *const c_char) -> *const c_void {
    // SAFETY: a C string.
    let name = unsafe { CStr::from_ptr(name) }.to_str().unwrap_or_default();
    match name {
        "get_godot_version" => version as *const c_void,
        "get_godot_version2" => version2 as *const c_void,
        "string_name_new_with_latin1_chars"
        | "string_name_new_with_utf8_chars"
        | "string_new_with_utf8_chars"
        | "string_new_with_latin1_chars" => name_of_c_string as *const c_void,
        "string_name_new_with_utf8_chars_and_len"
        | "string_new_with_utf8_chars_and_len"
        | "string_new_with_utf8_chars_and_len2"
        | "string_new_with_latin1_chars_and_len" => name_of_bytes as *const c_void,
        _ if name.starts_with("classdb_register_extension_class_property") => match name {
            "classdb_register_extension_class_property" => register_property as *const c_void,
            _ => nothing as *const c_void,
        },
        "classdb_register_extension_class_method" => register_method as *const c_void,
        _ if name
            .strip_prefix("classdb_register_extension_class")
            .is_some_and(|rest| rest.chars().all(|c| c.is_ascii_digit())) =>
        {
            register_class as *const c_void
        }
        "classdb_get_method_bind" => method_bind as *const c_void,
        "object_method_bind_ptrcall" => call as *const c_void,
        "variant_get_ptr_constructor" => constructor as *const c_void,
        "get_variant_from_type_constructor" => to_variant as *const c_void,
        _ if name.starts_with("variant_get_ptr_") || name.starts_with("get_variant_") => {
            no_function as *const c_void
        }
        _ => nothing as *const c_void,
    }
}

#[repr(C)]
struct Initialization {
    minimum_level: u32,
    data: *mut c_void,
    initialize: Option<unsafe extern "C" fn(*mut c_void, u32)>,
    deinitialize: Option<unsafe extern "C" fn(*mut c_void, u32)>,
}

type Entry = unsafe extern "C" fn(
    unsafe extern "C" fn(*const c_char) -> *const c_void,
    *const c_void,
    *mut Initialization,
) -> u8;

/// The library beside this test program.
fn library() -> PathBuf {
    let mut folder = std::env::current_exe().expect("a program");
    folder.pop();
    let name = format!(
        "{}foresound_godot{}",
        std::env::consts::DLL_PREFIX,
        std::env::consts::DLL_SUFFIX
    );
    let places = [folder.join(&name), folder.join("..").join(&name)];
    let found = places.into_iter().find(|place| place.exists());
    found.expect("the library is built with its tests")
}

/// A line `key = "value"` of the extension file.
fn setting(text: &str, key: &str) -> String {
    let line = text.lines().find(|line| line.starts_with(key));
    let value = line.and_then(|line| line.split('"').nth(1));
    value.expect("a setting").to_owned()
}

#[test]
fn the_library_starts_and_registers_its_classes() {
    let folder = env!("CARGO_MANIFEST_DIR");
    let path = format!("{folder}/addon/foresound.gdextension");
    let extension = std::fs::read_to_string(path).expect("the extension file");
    for platform in [
        "linux.release.x86_64",
        "android.release.arm64",
        "android.debug.arm64",
    ] {
        let file = setting(&extension, platform);
        assert!(file.starts_with("res://addons/foresound/"), "{file}");
        assert!(file.contains("foresound_godot"), "{file}");
    }
    // SAFETY: the library's start has no effects but its own statics'.
    let library = unsafe { libloading::Library::new(library()) }.expect("the library opens");
    let entry = setting(&extension, "entry_symbol");
    // SAFETY: the type is that of Godot's interface.
    let entry: libloading::Symbol<Entry> =
        unsafe { library.get(entry.as_bytes()) }.expect("the entry point");
    let mut start = Initialization {
        minimum_level: 0,
        data: ptr::null_mut(),
        initialize: None,
        deinitialize: None,
    };
    // SAFETY: as Godot calls it, once, from one thread.
    let is_good = unsafe { entry(address, ptr::from_ref(&NOTHING).cast(), &raw mut start) };
    assert_eq!(is_good, 1);
    let initialize = start.initialize.expect("a function");
    // Core, servers, scene.
    for level in 0..3 {
        // SAFETY: in Godot's order, with the library's own data.
        unsafe { initialize(start.data, level) };
    }
    let classes = CLASSES
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .clone();
    println!("{classes:#?}");
    for (name, parent, properties, methods) in [
        (
            "ForesoundEngine",
            "Node",
            &["source_slots", "max_sources", "bus", "max_drawn_paths"][..],
            &[
                "rebuild",
                "is_building",
                "update_ms",
                "update_count",
                "path_count",
                "drawn_paths",
                "set_paused",
            ][..],
        ),
        ("ForesoundListener3D", "Node3D", &[], &[]),
        (
            "ForesoundSource3D",
            "Node3D",
            &[
                "stream",
                "autoplay",
                "looped",
                "paused",
                "gain",
                "pitch",
                "without_position",
            ],
            &["play", "stop"],
        ),
        ("ForesoundGeometry", "Node3D", &["material"], &[]),
        ("ForesoundInstance", "Node3D", &["material"], &[]),
        (
            "ForesoundMaterial",
            "Resource",
            &["library_name", "absorption", "scattering", "transmission"],
            &[],
        ),
        ("ForesoundStream", "AudioStream", &[], &[]),
        ("ForesoundPlayback", "AudioStreamPlayback", &[], &[]),
    ] {
        let class = classes.get(name).unwrap_or_else(|| panic!("no {name}"));
        assert_eq!(class.parent, parent, "{name}");
        assert_eq!(class.properties, properties, "{name}");
        for method in methods {
            assert!(
                class.methods.iter().any(|own| own == method),
                "{name}.{method}"
            );
        }
    }
    assert_eq!(classes.len(), 8);
    // The library's statics live as long as the process.
    std::mem::forget(library);
}
