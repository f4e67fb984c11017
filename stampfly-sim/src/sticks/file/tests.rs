//! Valid and invalid stick files.

use super::*;
use proptest::prelude::*;

const HEADER: &str = "t,throttle,roll,pitch,yaw,mode,arm";

fn rows(lines: &str) -> Result<StickFile, String> {
    StickFile::parse(format!("{HEADER}\n{lines}").as_bytes()).map_err(|error| error.to_string())
}

fn refused(lines: &str) -> String {
    rows(lines).expect_err("a mistake")
}

#[test]
fn columns_come_in_any_order_and_lines_end_as_on_any_system() {
    let unix = "t,throttle,roll,pitch,yaw,mode,arm,kill\n0,-1,0.5,-0.25,1,acro,0,1\n2.5,1,0,0,0,poshold,1,0\n";
    let file = StickFile::parse(unix.as_bytes()).expect("a file");
    let windows = format!("\u{feff}{}", unix.replace('\n', "\r\n").replace("2.5,", "\r\n 2.5 , "));
    assert_eq!(StickFile::parse(windows.as_bytes()).as_ref(), Ok(&file));
    let shuffled = "kill,arm,mode,yaw,pitch,roll,throttle,t\n1,0,acro,1,-0.25,0.5,-1,0\n0,1,poshold,0,0,0,1,2.5";
    assert_eq!(StickFile::parse(shuffled.as_bytes()).as_ref(), Ok(&file));
    let [first, last] = file.rows() else { panic!("{file:?}") };
    let input = first.input;
    assert_eq!([input.throttle, input.roll, input.pitch, input.yaw], [-1.0, 0.5, -0.25, 1.0]);
    assert_eq!((input.mode, input.arm, input.kill), (FlightMode::Acro, false, true));
    assert_eq!((last.at, last.input.mode, last.input.arm), (Duration::from_millis(2_500), FlightMode::PosHold, true));
}

#[test]
fn rows_that_repeat_the_one_above_are_left_out_and_the_end_is_kept() {
    let file = rows("0,0,0,0,0,acro,1\n1,0,0,0,0,acro,1\n2,0,0,0,0,acro,1\n3,0,1,0,0,acro,1\n4,0,1,0,0,acro,1");
    let file = file.expect("a file");
    let seconds: Vec<_> = file.rows().iter().map(|row| row.at.as_millis()).collect();
    assert_eq!(seconds, [0, 3_000, 4_000]);
    assert_eq!(file.spans().map(|(_, span)| span.as_millis()).collect::<Vec<_>>(), [3_000, 1_000, 0]);
    assert_eq!(file.modes(), [FlightMode::Acro]);
}

#[test]
fn every_mistake_is_named_with_its_line() {
    let whole = |text: &str| StickFile::parse(text.as_bytes()).expect_err("a mistake").to_string();
    assert_eq!(whole(""), "the file is empty: its first line names the columns");
    assert_eq!(whole("\n\r\n"), "the file is empty: its first line names the columns");
    assert_eq!(whole(HEADER), "there is no row below the header");
    assert_eq!(whole("t,throttle,roll,pitch,mode,arm\n"), "line 1: column yaw is missing");
    assert_eq!(whole("t,throttle,roll,pitch,yaw,mode,arm,gear\n"), "line 1: column 'gear' is unknown");
    assert_eq!(whole("t,t\n"), "line 1: column t is there twice");
    assert_eq!(refused("0,0,0,0,0,acro\n"), "line 2: 6 fields, and the header has 7");
    assert_eq!(refused("\n0,x,0,0,0,acro,1"), "line 3: throttle: 'x' is no number from -1 to 1");
    assert_eq!(refused("0,0,0,0,0,acro,2"), "line 2: arm: '2' is neither 0 nor 1");
    let modes = "stabilize, acro, althold, poshold";
    assert_eq!(refused("0,0,0,0,0,loiter,1"), format!("line 2: mode: 'loiter' is none of {modes}"));
    assert_eq!(refused("1,0,0,0,0,acro,1\n0.99,0,0,0,0,acro,1"), "line 3: t: 0.99 is before the time of the row above");
    assert_eq!(refused("0,0,0,0,0,acro,1\n2,0,0,0,0,acro,1\n1,0,0,0,0,acro,1").split(':').next(), Some("line 4"));
}

#[test]
fn only_numbers_in_their_ranges_are_numbers() {
    for number in ["NaN", "inf", "-inf", "1.01", "-1.000001", "1e39", "", "0x1", "1,", "--1", "١"] {
        for column in 0..4 {
            let mut fields = ["0"; 4];
            fields[column] = number;
            assert!(refused(&format!("0,{},acro,1", fields.join(","))).starts_with("line 2: "), "{number}");
        }
    }
    for time in ["NaN", "inf", "-0.001", "3600.001", "1e300", ""] {
        assert_eq!(
            refused(&format!("{time},0,0,0,0,acro,1")),
            format!("line 2: t: '{time}' is no number of seconds from 0 to 3600")
        );
    }
    assert!(rows("3600,1,-1,1e-3,-0,acro,1").is_ok());
}

#[test]
fn what_is_too_much_is_refused_before_it_is_read() {
    let long = refused(&format!("0,0,0,0,0,acro,1\n{}", "1".repeat(1 << 20)));
    assert_eq!(long, "line 3: the line is longer than 1000 bytes");
    let header = StickFile::parse("t,".repeat(1 << 19).as_bytes()).expect_err("long");
    assert_eq!((header.line, header.kind), (1, StickErrorKind::LineTooLong));
    let name = "ü".repeat(400);
    let shown = StickFile::parse(name.as_bytes()).expect_err("unknown").to_string();
    assert!(shown.chars().count() < 60, "{shown}");
    let row = |n: usize| format!("{},0,{},0,0,acro,1\n", n / 100, n % 2);
    let many: String = (0..=MOST_ROWS).map(row).collect();
    assert_eq!(refused(&many), format!("line {}: there are more than {MOST_ROWS} rows", MOST_ROWS + 2));
    let held = "0,0,0,0,0,acro,1\n".repeat(MOST_BYTES / 17 + 10);
    // Cut off within a line, as when reading stops at the limit.
    let cut = format!("{HEADER}\n{held}");
    let cut = StickFile::parse(&cut.as_bytes()[..=MOST_BYTES]).expect_err("too large");
    assert_eq!(cut.kind, StickErrorKind::TooLarge, "{cut}");
    assert!(refused(&held).ends_with("the file is larger than 16777216 bytes"), "rows that repeat one count, too");
}

#[test]
fn a_file_that_is_not_there_or_no_file_is_unreadable() {
    for path in ["no/such/file.csv", "."] {
        let error = StickFile::read(Path::new(path)).expect_err("no file");
        assert!(matches!(error, StickError { line: 0, kind: StickErrorKind::Unreadable(_) }), "{error}");
    }
}

prop_compose! {
    fn row()(
        at in 0..3_600_000_000_u64,
        sticks in prop::array::uniform4(-1.0..=1.0_f32),
        mode in 0..4_usize,
        levels in prop::array::uniform4(any::<bool>()),
    ) -> Row {
        let ([throttle, roll, pitch, yaw], [arm, kill, flip, land]) = (sticks, levels);
        let input = PilotInput { roll, pitch, yaw, throttle, mode: MODES[mode].1, arm, kill };
        Row { at: Duration::from_micros(at), input, flip, land }
    }
}

proptest! {
    #[test]
    fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = StickFile::parse(&bytes);
    }

    #[test]
    fn any_line_under_a_header_is_read_or_refused(lines in "[0-9a-z,.\\-\\n\\r \\PC]{0,200}") {
        let _ = rows(&lines);
    }

    #[test]
    fn a_file_with_a_byte_changed_is_read_or_refused(place in 0..200_usize, byte in any::<u8>()) {
        let mut bytes = format!("{HEADER}\n{}", "0.5,-1,0.25,0,-0.5,althold,1\n".repeat(6)).into_bytes();
        let place = place % bytes.len();
        bytes[place] = byte;
        let _ = StickFile::parse(&bytes);
    }

    #[test]
    fn a_file_survives_its_text(mut rows in prop::collection::vec(row(), 1..30)) {
        rows.sort_by_key(|row| row.at);
        rows.dedup_by(|row, above| row.repeats(above));
        let file = StickFile { rows };
        prop_assert_eq!(StickFile::parse(file.to_string().as_bytes()), Ok(file));
    }
}
