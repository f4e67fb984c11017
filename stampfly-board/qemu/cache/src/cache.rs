//! A set-associative cache that replaces the line unused for longest. It holds no bytes: only which lines are there.
//!
//! The ESP32-S3's instruction and data cache are of this kind (ESP32-S3 Technical Reference Manual v1.6, section 4.3.3.2 "Cache": four
//! or eight ways, lines of 16, 32 or 64 bytes). How it chooses the line to give up is not written there; the one unused for longest is
//! the usual way.

/// Shape of a cache.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Bytes in all.
    pub size: usize,
    /// Places for lines of the same set.
    pub ways: usize,
    /// Bytes a line, a power of two.
    pub line: usize,
}

impl Shape {
    /// Instructions, as esp-hal 1.2 sets the ESP32-S3 up (`esp_config.yml`: 32 kB, eight ways, lines of 32 bytes).
    pub const INSTRUCTIONS: Self = Self { size: 32 * 1024, ways: 8, line: 32 };
    /// Constants: the firmware's setting of 32 kB, else as esp-hal 1.2 sets it up (eight ways, lines of 32 bytes).
    pub const DATA: Self = Self { size: 32 * 1024, ways: 8, line: 32 };
}

/// Which lines are in a cache.
#[derive(Clone, Debug)]
pub struct Cache {
    line_bits: u32,
    ways: usize,
    /// Set after set, the line used last first. A line is known by its address over its length; `None` is an empty place.
    places: Vec<Option<u64>>,
}

impl Cache {
    /// An empty one.
    pub fn new(shape: Shape) -> Self {
        let Shape { size, ways, line } = shape;
        assert!(
            line.is_power_of_two() && ways > 0 && size % (ways * line) == 0 && size > 0,
            "no such cache: {shape:?}"
        );
        Self { line_bits: line.trailing_zeros(), ways, places: vec![None; size / line] }
    }

    /// Looks an address up and fetches its line when it is not there. Was it missing?
    pub fn misses(&mut self, address: u64) -> bool {
        let line = address >> self.line_bits;
        let sets = self.places.len() / self.ways;
        let first = (line % sets as u64) as usize * self.ways;
        let set = &mut self.places[first..first + self.ways];
        let found = set.iter().position(|place| *place == Some(line));
        // The lines used since move one place back; of a full set the last one is gone.
        let until = found.unwrap_or(self.ways - 1);
        set[..=until].rotate_right(1);
        set[0] = Some(line);
        found.is_none()
    }

    /// Address of the line that holds this one.
    pub fn line_of(&self, address: u64) -> u64 {
        address >> self.line_bits << self.line_bits
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two sets of two lines.
    const SMALL: Shape = Shape { size: 64, ways: 2, line: 16 };

    #[test]
    fn a_line_is_fetched_once_while_it_is_used() {
        let mut cache = Cache::new(SMALL);
        assert!(cache.misses(0x100));
        assert!(!cache.misses(0x10f));
        assert!(cache.misses(0x110), "the next line");
        assert!(!cache.misses(0x100));
    }

    #[test]
    fn the_line_unused_for_longest_gives_way() {
        let mut cache = Cache::new(SMALL);
        // Three lines of one set, which has two places.
        let [a, b, c] = [0x100, 0x120, 0x140];
        assert!(cache.misses(a) && cache.misses(b));
        assert!(!cache.misses(a));
        assert!(cache.misses(c));
        assert!(!cache.misses(a), "used after the other");
        assert!(cache.misses(b));
    }

    #[test]
    fn a_loop_longer_than_the_cache_finds_nothing() {
        let mut cache = Cache::new(Shape::INSTRUCTIONS);
        let lines = |bytes: u64| (0..bytes).step_by(32);
        let mut run = |bytes| lines(bytes).filter(|at| cache.misses(*at)).count();
        assert_eq!((run(32 * 1024), run(32 * 1024)), (1024, 0));
        // An eighth more than it holds, and each line is gone by the time it is wanted again.
        assert_eq!((run(36 * 1024), run(36 * 1024)), (128, 1152));
    }
}
