//! The two tables. The grammar is here, the expansion in `stampfly-bus-macros`.

/// Declares the topics of a vehicle, in a module of their own.
///
/// ```text
/// topics! {
///     outside participant, participant;
///
///     /// Documentation.
///     name: Message = latest | ring(N) | queue(N) @ 400 Hz | on event from publisher => [reader, reader];
/// }
/// ```
///
/// Participants are runnables, or `outside`: drivers, links, motors. Rates are in `Hz` or `kHz` and may be fractions
/// (`0.5 Hz`, `1/3 Hz`); depths are powers of two, written as a number or a constant.
///
/// | generated | what it is |
/// |---|---|
/// | `Bus` | the storage of every topic: a value; implements [`TopicTable`](crate::TopicTable) |
/// | `Bus::split` | hands out every end once: `runnables`, `outside`, the log's `taps` |
/// | `EstimationEnds<'b>` | the ends of participant `estimation`, one field per topic, named by topic |
/// | `Ends<'b>`, `Outside<'b>` | the ends of all runnables, and of everybody outside; `Ends::estimation` makes those of a runnable for an activation |
/// | `SensorImuTx<'b>`, `SensorImuRx<'b>` | names for the types of a topic's ends |
/// | `TOPICS`, `Id`, `COUNT` | the table as data |
///
/// A runnable reads through inputs ([`NewestInput`](crate::NewestInput), [`SamplesInput`](crate::SamplesInput)), a
/// participant outside through a [`Subscriber`](crate::Subscriber). All publish through a [`Publisher`](crate::Publisher), or
/// through a [`NewestOutput`](crate::NewestOutput) with the same methods, where runnables read the newest sample of a runnable.
///
/// ```
/// mod topics {
///     use stampfly_types::messages::{ImuData, TofData};
///
///     stampfly_bus::topics! {
///         outside imu, tof, display;
///
///         /// Inertial sample.
///         sensor_imu: ImuData = ring(16) @ 400 Hz from imu => [estimation];
///         /// Range to the ground.
///         sensor_tof: TofData = latest @ 30 Hz from tof => [estimation, display];
///     }
/// }
///
/// use stampfly_bus::{Activation, ReadInputs, Split};
/// use stampfly_types::{Instant, messages::{ImuData, TofData}};
///
/// let mut bus = topics::Bus::new();
/// let Split { mut runnables, outside, .. } = bus.split(None);
/// let topics::Outside { mut imu, mut tof, mut display } = outside;
///
/// imu.sensor_imu.publish(Instant::from_micros(2_500), &ImuData::default());
/// tof.sensor_tof.publish(Instant::from_micros(2_000), &TofData { distance: 0.4, valid: true, ..Default::default() });
/// assert_eq!(display.sensor_tof.latest().unwrap().data.distance, 0.4);
///
/// let mut ends = runnables.estimation();
/// ends.read(&mut Activation::live(0, Instant::from_micros(2_500)));
/// assert_eq!(ends.sensor_imu.len(), 1);
/// assert_eq!(ends.sensor_tof.get().distance, 0.4);
/// ```
///
/// Publishing from two places, reading without being named and forgetting a participant do not compile.
#[macro_export]
macro_rules! topics {
    ($($table:tt)*) => { $crate::__topics! { $crate $($table)* } };
}

/// Declares what runs when, in a module of its own.
///
/// ```text
/// schedule! {
///     /// Documentation, and derives, of the struct of all runnables.
///     #[derive(Clone)]
///     pub struct Runnables on path::to::topics from Config;
///
///     /// Documentation.
///     name = Type: on topic | topic, flight, 300 us;
///     name = Type: after name or at latest 5 ms, flight, 40 us;
///     name = Type: every 20 ms, background, 80 us;
/// }
/// ```
///
/// A line's name is that of a participant in the topic table; every participant that is not outside has a line. `Type`
/// implements [`Runnable`](crate::Runnable) with that participant's ends, and has a constructor `new(&Config)`. Times are
/// in `us`, `ms` or `s`. The flight band runs in the table's order, so `after` names a line above.
///
/// | generated | what it is |
/// |---|---|
/// | `Runnables` | one field per line; implements [`Schedule`](crate::Schedule) |
/// | `ACTIVATIONS`, `Id`, `COUNT` | the table as data |
/// | `RESPONSE_TIMES` | how long after its trigger each line has published at the latest |
///
/// A line that could not finish before it is due again (see [`response_time`](crate::response_time)) does not compile.
///
/// ```
/// mod topics {
///     use stampfly_types::messages::{ControlOutput, TofData};
///     stampfly_bus::topics! {
///         outside tof, motors;
///         /// Range to the ground.
///         sensor_tof: TofData = latest @ 30 Hz from tof => [control];
///         /// Thrust and torque.
///         control_output: ControlOutput = latest @ 30 Hz from control => [motors];
///     }
/// }
///
/// use stampfly_bus::{Activation, Runnable, schedule};
/// use stampfly_types::messages::ControlOutput;
///
/// /// Holds a height.
/// #[derive(Clone)]
/// pub struct Control { height: f32 }
///
/// impl Control {
///     fn new(height: &f32) -> Self { Self { height: *height } }
/// }
///
/// impl Runnable for Control {
///     type Ends<'b> = topics::ControlEnds<'b>;
///
///     fn run(&mut self, activation: &mut Activation, ends: &mut Self::Ends<'_>) {
///         let thrust = 0.4 + self.height - ends.sensor_tof.get().distance;
///         ends.control_output.publish(activation.now(), &ControlOutput { thrust, ..Default::default() });
///     }
/// }
///
/// schedule! {
///     /// Every runnable.
///     #[derive(Clone)]
///     pub struct Runnables on crate::topics from f32;
///
///     /// Holds the height.
///     control = Control: on sensor_tof or at latest 50 ms, flight, 100 us;
/// }
/// # fn main() { assert_eq!(ACTIVATIONS[0].name, "control"); }
/// ```
#[macro_export]
macro_rules! schedule {
    ($($table:tt)*) => { $crate::__schedule! { $crate $($table)* } };
}
