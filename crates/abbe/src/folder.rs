//! Places for results: never into somebody's files by accident, and nothing left behind by work that failed.

use crate::failure::Failure;
use crate::interrupt;
use std::fs;
use std::io::{self, BufWriter, Write as _};
use std::path::{Path, PathBuf};

/// A folder that is ready to be written into.
///
/// Dropping it removes the folders that were made for it and have stayed empty.
#[derive(Debug)]
pub(crate) struct Ready {
    /// The folder.
    pub(crate) dir: PathBuf,
    /// The topmost folder that was not there before.
    made: Option<PathBuf>,
}

impl Drop for Ready {
    fn drop(&mut self) {
        if let Some(top) = &self.made {
            remove_empty(top);
        }
    }
}

/// Removes a folder and those below it as far as they are empty.
fn remove_empty(dir: &Path) {
    for entry in fs::read_dir(dir).into_iter().flatten().flatten() {
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            remove_empty(&entry.path());
        }
    }
    // The system refuses to remove a folder with something in it.
    _ = fs::remove_dir(dir);
}

/// Makes the folder `dir` that `option` names ready to write into: new, empty, or anything with `force`.
pub(crate) fn prepare(option: &str, dir: &Path, force: bool) -> Result<Ready, Failure> {
    let shown = dir.display();
    if dir.exists() && !dir.is_dir() {
        return Err(Failure::usage(format!("{option} {shown}: this is a file, not a folder; name another")));
    }
    let occupied = fs::read_dir(dir).is_ok_and(|mut entries| entries.next().is_some());
    if occupied && !force {
        return Err(Failure::usage(format!(
            "{option} {shown}: the folder is not empty; name a new one or add --force"
        )));
    }
    make(dir)
        .map_err(|error| Failure::work(format!("{option} {shown}: the folder cannot be written: {error}")))
}

/// Makes the place of a file that `option` names ready: it must be new without `force`, its folder is made if need be.
pub(crate) fn prepare_file(option: &str, file: &Path, force: bool) -> Result<Ready, Failure> {
    keep_file(option, file, force)?;
    let dir = match file.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    make(dir).map_err(|error| {
        Failure::work(format!(
            "{option} {}: the folder {} cannot be written: {error}",
            file.display(),
            dir.display()
        ))
    })
}

/// Refuses a file that exists without `force`, and a folder always.
pub(crate) fn keep_file(option: &str, file: &Path, force: bool) -> Result<(), Failure> {
    let shown = file.display();
    if file.is_dir() || file.file_name().is_none() {
        return Err(Failure::usage(format!("{option} {shown}: this is a folder, not a file; name a file")));
    }
    if file.exists() && !force {
        return Err(Failure::usage(format!(
            "{shown}: the file exists; choose another {option} or add --force to replace it"
        )));
    }
    Ok(())
}

/// Makes a folder with those above it. One that cannot be written is found before the work, not after it.
fn make(dir: &Path) -> io::Result<Ready> {
    let made = dir.ancestors().take_while(|above| !above.as_os_str().is_empty() && !above.exists()).last();
    if dir.exists() && !dir.is_dir() {
        return Err(io::Error::other("it is a file"));
    }
    let ready = Ready { dir: dir.to_path_buf(), made: made.map(Path::to_path_buf) };
    fs::create_dir_all(dir)?;
    interrupt::results_go_to(dir);
    let probe = dir.join(format!(".abbe.{}.part", std::process::id()));
    fs::write(&probe, b"").and_then(|()| fs::remove_file(&probe))?;
    Ok(ready)
}

/// Makes a new folder `abbe-demo-N` here, with the lowest N that is free.
pub(crate) fn next_demo() -> Result<Ready, Failure> {
    let made = next_free(|number| {
        let dir = PathBuf::from(format!("abbe-demo-{number}"));
        fs::create_dir(&dir).map(|()| dir)
    });
    let dir = made.map_err(|error| {
        Failure::work(format!("a folder abbe-demo-N cannot be made here: {error}; use --out DIR"))
    })?;
    interrupt::results_go_to(&dir);
    Ok(Ready { made: Some(dir.clone()), dir })
}

/// Writes a flight recording into a new file `abbe-flight-N.abr`, with the lowest N that is free.
pub(crate) fn write_next_flight(dir: &Path, bytes: &[u8]) -> Result<PathBuf, Failure> {
    // The empty file holds the name until the whole one takes its place.
    let held = next_free(|number| {
        let file = dir.join(format!("abbe-flight-{number}.abr"));
        fs::File::create_new(&file).map(|_| file)
    });
    let file = held.map_err(|error| {
        Failure::work(format!("{}: abbe-flight-N.abr cannot be written there: {error}", dir.display()))
    })?;
    match write_whole(&file, bytes) {
        Ok(()) => Ok(file),
        Err(failure) => {
            _ = fs::remove_file(&file);
            Err(failure)
        }
    }
}

/// Makes something with the lowest number with which it is new.
fn next_free(make: impl Fn(u32) -> io::Result<PathBuf>) -> io::Result<PathBuf> {
    for number in 1..100_000 {
        match make(number) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            made => return made,
        }
    }
    Err(io::Error::other("there are 99999 of them"))
}

/// Writes a file beside its place and renames it: it appears whole or not at all.
pub(crate) fn write_whole(file: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let mut growing = Growing::new(file)?;
    growing.write(bytes)?;
    growing.done()
}

/// A file that grows beside its place until it is whole. Dropped before, it goes.
#[derive(Debug)]
pub(crate) struct Growing {
    file: PathBuf,
    beside: PathBuf,
    writer: BufWriter<fs::File>,
    renamed: bool,
}

impl Growing {
    /// An empty one.
    pub(crate) fn new(file: &Path) -> Result<Self, Failure> {
        let beside = file.with_file_name(format!(
            ".{}.{}.part",
            file.file_name().map_or_else(|| "file".into(), |name| name.to_string_lossy()),
            std::process::id()
        ));
        let writer = fs::File::create(&beside).map_err(|error| unwritten(file, &error))?;
        Ok(Self { file: file.into(), beside, writer: BufWriter::new(writer), renamed: false })
    }

    /// More of it.
    pub(crate) fn write(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        self.writer.write_all(bytes).map_err(|error| unwritten(&self.file, &error))
    }

    /// It is whole and takes its place.
    pub(crate) fn done(mut self) -> Result<(), Failure> {
        let done = self.writer.flush().and_then(|()| fs::rename(&self.beside, &self.file));
        done.map_err(|error| unwritten(&self.file, &error))?;
        self.renamed = true;
        Ok(())
    }
}

impl Drop for Growing {
    fn drop(&mut self) {
        if !self.renamed {
            _ = fs::remove_file(&self.beside);
        }
    }
}

fn unwritten(file: &Path, error: &io::Error) -> Failure {
    Failure::work(format!("{}: the file cannot be written: {error}", file.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_with_something_in_it_is_refused_without_force() {
        let dir = tempfile::tempdir().unwrap();
        prepare("--out", dir.path(), false).unwrap();
        fs::write(dir.path().join("mine"), b"1").unwrap();
        assert_eq!(prepare("--out", dir.path(), false).unwrap_err().status(), 2);
        prepare("--out", dir.path(), true).unwrap();
        assert_eq!(fs::read(dir.path().join("mine")).unwrap(), b"1");
    }

    #[test]
    fn folders_made_for_nothing_go_and_others_stay() {
        let dir = tempfile::tempdir().unwrap();
        let theirs = dir.path().join("theirs");
        fs::create_dir(&theirs).unwrap();
        let ready = prepare("--out", &theirs.join("a/b"), false).unwrap();
        fs::create_dir(ready.dir.join("c")).unwrap();
        drop(ready);
        assert!(theirs.exists() && !theirs.join("a").exists());

        let ready = prepare("--out", &theirs.join("a/b"), false).unwrap();
        fs::write(ready.dir.join("result"), b"1").unwrap();
        drop(ready);
        assert!(theirs.join("a/b/result").exists());
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
