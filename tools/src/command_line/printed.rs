//! Results as text: lines on standard output, keys and values of JSON objects.

use std::fmt::Arguments;
use std::io::{ErrorKind, Write};

use serde_json::Value;

use crate::signals::remove_temporary_files;

/// Maximum columns of a line of text.
const COLUMNS: usize = 110;

/// Prints a line, for `outln!`.
pub(crate) fn line(text: Arguments<'_>) {
    let Err(error) = writeln!(std::io::stdout(), "{text}") else {
        return;
    };
    // Whoever closes a pipe has read what it needed.
    if error.kind() != ErrorKind::BrokenPipe {
        eprintln!("error: standard output: {error}; direct it to a place with room");
    }
    let _files = remove_temporary_files();
    std::process::exit(2);
}

/// Prints the keys and values of an object in paragraphs; nested keys are joined by dots.
pub(crate) fn row(row: &Value) {
    let mut pairs = Vec::new();
    flatten("", row, &mut pairs);
    let mut line = String::new();
    for pair in pairs {
        if line.len() + pair.len() > COLUMNS {
            outln!("{line}");
            line = "   ".to_owned();
        }
        let gap = if line.is_empty() { "" } else { "  " };
        line = format!("{line}{gap}{pair}");
    }
    outln!("{line}");
}

/// Prints one JSON object of rows, or each row as text.
pub(crate) fn rows(rows: &[Value], json: bool) {
    if json {
        outln!("{}", serde_json::json!({ "rows": rows }));
    } else {
        rows.iter().for_each(row);
    }
}

/// A number with four significant digits, or nine decimals.
pub(crate) fn four_digits(number: f64) -> String {
    let decimals = (3.0 - number.abs().max(1e-6).log10().floor()).clamp(0.0, 9.0);
    format!("{number:.*}", decimals as usize)
}

fn flatten(key: &str, value: &Value, pairs: &mut Vec<String>) {
    match value {
        Value::Object(object) => {
            for (name, value) in object {
                let dot = if key.is_empty() { "" } else { "." };
                flatten(&format!("{key}{dot}{name}"), value, pairs);
            }
        }
        Value::Number(number) if number.is_f64() => {
            let number = number.as_f64().unwrap_or_default();
            pairs.push(format!("{key} {}", four_digits(number)));
        }
        Value::String(text) => pairs.push(format!("{key} {text}")),
        other => pairs.push(format!("{key} {other}")),
    }
}

#[cfg(test)]
mod tests {
    use super::four_digits;

    #[test]
    fn numbers_have_four_digits_and_no_exponent() {
        let shown = [100.0, 0.0, 12_345.6, 0.012_345_6, -2.5, 1e-12].map(four_digits);
        assert_eq!(
            shown,
            [
                "100.0",
                "0.000000000",
                "12346",
                "0.01235",
                "-2.500",
                "0.000000000"
            ]
        );
    }
}
