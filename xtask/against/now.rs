use stampfly_control::Airframe;
use stampfly_types::Instant;

const HELD: [bool; 3] = [false; 3];
const HOVER: f32 = 4.9;
const VOLTAGE: f32 = 7.4;

fn parts() -> (RateConfig, MultirotorMixer, MotorConfig) {
    let airframe = Airframe::EXAMPLE;
    let mixer = MultirotorMixer::for_airframe(&airframe).expect("it flies");
    (RateConfig::for_airframe(&airframe), mixer, MotorConfig::for_airframe(&airframe))
}

fn at(micros: u64) -> Instant {
    Instant::from_micros(micros)
}
