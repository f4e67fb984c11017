//! Declaring the parameters of a plant: a struct of `f64`, one constant of it, and its table for
//! [`stampfly_param`].

macro_rules! parameters {
    (
        $(#[$meta:meta])* $Name:ident, $(#[$example_meta:meta])* $EXAMPLE:ident {
            $($field:ident = $example:literal [$unit:literal] in $low:literal ..= $high:literal, $meaning:literal;)*
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $Name {
            $(#[doc = concat!($meaning, " Unit: ", $unit, ".")] pub $field: f64,)*
        }

        impl $Name {
            $(#[$example_meta])*
            pub const $EXAMPLE: Self = Self { $($field: $example),* };
        }

        stampfly_param::parameters! {
            impl $Name: f64 { $(#[doc = $meaning] $field in [$low, $high] $unit;)* }
        }
    };
}

pub(crate) use parameters;
