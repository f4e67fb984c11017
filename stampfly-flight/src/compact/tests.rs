use super::model::{unzigzag, width, zigzag};
use super::{Ring, Store};
use proptest::prelude::*;
use std::vec::Vec;

proptest! {
    #[test]
    fn a_signed_difference_comes_back(number in any::<u64>()) {
        prop_assert_eq!(unzigzag(zigzag(number)), number);
    }

    #[test]
    fn a_width_holds_its_difference(difference in any::<i32>(), shift in 0..32u32) {
        let difference = difference >> shift;
        let bits = 32 - 8 * u32::from(width(difference as u32));
        let kept = if bits == 32 { 0 } else { difference << bits >> bits };
        prop_assert_eq!(kept, difference);
    }

    /// What a ring holds are the newest parts, whole, as many as fit.
    #[test]
    fn the_newest_parts_are_kept(sizes in prop::collection::vec(1..40usize, 1..60)) {
        let mut memory = [0; 64];
        let mut ring = Ring::new(&mut memory);
        let mut parts = Vec::new();
        for (number, size) in sizes.into_iter().enumerate() {
            let part: Vec<u8> = (0..size).map(|place| (number * 7 + place) as u8).collect();
            prop_assert!(ring.begin(1));
            prop_assert!(part.iter().all(|byte| ring.put(&[*byte])));
            parts.push(part);
            let kept: Vec<u8> = ring.bytes().collect();
            let fitting = (1..=parts.len()).rev().find(|last| parts[parts.len() - last..].concat().len() <= 64);
            let least = fitting.map(|last| parts[parts.len() - last..].concat()).unwrap_or_default();
            prop_assert!(least == kept, "{:?}", kept);
        }
    }
}

#[test]
fn a_part_that_is_larger_than_the_ring_ends_in_what_fitted() {
    let mut memory = [0; 4];
    let mut ring = Ring::new(&mut memory);
    assert!(ring.begin(1) && ring.put(&[1, 2, 3]));
    assert!(!ring.put(&[4, 5]) && !ring.put(&[6]), "nothing after a gap");
    assert_eq!(ring.bytes().collect::<Vec<_>>(), [1, 2, 3]);
    assert!(!ring.begin(5) && ring.begin(1) && ring.put(&[7]));
}
