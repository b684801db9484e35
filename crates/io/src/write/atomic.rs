//! Files that appear complete or not at all: write beside, flush to the disk, rename.

use super::WriteError;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// A file under construction. Nothing is seen under its name before [`AtomicFile::commit`], and dropping it uncommitted
/// (an error, a panic, an early return) removes every trace.
///
/// The bytes go to a hidden file in the same folder, which the commit renames: on one file system a rename is atomic,
/// so a reader sees the old file or the new one. A symbolic link is followed: the file it points to is replaced.
///
/// ```
/// use ondelette_io::write::AtomicFile;
/// use std::io::Write;
/// let folder = tempfile::tempdir().unwrap();
/// let path = folder.path().join("note.txt");
/// let mut file = AtomicFile::create(&path).unwrap();
/// file.write_all(b"lit").unwrap();
/// assert!(!path.exists());
/// file.commit().unwrap();
/// assert_eq!(std::fs::read(&path).unwrap(), b"lit");
/// ```
#[derive(Debug)]
pub struct AtomicFile {
    /// The path as asked for: what messages name.
    path: PathBuf,
    /// The same with symbolic links followed: what the rename replaces.
    target: PathBuf,
    beside: PathBuf,
    /// `None` once committed.
    file: Option<BufWriter<File>>,
}

/// Ending of a file under construction.
const PART: &str = ".part";

/// Tells apart the files that one process has under construction in the same folder.
static SERIAL: AtomicU32 = AtomicU32::new(0);

impl AtomicFile {
    /// Starts the file `path`.
    ///
    /// # Errors
    /// The folder is missing or refuses new files, or `path` is a folder, a device or a read-only file.
    pub fn create(path: &Path) -> Result<Self, WriteError> {
        let refused = |doing, source| WriteError::Refused { path: path.to_path_buf(), doing, source };
        let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        if let Ok(found) = fs::metadata(&target) {
            if !found.is_file() {
                return Err(WriteError::NotAFile(path.to_path_buf()));
            }
            if found.permissions().readonly() {
                return Err(WriteError::ReadOnly(path.to_path_buf()));
            }
        }
        let (Some(name), false) = (target.file_name(), ends_with_separator(path)) else {
            return Err(WriteError::NotAFile(path.to_path_buf()));
        };
        let folder = folder_of(&target);
        if !folder.is_dir() {
            return Err(WriteError::MissingFolder { path: path.to_path_buf(), folder: folder.to_path_buf() });
        }
        loop {
            let serial = SERIAL.fetch_add(1, Ordering::Relaxed);
            let mut hidden = std::ffi::OsString::from(".");
            hidden.push(name);
            hidden.push(format!(".{}-{serial}{PART}", std::process::id()));
            let beside = folder.join(hidden);
            match OpenOptions::new().write(true).create_new(true).open(&beside) {
                Ok(file) => {
                    let file = Some(BufWriter::new(file));
                    return Ok(AtomicFile { path: path.to_path_buf(), target, beside, file });
                }
                // left by a process of the same number that was killed: take the next serial number
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(refused("creating a file in its folder", e)),
            }
        }
    }

    /// Makes the bytes durable and gives the file its name.
    ///
    /// # Errors
    /// The disk is full or the rename was refused; nothing is left behind, an older file of that name is untouched.
    pub fn commit(mut self) -> Result<(), WriteError> {
        let Some(file) = self.file.take() else { return Ok(()) };
        let finished = file
            .into_inner()
            .map_err(|e| e.into_error())
            .and_then(|file| file.sync_all())
            .map_err(|e| self.refused("writing to the disk", e))
            .and_then(|()| fs::rename(&self.beside, &self.target).map_err(|e| self.refused("renaming", e)));
        if finished.is_err() {
            // the first error is the one to report; this removal is best effort
            let _ = fs::remove_file(&self.beside);
        } else if let Ok(folder) = File::open(folder_of(&self.target)) {
            // makes the new name durable too; systems that cannot sync a folder lose nothing but that
            let _ = folder.sync_all();
        }
        finished
    }

    /// The error for a step that the system refused.
    pub(crate) fn refused(&self, doing: &'static str, source: io::Error) -> WriteError {
        WriteError::Refused { path: self.path.clone(), doing, source }
    }

    fn open(&mut self) -> io::Result<&mut BufWriter<File>> {
        self.file.as_mut().ok_or_else(|| io::Error::other("the file is already committed"))
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.open()?.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.open()?.flush()
    }
}

impl Seek for AtomicFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.open()?.seek(to)
    }
}

impl Drop for AtomicFile {
    fn drop(&mut self) {
        if let Some(file) = self.file.take() {
            // closed without flushing its buffer: the bytes are on their way out anyway
            let _ = file.into_parts();
            // nothing more can be done here about a folder that stopped accepting changes
            let _ = fs::remove_file(&self.beside);
        }
    }
}

/// Writes `bytes` as the file `path`, whole or not at all.
///
/// # Errors
/// As [`AtomicFile::create`] and [`AtomicFile::commit`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    let mut file = AtomicFile::create(path)?;
    file.write_all(bytes).map_err(|e| file.refused("writing", e))?;
    file.commit()
}

/// Whether `path` could be written now: to be asked before a long computation. Leaves no trace.
///
/// # Errors
/// The error that writing the file would meet.
pub fn check_writable(path: &Path) -> Result<(), WriteError> {
    AtomicFile::create(path).map(drop)
}

/// Removes what this process has under construction in `folder`: for a program that ends at once, without dropping its
/// [`AtomicFile`]s. Best effort, no errors: there is nobody left to tell.
pub fn remove_unfinished(folder: &Path) {
    let folder = if folder == Path::new("") { Path::new(".") } else { folder };
    let own = format!(".{}-", std::process::id());
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let serial = name.strip_suffix(PART).and_then(|stem| stem.rsplit_once(&own)).map(|(_, serial)| serial);
        if name.starts_with('.') && serial.is_some_and(|s| !s.is_empty() && s.bytes().all(|b| b.is_ascii_digit())) {
            // gone or refused: either way there is nothing more to do
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Makes `folder` and the folders above it. For the program's own default folder only: a folder that a user typed and
/// that is not there is more likely a slip, which [`check_writable`] reports.
///
/// # Errors
/// The system refused, or a file of that name is in the way.
pub fn create_folder(folder: &Path) -> Result<(), WriteError> {
    fs::create_dir_all(folder).map_err(|source| WriteError::Refused {
        path: folder.to_path_buf(),
        doing: "creating the folder",
        source,
    })
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

fn ends_with_separator(path: &Path) -> bool {
    path.as_os_str().to_string_lossy().ends_with(std::path::is_separator)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn an_abandoned_file_leaves_the_old_one_and_no_trace() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("room.png");
        write_bytes(&path, b"old").unwrap();
        let mut file = AtomicFile::create(&path).unwrap();
        file.write_all(&vec![7; 100_000]).unwrap();
        drop(file);
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["room.png"]);
    }

    #[test]
    fn a_process_that_ends_at_once_can_clear_up_and_spares_all_other_files() {
        let folder = tempfile::tempdir().unwrap();
        for other in [".room.png.1-0.part", "room.part", ".part", "note.txt"] {
            write_bytes(&folder.path().join(other), b"keep").unwrap();
        }
        let before = names(folder.path());
        let file = AtomicFile::create(&folder.path().join("room.png")).unwrap();
        assert_eq!(names(folder.path()).len(), before.len() + 1);
        remove_unfinished(folder.path());
        assert_eq!(names(folder.path()), before);
        drop(file);
        remove_unfinished(&folder.path().join("missing"));
    }

    #[test]
    fn a_commit_replaces_and_two_writers_do_not_meet() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("room.png");
        let mut first = AtomicFile::create(&path).unwrap();
        let mut second = AtomicFile::create(&path).unwrap();
        first.write_all(b"first").unwrap();
        second.write_all(b"second").unwrap();
        second.commit().unwrap();
        first.commit().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"first");
        assert_eq!(names(folder.path()), ["room.png"]);
    }

    #[test]
    fn a_check_says_what_is_wrong_before_the_work_and_leaves_no_trace() {
        let folder = tempfile::tempdir().unwrap();
        let good = folder.path().join("room.png");
        check_writable(&good).unwrap();
        assert!(names(folder.path()).is_empty());

        let missing = check_writable(&folder.path().join("typo/room.png")).unwrap_err();
        assert!(matches!(missing, WriteError::MissingFolder { .. }));
        assert!(missing.to_string().contains("typo"));

        assert!(matches!(check_writable(folder.path()), Err(WriteError::NotAFile(_))));
        assert!(matches!(check_writable(&folder.path().join("new.png/")), Err(WriteError::NotAFile(_))));
        assert!(matches!(check_writable("".as_ref()), Err(WriteError::NotAFile(_))));

        write_bytes(&good, b"keep").unwrap();
        assert!(matches!(check_writable(&good.join("inside.png")), Err(WriteError::MissingFolder { .. })));
        let mut permissions = fs::metadata(&good).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&good, permissions).unwrap();
        assert!(matches!(check_writable(&good), Err(WriteError::ReadOnly(_))));
        assert!(write_bytes(&good, b"lost").is_err());
        assert_eq!(fs::read(&good).unwrap(), b"keep");
    }

    #[test]
    fn the_system_s_reason_is_passed_on() {
        let folder = tempfile::tempdir().unwrap();
        let long = folder.path().join("n".repeat(400) + ".png");
        let error = check_writable(&long).unwrap_err();
        assert!(matches!(error, WriteError::Refused { .. }), "{error}");
        assert!(error.to_string().contains("os error"), "{error}");
    }

    #[test]
    fn the_default_folder_is_made_with_its_parents() {
        let folder = tempfile::tempdir().unwrap();
        let deep = folder.path().join("a/b");
        create_folder(&deep).unwrap();
        create_folder(&deep).unwrap();
        check_writable(&deep.join("room.png")).unwrap();
        write_bytes(&deep.join("file"), b"").unwrap();
        assert!(create_folder(&deep.join("file/out")).unwrap_err().to_string().contains("file/out"));
    }

    #[cfg(unix)]
    #[test]
    fn a_symbolic_link_stays_a_link() {
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("real.png"), folder.path().join("link.png"));
        write_bytes(&real, b"old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write_bytes(&link, b"new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&real).unwrap(), b"new");
    }
}
