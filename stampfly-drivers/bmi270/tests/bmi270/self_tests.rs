//! The self tests of accelerometer and gyroscope.

use super::chip::{BLOB, bench, driver};
use stampfly_bmi270::{Bmi270, Config};
use stampfly_driver_core::blocking::block_on;
use stampfly_driver_core::chip::{AxisMap, ChipError};
use stampfly_driver_core::{Imu, Timebase};
use stampfly_driver_fakes::closure::{AXES, Access, SpiBus};
use stampfly_types::Duration;

#[test]
fn the_self_test_tells_masses_that_move_from_masses_that_do_not() {
    let (clock, chip) = bench();
    let mut imu = driver(&clock, &chip, Config::default());
    assert_eq!(block_on(imu.self_test()), Ok(()));
    block_on(imu.next()).expect("set up again");
    let shared = chip.clone();
    let stuck = SpiBus {
        clock: clock.clone(),
        chip: move |access: Access<'_>| match access {
            Access::Write(0x6D, _) => Ok(()),
            other => shared.borrow_mut().access(other),
        },
    };
    let outcome = {
        chip.borrow_mut().registers[0x0C..0x12].fill(0);
        block_on(Bmi270::spi(stuck, clock.clone(), &BLOB, AxisMap::IDENTITY, Config::default()).self_test())
    };
    assert_eq!(outcome, Err(ChipError::SelfTest));
}

#[test]
fn the_gyroscopes_self_test_is_started_awaited_and_given_up() {
    for (axes, status, ends, outcome) in [
        (0x0F, 0x00, true, Ok(())),
        (0x0F, 0x07, true, Ok(())),
        (0x0D, 0x00, true, Err(ChipError::SelfTest)),
        (0x01, 0x00, true, Err(ChipError::SelfTest)),
        (0x00, 0x00, true, Err(ChipError::SelfTest)),
        (0x0F, 0x08, true, Err(ChipError::SelfTest)),
        (0x0F, 0x00, false, Err(ChipError::SelfTest)),
    ] {
        let (clock, chip) = bench();
        chip.borrow_mut().registers[0x6E] = axes;
        chip.borrow_mut().registers[0x38] = status;
        let (shared, time, mut asked) = (chip.clone(), clock.clone(), None);
        let bus = SpiBus {
            clock: clock.clone(),
            chip: move |access: Access<'_>| {
                let mut chip = shared.borrow_mut();
                if let Access::Read(0x69, _) = access {
                    let command = chip.writes.last().expect("writes");
                    assert_eq!((command.0, &command.1[..]), (0x7E, &[0x02][..]));
                    // A third of a second.
                    let begun = *asked.get_or_insert(time.now());
                    if ends && time.now().since(begun) > Duration::from_millis(333) {
                        chip.registers[0x69] = 0;
                    }
                }
                chip.access(access)
            },
        };
        let mut imu = Bmi270::spi(bus, clock.clone(), &BLOB, AXES, Config::default());
        let begun = clock.now();
        assert_eq!(block_on(imu.gyro_self_test()), outcome, "{axes:#04x} {status:#04x}");
        let took = clock.now().since(begun);
        assert!(took < Duration::from_millis(2_200) && took > Duration::from_millis(333), "{took}");
        let writes = chip.borrow().writes.clone();
        let test: Vec<(u8, &[u8])> = writes.iter().map(|write| (write.0, &write.1[..])).collect();
        let expected: [(u8, &[u8]); 5] =
            [(0x69, &[0x04]), (0x7D, &[0x04]), (0x2F, &[1]), (0x32, &[0, 0]), (0x7E, &[0x02])];
        assert!(test.windows(5).any(|five| five == expected), "{test:02x?}");
        chip.borrow_mut().registers[0x69] = 0;
        block_on(imu.next()).expect("set up again");
    }
}
