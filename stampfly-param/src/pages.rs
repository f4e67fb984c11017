//! The pages of a store, and the mark on the first of them.
//!
//! Flash with other content is not blank: other firmware leaves pages whose ends may look free, and
//! a value written there is lost. The mark on the first page says that all others were erased for
//! this store. It is erased first and written last, so a power cut in between leaves no mark.

use crate::EraseError;
use core::ops::Range;
use embedded_storage_async::nor_flash::NorFlash;

/// Changes when values are kept in another way: what an older version has kept is then erased.
const VERSION: u32 = 2;

/// A whole number of words of every flash there is.
const LENGTH: usize = 32;

/// Aligned as flash likes it.
#[derive(PartialEq)]
#[repr(align(4))]
struct Mark([u8; LENGTH]);

/// The first page is for the mark, the others are for values.
#[derive(Clone, Debug)]
pub struct Pages {
    mark: Range<u32>,
    pub values: Range<u32>,
}

impl Pages {
    /// These bytes of the flash. `None` when there is no room for the mark and two pages of values.
    pub fn of<F: NorFlash>(range: Range<u32>) -> Option<Self> {
        let page = u32::try_from(F::ERASE_SIZE).ok()?;
        let values = range.start.checked_add(page)?..range.end;
        let room = values.end.checked_sub(values.start)?;
        (room.checked_div(page)? >= 2).then_some(Self { mark: range.start..values.start, values })
    }

    /// Whose they are: name, version, bytes for values.
    fn expected(&self) -> Mark {
        let mut mark = *b"StampFly parameters\0\0\0\0\0\0\0\0\0\0\0\0\0";
        let numbers = [VERSION, self.values.end.saturating_sub(self.values.start)].map(u32::to_le_bytes);
        for (place, byte) in mark.iter_mut().skip(24).zip(numbers.as_flattened()) {
            *place = *byte;
        }
        Mark(mark)
    }

    /// Is this a store of this version and size? If not it is blank, of other firmware, or half
    /// erased.
    pub async fn are_ours<F: NorFlash>(&self, flash: &mut F) -> Result<bool, F::Error> {
        let mut found = Mark([0; LENGTH]);
        flash.read(self.mark.start, &mut found.0).await?;
        Ok(found == self.expected())
    }

    /// Erases everything and leaves the mark.
    pub async fn format<F: NorFlash>(&self, flash: &mut F) -> Result<(), EraseError<F::Error>> {
        // One page at a time, the mark's first: that is how long everything else on the chip has to
        // wait.
        for from in (self.mark.start..self.values.end).step_by(F::ERASE_SIZE.max(1)) {
            flash.erase(from, from.saturating_add(F::ERASE_SIZE as u32)).await.map_err(EraseError::Flash)?;
        }
        flash.write(self.mark.start, &self.expected().0).await.map_err(EraseError::Flash)?;
        if self.are_ours(flash).await.map_err(EraseError::Flash)? { Ok(()) } else { Err(EraseError::NotKept) }
    }
}
