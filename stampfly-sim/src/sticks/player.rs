//! Plays a stick file as a transmitter sends it.

use super::file::{Row, StickFile};
use stampfly_types::Duration;
use stampfly_types::messages::PilotInput;

/// Content of one transmitter frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Sticks and switches. The kill switch is on if any row since the last frame had it on.
    pub input: PilotInput,
    /// A row since the last frame requests a flip.
    pub flip: bool,
    /// A row since the last frame requests a landing.
    pub land: bool,
}

/// Plays a file frame by frame. Events in rows between two frames are not lost.
///
/// ```
/// use stampfly_sim::sticks::{Player, StickFile};
/// use stampfly_types::Duration;
/// let text = "t,throttle,roll,pitch,yaw,mode,arm,land\n1,0,0,0,0,poshold,1,0\n1.01,0,0,0,0,poshold,1,1\n1.03,0,0,1,0,poshold,1,0";
/// let file = StickFile::parse(text.as_bytes())?;
/// let mut player = Player::new(&file);
/// let mut frame = |millis| player.at(Duration::from_millis(millis));
/// assert!(!frame(980).input.arm, "before the first row every switch is off");
/// assert!(!frame(1_000).land && frame(1_020).land && !frame(1_040).land);
/// assert!(player.is_over());
/// # Ok::<(), stampfly_sim::sticks::StickError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Player<'f> {
    rows: &'f [Row],
    next: usize,
    held: Row,
}

impl<'f> Player<'f> {
    /// Starts at the beginning of the file. Until the first row, its sticks are sent with all
    /// switches off.
    #[must_use]
    pub fn new(file: &'f StickFile) -> Self {
        let input = PilotInput { arm: false, kill: false, ..file.first().input };
        Self { rows: file.rows(), next: 0, held: Row { input, ..Row::default() } }
    }

    /// The frame at this time since the beginning of the file. Call it with ascending times.
    pub fn at(&mut self, time: Duration) -> Frame {
        let mut frame = Frame { input: self.held.input, flip: false, land: false };
        let mut kill = false;
        while let Some(row) = self.rows.get(self.next).filter(|row| row.at <= time) {
            // Rising edges between two frames are collected, so that a short pulse is not lost.
            frame.flip |= row.flip && !self.held.flip;
            frame.land |= row.land && !self.held.land;
            kill |= row.input.kill;
            self.held = *row;
            self.next += 1;
        }
        frame.input = PilotInput { kill: kill || self.held.input.kill, ..self.held.input };
        frame
    }

    /// True when the last row has been sent.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.next >= self.rows.len()
    }

    /// True if a later row turns the arm switch on.
    #[must_use]
    pub fn arms_again(&self) -> bool {
        let mut before = self.held.input.arm;
        self.rows.iter().skip(self.next).any(|row| {
            let rises = row.input.arm && !before;
            before = row.input.arm;
            rises
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_shorter_than_a_frame_is_not_lost() {
        let text = "t,throttle,roll,pitch,yaw,mode,arm,kill,flip\n0,0,0,0,0,acro,1,0,0\n0.025,0,0,0,0,acro,1,1,1\n0.03,0,0,0,0,acro,0,0,0\n0.1,0,0,0,0,acro,1,0,0";
        let file = StickFile::parse(text.as_bytes()).expect("a file");
        let mut player = Player::new(&file);
        let frames: Vec<_> = (0..5).map(|n| player.at(Duration::from_millis(20 * n))).collect();
        assert_eq!(frames.iter().map(|frame| frame.input.kill).collect::<Vec<_>>(), [false, false, true, false, false]);
        assert_eq!(frames.iter().filter(|frame| frame.flip).count(), 1);
        assert!(player.arms_again() && !player.is_over());
        assert!(player.at(Duration::from_secs(1)).input.arm && player.is_over() && !player.arms_again());
    }
}
