//! Model of a LiHV battery: cells in series.
//!
//! Terminal voltage = open-circuit voltage of the state of charge − instantaneous resistance ×
//! current − polarisation, which follows the current with one time constant. Temperature and ageing
//! change the parameters, see `wear.rs`.
//!
//! Battery and motors form one circuit: the motors' current depends on the voltage, and the voltage
//! on their current. [`Battery::under`] solves it exactly. Using the voltage of the previous step
//! instead oscillates as soon as resistance times conductance of the motors exceeds one, which is
//! 0.21 Ω for a StampFly.

/// Open-circuit voltage of a LiHV cell at 0, 10, …, 100 % of charge, V (typical discharge curve at
/// rest).
const OPEN_CIRCUIT: [f64; 11] = [3.20, 3.58, 3.67, 3.72, 3.76, 3.81, 3.88, 3.97, 4.08, 4.20, 4.35];

/// Parameters of a battery.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BatterySpec {
    /// Number of cells in series.
    pub cells: f64,
    /// State of charge at the start, 0 to 1.
    pub charge: f64,
    /// Capacity, A·h.
    pub capacity: f64,
    /// Instantaneous resistance, Ω.
    pub resistance: f64,
    /// Resistance of the polarisation, Ω.
    pub polarisation: f64,
    /// Time constant of the polarisation, s.
    pub time_constant: f64,
}

impl BatterySpec {
    /// A generic full cell of 1 A·h.
    pub const CELL: Self =
        Self { cells: 1.0, charge: 1.0, capacity: 1.0, resistance: 0.02, polarisation: 0.01, time_constant: 10.0 };
}

/// A load whose current grows linearly with voltage and is zero below a threshold: a turning motor.
///
/// ```
/// use stampfly_sim::plant::{Battery, BatterySpec, Load};
/// let battery = Battery::new(&BatterySpec { resistance: 0.5, ..BatterySpec::CELL }, 0.0);
/// // A motor of 0.5 Ω with a back-EMF of 2 V: battery and motor share the difference equally.
/// let motor = Load { conductance: 2.0, back: 4.0 };
/// let voltage = battery.under(0.0, &[motor]);
/// assert!((voltage - 0.5 * (4.35 + 2.0)).abs() < 1e-9);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// Conductance, A/V.
    pub conductance: f64,
    /// Current subtracted because of the back-EMF, A.
    pub back: f64,
}

impl Load {
    /// Load of a motor with this duty cycle, winding resistance, Ω, and back-EMF, V. Current flows
    /// during the share `duty` of the time, so the conductance has `duty` squared.
    pub(super) fn of_motor(duty: f64, resistance: f64, own: f64) -> Self {
        let share = duty / resistance;
        Self { conductance: duty * share, back: share * own }
    }

    /// Battery current at a terminal voltage, A.
    #[must_use]
    pub fn current(&self, voltage: f64) -> f64 {
        (self.conductance * voltage - self.back).max(0.0)
    }
}

/// A battery with its state.
///
/// ```
/// use stampfly_sim::plant::{Battery, BatterySpec};
/// let mut battery = Battery::new(&BatterySpec { cells: 3.0, ..BatterySpec::CELL }, 0.2);
/// let rested = battery.voltage();
/// battery.step(1.0, 5.0);
/// assert!(battery.voltage() < rested);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Battery {
    /// Charge drawn since the start, C.
    drawn: f64,
    current: f64,
    polarisation: f64,
    voltage: f64,
    /// Open-circuit voltage at the present state of charge.
    open_circuit: f64,
    cells: f64,
    initial: f64,
    capacity: f64,
    resistance: f64,
    slow_resistance: f64,
    time_constant: f64,
}

impl Battery {
    /// A full cell from which no current is drawn: the default of vehicles without a battery model.
    pub const UNUSED: Self = {
        let BatterySpec { cells, charge, capacity, resistance, polarisation, time_constant } = BatterySpec::CELL;
        Self {
            drawn: 0.0,
            current: 0.0,
            polarisation: 0.0,
            voltage: cells * OPEN_CIRCUIT[10],
            open_circuit: cells * OPEN_CIRCUIT[10],
            cells,
            initial: charge,
            capacity: capacity * 3600.0,
            resistance,
            slow_resistance: polarisation,
            time_constant,
        }
    };

    /// A battery that already delivers `current`, A.
    #[must_use]
    pub fn new(spec: &BatterySpec, current: f64) -> Self {
        let mut battery = Self {
            drawn: 0.0,
            current: 0.0,
            polarisation: 0.0,
            voltage: 0.0,
            open_circuit: 0.0,
            cells: spec.cells,
            initial: spec.charge,
            capacity: spec.capacity * 3600.0,
            resistance: spec.resistance,
            slow_resistance: spec.polarisation,
            time_constant: spec.time_constant,
        };
        battery.step(0.0, current);
        battery
    }

    /// Terminal voltage, V, at which the loads and a constant `idle` current, A, draw what the
    /// battery delivers.
    #[must_use]
    pub fn under(&self, idle: f64, loads: &[Load]) -> f64 {
        let source = self.open_circuit - self.polarisation - self.resistance * idle;
        let (mut voltage, mut drew) = (source, usize::MAX);
        // The circuit is linear for the loads that conduct. Dropping loads that do not conduct
        // lowers the voltage, so a dropped load never returns: the count stays the same after at
        // most one pass per load, and the loop ends.
        loop {
            let drawing = loads.iter().filter(|load| load.conductance * voltage > load.back);
            let (count, conductance, back) = drawing
                .fold((0, 0.0, 0.0), |(count, sum, back), load| (count + 1, sum + load.conductance, back + load.back));
            if count >= drew {
                break;
            }
            drew = count;
            voltage = (source + self.resistance * back) / (1.0 + self.resistance * conductance);
        }
        voltage.max(0.0)
    }

    /// Draws `current`, A, for `dt`, s.
    pub fn step(&mut self, dt: f64, current: f64) {
        self.current = current;
        self.drawn += current * dt;
        // Explicit Euler: a step is far shorter than the time constant.
        self.polarisation += (current * self.slow_resistance - self.polarisation) * (dt / self.time_constant);
        self.open_circuit = self.at_rest();
        self.voltage = (self.open_circuit - current * self.resistance - self.polarisation).max(0.0);
    }

    /// Terminal voltage under the present load, V.
    #[must_use]
    pub fn voltage(&self) -> f64 {
        self.voltage
    }

    /// Present current, A.
    #[must_use]
    pub fn current(&self) -> f64 {
        self.current
    }

    /// Charge drawn since the start, C.
    #[must_use]
    pub fn drawn(&self) -> f64 {
        self.drawn
    }

    /// State of charge, 0 to 1.
    #[must_use]
    pub fn charge(&self) -> f64 {
        (self.initial - self.drawn / self.capacity).max(0.0)
    }

    /// Open-circuit voltage at the present state of charge, V.
    #[must_use]
    pub fn open_circuit(&self) -> f64 {
        self.open_circuit
    }

    /// Open-circuit voltage from the discharge curve, linear between its points.
    fn at_rest(&self) -> f64 {
        // Ten intervals of 10 % each; the index is limited for a full cell.
        let position = self.charge().min(1.0) * 10.0;
        let below = (position as usize).min(9);
        let (low, high) = (OPEN_CIRCUIT[below], OPEN_CIRCUIT[below + 1]);
        self.cells * (low + (high - low) * (position - below as f64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPEC: BatterySpec = BatterySpec {
        cells: 1.0,
        charge: 1.0,
        capacity: 0.35,
        resistance: 0.05,
        polarisation: 0.02,
        time_constant: 10.0,
    };

    #[test]
    fn voltage_sags_at_once_then_slowly_and_comes_back() {
        let (at_once, slowly) = (4.0 * SPEC.resistance, 4.0 * SPEC.polarisation);
        let mut battery = Battery::new(&SPEC, 0.0);
        assert_eq!(battery.voltage(), 4.35);
        battery.step(0.001, 4.0);
        assert!((battery.voltage() - (4.35 - at_once)).abs() < 1e-3, "{}", battery.voltage());
        for _ in 0..30_000 {
            battery.step(0.001, 4.0);
        }
        let sag = battery.open_circuit() - battery.voltage();
        assert!((sag - at_once - slowly * (1.0 - (-3f64).exp())).abs() < 1e-3, "{sag}");
        for _ in 0..100_000 {
            battery.step(0.001, 0.0);
        }
        assert!((battery.voltage() - battery.open_circuit()).abs() < 1e-4);
        assert!((battery.drawn() - 4.0 * 30.001).abs() < 1e-6);
    }

    #[test]
    fn battery_and_loads_are_one_circuit() {
        for (resistance, duty) in [(0.0, 1.0), (0.06, 0.6), (0.28, 1.0), (1.0, 1.0)] {
            let battery = Battery::new(&BatterySpec { resistance, ..SPEC }, 0.0);
            // Duties at rest, at low speed, at high speed, and one whose back-EMF exceeds the
            // battery voltage.
            let loads = [0.0, 1.0, 2.0, 5.0].map(|own| Load::of_motor(duty, 0.76, own));
            let voltage = battery.under(0.15, &loads);
            let current = 0.15 + loads.iter().map(|load| load.current(voltage)).sum::<f64>();
            assert!(
                (battery.open_circuit() - resistance * current - voltage).abs() < 1e-9,
                "{resistance} Ω: {voltage}"
            );
            assert_eq!(loads[3].current(voltage), 0.0);
        }
        let short = Battery::new(&SPEC, 0.0).under(200.0, &[]);
        assert_eq!(short, 0.0, "a battery gives no negative voltage");
    }

    #[test]
    fn an_empty_battery_stays_empty() {
        let mut battery = Battery::new(&BatterySpec { charge: 0.01, ..SPEC }, 0.2);
        for _ in 0..1_000 {
            battery.step(1.0, 4.0);
        }
        assert_eq!(battery.charge(), 0.0);
        assert_eq!(battery.open_circuit(), OPEN_CIRCUIT[0]);
    }

    #[test]
    fn the_unused_one_is_a_new_one() {
        assert_eq!(Battery::UNUSED, Battery::new(&BatterySpec::CELL, 0.0));
    }

    #[test]
    fn cells_add_up() {
        let battery = Battery::new(&BatterySpec { cells: 3.0, ..SPEC }, 0.0);
        assert!((battery.voltage() - 3.0 * 4.35).abs() < 1e-9);
    }
}
