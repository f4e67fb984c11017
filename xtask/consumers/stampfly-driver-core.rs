//! A stranger's program: a sensor of its own behind the stack's trait.

use stampfly_driver_core::{Imu, Sample, SensorErrorKind};
use stampfly_types::{Duration, GRAVITY, Instant, Vec3, messages::ImuData};
use std::future::Future;

struct Still(Instant);

#[derive(Debug)]
struct Never;

impl stampfly_driver_core::SensorError for Never {
    fn kind(&self) -> SensorErrorKind {
        SensorErrorKind::Timeout
    }
}

impl Imu for Still {
    type Error = Never;
    async fn next(&mut self) -> Result<Sample<ImuData>, Never> {
        self.0 += Duration::from_micros(2_500);
        Ok(Sample { at: self.0, data: ImuData { accel: Vec3::new(0.0, 0.0, -GRAVITY), ..Default::default() } })
    }
}

fn main() {
    let mut imu = Still(Instant::ZERO);
    let sample = std::pin::pin!(imu.next());
    let mut context = std::task::Context::from_waker(std::task::Waker::noop());
    let std::task::Poll::Ready(Ok(Sample { at, .. })) = sample.poll(&mut context) else { panic!("it has a sample at once") };
    assert_eq!(at, Instant::from_micros(2_500));
}
