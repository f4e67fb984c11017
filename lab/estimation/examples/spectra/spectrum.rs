//! Power spectral density after Welch (1967): Hann windows, half overlapping, averaged.

use core::f64::consts::TAU;

const LENGTH: usize = 512;

/// One-sided power spectral density.
pub struct Spectrum {
    step: f64,
    density: Vec<f64>,
}

impl Spectrum {
    /// (frequency, amplitude density) from the second line on; the first is the mean.
    pub fn amplitudes(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.density.iter().enumerate().skip(1).map(|(line, density)| (line as f64 * self.step, density.sqrt()))
    }

    /// Root mean square amplitude density between two frequencies.
    pub fn level(&self, low: f64, high: f64) -> f64 {
        let lines = self.amplitudes().filter(|(frequency, _)| (low..high).contains(frequency));
        let (sum, count) = lines.fold((0.0, 0.0), |(sum, count), (_, a)| (sum + a * a, count + 1.0));
        (sum / count).sqrt()
    }
}

pub fn welch(samples: &[f64], rate: f64) -> Spectrum {
    let window: Vec<f64> = (0..LENGTH).map(|n| 0.5 - 0.5 * (TAU * n as f64 / LENGTH as f64).cos()).collect();
    let energy: f64 = window.iter().map(|w| w * w).sum();
    let mut density = vec![0.0; LENGTH / 2 + 1];
    let starts: Vec<usize> = (0..=samples.len().saturating_sub(LENGTH)).step_by(LENGTH / 2).collect();
    for start in &starts {
        let part = &samples[*start..start + LENGTH];
        let mean = part.iter().sum::<f64>() / LENGTH as f64;
        let mut line: Vec<(f64, f64)> = part.iter().zip(&window).map(|(x, w)| ((x - mean) * w, 0.0)).collect();
        transform(&mut line);
        for (sum, (re, im)) in density.iter_mut().zip(&line) {
            *sum += 2.0 * (re * re + im * im) / (energy * rate * starts.len() as f64);
        }
    }
    Spectrum { step: rate / LENGTH as f64, density }
}

/// Fast Fourier transform, recursive, length a power of two.
fn transform(line: &mut [(f64, f64)]) {
    let n = line.len();
    if n < 2 {
        return;
    }
    let mut even: Vec<_> = line.iter().copied().step_by(2).collect();
    let mut odd: Vec<_> = line.iter().copied().skip(1).step_by(2).collect();
    transform(&mut even);
    transform(&mut odd);
    for k in 0..n / 2 {
        let (sin, cos) = (-TAU * k as f64 / n as f64).sin_cos();
        let (re, im) = odd[k];
        let turned = (re * cos - im * sin, re * sin + im * cos);
        line[k] = (even[k].0 + turned.0, even[k].1 + turned.1);
        line[k + n / 2] = (even[k].0 - turned.0, even[k].1 - turned.1);
    }
}
