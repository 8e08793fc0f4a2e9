//! Ctrl-C: the work ends at the next safe place, files are whole or not there.
//!
//! The first one only raises a flag that the work looks at. A second one ends the program at once; files that are then
//! still half written are removed first.

use crate::failure::Failure;
use std::collections::BTreeSet;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

static ASKED: AtomicBool = AtomicBool::new(false);

/// Folders that results go to, each with the half-written files that somebody else left there before.
static FOLDERS: Mutex<Vec<(PathBuf, BTreeSet<PathBuf>)>> = Mutex::new(Vec::new());

/// The user asked to stop.
#[derive(Debug, thiserror::Error)]
#[error("stopped by Ctrl-C; every file written so far is whole")]
pub(crate) struct Interrupted;

/// Watches for Ctrl-C and termination. A second one ends the program at once.
pub(crate) fn watch(json: bool) -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(move || {
        if !ASKED.swap(true, Ordering::Relaxed) {
            crate::progress::note("stopping … (once more: at once)");
            return;
        }
        remove_half_written();
        let failure = Failure::from(Interrupted);
        failure.print(json);
        std::process::exit(failure.status().into());
    })
}

/// Whether the user asked to stop.
pub(crate) fn check() -> Result<(), Interrupted> {
    if ASKED.load(Ordering::Relaxed) { Err(Interrupted) } else { Ok(()) }
}

/// Runs work that calls [`leave_if_asked`] now and then.
///
/// For work that reports progress but takes no answer. Leaving unwinds its stack: all it holds is dropped, so its
/// half-written files go.
pub(crate) fn leaving<T>(work: impl FnOnce() -> T) -> Result<T, Interrupted> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|payload| match payload.downcast::<Interrupted>() {
        Ok(interrupted) => *interrupted,
        Err(panic) => resume_unwind(panic),
    })
}

/// Leaves the work inside [`leaving`] if the user asked to stop.
pub(crate) fn leave_if_asked() {
    if let Err(interrupted) = check() {
        resume_unwind(Box::new(interrupted));
    }
}

/// Tells of a folder that results go to, before the first of them.
pub(crate) fn results_go_to(dir: &Path) {
    if let Ok(mut folders) = FOLDERS.lock() {
        folders.push((dir.to_path_buf(), half_written(dir)));
    }
}

fn remove_half_written() {
    // The thread that holds the lock is not writing a file.
    let Ok(folders) = FOLDERS.lock() else { return };
    for (dir, before) in folders.iter() {
        for file in half_written(dir).difference(before) {
            _ = fs::remove_file(file);
        }
    }
}

/// Files under a temporary name, in a folder and in the folders right below it.
fn half_written(dir: &Path) -> BTreeSet<PathBuf> {
    let below = entries(dir).filter(|path| path.is_dir()).collect::<Vec<_>>();
    below
        .iter()
        .flat_map(|dir| entries(dir))
        .chain(entries(dir))
        .filter(|path| is_half_written(path))
        .collect()
}

fn entries(dir: &Path) -> impl Iterator<Item = PathBuf> {
    fs::read_dir(dir).into_iter().flatten().flatten().map(|entry| entry.path())
}

fn is_half_written(path: &Path) -> bool {
    let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
    hidden && path.extension().is_some_and(|ending| ending == "part" || ending == "partial")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_half_written_files_that_are_new_are_removed() {
        let dir = tempfile::tempdir().unwrap();
        let file = |name: &str| dir.path().join(name);
        fs::create_dir(file("tiles")).unwrap();
        fs::write(file(".theirs.partial"), b"1").unwrap();
        results_go_to(dir.path());
        for name in [".a.csv.12.part", "tiles/.t.tif.partial", "whole.tif", "tiles/whole.part"] {
            fs::write(file(name), b"1").unwrap();
        }
        remove_half_written();
        for (name, stays) in [
            (".theirs.partial", true),
            ("whole.tif", true),
            ("tiles/whole.part", true),
            (".a.csv.12.part", false),
            ("tiles/.t.tif.partial", false),
        ] {
            assert_eq!(file(name).exists(), stays, "{name}");
        }
    }
}
