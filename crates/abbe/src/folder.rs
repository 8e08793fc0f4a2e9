//! Folders for results: never into somebody's files by accident.

use crate::failure::Failure;
use std::fs;
use std::path::{Path, PathBuf};

/// Makes `dir` ready to write into: new, empty, or anything with `force`.
pub(crate) fn prepare(dir: &Path, force: bool) -> Result<(), Failure> {
    let shown = dir.display();
    if dir.exists() && !dir.is_dir() {
        return Err(Failure::usage(format!("--out {shown}: this is a file, not a folder")));
    }
    let occupied = fs::read_dir(dir).is_ok_and(|mut entries| entries.next().is_some());
    if occupied && !force {
        return Err(Failure::usage(format!(
            "--out {shown}: the folder is not empty; name a new one or add --force"
        )));
    }
    fs::create_dir_all(dir).map_err(|error| cannot_write(dir, &error))?;
    try_writing(dir)
}

/// A folder that cannot be written is found before the work, not after it.
fn try_writing(dir: &Path) -> Result<(), Failure> {
    let probe = dir.join(format!(".abbe-probe-{}", std::process::id()));
    fs::write(&probe, b"").and_then(|()| fs::remove_file(&probe)).map_err(|error| cannot_write(dir, &error))
}

fn cannot_write(dir: &Path, error: &std::io::Error) -> Failure {
    Failure::Work(anyhow::anyhow!("--out {}: the folder cannot be written: {error}", dir.display()))
}

/// Makes a new folder `abbe-demo-N` here, with the lowest N that is free.
pub(crate) fn next_demo() -> Result<PathBuf, Failure> {
    for number in 1..100_000 {
        let dir = PathBuf::from(format!("abbe-demo-{number}"));
        match fs::create_dir(&dir) {
            Ok(()) => return Ok(dir),
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(cannot_write(&dir, &error)),
        }
    }
    Err(Failure::Work(anyhow::anyhow!("there are 99999 folders abbe-demo-N here; use --out")))
}

/// Refuses to replace a file without `force`.
pub(crate) fn keep_file(file: &Path, force: bool) -> Result<(), Failure> {
    if file.exists() && !force {
        return Err(Failure::usage(format!(
            "--out {}: the file exists; add --force to replace it",
            file.display()
        )));
    }
    Ok(())
}

/// Writes a file beside its place and renames it: it appears whole or not at all.
pub(crate) fn write_whole(file: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let beside = file.with_file_name(format!(
        ".{}.{}.part",
        file.file_name().map_or_else(|| "file".into(), |name| name.to_string_lossy()),
        std::process::id()
    ));
    fs::write(&beside, bytes).and_then(|()| fs::rename(&beside, file)).map_err(|error| {
        _ = fs::remove_file(&beside);
        Failure::Work(anyhow::anyhow!("{}: the file cannot be written: {error}", file.display()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_with_something_in_it_is_refused_without_force() {
        let dir = tempfile::tempdir().unwrap();
        prepare(dir.path(), false).unwrap();
        fs::write(dir.path().join("mine"), b"1").unwrap();
        assert_eq!(prepare(dir.path(), false).unwrap_err().status(), 2);
        prepare(dir.path(), true).unwrap();
        assert_eq!(fs::read(dir.path().join("mine")).unwrap(), b"1");
    }

    #[test]
    fn nothing_is_left_beside_a_file_that_cannot_be_written() {
        let dir = tempfile::tempdir().unwrap();
        let blocked = dir.path().join("blocked");
        fs::create_dir(&blocked).unwrap();
        fs::write(blocked.join("x"), b"").unwrap();
        assert!(write_whole(&blocked, b"text").is_err());
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }
}
