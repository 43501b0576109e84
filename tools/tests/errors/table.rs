//! The table of `ERRORS.md`, and the row of a line.

/// A row: problem and advice, with `…` for the variable parts.
#[derive(PartialEq)]
pub(crate) struct Row {
    pub(crate) problem: String,
    pub(crate) advice: String,
}

impl Row {
    /// Both, as in an error.
    pub(crate) fn pattern(&self) -> String {
        format!("{}; {}", self.problem, self.advice)
    }
}

pub(crate) fn table() -> Vec<Row> {
    let text = include_str!("../../../ERRORS.md");
    let cells = |line: &str| -> Option<Row> {
        let inner = line.strip_prefix("| ")?.strip_suffix(" |")?;
        let [problem, _because, advice] =
            inner.split(" | ").collect::<Vec<_>>()[..].try_into().ok()?;
        (problem != "It says").then(|| Row {
            problem: problem.to_owned(),
            advice: advice.to_owned(),
        })
    };
    let rows: Vec<Row> = text.lines().filter_map(cells).collect();
    assert!(rows.len() > 100, "{} rows", rows.len());
    rows
}

/// Whether a text matches a pattern, in which each `…` is any text.
pub(crate) fn fits(pattern: &str, text: &str) -> bool {
    let parts: Vec<&str> = pattern.split('…').collect();
    let (Some(first), Some(last)) = (parts.first(), parts.last()) else {
        return false;
    };
    let Some(mut rest) = text.strip_prefix(first) else {
        return false;
    };
    if parts.len() == 1 {
        return rest.is_empty();
    }
    for part in &parts[1..parts.len() - 1] {
        let Some(at) = rest.find(part) else {
            return false;
        };
        rest = &rest[at + part.len()..];
    }
    rest.ends_with(last)
}

/// The row of a line of the form `thing: problem; advice`: among matching rows the one with the most letters of its own.
pub(crate) fn row_of<'a>(rows: &'a [Row], line: &str) -> Option<&'a Row> {
    // Before the problem come the file and line, the setting or the handle.
    let texts: Vec<&str> = line
        .match_indices(": ")
        .map(|(at, colon)| &line[at + colon.len()..])
        .chain([line])
        .collect();
    let letters = |row: &&Row| row.pattern().chars().filter(|c| *c != '…').count();
    rows.iter()
        .filter(|row| texts.iter().any(|text| fits(&row.pattern(), text)))
        .max_by_key(letters)
}

#[test]
fn patterns_match_their_own_lines_only() {
    assert!(fits("a … of …", "a piece of cake"));
    assert!(fits("…", "anything"));
    assert!(!fits("a … of …", "the piece of cake"));
    assert!(!fits("no rows", "no rows at all"));
}
