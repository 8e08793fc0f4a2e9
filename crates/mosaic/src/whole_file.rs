//! Files that appear whole or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// A file under a temporary name beside its target; renamed by [`WholeFile::finish`], removed when dropped before.
pub(crate) struct WholeFile {
    writer: Option<BufWriter<File>>,
    partial: PathBuf,
    target: PathBuf,
}

impl WholeFile {
    /// Opens the temporary file `.NAME.partial` in the folder of `target`.
    pub(crate) fn create(target: &Path) -> io::Result<Self> {
        let name = target
            .file_name()
            .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "not a file name"))?;
        let partial = target.with_file_name(format!(".{}.partial", name.to_string_lossy()));
        let writer = Some(BufWriter::with_capacity(1 << 20, File::create(&partial)?));
        Ok(Self { writer, partial, target: target.to_path_buf() })
    }

    /// The stream to write to.
    pub(crate) fn writer(&mut self) -> io::Result<&mut BufWriter<File>> {
        self.writer.as_mut().ok_or_else(|| io::Error::other("file already finished"))
    }

    /// Flushes and gives the file its name.
    pub(crate) fn finish(mut self) -> io::Result<()> {
        if let Some(writer) = self.writer.take() {
            writer.into_inner().map_err(io::IntoInnerError::into_error)?.sync_data()?;
        }
        fs::rename(&self.partial, &self.target)
    }
}

impl Drop for WholeFile {
    fn drop(&mut self) {
        drop(self.writer.take());
        // After a successful rename there is nothing left to remove; an error here has no reader.
        let _ = fs::remove_file(&self.partial);
    }
}

/// Writes `contents` to `path`, whole or not at all.
pub(crate) fn write_whole(path: &Path, contents: &[u8]) -> io::Result<()> {
    let mut file = WholeFile::create(path)?;
    file.writer()?.write_all(contents)?;
    file.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_abandoned_file_leaves_the_old_one_and_no_remains() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        write_whole(&path, b"old").unwrap();
        let mut half = WholeFile::create(&path).unwrap();
        half.writer().unwrap().write_all(b"new").unwrap();
        drop(half);
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }
}
