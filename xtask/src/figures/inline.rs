//! Single figures inside a sentence: `<!-- =/x/after/spread_um 2 -->0.46<!-- / -->` holds the number that stands at
//! that place of the summary, with two decimals; `+2` writes its sign, too.

use anyhow::{Context, Result};
use serde_json::Value;

const OPENING: &str = "<!-- =";
const MIDDLE: &str = " -->";
const CLOSING: &str = "<!-- / -->";

/// The page with every figure filled in from `summary`.
pub(super) fn filled(page: &str, summary: &Value) -> Result<String> {
    let mut parts = page.split(OPENING);
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (what, rest) =
            part.split_once(MIDDLE).with_context(|| format!("`{OPENING}` without `{MIDDLE}`"))?;
        let (_, rest) = rest.split_once(CLOSING).with_context(|| format!("{what}: no `{CLOSING}`"))?;
        for piece in [OPENING, what, MIDDLE, &figure(what, summary)?, CLOSING, rest] {
            text.push_str(piece);
        }
    }
    Ok(text)
}

fn figure(what: &str, summary: &Value) -> Result<String> {
    let (pointer, format) = what.split_once(' ').with_context(|| format!("{what}: pointer and decimals"))?;
    let number = summary.pointer(pointer).and_then(Value::as_f64);
    let number = number.with_context(|| format!("{pointer}: no such number in the summary"))?;
    let decimals: usize = format.trim_start_matches('+').parse().with_context(|| what.to_owned())?;
    let signed = format.starts_with('+');
    let text = if signed { format!("{number:+.decimals$}") } else { format!("{number:.decimals$}") };
    Ok(text.replace('-', "−"))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_figure_is_replaced_and_the_words_around_it_stay() {
        let page = "worst <!-- =/x/worst +2 -->old<!-- / --> µm of <!-- =/tiles 0 --><!-- / --> tiles";
        let summary = json!({ "x": { "worst": -0.926 }, "tiles": 36 });
        let filled_once = filled(page, &summary).unwrap();
        assert_eq!(
            filled_once,
            "worst <!-- =/x/worst +2 -->−0.93<!-- / --> µm of <!-- =/tiles 0 -->36<!-- / --> tiles"
        );
        assert_eq!(filled(&filled_once, &summary).unwrap(), filled_once);
    }

    #[test]
    fn a_figure_that_is_not_there_is_named() {
        let error = filled("<!-- =/x/nothing 2 --><!-- / -->", &json!({})).unwrap_err();
        assert!(error.to_string().contains("/x/nothing"), "{error}");
        assert!(filled("<!-- =/x 2 -->", &json!({ "x": 1 })).is_err());
    }
}
