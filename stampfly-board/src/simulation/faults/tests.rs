use super::*;
use crate::messages::TelemetryFrame;
use stampfly_types::messages::{BaroData, FlowData, GuidedCommand, ImuData, MagData, PilotInput, PowerData, TofData};
use std::collections::BTreeSet;
use std::format;

#[test]
fn every_row_acts_somewhere_and_has_a_name_of_its_own() {
    let names: BTreeSet<_> = FAULTS.iter().map(|kind| kind.name).collect();
    assert_eq!(names.len(), FAULTS.len());
    for kind in FAULTS {
        let fault = Fault::parse(&format!("{}@hover", kind.name), FAULTS).expect(kind.name);
        assert!(!acts(&fault).is_empty(), "{}", kind.name);
        assert!(kind.expected.may_be_acceptable());
        if let (Some(default), Some([low, high])) = (kind.value.default(), kind.value.range()) {
            assert!((low..=high).contains(&default), "{}", kind.name);
        }
    }
    let faults: Vec<_> =
        FAULTS.iter().filter_map(|kind| Fault::parse(&format!("{}@1", kind.name), FAULTS).ok()).collect();
    assert_eq!(faults.len(), FAULTS.len());
    // A line panics when a field does not exist.
    let wrong = Wrong::new(&faults, Instant::ZERO, 1);
    let _ = wrong.line::<ImuData>(Id::sensor_imu);
    let _ = wrong.line::<TofData>(Id::sensor_tof);
    let _ = wrong.line::<FlowData>(Id::sensor_flow);
    let _ = wrong.line::<MagData>(Id::sensor_mag);
    let _ = wrong.line::<BaroData>(Id::sensor_baro);
    let _ = wrong.line::<PowerData>(Id::sensor_power);
    let _ = wrong.line::<PilotInput>(Id::command_pilot);
    let _ = wrong.line::<GuidedCommand>(Id::command_guided);
    let _ = wrong.line::<TelemetryFrame>(Id::telemetry);
}
