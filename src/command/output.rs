//! Files that appear whole or not at all; text on standard output.

use super::{Failed, Format};
use crate::report::page::RenderError;
use std::io::Write;
use std::path::Path;

/// Writes `content` to a temporary file beside `path` and renames it. Folders that do not exist are made: an answer of
/// minutes is not thrown away for the want of one.
pub(super) fn write_whole(path: &Path, content: &str) -> Result<(), Failed> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let temporary = || tempfile::Builder::new().prefix(".ident").tempfile_in(folder);
    let written = std::fs::create_dir_all(folder).and_then(|()| temporary()).and_then(|mut file| {
        file.write_all(content.as_bytes())?;
        file.flush()?;
        readable(&file)?;
        file.persist(path).map_err(|error| error.error)?;
        Ok(())
    });
    written.map_err(|error| {
        eprintln!("error: cannot write {}: {error}", path.display());
        Failed
    })
}

/// Writes to standard output. A reader that has seen enough and goes away (`| head`) is no error.
pub(super) fn show(text: &str) {
    let mut output = std::io::stdout().lock();
    if let Err(error) = output.write_all(text.as_bytes()).and_then(|()| output.flush())
        && error.kind() != std::io::ErrorKind::BrokenPipe
    {
        eprintln!("error: cannot write to standard output: {error}");
    }
}

/// Temporary files are private to the user; results are not.
#[cfg(unix)]
fn readable(file: &tempfile::NamedTempFile) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.as_file().set_permissions(std::fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn readable(_file: &tempfile::NamedTempFile) -> std::io::Result<()> {
    Ok(())
}

/// The text of a JSON document, or a message where it cannot be made.
pub(super) fn json(document: Result<String, serde_json::Error>) -> Result<String, Failed> {
    document.map_err(|error| {
        eprintln!("error: the answer cannot be written as JSON: {error}");
        Failed
    })
}

/// Writes the page that was asked for.
pub(super) fn page(path: Option<&Path>, make: impl FnOnce() -> Result<String, RenderError>) -> Result<(), Failed> {
    let Some(path) = path else { return Ok(()) };
    let page = make().map_err(|error| {
        eprintln!("error: the page cannot be made: {error}");
        Failed
    })?;
    write_whole(path, &page)
}

/// Writes the picture that was asked for.
pub(super) fn figure(path: Option<&Path>, make: impl FnOnce() -> String) -> Result<(), Failed> {
    path.map_or(Ok(()), |path| write_whole(path, &make()))
}

/// The answer on standard output, in the form that was asked for.
pub(super) fn answer(
    format: Format,
    text: impl FnOnce() -> String,
    document: impl FnOnce() -> Result<String, serde_json::Error>,
) -> Result<(), Failed> {
    match format {
        Format::Text => show(&text()),
        Format::Json => show(&(json(document())? + "\n")),
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_are_written_into_folders_that_do_not_exist_yet() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("answers/of/today/fit.json");
        assert!(write_whole(&path, "{}").is_ok());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "{}");
        let beside = std::fs::read_dir(path.parent().unwrap()).unwrap().count();
        assert_eq!(beside, 1, "the temporary file is gone");
    }

    #[test]
    fn a_file_in_the_way_is_told_and_kept() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("answers");
        std::fs::write(&file, "kept").unwrap();
        assert!(write_whole(&file.join("fit.json"), "{}").is_err());
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "kept");
    }
}
