//! Which pin does what: the only file that knows.
//!
//! The first table is the StampFly's, as its schematic has it. Its traps: pins 43 and 44 belong to UART 0, so the
//! console is on USB; both chip selects of the one SPI bus must be high before the first transfer; pin 0 held low at
//! reset starts the downloader; pins 39 to 42 belong to the debugger's port until they are taken.
//!
//! The second table is of no board. It gives every function a pin of an ESP32-C6, so that the code around it can be
//! compiled, linked and made into an image where there is no Xtensa compiler.

#[cfg(feature = "esp32s3")]
esp_hal::assign_resources! {
    /// Pins of the StampFly.
    pub Pins<'d> {
        /// Gates of the motors' transistors, 10 kΩ to ground each.
        motors: MotorPins<'d> {
            front_right: GPIO42,
            rear_right: GPIO41,
            rear_left: GPIO10,
            front_left: GPIO5,
        },
        /// Inertial sensor and flow sensor.
        spi: SpiPins<'d> {
            clock: GPIO44,
            to_chips: GPIO14,
            from_chips: GPIO43,
            imu_select: GPIO46,
            imu_ready: GPIO11,
            flow_select: GPIO12,
        },
        /// Magnetometer, barometer, battery monitor, range finders.
        i2c: I2cPins<'d> {
            data: GPIO3,
            clock: GPIO4,
        },
        /// Range finders sleep while theirs is low.
        range: RangePins<'d> {
            bottom_enable: GPIO7,
            front_enable: GPIO9,
        },
        /// What people see, hear and press.
        people: PeoplePins<'d> {
            status_light: GPIO21,
            /// Switches the supply of the status light on boards with a Stamp-S3A (StampFly v1.1); not connected on v1.0.
            status_light_supply: GPIO38,
            body_lights: GPIO39,
            buzzer: GPIO40,
            button: GPIO0,
        },
    }
}

#[cfg(feature = "esp32c6")]
esp_hal::assign_resources! {
    /// Stand-ins.
    pub Pins<'d> {
        motors: MotorPins<'d> {
            front_right: GPIO0,
            rear_right: GPIO1,
            rear_left: GPIO2,
            front_left: GPIO3,
        },
        spi: SpiPins<'d> {
            clock: GPIO4,
            to_chips: GPIO5,
            from_chips: GPIO6,
            imu_select: GPIO7,
            imu_ready: GPIO22,
            flow_select: GPIO8,
        },
        i2c: I2cPins<'d> {
            data: GPIO10,
            clock: GPIO11,
        },
        range: RangePins<'d> {
            bottom_enable: GPIO15,
            front_enable: GPIO18,
        },
        people: PeoplePins<'d> {
            status_light: GPIO19,
            status_light_supply: GPIO23,
            body_lights: GPIO20,
            buzzer: GPIO21,
            button: GPIO9,
        },
    }
}

/// With `--cfg wrong_pin` this must not compile: the S3 has no such pin. `cargo xtask esp32` looks.
#[cfg(wrong_pin)]
const _: fn(esp_hal::peripherals::Peripherals) = |chip| drop(chip.GPIO22);
