//! `Native.cs` of the Unity package, from the text of the C header: enumerations, structures, functions.
//!
//! Names are those of C in C#'s case without `Foresound` or `foresound_`. A declaration of a form that is not expected here
//! panics.

use std::fmt::Write as _;

use foresound::bridge::interface::camel_case;

const PREAMBLE: &str = "\
// Written from include/foresound.h by `FORESOUND_WRITE_HEADER=1 cargo test --test c_header`; do not edit.

using System;
using System.Runtime.InteropServices;

namespace Foresound.Interop
{
";

const CLASS: &str = "
    /// <summary>
    /// The C interface, function by function: foresound_engine_tick is <see cref=\"EngineTick\"/>, and so on. Comments are those
    /// of foresound.h, which has the rules for handles, threads, units and pointers. Calls neither allocate nor throw, except
    /// for a DllNotFoundException where the library is missing.
    /// </summary>
    public static unsafe class Native
    {
        const string Library = \"foresound\";
";

/// A declared variable: a parameter or a field.
struct Variable {
    ctype: String,
    name: String,
    /// Elements, 1 for a variable that is no array.
    elements: usize,
}

/// A type, and the bytes and the alignment of a field of it. Pointers are parameters only.
struct Layout {
    csharp: String,
    bytes: usize,
    alignment: usize,
}

/// A name in C#'s case.
fn pascal_case(name: &str) -> String {
    let name = camel_case(&name.to_lowercase());
    let (first, rest) = name.split_at(1);
    first.to_uppercase() + rest
}

/// A name that is no keyword.
fn local_name(name: &str) -> String {
    match camel_case(name).as_str() {
        word @ ("ref" | "out" | "in" | "params" | "object" | "string") => format!("@{word}"),
        word => word.to_owned(),
    }
}

/// The text of a parenthesis or a line, as a variable: `const uint64_t *name`, `float name[6][3]`.
fn variable(text: &str) -> Variable {
    let (text, counts) = text.split_at(text.find('[').unwrap_or(text.len()));
    let counts = counts.split(['[', ']']).filter(|count| !count.is_empty());
    let text = text.replace("const ", "").replace("struct ", "");
    let name = text
        .rsplit([' ', '*'])
        .next()
        .unwrap_or_default()
        .to_owned();
    let ctype = text[..text.len() - name.len()].replace("const", "");
    Variable {
        ctype: ctype.split_whitespace().collect(),
        name,
        elements: counts
            .map(|n| n.parse::<usize>().expect("a length"))
            .product(),
    }
}

/// What the header declares.
#[derive(Default)]
struct Writer {
    types: String,
    functions: String,
    /// Enumerations, structures and function pointers: C# name, bytes, alignment.
    known: Vec<(String, usize, usize)>,
}

fn summary(docs: &[String], indent: &str) -> String {
    let escape = |line: &String| {
        let line = line
            .replace('&', "&amp;")
            .replace('<', "&lt;")
            .replace('>', "&gt;");
        format!("{indent}/// {line}").trim_end().to_owned()
    };
    match docs {
        [line] if line.len() < 80 => {
            let line = escape(line);
            let text = line.trim_start().trim_start_matches("/// ");
            format!("{indent}/// <summary>{text}</summary>\n")
        }
        lines => {
            let lines: Vec<String> = lines.iter().map(escape).collect();
            let lines = lines.join("\n");
            format!("{indent}/// <summary>\n{lines}\n{indent}/// </summary>\n")
        }
    }
}

impl Writer {
    fn layout(&self, ctype: &str) -> Layout {
        let (base, stars) = ctype.split_at(ctype.find('*').unwrap_or(ctype.len()));
        let (csharp, bytes, alignment) = match base {
            "void" => ("void", 0, 1),
            "char" | "uint8_t" => ("byte", 1, 1),
            "int32_t" => ("int", 4, 4),
            "uint32_t" => ("uint", 4, 4),
            "uint64_t" => ("ulong", 8, 8),
            "size_t" => ("UIntPtr", 8, 8),
            "float" => ("float", 4, 4),
            "double" => ("double", 8, 8),
            _ => {
                let name = base.strip_prefix("Foresound").expect("a type of ours");
                let found = self.known.iter().find(|(known, ..)| known == name);
                let (name, bytes, alignment) = found.expect("a type declared before");
                (name.as_str(), *bytes, *alignment)
            }
        };
        let csharp = format!("{csharp}{stars}");
        Layout {
            csharp,
            bytes,
            alignment,
        }
    }

    fn enumeration(&mut self, name: &str, width: &str, docs: &[String], body: &[Documented]) {
        let base = self.layout(width);
        let docs = summary(docs, "    ");
        let _ = write!(
            self.types,
            "{docs}    public enum {name} : {}\n    {{\n",
            base.csharp
        );
        let prefix = format!("FORESOUND_{}_", constant_case(name));
        for (docs, line) in body {
            let (member, value) = line
                .trim_end_matches(',')
                .split_once(" = ")
                .expect("a value");
            let member = member
                .strip_prefix(&prefix)
                .expect("the enumeration's prefix");
            let (docs, member) = (summary(docs, "        "), pascal_case(member));
            let _ = writeln!(self.types, "{docs}        {member} = {value},");
        }
        self.types += "    }\n\n";
        self.known
            .push((name.to_owned(), base.bytes, base.alignment));
    }

    fn structure(&mut self, name: &str, docs: &[String], body: &[Documented]) {
        let (mut fields, mut offset, mut alignment) = (String::new(), 0usize, 1);
        for (docs, line) in body {
            let field = variable(line.trim_end_matches(';'));
            let layout = self.layout(&field.ctype);
            offset = offset.next_multiple_of(layout.alignment) + field.elements * layout.bytes;
            alignment = alignment.max(layout.alignment);
            let (docs, csharp) = (summary(docs, "        "), layout.csharp);
            let name = pascal_case(&field.name);
            let _ = match field.elements {
                1 => writeln!(fields, "{docs}        public {csharp} {name};"),
                n => writeln!(fields, "{docs}        public fixed {csharp} {name}[{n}];"),
            };
        }
        let bytes = offset.next_multiple_of(alignment);
        let docs = summary(docs, "    ");
        let _ = write!(
            self.types,
            "{docs}    [StructLayout(LayoutKind.Sequential)]\n    public unsafe struct {name}\n    {{\n        \
             /// <summary>Bytes in C.</summary>\n        public const uint Bytes = {bytes};\n\n{fields}    }}\n\n"
        );
        self.known.push((name.to_owned(), bytes, alignment));
    }

    fn parameters(&self, list: &str) -> String {
        if list == "void" {
            return String::new();
        }
        let one = |text: &str| {
            let Variable {
                ctype,
                name,
                elements,
            } = variable(text.trim());
            assert_eq!(elements, 1, "{text} is an array");
            format!("{} {}", self.layout(&ctype).csharp, local_name(&name))
        };
        list.split(',').map(one).collect::<Vec<_>>().join(", ")
    }

    /// A declaration of one statement: a function or a pointer to one.
    fn statement(&mut self, docs: &[String], statement: &str) {
        let statement = statement
            .trim_end_matches(';')
            .trim_start_matches("FORESOUND_API ");
        let (head, list) = statement.split_once('(').expect("a function");
        if let Some(returned) = head.strip_prefix("typedef ") {
            let (name, list) = list.split_once(")(").expect("a pointer to a function");
            let name = name.strip_prefix("*Foresound").expect("a name of ours");
            let parameters = self.parameters(list.trim_end_matches(')'));
            let (docs, returned) = (summary(docs, "    "), self.layout(returned.trim()).csharp);
            let _ = write!(
                self.types,
                "{docs}    [UnmanagedFunctionPointer(CallingConvention.Cdecl)]\n    \
                 public unsafe delegate {returned} {name}({parameters});\n\n"
            );
            self.known.push((name.to_owned(), 8, 8));
            return;
        }
        let function = variable(head);
        let (docs, returned) = (
            summary(docs, "        "),
            self.layout(&function.ctype).csharp,
        );
        let method = pascal_case(function.name.trim_start_matches("foresound_"));
        let parameters = self.parameters(list.trim_end_matches(')'));
        let line = format!("        public static extern {returned} {method}({parameters});");
        let line = match line.len() {
            0..=120 => line,
            _ => line.replacen('(', "(\n            ", 1),
        };
        let _ = write!(
            self.functions,
            "\n{docs}        [DllImport(Library, EntryPoint = \"{}\", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]\n{line}\n",
            function.name
        );
    }
}

/// Lines of documentation, and what they are of.
type Documented = (Vec<String>, String);

/// `EngineState` as `ENGINE_STATE`.
fn constant_case(name: &str) -> String {
    let mut text = String::new();
    for letter in name.chars() {
        if letter.is_uppercase() && !text.is_empty() {
            text.push('_');
        }
        text.push(letter.to_ascii_uppercase());
    }
    text
}

/// Whether a line is for C's compilers only.
fn is_plumbing(line: &str) -> bool {
    let is_alias = line.starts_with("typedef") && line.ends_with(';') && !line.contains('(');
    line.is_empty() || line.starts_with(['#', '}']) || line.starts_with("extern \"C\"") || is_alias
}

/// The documented members up to the closing brace.
fn members<'a>(lines: &mut impl Iterator<Item = &'a str>) -> Vec<Documented> {
    let (mut members, mut docs) = (Vec::new(), Vec::new());
    for line in lines.take_while(|line| !line.starts_with('}')) {
        match line.trim().strip_prefix("//") {
            Some(text) => docs.push(text.trim().to_owned()),
            None => members.push((std::mem::take(&mut docs), line.trim().to_owned())),
        }
    }
    members
}

/// `Native.cs` for a header.
pub(crate) fn native_cs(header: &str, version: u32) -> String {
    let mut writer = Writer::default();
    let (_, code) = header
        .split_once("#include <stdint.h>")
        .expect("its includes");
    let mut lines = code.lines();
    let mut docs = Vec::new();
    while let Some(line) = lines.next() {
        if line.starts_with("/*") {
            // The header's own remarks.
            if !line.ends_with("*/") {
                lines.by_ref().find(|line| line.ends_with("*/"));
            }
        } else if let Some(text) = line.strip_prefix("//") {
            docs.push(text.trim().to_owned());
            continue;
        } else if line.starts_with("#define") && line.ends_with('\\') {
            lines.by_ref().find(|line| !line.ends_with('\\'));
        } else if let Some(name) = line.strip_prefix("enum Foresound") {
            let width = lines
                .by_ref()
                .find_map(|line| line.trim().strip_prefix(": "));
            let width = width.expect("a width");
            lines.by_ref().find(|line| line.ends_with('{'));
            writer.enumeration(name, width, &docs, &members(&mut lines));
        } else if let Some(rest) = line.strip_prefix("typedef struct Foresound") {
            let name = rest.trim_end_matches(" {");
            writer.structure(name, &docs, &members(&mut lines));
        } else if !is_plumbing(line) {
            let mut statement = line.to_owned();
            while !statement.ends_with(';') {
                statement += " ";
                statement += lines.next().expect("an end").trim();
            }
            writer.statement(&docs, &statement);
        }
        docs.clear();
    }
    let Writer {
        types, functions, ..
    } = writer;
    let version = format!(
        "\n        /// <summary>The version of this file.</summary>\n        public const uint ApiVersion = {version:#010x};\n"
    );
    format!(
        "{PREAMBLE}{}{CLASS}{version}{functions}    }}\n}}\n",
        types.trim_end().to_owned() + "\n"
    )
}
