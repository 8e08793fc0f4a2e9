//! The table of the two READMEs: paper A beside the demo of seed 1, in English and Chinese.

use serde_json::Value;
use std::fmt::Write as _;

/// The words of one language.
pub(super) struct Words {
    pub(super) file: &'static str,
    head: &'static str,
    rows: [&'static str; 8],
    stated: &'static str,
    tiles: fn(&str, &str, &str) -> String,
}

pub(super) const LANGUAGES: [Words; 2] = [
    Words {
        file: "README.md",
        head: "| figure | paper A | abbe X, µm | abbe Y, µm |",
        rows: [
            "error before compensation at 90 mm",
            "error before compensation at 100 mm",
            "mean error per point and direction, 7 runs",
            "worst single error",
            "spread of 7 runs",
            "ISO 230-2 A (accuracy)",
            "ISO 230-2 R (repeatability)",
            "ISO 230-2 E, M, B",
        ],
        stated: "±5 µm stated",
        tiles: |tiles, rms, worst| {
            format!("The mosaic: {tiles} tiles, {rms} px rms from their true places, the worst {worst} px.")
        },
    },
    Words {
        file: "README.zh-CN.md",
        head: "| 指标 | 论文 A | abbe X，µm | abbe Y，µm |",
        rows: [
            "补偿前误差，90 mm 处",
            "补偿前误差，100 mm 处",
            "各点各方向平均误差，7 次",
            "最大单次误差",
            "7 次测量的极差",
            "ISO 230-2 A（定位精度）",
            "ISO 230-2 R（重复定位精度）",
            "ISO 230-2 E、M、B",
        ],
        stated: "±5 µm（标称）",
        tiles: |tiles, rms, worst| {
            format!("拼接：{tiles} 幅图像与真实位置之差 {rms} px（均方根），最大 {worst} px。")
        },
    },
];

/// The table and the sentence on the mosaic.
pub(super) fn section(words: &Words, summary: &Value) -> String {
    let papers = [
        "X 82 µm, Y 195 µm",
        "X 90 µm, Y 233 µm",
        "−3.6 … +3.8 µm",
        "4.4 µm",
        "≤ 3.00 µm",
        words.stated,
        "–",
        "–",
    ];
    let mut text = format!("{}\n|---|---:|---:|---:|\n", words.head);
    for ((name, paper), cell) in words.rows.iter().zip(papers).zip(CELLS) {
        let [x, y] = ["x", "y"].map(|axis| cell(&summary[axis]));
        // Writing to a String cannot fail.
        let _ = writeln!(text, "| {name} | {paper} | {x} | {y} |");
    }
    let of = |key: &str| &summary["mosaic"]["against_truth"][key];
    let (tiles, rms, worst) = (of("tiles"), plain(of("rms_px"), 3), plain(of("worst_px"), 3));
    let _ = writeln!(text, "\n{}", (words.tiles)(&tiles.to_string(), &rms, &worst));
    text
}

/// What stands in each row, from the part of the summary that belongs to an axis.
const CELLS: [fn(&Value) -> String; 8] = [
    |axis| signed(&axis["before"]["at_90_um"], 0),
    |axis| signed(&axis["before"]["at_100_um"], 0),
    |axis| {
        let (low, high) = (&axis["after"]["mean_min_um"], &axis["after"]["mean_max_um"]);
        format!("{} … {}", signed(low, 2), signed(high, 2))
    },
    |axis| signed(&axis["after"]["worst_single_um"], 2),
    |axis| plain(&axis["after"]["spread_um"], 2),
    |axis| plain(&axis["after"]["iso230"]["A"], 2),
    |axis| plain(&axis["after"]["iso230"]["R"], 2),
    |axis| ["E", "M", "B"].map(|figure| plain(&axis["after"]["iso230"][figure], 2)).join(", "),
];

fn plain(value: &Value, decimals: usize) -> String {
    value.as_f64().map_or_else(|| "–".into(), |number| format!("{number:.decimals$}"))
}

/// With its sign, and a true minus.
fn signed(value: &Value, decimals: usize) -> String {
    value.as_f64().map_or_else(|| "–".into(), |number| format!("{number:+.decimals$}").replace('-', "−"))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn both_tables_hold_the_same_figures() {
        let axis = json!({
            "before": { "at_90_um": 81.6, "at_100_um": 90.2 },
            "after": {
                "mean_min_um": -0.4, "mean_max_um": 0.3, "worst_single_um": -0.65, "spread_um": 0.5,
                "iso230": { "A": 1.3, "R": 1.1, "E": 0.7, "M": 0.6, "B": 0.5 },
            },
        });
        let summary = json!({
            "x": axis, "y": axis,
            "mosaic": { "against_truth": { "tiles": 36, "rms_px": 0.02, "worst_px": 0.04 } },
        });
        for words in &LANGUAGES {
            let text = section(words, &summary);
            assert!(text.contains("| −3.6 … +3.8 µm | −0.40 … +0.30 | −0.40 … +0.30 |"), "{text}");
            assert!(text.contains("| 0.70, 0.60, 0.50 |") && text.contains("0.020 px"), "{text}");
        }
    }
}
