//! The document says what the code says.

use super::*;

const DOCUMENT: &str = include_str!("../../../../../docs/gcode.md");

/// The table as Markdown.
fn table() -> String {
    let row = |row: &Row| {
        let (name, group) = (row.name, row.group.name());
        format!("| `{name}` | {group} | {} | {} |\n", row.takes, row.does)
    };
    let rows: String = TABLE.iter().map(row).collect();
    format!("| word | group | takes | does |\n|---|---|---|---|\n{rows}")
}

#[test]
fn the_document_has_the_words_of_the_table() {
    assert!(DOCUMENT.contains(&table()), "docs/gcode.md must hold this table:\n\n{}", table());
    let line = format!("at most {LONGEST} characters");
    assert!(DOCUMENT.contains(&line), "docs/gcode.md must say: {line}");
}

#[test]
fn the_program_in_the_document_is_good() {
    let program = DOCUMENT.split("```").nth(1).and_then(|block| block.split_once('\n')).unwrap().1;
    let state = after(&program.lines().collect::<Vec<_>>());
    assert_eq!(place(state.position()), "(10, 20.1)");
}

#[test]
fn the_error_in_the_document_is_said() {
    let error = read(&mut after(&["G1 F9"]), b"G2 X20 Y0 I4").unwrap_err();
    assert!(DOCUMENT.contains(&error.to_string()), "docs/gcode.md must say: {error}");
}
