//! A stranger's program: a sensor of its own behind the stack's trait.

use stampfly_drivers::{Imu, Sample, SensorErrorKind};
use stampfly_types::{GRAVITY, Micros, Vec3, messages::ImuData};
use std::future::Future;

struct Still(Micros);

#[derive(Debug)]
struct Never;

impl stampfly_drivers::SensorError for Never {
    fn kind(&self) -> SensorErrorKind {
        SensorErrorKind::Timeout
    }
}

impl Imu for Still {
    type Error = Never;
    async fn next(&mut self) -> Result<Sample<ImuData>, Never> {
        self.0 = self.0 + Micros(2_500);
        Ok(Sample { at: self.0, data: ImuData { accel: Vec3::new(0.0, 0.0, -GRAVITY), ..Default::default() } })
    }
}

fn main() {
    let mut imu = Still(Micros::ZERO);
    let sample = std::pin::pin!(imu.next());
    let mut context = std::task::Context::from_waker(std::task::Waker::noop());
    assert!(matches!(sample.poll(&mut context), std::task::Poll::Ready(Ok(Sample { at: Micros(2_500), .. }))));
}
