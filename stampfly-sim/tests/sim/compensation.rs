//! Bosch's compensation formulas, implemented for the tests independently of drivers and emulators.

/// Temperature, °C, and pressure, Pa, by the 64-bit integer formula.
pub fn bmp280(calibration: &[u8; 24], data: &[u8; 6]) -> (f64, f64) {
    let unsigned = |n: usize| i64::from(u16::from_le_bytes([calibration[2 * n], calibration[2 * n + 1]]));
    let signed = |n: usize| i64::from(i16::from_le_bytes([calibration[2 * n], calibration[2 * n + 1]]));
    let adc = |at: usize| i64::from(data[at]) << 12 | i64::from(data[at + 1]) << 4 | i64::from(data[at + 2]) >> 4;
    let (adc_p, adc_t) = (adc(0), adc(3));
    let (t1, t2, t3, p1) = (unsigned(0), signed(1), signed(2), unsigned(3));
    let p = |n: usize| signed(n + 2);
    let linear = (((adc_t >> 3) - (t1 << 1)) * t2) >> 11;
    let square = (((((adc_t >> 4) - t1) * ((adc_t >> 4) - t1)) >> 12) * t3) >> 14;
    let fine = linear + square;
    let x = fine - 128_000;
    let offset = x * x * p(6) + ((x * p(5)) << 17) + (p(4) << 35);
    let slope = ((x * x * p(3)) >> 8) + ((x * p(2)) << 12);
    let slope = (((1 << 47) + slope) * p1) >> 33;
    let y = (((1_048_576 - adc_p) << 31) - offset) * 3_125 / slope;
    let corrections = ((p(9) * (y >> 13) * (y >> 13)) >> 25) + ((p(8) * y) >> 19);
    let pressure = ((y + corrections) >> 8) + (p(7) << 4);
    (((fine * 5 + 128) >> 8) as f64 / 100.0, pressure as f64 / 256.0)
}

/// Field in µT, chip axes.
pub fn bmm150(trim: &[u8; 21], data: &[u8; 8]) -> [f64; 3] {
    let short = |register: usize| f64::from(trim[register - 0x5D] as i8);
    let signed = |register: usize| f64::from(i16::from_le_bytes([trim[register - 0x5D], trim[register - 0x5C]]));
    let unsigned = |register: usize| f64::from(u16::from_le_bytes([trim[register - 0x5D], trim[register - 0x5C]]));
    let word = |place: usize| i16::from_le_bytes([data[place], data[place + 1]]);
    let hall = f64::from(word(6) as u16 >> 2);
    let xyz1 = unsigned(0x6C);
    let turn = xyz1 * 16_384.0 / hall - 16_384.0;
    let gain = short(0x70) * turn * turn / 268_435_456.0 + turn * f64::from(trim[0x71 - 0x5D]) / 16_384.0;
    let flat = |raw: i16, one: f64, two: f64| {
        (f64::from(raw >> 3) * ((gain + 256.0) * (two + 160.0)) / 8_192.0 + one * 8.0) / 16.0
    };
    let upright = (f64::from(word(4) >> 1) - signed(0x62)) * 131_072.0 - signed(0x6E) * (hall - xyz1);
    [
        flat(word(0), short(0x5D), short(0x64)),
        flat(word(2), short(0x5E), short(0x65)),
        upright / ((signed(0x68) + unsigned(0x6A) * hall / 32_768.0) * 4.0) / 16.0,
    ]
}
