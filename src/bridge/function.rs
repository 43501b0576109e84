//! Functions as the C header and `Native.java` describe them.

/// A parameter or result.
pub struct Parameter {
    /// Its name.
    pub name: &'static str,
    /// The name of the array's length in C.
    pub count: Option<&'static str>,
    /// The type in C, as Rust source.
    pub c: String,
    /// The type in Java and in a signature.
    pub java: [&'static str; 2],
}

/// A function of the tables.
pub struct Function {
    /// Lines of documentation.
    pub docs: &'static [&'static str],
    /// The name in C.
    pub name: &'static str,
    /// Parameters without the result.
    pub parameters: Vec<Parameter>,
    /// The result beside the status.
    pub result: Option<Parameter>,
}

impl Function {
    /// The name of the native: the C name in camel case without its prefix.
    pub fn java_name(&self) -> String {
        camel_case(self.name.trim_start_matches("foresound_"))
    }

    /// The signature of the native.
    pub fn java_signature(&self) -> String {
        let parameters: String = self.parameters.iter().map(|p| p.java[1]).collect();
        let result = self.result.as_ref().map_or("V", |result| result.java[1]);
        format!("({parameters}){result}")
    }
}

/// A Rust name in Java's case.
pub fn camel_case(name: &str) -> String {
    let parts = name.split('_').enumerate();
    let capital = |(i, part): (usize, &str)| match part.split_at_checked(1) {
        Some((first, rest)) if i > 0 => first.to_uppercase() + rest,
        _ => part.to_owned(),
    };
    parts.map(capital).collect()
}
