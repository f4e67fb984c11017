use stampfly_types::Micros;

const HELD: bool = false;
const HOVER: f32 = 0.36;
const VOLTAGE: f32 = 3.7;

fn parts() -> (RateConfig, MultirotorMixer, MotorConfig) {
    (RateConfig::default(), MultirotorMixer::stampfly(), MotorConfig::default())
}

fn at(micros: u64) -> Micros {
    Micros(micros)
}
