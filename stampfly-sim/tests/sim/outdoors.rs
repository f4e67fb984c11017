//! Readings of an aeroplane's sensors compared with the truth, and the response of its servos.

use nalgebra::Vector3;
use stampfly_drivers::{Airspeed, Barometer, Gnss, Imu, Magnetometer, MotorOutputs, Sample, ServoOutputs};
use stampfly_sim::plant::{Aeroplane, AeroplaneParameters, Body, Plant, RotorFault, SURFACES, Surface, WindConfig};
use stampfly_sim::sensors::{AirspeedModel, GnssConfig, GnssModel, ServoModel};
use stampfly_sim::time::block_on;
use stampfly_sim::vehicle::Options;
use stampfly_sim::{Simulation, SimulationConfig};
use stampfly_types::messages::{GnssData, GnssFix, MotorOutput, ServoOutput};
use stampfly_types::{Instant, Origin, Vec3, math};

const ORIGIN: Origin = Origin { latitude: 365_440_000, longitude: 1_367_050_000, altitude: 30_000 };
const PERFECT: AeroplaneParameters =
    AeroplaneParameters { manufacturing_spread: 0.0, propeller_spin: 0.0, ..AeroplaneParameters::EXAMPLE };

fn standing() -> SimulationConfig<AeroplaneParameters> {
    SimulationConfig {
        wind: WindConfig::CALM,
        pose: Some(PERFECT.standing([100.0, -50.0], 0.7)),
        ..SimulationConfig::new(PERFECT)
    }
}

/// Steady flight at 12 m/s to the north, 50 m high.
fn flying(wind: WindConfig) -> Simulation {
    let trim = Aeroplane::trim(&PERFECT, 12.0, 0.0).expect("flies");
    let simulation =
        Simulation::new(&SimulationConfig { wind, pose: Some(trim.pose(50.0, 0.0)), ..SimulationConfig::new(PERFECT) });
    simulation.world.change(Instant::ZERO, |plane: &mut Aeroplane| plane.settle(&trim));
    simulation
}

fn fixes(simulation: &Simulation, config: &GnssConfig, count: usize) -> Vec<Sample<GnssData>> {
    let mut gnss = GnssModel::new(&simulation.world, &simulation.clock, 5, config);
    block_on(&simulation.clock, async {
        let mut fixes = Vec::new();
        for _ in 0..count {
            let Ok(sample) = gnss.next().await;
            let age = sample.age(simulation.clock.now()).seconds_f64();
            assert!((age - config.delay).abs() < 0.006, "{age} s late");
            fixes.push(sample);
        }
        fixes
    })
}

fn deviation(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn the_first_fix_takes_some_seconds_and_comes_without_a_height() {
    let simulation = Simulation::new(&standing());
    let fixes = fixes(&simulation, &GnssConfig::m8(ORIGIN), 60);
    let first = |fix| fixes.iter().find(|sample| sample.data.fix == fix).expect("comes").at.as_micros() as f64 * 1e-6;
    assert_eq!(first(GnssFix::None), fixes[0].at.as_micros() as f64 * 1e-6);
    assert!((4.0..4.21).contains(&first(GnssFix::TwoDimensional)), "{}", first(GnssFix::TwoDimensional));
    assert!((5.0..5.21).contains(&first(GnssFix::ThreeDimensional)), "{}", first(GnssFix::ThreeDimensional));
    assert!(fixes[0].data.satellites == 0 && fixes[59].data.satellites == 14);
}

#[test]
fn the_error_of_a_fix_wanders_as_far_as_it_says_and_each_has_some_of_its_own() {
    // A short correlation time, so that the full wander is observed.
    let config = GnssConfig { correlation: 2.0, first_fix: 0.0, rate: 10.0, ..GnssConfig::m8(ORIGIN) };
    let simulation = Simulation::new(&standing());
    let fixes = fixes(&simulation, &config, 20_000);
    let places: Vec<Vector3<f64>> = fixes
        .iter()
        .map(|Sample { data, .. }| {
            let [north, east] = ORIGIN.local(data.latitude, data.longitude);
            Vector3::new(north - 100.0, east + 50.0, ORIGIN.down(data.altitude) + 0.2238).cast()
        })
        .collect();
    for axis in 0..3 {
        let said = if axis < 2 { fixes[9].data.horizontal_accuracy } else { fixes[9].data.vertical_accuracy };
        let seen = deviation(places.iter().map(|place| place[axis]));
        assert!((seen / f64::from(said) - 1.0).abs() < 0.1, "axis {axis}: {seen} m, {said} m said");
        // Two fixes differ by their white noise and by the wander between them.
        let (wander, own) = if axis < 2 { (1.2, 0.15) } else { (2.0, 0.3) };
        let expected = (2.0 * (own * own + wander * wander * (1.0 - (-0.05f64).exp()))).sqrt();
        let steps = deviation(places.windows(2).map(|pair| pair[1][axis] - pair[0][axis]));
        assert!((steps / expected - 1.0).abs() < 0.05, "axis {axis}: {steps} m, expected {expected} m");
    }
    let speed = deviation(fixes.iter().map(|sample| f64::from(sample.data.velocity.x)));
    assert!((speed / 0.06 - 1.0).abs() < 0.05, "{speed} m/s");
}

#[test]
fn a_fix_is_where_the_aeroplane_was_and_ten_a_second_overlap() {
    let simulation = flying(WindConfig::CALM);
    let config = GnssConfig {
        wander: [0.0; 2],
        noise: [0.0; 2],
        speed_noise: 0.0,
        first_fix: 0.0,
        rate: 10.0,
        ..GnssConfig::m8(ORIGIN)
    };
    let fixes = fixes(&simulation, &config, 100);
    // The same flight again, for the truth at these instants.
    let truth = flying(WindConfig::CALM).world;
    for pair in fixes.windows(2) {
        assert_eq!(pair[1].at.since(pair[0].at).as_micros(), 100_000, "none is missed");
        let [north, _] = ORIGIN.local(pair[1].data.latitude, pair[1].data.longitude);
        let way = truth.motion_at(pair[1].at).position.x;
        // 10⁻⁷ degrees is 11 mm.
        assert!((f64::from(north) - way).abs() < 0.012, "{north} m after {way} m");
    }
    assert!((fixes[10].data.velocity.x - 12.0).abs() < 0.05 && (fixes[10].data.altitude - 80.0).abs() < 0.1);
}

#[test]
fn whoever_asks_late_misses_fixes() {
    let simulation = flying(WindConfig::CALM);
    let mut gnss = GnssModel::new(&simulation.world, &simulation.clock, 5, &GnssConfig::m8(ORIGIN));
    block_on(&simulation.clock, async {
        let Ok(first) = gnss.next().await;
        simulation.clock.sleep_until(Instant::from_secs(3)).await;
        let Ok(next) = gnss.next().await;
        assert!(next.at.since(first.at).as_micros() > 2_500_000 && next.at > Instant::from_millis(2_930));
    });
}

#[test]
fn the_tube_measures_the_wind_ahead_with_its_errors() {
    let wind = WindConfig { mean: Vec3::new(-3.0, 2.0, 0.0), gust: 0.0, ..WindConfig::CALM };
    let simulation = flying(WindConfig::CALM);
    let mut tube = AirspeedModel::new(&simulation.world, &simulation.clock, 3);
    let (offset, scale) = tube.errors();
    let mean = |tube: &mut AirspeedModel, simulation: &Simulation| {
        block_on(&simulation.clock, async {
            let mut sum = 0.0;
            for _ in 0..100 {
                let Ok(sample) = tube.next().await;
                sum += f64::from(sample.data.pressure) / 100.0;
            }
            sum
        })
    };
    // 12 m/s at an angle of attack, of which the tube measures the cosine.
    let alpha = Aeroplane::trim(&PERFECT, 12.0, 0.0).expect("flies").alpha;
    let dynamic = 0.5 * 1.225 * (12.0 * alpha.cos()).powi(2);
    let seen = mean(&mut tube, &simulation);
    assert!((seen - (dynamic * scale + offset)).abs() < 1.0, "{seen} Pa of {dynamic} Pa");

    // At rest with wind from behind: negative.
    let pose = Some(PERFECT.standing([0.0; 2], core::f64::consts::PI));
    let simulation = Simulation::new(&SimulationConfig { wind, pose, ..standing() });
    let mut tube = AirspeedModel::new(&simulation.world, &simulation.clock, 3);
    let share = 0.2238 / (0.2238 + 0.3);
    let expected = -0.5 * 1.225 * (3.0f64 * share).powi(2) * scale + offset;
    let seen = mean(&mut tube, &simulation);
    assert!((seen - expected).abs() < 0.15, "{seen} Pa, expected {expected} Pa");
    let specimens: Vec<_> =
        (0..50).map(|seed| AirspeedModel::new(&simulation.world, &simulation.clock, seed).errors()).collect();
    assert!(specimens.iter().all(|(_, scale)| (scale - 1.0).abs() <= 0.03));
    assert!((0.35..0.65).contains(&deviation(specimens.iter().map(|(offset, _)| *offset))));
}

#[test]
fn servos_take_what_is_finite_and_exists() {
    let Simulation { clock, world, .. } = Simulation::new(&standing());
    let all = [Surface::RightAileron, Surface::LeftAileron, Surface::Elevator, Surface::Rudder, Surface::Flaps];
    let mut servos = ServoModel::new(&world, &clock, &all);
    let deflection = [2.0, -0.3, f32::NAN, 0.4, 1.0, 1.0, 1.0, 1.0];
    let Ok(()) = servos.write(&ServoOutput { deflection, count: 4 });
    world.advance_to(Instant::from_secs(1));
    let shares = world.inspect_as(|plane: &Aeroplane| plane.surfaces()).expect("an aeroplane");
    let expected: [f64; SURFACES] = [1.0, -0.3, 0.0, 0.4, 0.0, 0.0];
    assert!(shares.iter().zip(expected).all(|(share, expected)| (share - expected).abs() < 1e-3), "{shares:?}");

    // A quadrotor has no surfaces.
    let Simulation { clock, world, .. } = Simulation::new(&SimulationConfig::example());
    let Ok(()) = ServoModel::new(&world, &clock, &all).write(&ServoOutput { deflection, count: 4 });
    world.advance_to(Instant::from_millis(10));
    assert!(world.inspect_as(|plane: &Aeroplane| plane.surfaces()).is_none());
    assert!(world.inspect_as(|plant: &Plant| plant.ground().contact()).is_some_and(|contact| contact));
}

#[test]
fn throttle_vibration_compass_and_barometer_work_in_an_aeroplane() {
    let config = SimulationConfig { seed: 2, ..standing() };
    let mut simulation = Simulation::new(&config);
    simulation.world = simulation.world.clone().with_field([20.0, 0.0, 45.0]);
    let compass = Simulation::new(&config);
    let field = |mut simulation: Simulation| {
        block_on(&simulation.clock.clone(), async {
            let Ok(sample) = simulation.sensors.mag.next().await;
            sample.data.field - simulation.sensors.mag.hard_iron()
        })
    };
    // Kanazawa's field, rotated by the heading of 0.7 rad.
    let seen = field(compass);
    let (sin, cos) = (math::sin(0.7), math::cos(0.7));
    assert!((seen.x - (30.8 * cos - 4.3 * sin)).abs() < 3.0 && (seen.z - 36.4).abs() < 3.0, "{seen:?}");

    let clock = simulation.clock.clone();
    block_on(&clock, async {
        let output = MotorOutput { duty: [0.3; 8], count: 1, armed: true, ..Default::default() };
        let Ok(()) = simulation.sensors.motors.write(&output);
        clock.sleep_until(Instant::from_millis(500)).await;
        let Ok(shaken) = simulation.sensors.imu.next().await;
        assert!(shaken.data.accel.z < -3.0);
        let Ok(sample) = simulation.sensors.baro.next().await;
        assert!((sample.data.pressure - 101_000.0).abs() < 250.0, "{:?}", sample.data);
    });
    let speed = simulation.truth().rotor_speed;
    assert!(speed[0] > 100.0 && speed[1..] == [0.0; 3], "{speed:?}");
    simulation.world.set_rotor_fault(clock.now(), 0, RotorFault { duty: Some(0.0), ..RotorFault::NONE });
    simulation.world.advance_to(Instant::from_secs(5));
    assert!(simulation.world.inspect(|body| body.motion().rotor_speed[0]) < 1.0, "the motor has failed");
}

#[test]
fn options_name_the_aeroplanes_numbers() {
    let mut config = standing();
    let options = Options {
        plant: vec!["mass=0.6".into(), "yaw_beta=0.1".into()],
        wind: Some([3.0, -1.0]),
        gust: Some(1.0),
        ..Options::default()
    };
    options.change(&mut config).expect("good options");
    assert_eq!((config.plant.mass, config.plant.yaw_beta, config.wind.mean.x), (0.6, 0.1, 3.0));
    let error = Options { plant: vec!["rotor_offset=0.1".into()], ..Options::default() }.change(&mut config);
    assert!(error.is_err_and(|text| text.contains("rotor_offset")));
}

#[test]
fn the_same_seed_gives_the_same_bits() {
    let fly = |seed| {
        let trim = Aeroplane::trim(&PERFECT, 12.0, 0.0).expect("flies");
        let pose = trim.pose(50.0, 0.0);
        let mut plane = Aeroplane::new(&AeroplaneParameters::EXAMPLE, &WindConfig::MEADOW, Some(&pose), seed);
        plane.settle(&trim);
        (0..8000).for_each(|_| Body::step(&mut plane));
        *plane.motion()
    };
    assert_eq!(fly(4), fly(4));
    assert_ne!(fly(4), fly(5));
}
