//! Stick files, as people and other programs write them.

use stampfly_sim::sticks::{LATEST, Player, StickFile};
use stampfly_types::Duration;

/// A file as it is, and played at fifty frames a second.
pub fn stick_file(data: &[u8]) {
    let Ok(file) = StickFile::parse(data) else { return };
    assert!(!file.rows().is_empty());
    let mut before = Duration::ZERO;
    for row in file.rows() {
        let input = row.input;
        let sticks = [input.throttle, input.roll, input.pitch, input.yaw];
        assert!(sticks.iter().all(|stick| (-1.0..=1.0).contains(stick)), "{row:?}");
        assert!(before <= row.at && row.at.seconds_f64() <= LATEST, "{row:?}");
        before = row.at;
    }
    let written = file.to_string();
    assert_eq!(StickFile::parse(written.as_bytes()).as_ref(), Ok(&file), "what is written is read as it was");
    let mut player = Player::new(&file);
    // Whatever the file's length, as many frames as a flight of half a minute has.
    for frame in 0..1_500 {
        player.at(Duration::from_millis(20 * frame));
    }
    player.at(Duration::from_seconds(LATEST as f32));
    assert!(player.is_over() && !player.arms_again());
}
