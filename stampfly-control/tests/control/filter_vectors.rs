//! Filters against vectors computed independently in double precision.

use serde_json::Value;
use stampfly_control::filter::{BiquadChain, BiquadCoefficients, LowPass};

fn vectors() -> Value {
    serde_json::from_str(include_str!("../vectors/filters.json")).expect("valid JSON")
}

fn numbers(value: &Value) -> Vec<f32> {
    value.as_array().expect("array").iter().map(|v| v.as_f64().expect("number") as f32).collect()
}

fn number(value: &Value) -> f32 {
    value.as_f64().expect("number") as f32
}

fn assert_close(ours: f32, theirs: f32, what: &str) {
    let tolerance = number(&vectors()["tolerance_f32"]);
    assert!((ours - theirs).abs() <= tolerance * theirs.abs().max(1.0), "{what}: {ours} against {theirs}");
}

#[test]
fn first_order_coefficients_and_step() {
    let vectors = vectors();
    for case in vectors["ema_alpha"].as_array().expect("cases") {
        let filter = LowPass::with_corner(number(&case["fc"]), number(&case["fs"])).expect("possible");
        let expected = number(&case["alpha"]);
        assert!((filter.alpha() / expected - 1.0).abs() < 1e-5, "alpha {} against {expected}", filter.alpha());
    }
    let mut filter = LowPass::with_corner(100.0, 4000.0).expect("possible");
    for expected in numbers(&vectors["ema_step_100_4000"]) {
        assert_close(filter.step(1.0), expected, "step response");
    }
}

#[test]
fn second_order_coefficients() {
    for case in vectors()["biquad"].as_array().expect("cases") {
        let design =
            BiquadCoefficients::low_pass(number(&case["fc"]), number(&case["fs"]), BiquadCoefficients::BUTTERWORTH)
                .expect("possible");
        for (ours, theirs) in design.b.iter().zip(numbers(&case["b"])) {
            assert!((ours / theirs - 1.0).abs() < 1e-5, "b {ours} against {theirs}");
        }
        for (ours, theirs) in design.a.iter().zip(numbers(&case["a"]).into_iter().skip(1)) {
            assert_close(*ours, theirs, "a");
        }
    }
}

#[test]
fn two_stages_step_and_impulse() {
    let vectors = vectors();
    let design = BiquadCoefficients::low_pass(75.0, 4000.0, BiquadCoefficients::BUTTERWORTH).expect("possible");
    let mut chain: BiquadChain<f32, 2> = BiquadChain::new(design);
    let response: Vec<f32> = (0..400).map(|_| chain.step(1.0)).collect();
    for (index, expected) in vectors["biquad2_step_75_4000"].as_object().expect("samples") {
        assert_close(response[index.parse::<usize>().expect("index")], number(expected), "step response");
    }
    let mut chain: BiquadChain<f32, 2> = BiquadChain::new(design);
    for (n, expected) in numbers(&vectors["biquad2_impulse_75_4000"]).into_iter().enumerate() {
        assert_close(chain.step(if n == 0 { 1.0 } else { 0.0 }), expected, "impulse response");
    }
}
