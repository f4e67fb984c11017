//! Rows of a campaign as a Parquet file: written whole or not at all, read with every error named.
//!
//! Columns are plain or in a dictionary, uncompressed; each file has one row group. What the file is a part of stands in its
//! footer, so that a campaign knows which of its files it can keep.

use super::row::{Column, Kind, Row, Value};
use parquet::basic::{ConvertedType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::record::Field;
use parquet::schema::types::{Type, TypePtr};
use std::cell::Cell;
use std::fmt;
use std::fs::{self, File};
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Once};

/// Under this key the footer says what the file is a part of.
const IDENTITY: &str = "stampfly.campaign";

/// What is in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Contents {
    /// What it is a part of, as it was written.
    pub identity: String,
    /// The flights.
    pub rows: Vec<Row>,
}

/// Writes rows into a file. It appears under its name when it is complete; what was there before is replaced.
///
/// # Errors
/// When the file cannot be written. Nothing has changed then.
pub fn write(path: &Path, identity: &str, rows: &[Row]) -> Result<(), FileError> {
    let folder = path.parent().unwrap_or(Path::new("."));
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    // Of this process alone: a task that was given up for lost may still be writing the same rows.
    let unfinished = folder.join(format!(".{name}.{}", std::process::id()));
    let written = write_all(&unfinished, identity, rows)
        .and_then(|()| fs::rename(&unfinished, path).map_err(|error| Cause::Io("written", error)));
    written.map_err(|cause| {
        let _ = fs::remove_file(&unfinished);
        FileError { path: path.into(), cause }
    })
}

fn write_all(path: &Path, identity: &str, rows: &[Row]) -> Result<(), Cause> {
    let file = File::create(path).map_err(|error| Cause::Io("written", error))?;
    let columns = rows.first().map_or_else(Row::common, Row::columns);
    let footer = KeyValue::new(IDENTITY.to_owned(), identity.to_owned());
    let properties = WriterProperties::builder().set_key_value_metadata(Some(vec![footer])).build();
    let mut writer = SerializedFileWriter::new(&file, schema(&columns)?, Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    // Column after column, as the format has it.
    let mut values: Vec<_> = rows.iter().map(|row| row.values().into_iter()).collect();
    for column in &columns {
        let of_column: Vec<_> = values.iter_mut().filter_map(Iterator::next).collect();
        let mut writer = group.next_column()?.ok_or(Cause::Contents("fewer columns than rows have".into()))?;
        write_column(&mut writer, column, of_column)?;
        writer.close()?;
    }
    group.close()?;
    writer.close()?;
    // Before it gets its name: a machine that fails must not leave a name without contents.
    file.sync_all().map_err(|error| Cause::Io("written", error))
}

fn schema(columns: &[Column]) -> Result<TypePtr, ParquetError> {
    let fields = columns.iter().map(|Column { name, kind, is_optional, .. }| {
        let (physical, converted) = match kind {
            Kind::Integer => (Physical::INT64, ConvertedType::UINT_64),
            Kind::Number => (Physical::DOUBLE, ConvertedType::NONE),
            Kind::Flag => (Physical::BOOLEAN, ConvertedType::NONE),
            Kind::Text => (Physical::BYTE_ARRAY, ConvertedType::UTF8),
        };
        let repetition = if *is_optional { Repetition::OPTIONAL } else { Repetition::REQUIRED };
        let field = Type::primitive_type_builder(name, physical);
        field.with_converted_type(converted).with_repetition(repetition).build().map(Arc::new)
    });
    let fields = fields.collect::<Result<_, _>>()?;
    Type::group_type_builder("flight").with_fields(fields).build().map(Arc::new)
}

fn write_column(
    writer: &mut SerializedColumnWriter<'_>,
    column: &Column,
    values: Vec<Value>,
) -> Result<(), ParquetError> {
    let levels: Vec<i16> = values.iter().map(|value| i16::from(*value != Value::Nothing)).collect();
    let levels = column.is_optional.then_some(levels.as_slice());
    macro_rules! batch {
        ($Type:ty, $Kind:ident, $value:ident => $stored:expr) => {{
            let take = |value| if let Value::$Kind($value) = value { Some($stored) } else { None };
            let stored: Vec<_> = values.into_iter().filter_map(take).collect();
            writer.typed::<$Type>().write_batch(&stored, levels, None)
        }};
    }
    match column.kind {
        // The same bits: the schema says that they have no sign.
        Kind::Integer => batch!(Int64Type, Integer, value => value as i64),
        Kind::Number => batch!(DoubleType, Number, value => value),
        Kind::Flag => batch!(BoolType, Flag, value => value),
        Kind::Text => batch!(ByteArrayType, Text, value => ByteArray::from(value.into_bytes())),
    }
    .map(drop)
}

std::thread_local! {
    /// Does this thread read a file whose panics are its errors?
    static READS: Cell<bool> = const { Cell::new(false) };
}

/// Runs what may panic because a file is damaged, without a word of that. `None` when it did.
fn without_panic<T>(work: impl FnOnce() -> T) -> Option<T> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if !READS.get() {
                before(panic);
            }
        }));
    });
    READS.set(true);
    let done = catch_unwind(AssertUnwindSafe(work));
    READS.set(false);
    done.ok()
}

/// Reads a file.
///
/// # Errors
/// When it cannot be read, or is no file of a campaign.
pub fn read(path: &Path) -> Result<Contents, FileError> {
    // The reader of Parquet takes some of what a damaged page says for granted, and panics.
    let damaged = || Err(FileError { path: path.into(), cause: Cause::Contents("a page is damaged".into()) });
    without_panic(|| read_rows(path)).unwrap_or_else(damaged)
}

fn read_rows(path: &Path) -> Result<Contents, FileError> {
    let with_path = |cause| FileError { path: path.into(), cause };
    let file = File::open(path).map_err(|error| with_path(Cause::Io("read", error)))?;
    let reader = SerializedFileReader::new(file).map_err(|error| with_path(error.into()))?;
    let identity =
        identity(&reader).ok_or_else(|| with_path(Cause::Contents(format!("no {IDENTITY} in its footer"))))?;
    let rows = reader.get_row_iter(None).map_err(|error| with_path(error.into()))?.map(|row| {
        let fields = row?.into_columns().into_iter().map(|(name, field)| (name, value(field)));
        Row::from_values(fields).map_err(Cause::Contents)
    });
    let rows = rows.collect::<Result<_, _>>().map_err(with_path)?;
    Ok(Contents { identity, rows })
}

fn identity(reader: &impl FileReader) -> Option<String> {
    let footer = reader.metadata().file_metadata().key_value_metadata()?;
    footer.iter().find(|pair| pair.key == IDENTITY)?.value.clone()
}

/// What no row has becomes text, and is refused there.
fn value(field: Field) -> Value {
    match field {
        Field::Null => Value::Nothing,
        Field::Bool(value) => Value::Flag(value),
        Field::ULong(value) => Value::Integer(value),
        Field::Double(value) => Value::Number(value),
        Field::Str(value) => Value::Text(value),
        other => Value::Text(other.to_string()),
    }
}

/// Why rows could not be written or read.
#[derive(Debug)]
pub struct FileError {
    path: PathBuf,
    cause: Cause,
}

#[derive(Debug)]
enum Cause {
    Io(&'static str, io::Error),
    Format(ParquetError),
    Contents(String),
}

impl From<ParquetError> for Cause {
    fn from(error: ParquetError) -> Self {
        Self::Format(error)
    }
}

impl FileError {
    /// Is there no such file?
    #[must_use]
    pub fn is_missing(&self) -> bool {
        matches!(&self.cause, Cause::Io(_, error) if error.kind() == io::ErrorKind::NotFound)
    }
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = self.path.display();
        match &self.cause {
            Cause::Io(what, error) => write!(f, "{path} cannot be {what}: {error}"),
            Cause::Format(error) => write!(f, "{path} is no complete Parquet file: {error}"),
            Cause::Contents(what) => write!(f, "{path} is no file of a campaign: {what}"),
        }
    }
}

impl std::error::Error for FileError {}
