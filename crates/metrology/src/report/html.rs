//! Pieces of HTML. Every value passes through [`escaped`]; only this module writes tags around values.

/// `text` with the five characters that mean something in HTML replaced.
pub(super) fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            c => safe.push(c),
        }
    }
    safe
}

/// A number with `decimals` places, a true minus sign, and no negative zero.
pub(super) fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| matches!(c, '0' | '.')) => digits.to_owned(),
        Some(digits) => format!("−{digits}"),
        None => text,
    }
}

/// The same with a plus sign before what is above zero.
pub(super) fn signed(value: f64, decimals: usize) -> String {
    let text = number(value, decimals);
    let plus = value > 0.0 && text.chars().any(|c| matches!(c, '1'..='9'));
    if plus { format!("+{text}") } else { text }
}

/// `text` escaped inside a tag; a line break in it stays one.
fn wrapped(tag: &str, text: &str) -> String {
    format!("<{tag}>{}</{tag}>", escaped(text).replace('\n', "<br>"))
}

/// Pieces of HTML one after the other.
pub(super) fn each(pieces: impl Iterator<Item = String>) -> String {
    pieces.collect::<Vec<_>>().concat()
}

/// A table under construction: plain text in, escaped HTML out.
pub(super) struct Table {
    html: String,
}

impl Table {
    /// `class` is a class of the style sheet, or empty.
    pub(super) fn new(class: &str, caption: &str, head: &[&str]) -> Self {
        let caption = if caption.is_empty() { String::new() } else { wrapped("caption", caption) };
        let cells = each(head.iter().map(|text| wrapped("th", text)));
        Self { html: format!("<table class=\"{class}\">{caption}<thead><tr>{cells}</tr></thead>\n<tbody>\n") }
    }

    /// Adds a row; `class` marks the row, or is empty.
    pub(super) fn row(&mut self, class: &str, cells: &[String]) {
        let cells = each(cells.iter().map(|text| wrapped("td", text)));
        self.html.extend(["<tr class=\"", class, "\">", &cells, "</tr>\n"]);
    }

    /// Adds a row whose last cell bears a class of its own.
    pub(super) fn row_with_verdict(&mut self, cells: &[String], class: &str, verdict: &str) {
        let cells = each(cells.iter().map(|text| wrapped("td", text)));
        let verdict = escaped(verdict);
        self.html.extend(["<tr>", &cells, "<td class=\"", class, "\">", &verdict, "</td></tr>\n"]);
    }

    pub(super) fn finish(self) -> String {
        self.html + "</tbody>\n</table>\n"
    }
}

/// A list of names and values; pairs without a value are left out.
pub(super) fn definitions(pairs: &[(String, String)]) -> String {
    let filled = pairs.iter().filter(|(_, value)| !value.is_empty());
    let items = each(filled.map(|(name, value)| wrapped("dt", name) + &wrapped("dd", value) + "\n"));
    format!("<dl>\n{items}</dl>\n")
}

/// A PNG inside the page. Nothing is fetched from anywhere.
pub(super) fn embedded_png(png: &[u8], caption: &str) -> String {
    let caption = escaped(caption);
    let data = base64(png);
    format!(
        "<figure><img alt=\"{caption}\" src=\"data:image/png;base64,{data}\"><figcaption>{caption}</figcaption></figure>\n"
    )
}

/// Base64 with padding, RFC 4648 §4.
fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let byte = |i: usize| u32::from(group.get(i).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            // A group of n bytes fills n + 1 characters.
            let letter = ALPHABET[(bits >> (18 - 6 * i) & 63) as usize];
            text.push(if i <= group.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The test vectors of RFC 4648 §10, and every letter once.
    #[test]
    fn base64_of_the_rfc() {
        let table = [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ];
        for (plain, expected) in table {
            assert_eq!(base64(plain.as_bytes()), expected);
        }
        assert_eq!(base64(&[0xfb, 0xff, 0xfe]), "+//+");
    }

    #[test]
    fn numbers_have_true_signs() {
        assert_eq!([number(-1.25, 1), number(-0.04, 1), number(2.0, 0)], ["−1.2", "0.0", "2"]);
        assert_eq!([signed(1.25, 2), signed(-1.25, 2), signed(0.001, 2)], ["+1.25", "−1.25", "0.00"]);
    }

    #[test]
    fn values_cannot_write_tags() {
        let mut table = Table::new("", "<b>", &["a&b"]);
        table.row("", &["\"'><script>".to_owned()]);
        let html = table.finish();
        assert!(html.contains("&lt;b&gt;") && html.contains("a&amp;b"));
        assert!(html.contains("<td>&quot;&#39;&gt;&lt;script&gt;</td>"));
    }
}
