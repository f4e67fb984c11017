//! Compact flight records as logs: the flight is run again here, and written down as any other.

use stampfly_flight::compact::{self, Contents, File, ReadError, Samples};
use stampfly_sim::recorder::{Memory, head};
use stampfly_sim::vehicle::Vehicle;
use stampfly_types::Instant;
use std::borrow::Cow;
use std::fmt;

use crate::vehicles::{self, ForVehicle, UnknownVehicle};

/// Why a compact record cannot be made a log.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum RecordError {
    /// It names a vehicle that is none of ours.
    Vehicle(UnknownVehicle),
    /// It cannot be read.
    Read(ReadError),
}

impl fmt::Display for RecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Vehicle(error) => write!(f, "{error}"),
            Self::Read(error) => write!(f, "{error}"),
        }
    }
}

impl std::error::Error for RecordError {}

/// Is this a compact record?
#[must_use]
pub fn is_record(bytes: &[u8]) -> bool {
    File::is_one(bytes)
}

/// A log as it is, or a compact record as a log with everything that was published when the flight was run again. Returns what was in
/// the record, too.
///
/// # Errors
/// When a compact record cannot be read.
pub fn as_log(bytes: &[u8]) -> Result<(Cow<'_, [u8]>, Option<Contents>), RecordError> {
    if !is_record(bytes) {
        return Ok((bytes.into(), None));
    }
    let (log, contents) = run_again(bytes, None, Samples::Again)?;
    Ok((log.into(), Some(contents)))
}

/// Runs a compact record again, of the vehicle that it names unless another is named here. Returns the log.
///
/// # Errors
/// When it cannot be read.
pub fn run_again(bytes: &[u8], vehicle: Option<&str>, samples: Samples) -> Result<(Vec<u8>, Contents), RecordError> {
    let name = vehicle.or_else(|| compact::vehicle_name(bytes)).unwrap_or(vehicles::DEFAULT);
    vehicles::with(name, Again { bytes, samples }).map_err(RecordError::Vehicle)?.map_err(RecordError::Read)
}

struct Again<'b> {
    bytes: &'b [u8],
    samples: Samples,
}

impl ForVehicle for Again<'_> {
    type Output = Result<(Vec<u8>, Contents), ReadError>;

    fn run<V: Vehicle>(self) -> Self::Output {
        // A record begins with a key frame, which has the parameters in it.
        let config = V::default_config();
        let facts = [("record".to_owned(), "compact, run again".to_owned())];
        let head = head::<V, _>(Memory::default(), Instant::ZERO, &config, &facts);
        let log = head.and_then(|head| head.data(stampfly_flight::LogSchema::new(&[])));
        let mut log = stampfly_flight::Recorder::<V::Runnables, _>::new(log.map_err(|_| ReadError::Full)?);
        let contents = compact::read(self.bytes, &config, self.samples, &mut log)?;
        Ok((log.into_sink().0, contents))
    }
}
