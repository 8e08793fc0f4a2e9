//! Stitches a folder of tiles: `cargo run --release --example stitch -- DIR MOSAIC.tif`.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use abbe_mosaic::stitch::{StitchOptions, stitch};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [dir, mosaic] = arguments.as_slice() else {
        return Err("usage: stitch DIR MOSAIC.tif".into());
    };
    let start = Instant::now();
    let report = stitch(Path::new(dir), Path::new(mosaic), &StitchOptions::default(), &|_| ())?;
    println!("{}", serde_json::to_string_pretty(&report)?);
    eprintln!("{:.2} s", start.elapsed().as_secs_f64());
    Ok(())
}
