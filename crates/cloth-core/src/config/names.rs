//! Settings that are chosen by name.

/// Gives an enum `ALL`, `name`, `Display` and `FromStr`.
macro_rules! names {
    ($type:ty, $what:literal, $($value:path => $name:literal),+) => {
        impl $type {
            /// All of them.
            pub const ALL: &[Self] = &[$($value),+];

            /// Its name on the command line and in scene files.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $($value => $name),+
                }
            }
        }

        impl std::str::FromStr for $type {
            type Err = String;

            fn from_str(name: &str) -> Result<Self, String> {
                Self::ALL.iter().copied().find(|value| value.name() == name).ok_or_else(|| {
                    let names: Vec<_> = Self::ALL.iter().map(|value| value.name()).collect();
                    format!("unknown {} {name:?}: use {}", $what, names.join(" or "))
                })
            }
        }

        impl std::fmt::Display for $type {
            fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                formatter.write_str(self.name())
            }
        }
    };
}

pub(super) use names;
