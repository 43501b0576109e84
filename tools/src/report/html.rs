//! Parts of the page: tables, and text with HTML's own characters replaced.

/// Text of a missing figure.
pub(super) const NONE: &str = "–";

/// A table in a frame that scrolls. The caption may be empty.
pub(super) fn table(class: &str, caption: &str, head: &[&str], body: &str) -> String {
    let head: String = head
        .iter()
        .map(|name| format!("<th scope=\"col\">{name}</th>"))
        .collect();
    let caption = match caption {
        "" => String::new(),
        text => format!("<caption>{text}</caption>"),
    };
    format!(
        "<div class=\"scroll\" tabindex=\"0\"><table class=\"{class}\">{caption}<thead><tr>{head}</tr></thead>\
         <tbody>{body}</tbody></table></div>"
    )
}

/// A table's row of a class.
pub(super) fn row<S: AsRef<str>>(class: &str, cells: &[S]) -> String {
    let cells: String = cells
        .iter()
        .map(|cell| format!("<td>{}</td>", cell.as_ref()))
        .collect();
    format!("<tr class=\"{class}\">{cells}</tr>")
}

/// A figure, shaded if it meets its target.
pub(super) fn figure((text, met): (String, bool)) -> String {
    match met {
        true => format!("<span class=\"met\">{text}</span>"),
        false => text,
    }
}

/// Text with HTML's own characters replaced.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
