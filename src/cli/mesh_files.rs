//! Meshes, models, weather and arrays that a job names as files at or below its own folder.

use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use crate::annual::weather::{self, Weather};

use crate::document::FileSource;
use crate::document::limits::{ARRAY_BYTES, MODEL_BYTES, WEATHER_BYTES};
use crate::geometry::TriangleMesh;
use crate::geometry::obj::{ObjLimits, parse_obj};
use crate::output::npy::{self, Array};

/// Source of OBJ, HBJSON, weather and array files at or below a folder; no other file can be read through it.
pub struct MeshFiles {
    folder: PathBuf,
    limits: ObjLimits,
    /// Weather file in place of the one that the document names.
    weather: Option<PathBuf>,
}

impl MeshFiles {
    /// Creates a source of the files at or below the folder of the job file `job`.
    pub fn beside(job: &Path) -> Self {
        Self::below(job.parent().unwrap_or(Path::new("")))
    }

    /// Creates a source of the files at or below `folder`; an empty path is the working directory.
    pub fn below(folder: &Path) -> Self {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        Self { folder: folder.to_owned(), limits: ObjLimits::default(), weather: None }
    }

    /// Returns the source with a weather file, which may be in any folder, in place of the one that the document names.
    pub fn with_weather(self, file: Option<PathBuf>) -> Self {
        Self { weather: file, ..self }
    }

    /// Returns the path of the file `name`, or a sentence that says why it cannot be used.
    pub fn path(&self, name: &str) -> Result<PathBuf, String> {
        let relative = Path::new(name);
        let plain = |component| matches!(component, Component::Normal(_) | Component::CurDir);
        if name.contains('\0') || !relative.components().all(plain) {
            return Err(format!("{name:?} must be a file in the job file's folder or below it"));
        }
        let missing = |error: std::io::Error| format!("{name:?} cannot be read: {error}");
        let folder = self.folder.canonicalize().map_err(missing)?;
        let file = folder.join(relative).canonicalize().map_err(missing)?;
        // a symbolic link may lead anywhere
        if !file.starts_with(&folder) {
            return Err(format!("{name:?} must be a file in the job file's folder or below it"));
        }
        if !file.is_file() {
            return Err(format!("{name:?} is not a file"));
        }
        Ok(file)
    }

    /// Reads the file `name` of at most `most` bytes.
    fn read(&self, name: &str, most: usize) -> Result<Vec<u8>, String> {
        read_at(&self.path(name)?, name, most)
    }
}

/// Reads a file of at most `most` bytes; `name` is its name in messages.
pub(super) fn read_at(file: &Path, name: &str, most: usize) -> Result<Vec<u8>, String> {
    let unreadable = |error: std::io::Error| format!("{name:?} cannot be read: {error}");
    let size = file.metadata().map_err(unreadable)?.len();
    if size > most as u64 {
        return Err(format!("{name:?} has {size} bytes, but such a file may have at most {most}"));
    }
    std::fs::read(file).map_err(unreadable)
}

impl FileSource for MeshFiles {
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        let bytes = self.read(id, self.limits.bytes)?;
        parse_obj(&bytes, self.limits).map(Arc::new).map_err(|error| format!("{id}: {error}"))
    }

    fn weather(&self, id: &str) -> Result<Arc<Weather>, String> {
        let bytes = match &self.weather {
            Some(file) => read_at(file, id, WEATHER_BYTES)?,
            None => self.read(id, WEATHER_BYTES)?,
        };
        weather::read(&bytes).map(Arc::new).map_err(|error| format!("{id}: {error}"))
    }

    fn model(&self, name: &str) -> Result<Vec<u8>, String> {
        self.read(name, MODEL_BYTES)
    }

    fn array(&self, id: &str) -> Result<Arc<Array>, String> {
        npy::decode(&self.read(id, ARRAY_BYTES)?).map(Arc::new).map_err(|error| format!("{id}: {error}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_at_or_below_the_folder() {
        let directory = tempfile::tempdir().unwrap();
        let folder = directory.path().join("jobs");
        std::fs::create_dir_all(folder.join("meshes")).unwrap();
        std::fs::write(folder.join("meshes/a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        std::fs::write(folder.join("broken.obj"), "v 0 0 0\nf 1 2 3\n").unwrap();
        std::fs::write(directory.path().join("secret.obj"), "").unwrap();
        std::os::unix::fs::symlink(directory.path().join("secret.obj"), folder.join("link.obj")).unwrap();
        let meshes = MeshFiles::beside(&folder.join("job.json"));
        assert_eq!(meshes.load("meshes/a.obj").unwrap().triangles.len(), 1);
        assert_eq!(meshes.load("./meshes/a.obj").unwrap().triangles.len(), 1);
        let absolute = directory.path().join("secret.obj");
        let absolute = absolute.to_str().unwrap();
        for name in ["../secret.obj", absolute, "link.obj", "meshes", "none.obj", "", "a\0b", "meshes/../../secret.obj"]
        {
            assert!(meshes.load(name).is_err(), "{name:?}");
        }
        assert!(meshes.load("broken.obj").unwrap_err().contains("line 2"));
    }
}
