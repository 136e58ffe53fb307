//! Finds the weight files of a folder and reads them one tensor at a time.

use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::{Cursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use half::{bf16, f16};
use safetensors::Dtype;
use safetensors::tensor::{Metadata, TensorInfo};

use super::header::{self, Header};
use super::index::ShardIndex;
use super::names::modern;
use crate::error::{Error, Result};
use whole_files::failed;

/// File names of models in order of preference, each with the names that an index of shards may have instead.
const NAMES: [(&str, &[&str]); 4] = [
    (
        "diffusion_pytorch_model.safetensors",
        &["diffusion_pytorch_model.safetensors.index.json"],
    ),
    ("model.safetensors", &["model.safetensors.index.json"]),
    (
        "diffusion_pytorch_model.fp16.safetensors",
        &[
            "diffusion_pytorch_model.safetensors.index.fp16.json",
            "diffusion_pytorch_model.safetensors.fp16.index.json",
            "diffusion_pytorch_model.fp16.safetensors.index.json",
        ],
    ),
    (
        "model.fp16.safetensors",
        &[
            "model.safetensors.index.fp16.json",
            "model.fp16.safetensors.index.json",
        ],
    ),
];

/// Bytes that are read and converted at once, so that no tensor is in memory twice.
const CHUNK: usize = 1 << 20;

/// An open file whose header has been read and checked.
#[derive(Debug)]
pub(super) struct WeightFile {
    pub(super) path: PathBuf,
    contents: Contents,
    header: Header,
}

/// Location of a file's bytes.
#[derive(Debug)]
enum Contents {
    Disk(File),
    /// Embedded in the program.
    Memory(&'static [u8]),
}

/// Source from which tensors are read.
trait ReadSeek: Read + Seek {}
impl<T: Read + Seek> ReadSeek for T {}

impl Contents {
    fn reader(&self) -> Box<dyn ReadSeek + '_> {
        match self {
            Self::Disk(file) => Box::new(file),
            Self::Memory(bytes) => Box::new(Cursor::new(*bytes)),
        }
    }

    fn size(&self) -> std::io::Result<u64> {
        match self {
            Self::Disk(file) => Ok(file.metadata()?.len()),
            Self::Memory(bytes) => Ok(bytes.len() as u64),
        }
    }
}

/// A tensor of a file that has not been read yet.
pub struct Stored<'a> {
    name: String,
    info: &'a TensorInfo,
    file: &'a WeightFile,
}

/// The files of one model.
#[derive(Debug)]
pub struct WeightFiles {
    files: Vec<WeightFile>,
}

impl WeightFiles {
    /// Opens a file, or the files of a folder.
    ///
    /// # Errors
    ///
    /// [`Error::MissingFile`], [`Error::Io`] or [`Error::InvalidSafetensors`] for files that are missing or damaged.
    pub fn open(path: &Path) -> Result<Self> {
        if !path.is_dir() {
            return Self::whole(path);
        }
        for (name, indices) in NAMES {
            let whole = path.join(name);
            if whole.is_file() {
                return Self::whole(&whole);
            }
            let mut indices = indices.iter().map(|index| path.join(index));
            if let Some(index) = indices.find(|index| index.is_file()) {
                return Self::shards(&ShardIndex::read(&index)?);
            }
        }
        let expected = NAMES
            .iter()
            .flat_map(|(name, indices)| std::iter::once(name).chain(*indices));
        Err(Error::MissingFile {
            folder: path.to_owned(),
            expected: expected.map(|name| (*name).to_owned()).collect(),
        })
    }

    /// Opens a file embedded in the program; `name` is used only in messages.
    pub(crate) fn embedded(name: &str, bytes: &'static [u8]) -> Result<Self> {
        Ok(Self {
            files: vec![WeightFile::new(Path::new(name), Contents::Memory(bytes))?],
        })
    }

    fn whole(path: &Path) -> Result<Self> {
        Ok(Self {
            files: vec![WeightFile::open(path)?],
        })
    }

    /// Opens the shards of an index, which must hold the tensors that it lists.
    fn shards(index: &ShardIndex) -> Result<Self> {
        let files = index.paths().map(|path| WeightFile::open(&path));
        let files: Vec<WeightFile> = files.collect::<Result<_>>()?;
        for file in &files {
            index.check(&file.path, file.metadata().offset_keys())?;
        }
        Ok(Self { files })
    }

    /// Returns an entry of the headers' free text, if one of them has it.
    pub fn note(&self, key: &str) -> Option<&str> {
        let headers = self.files.iter().map(WeightFile::metadata);
        let mut notes = headers.filter_map(|header| header.metadata().as_ref());
        notes.find_map(|notes| notes.get(key)).map(String::as_str)
    }

    /// Returns all tensors under their current names.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidSafetensors`] for a name that two files hold.
    pub fn tensors(&self) -> Result<BTreeMap<String, Stored<'_>>> {
        let mut tensors = BTreeMap::new();
        for file in &self.files {
            for (name, info) in file.metadata().tensors() {
                let stored = Stored {
                    name: modern(&name),
                    info,
                    file,
                };
                let name = stored.name.clone();
                if tensors.insert(name.clone(), stored).is_some() {
                    return Err(Error::InvalidSafetensors {
                        path: file.path.clone(),
                        reason: format!("two tensors have the name {name}").into(),
                    });
                }
            }
        }
        Ok(tensors)
    }
}

impl WeightFile {
    fn open(path: &Path) -> Result<Self> {
        // Opening a pipe would wait for a writer.
        let found = std::fs::metadata(path).map_err(|source| failed("read", path, source))?;
        if !found.is_file() {
            return Err(Error::InvalidSafetensors {
                path: path.to_owned(),
                reason: "not a regular file".into(),
            });
        }
        let file = File::open(path).map_err(|source| failed("read", path, source))?;
        Self::new(path, Contents::Disk(file))
    }

    fn new(path: &Path, contents: Contents) -> Result<Self> {
        let size = contents
            .size()
            .map_err(|source| failed("read", path, source))?;
        let header = header::read(path, contents.reader(), size)?;
        Ok(Self {
            path: path.to_owned(),
            contents,
            header,
        })
    }

    fn metadata(&self) -> &Metadata {
        &self.header.metadata
    }

    /// Passes on the bytes of a tensor, one chunk of whole numbers at a time.
    fn for_chunks(&self, info: &TensorInfo, mut each: impl FnMut(&[u8])) -> std::io::Result<()> {
        let (start, end) = info.data_offsets;
        let mut file = self.contents.reader();
        file.seek(SeekFrom::Start(self.header.data_start + start as u64))?;
        let mut left = end - start;
        let mut buffer = vec![0; left.min(CHUNK)];
        while left > 0 {
            let chunk = &mut buffer[..left.min(CHUNK)];
            file.read_exact(chunk)?;
            each(chunk);
            left -= chunk.len();
        }
        Ok(())
    }
}

impl Stored<'_> {
    /// Shape of the tensor.
    pub fn shape(&self) -> &[usize] {
        &self.info.shape
    }

    pub(super) fn dtype(&self) -> Dtype {
        self.info.dtype
    }

    /// Whether the tensor has a number type in which weights are stored.
    pub fn is_float(&self) -> bool {
        matches!(
            self.dtype(),
            Dtype::F32 | Dtype::F16 | Dtype::BF16 | Dtype::F64
        )
    }

    /// Reads the numbers as f32; they need not be finite.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] if the file cannot be read.
    pub fn numbers(&self) -> Result<Vec<f32>> {
        match self.dtype() {
            Dtype::F16 => self.converted(|b: [u8; 2]| f16::from_le_bytes(b).to_f32()),
            Dtype::BF16 => self.converted(|b: [u8; 2]| bf16::from_le_bytes(b).to_f32()),
            Dtype::F64 => self.converted(|b: [u8; 8]| f64::from_le_bytes(b) as f32),
            _ => self.converted(f32::from_le_bytes),
        }
    }

    /// Reads the numbers as f32 and checks that all are finite.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] if the file cannot be read, [`Error::InvalidWeight`] for a number that is not finite.
    pub fn read(&self) -> Result<Vec<f32>> {
        let numbers = self.numbers()?;
        match numbers.iter().find(|x| !x.is_finite()) {
            None => Ok(numbers),
            Some(x) => Err(Error::InvalidWeight {
                path: self.file.path.clone(),
                tensor: self.name.clone(),
                value: f64::from(*x),
            }),
        }
    }

    fn converted<const N: usize>(&self, number: impl Fn([u8; N]) -> f32) -> Result<Vec<f32>> {
        let (start, end) = self.info.data_offsets;
        // The header's offsets lie within the file, so this allocates no more than the file holds.
        let mut numbers = Vec::with_capacity((end - start) / N);
        let converted = self.file.for_chunks(self.info, |bytes| {
            let (whole, _) = bytes.as_chunks::<N>();
            numbers.extend(whole.iter().map(|bytes| number(*bytes)));
        });
        converted.map_err(|source| failed("read", &self.file.path, source))?;
        Ok(numbers)
    }
}

impl fmt::Debug for Stored<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?} {:?}", self.dtype(), self.shape())
    }
}
