//! What a vehicle takes: the messages that are for it, out of the two hundred of the dialect.
//!
//! The dialect's own enum has room for its longest message, and its reader a stack frame for all of them: kilobytes that a microcontroller does not have. What is not
//! in this list is passed over.

use super::unreadable::Unreadable;
use stampfly_link::mavlink::dialects::common::*;
use stampfly_link::mavlink::{MavlinkFrame, MessageData};

macro_rules! heard {
    ($($Data:ident => $Name:ident),+ $(,)?) => {
        /// A message that is for a vehicle.
        pub(super) enum Heard {
            /// Whatever it says of its sender.
            Heartbeat,
            $($Name($Data),)+
        }

        impl Heard {
            /// Reads one. `None` when a vehicle has nothing to say to it, an error when it cannot be read and wants an answer all the same.
            pub fn read(frame: &MavlinkFrame<'_>) -> Option<Result<Self, Unreadable>> {
                let read = match frame.id {
                    HEARTBEAT_DATA::ID => return Some(Ok(Self::Heartbeat)),
                    $($Data::ID => $Data::deser(frame.version, frame.payload).map(Self::$Name),)+
                    _ => return None,
                };
                match read {
                    Ok(heard) => Some(Ok(heard)),
                    Err(_) => Unreadable::of(frame.id, frame.payload).map(Err),
                }
            }
        }
    };
}

heard! {
    COMMAND_INT_DATA => CommandInt,
    COMMAND_LONG_DATA => CommandLong,
    LOG_REQUEST_LIST_DATA => LogRequestList,
    MANUAL_CONTROL_DATA => ManualControl,
    MISSION_ACK_DATA => MissionAck,
    MISSION_CLEAR_ALL_DATA => MissionClearAll,
    MISSION_COUNT_DATA => MissionCount,
    MISSION_ITEM_DATA => MissionItem,
    MISSION_ITEM_INT_DATA => MissionItemInt,
    MISSION_REQUEST_DATA => MissionRequest,
    MISSION_REQUEST_INT_DATA => MissionRequestInt,
    MISSION_REQUEST_LIST_DATA => MissionRequestList,
    MISSION_REQUEST_PARTIAL_LIST_DATA => MissionRequestPartialList,
    MISSION_SET_CURRENT_DATA => MissionSetCurrent,
    MISSION_WRITE_PARTIAL_LIST_DATA => MissionWritePartialList,
    PARAM_REQUEST_LIST_DATA => ParamRequestList,
    PARAM_REQUEST_READ_DATA => ParamRequestRead,
    PARAM_SET_DATA => ParamSet,
    PING_DATA => Ping,
    RC_CHANNELS_OVERRIDE_DATA => RcChannelsOverride,
    SET_ATTITUDE_TARGET_DATA => SetAttitudeTarget,
    SET_GPS_GLOBAL_ORIGIN_DATA => SetGpsGlobalOrigin,
    SET_MODE_DATA => SetMode,
    SET_POSITION_TARGET_GLOBAL_INT_DATA => SetPositionTargetGlobalInt,
    SET_POSITION_TARGET_LOCAL_NED_DATA => SetPositionTargetLocalNed,
    TIMESYNC_DATA => Timesync,
}
