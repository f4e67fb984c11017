//! `stages!`: the list of a mode's stages, or of a vehicle's modes.

/// Lists the stages of a mode: an enum of their names, and an enum of their memories.
///
/// ```text
/// stages! {
///     /// The names.
///     pub enum Name for Mode {
///         /// What it does.
///         First: FirstStage,
///     }
///     /// The current one, with what it remembers.
///     pub enum Memory;
/// }
/// ```
///
/// Names are `Copy` and `Eq`. A memory is `Clone`, `Debug` and `PartialEq`, so the stages have to be; further derives can be
/// written above it. In the list of a vehicle's modes, the type of a mode `Landing` is [`Active<Landing>`](crate::stage::Active).
#[macro_export]
macro_rules! stages {
    (
        $(#[$names:meta])*
        $name_visibility:vis enum $Name:ident for $Mode:ty {
            $($(#[$doc:meta])* $Stage:ident: $Type:ty),+ $(,)?
        }
        $(#[$memories:meta])*
        $memory_visibility:vis enum $Memory:ident;
    ) => {
        $(#[$names])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        $name_visibility enum $Name {
            $($(#[$doc])* $Stage),+
        }

        $(#[$memories])*
        #[derive(Clone, Debug, PartialEq)]
        $memory_visibility enum $Memory {
            $($(#[$doc])* $Stage($Type)),+
        }

        impl $crate::stage::Stages<$Mode> for $Name {
            type Memory = $Memory;

            fn name(memory: &$Memory) -> Self {
                match memory {
                    $($Memory::$Stage(_) => Self::$Stage),+
                }
            }

            fn enter(
                self,
                mode: &mut $Mode,
                now: $crate::stage::Instant,
                input: &$crate::stage::Input<'_, $Mode>,
            ) -> $Memory {
                match self {
                    $(Self::$Stage => {
                        $Memory::$Stage(<$Type as $crate::stage::Stage<$Mode>>::enter(mode, now, input))
                    })+
                }
            }

            fn limit(memory: &$Memory, mode: &$Mode) -> $crate::stage::Limit<$Mode> {
                match memory {
                    $($Memory::$Stage(stage) => $crate::stage::Stage::limit(stage, mode)),+
                }
            }

            fn execute(
                memory: &mut $Memory,
                mode: &mut $Mode,
                now: $crate::stage::Instant,
                input: &$crate::stage::Input<'_, $Mode>,
            ) -> $crate::stage::Step<$Mode> {
                match memory {
                    $($Memory::$Stage(stage) => $crate::stage::Stage::execute(stage, mode, now, input)),+
                }
            }

            fn exit(
                memory: &mut $Memory,
                mode: &mut $Mode,
                now: $crate::stage::Instant,
                input: &$crate::stage::Input<'_, $Mode>,
            ) {
                match memory {
                    $($Memory::$Stage(stage) => $crate::stage::Stage::<$Mode>::exit(stage, mode, now, input)),+
                }
            }

            fn describe(memory: &$Memory, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                match memory {
                    $($Memory::$Stage(stage) => $crate::stage::Stage::<$Mode>::describe(stage, f)),+
                }
            }
        }
    };
}
