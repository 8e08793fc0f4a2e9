//! Presets that cannot be used: each names the file, the line and the key.

use crate::ended::{PRESET, done, line_of, refused};
use std::fs;

#[test]
fn an_unknown_preset_names_the_nearest() {
    let dir = tempfile::tempdir().unwrap();
    for command in [&["home", "--twin"][..], &["iso230", "readings.csv"]] {
        let arguments = [command, &["--preset", "microscop-10"]].concat();
        refused(dir.path(), &arguments, 2, &["microscop-10", "`microscope-100`"]);
    }
}

#[test]
fn a_damaged_preset_names_file_line_and_key() {
    let dir = tempfile::tempdir().unwrap();
    // What is replaced, by what, and what the sentence names.
    let cases = [
        ("speed_mm_s = 20.0", "sped_mm_s = 20.0", &["`sped_mm_s`", "`speed_mm_s`"][..]),
        ("tick_hz = 10000.0", "tik_hz = 10000.0", &["`tik_hz`", "`tick_hz`"]),
        ("width_px = 640", "widht_px = 640", &["`widht_px`", "`width_px`"]),
        ("backlash_um = 3.0", "backlsh_um = 3.0", &["`backlsh_um`", "`backlash_um`"]),
        ("bounce_ms = 2.0", "bonce_ms = 2.0", &["`bonce_ms`", "`bounce_ms`"]),
        ("speed_mm_s = 20.0", "speed_mm_s = \"fast\"", &["`speed_mm_s`", "fast", "expected a number"]),
        ("speed_mm_s = 20.0", "speed_mm_s = -20.0", &["speed_mm_s", "-20"]),
        ("speed_mm_s = 20.0", "speed_mm_s = nan", &["speed_mm_s", "NaN"]),
        ("mass_kg = 3.2", "mass_kg = 0.0", &["`mass_kg`", "0"]),
        ("noise_um = 0.005", "noise_um = inf", &["`noise_um`", "[plant.x.scale]"]),
        ("exposure_s = 0.005", "exposure_s = 1e9", &["exposure_s", "1000000000"]),
        ("pixel_um = 0.5", "pixel_um = 0.0", &["pixel_um", "0"]),
        ("decode = 4", "decode = 3", &["decode", "1, 2 or 4, not 3"]),
        ("decode = 4", "decode = 4.5", &["`decode`", "expected a whole number from 0 to 255"]),
        ("filter_ns = 300", "filter_ns = 2033", &["filter_ns", "0 … 2032 ns, not 2033"]),
        ("filter_ns = 300", "filter_ns = -1", &["`filter_ns`", "-1", "expected a whole number from 0 up"]),
        ("[controller.x]", "[controller.x", &[]),
    ];
    for (from, to, names) in cases {
        let text = PRESET.replacen(from, to, 1);
        fs::write(dir.path().join("mine.toml"), &text).unwrap();
        let place = format!("mine.toml, line {}: ", line_of(&text, to));
        let names = [&[place.as_str()], names].concat();
        refused(dir.path(), &["home", "--twin", "--preset", "mine.toml"], 1, &names);
    }
}

#[test]
fn a_front_end_that_does_not_fit_the_rest_of_the_stage_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let litho = include_str!("../../../../presets/litho-120.toml");
    let finer = PRESET.replacen("count_um = 0.1 ", "count_um = 0.05", 1);
    let cases = [
        // Two edges are 2083 ns apart at 24 mm/s.
        (&*finer, "filter_ns = 300", "filter_ns = 1900", &["filter_ns", "here at most 1032, not 1900"][..]),
        (litho, "decode = 4", "decode = 2", &["decode", "4: an encoder with a sine and a cosine", "not 2"]),
    ];
    for (preset, from, to, names) in cases {
        let text = preset.replacen(from, to, 1);
        fs::write(dir.path().join("mine.toml"), &text).unwrap();
        let place = format!("mine.toml, line {}: axis x: ", line_of(&text, to));
        let names = [&[place.as_str()], names].concat();
        refused(dir.path(), &["home", "--twin", "--preset", "mine.toml"], 1, &names);
    }
}

#[test]
fn a_missing_key_or_half_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let (controller, plant) = PRESET.split_once("# ---- The truth").unwrap();
    for (text, key) in [
        (PRESET.replacen("speed_mm_s = 20.0", "", 1), "`speed_mm_s`"),
        (PRESET.replacen("decode = 4", "", 1), "`decode`"),
        (PRESET.replacen("filter_ns = 300", "", 1), "`filter_ns`"),
        (PRESET.replacen("backlash_um = 3.0", "", 1), "`backlash_um`"),
        (controller.to_owned(), "`plant`"),
        (format!("#{plant}"), "`controller`"),
    ] {
        fs::write(dir.path().join("mine.toml"), text).unwrap();
        let names = ["mine.toml", "missing key", key];
        refused(dir.path(), &["home", "--twin", "--preset", "mine.toml"], 1, &names);
    }
}

#[test]
fn what_is_no_text_or_no_toml_is_named() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("picture.toml"), [0x89, b'P', b'N', b'G', 0xff]).unwrap();
    fs::write(dir.path().join("letter.toml"), "Dear reader,\n").unwrap();
    fs::create_dir(dir.path().join("folder.toml")).unwrap();
    for (file, says) in
        [("picture.toml", "UTF-8"), ("letter.toml", "line 1"), ("folder.toml", "cannot be read")]
    {
        refused(dir.path(), &["home", "--twin", "--preset", file], 1, &[file, says]);
    }
}

#[test]
fn a_copy_of_the_preset_is_the_same_stage() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("copy.toml"), PRESET).unwrap();
    let built_in = done(dir.path(), &["home", "--twin"]);
    assert_eq!(done(dir.path(), &["home", "--twin", "--preset", "copy.toml"]), built_in);
}
