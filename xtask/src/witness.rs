//! Who can panic: the lines of our own source behind each call of `core::panicking` left in the gate's image.
//!
//! Reads the compiler's text form of the image. A call there carries a place, `!dbg !7`; a place names its line, its
//! scope (which names the function and the file) and the place it was inlined at.

use std::collections::{BTreeSet, HashMap};

/// The nodes of the debug information by their name, `!7`.
type Nodes<'a> = HashMap<&'a str, &'a str>;

/// One sentence for each line of ours that can panic, `src/servo.rs:57 in tick`.
pub(crate) fn panicking_lines(image: &str) -> BTreeSet<String> {
    let nodes: Nodes<'_> =
        image.lines().filter(|line| line.starts_with('!')).filter_map(|l| l.split_once(" = ")).collect();
    let calls = image.lines().filter(|line| line.contains("call ") && line.contains("panicking"));
    calls.filter_map(|call| field(call, "!dbg ")).map(|place| own_line(place, &nodes)).collect()
}

/// The innermost place outside the standard library on the way from a call outwards.
fn own_line(place: &str, nodes: &Nodes<'_>) -> String {
    let mut next = Some(place);
    let mut found = "a place without debug information".to_owned();
    while let Some(node) = next.and_then(|name| nodes.get(name)) {
        let scope = field(node, "scope: ").and_then(|name| nodes.get(name)).copied().unwrap_or_default();
        let file = field(scope, "file: ").and_then(|name| nodes.get(name)).copied().unwrap_or_default();
        let file = field(file, "filename: ").unwrap_or("an unknown file");
        found = format!("{file}:{} in {}", field(node, "line: ").unwrap_or("?"), function(scope, nodes));
        if !file.contains("library/") {
            break;
        }
        next = field(node, "inlinedAt: ");
    }
    found
}

/// The name of the function around a scope: a block in it names only its parent.
fn function<'a>(scope: &'a str, nodes: &Nodes<'a>) -> &'a str {
    let mut scope = scope;
    for _ in 0..64 {
        if let Some(name) = field(scope, "name: ") {
            return name;
        }
        match field(scope, "scope: ").and_then(|name| nodes.get(name)) {
            Some(parent) => scope = parent,
            None => break,
        }
    }
    "an unnamed function"
}

/// The value after a key: up to the next comma or parenthesis, without quotes.
fn field<'a>(node: &'a str, key: &str) -> Option<&'a str> {
    let value = &node[node.find(key)? + key.len()..];
    if let Some(quoted) = value.strip_prefix('"') {
        return quoted.split('"').next();
    }
    value.split([',', ')', ' ']).next()
}

#[cfg(test)]
mod tests {
    use super::*;

    const IMAGE: &str = r#"
  tail call void @core_panicking_panic() #5, !dbg !10
  call void @harmless(), !dbg !11
!1 = !DIFile(filename: "src/servo.rs", directory: "/x")
!2 = !DIFile(filename: "library/core/src/cmp.rs", directory: "/y")
!3 = distinct !DISubprogram(name: "tick", scope: !9, file: !1, line: 40)
!4 = distinct !DISubprogram(name: "clamp", scope: !9, file: !2, line: 1000)
!5 = distinct !DILexicalBlock(scope: !3, file: !1, line: 50, column: 9)
!10 = !DILocation(line: 1024, column: 5, scope: !4, inlinedAt: !12)
!11 = !DILocation(line: 60, column: 5, scope: !3)
!12 = distinct !DILocation(line: 57, column: 18, scope: !5)
"#;

    #[test]
    fn a_panic_inside_the_library_is_told_by_the_line_that_called_it() {
        let lines: Vec<String> = panicking_lines(IMAGE).into_iter().collect();
        assert_eq!(lines, ["src/servo.rs:57 in tick"]);
    }

    #[test]
    fn a_call_without_a_place_is_still_reported() {
        let lines = panicking_lines("call void @panicking(), !dbg !99\n");
        assert_eq!(lines.len(), 1);
    }
}
