//! The table of keys: everything that a project file may hold. A key stands once, beside the field that holds it, with
//! its unit, range, default and meaning. The check of a project, the comments in a saved file, ranges, units and help of
//! the window's forms, `hapdef keys` and the reference page are made from it, so that they cannot disagree; a key more is
//! one entry more. (After rust-analyzer's `config_data!`.)

use super::key::Key;
use super::value::{BadValue, Value};

/// A table of a project file, with the values of its keys.
pub trait KeyTable {
    /// What stands in its brackets.
    fn name(&self) -> &'static str;

    /// Shows each key with its value, in the order of the file.
    fn each(&self, see: &mut dyn FnMut(&'static Key, &dyn Value));

    /// Its keys, in the order of the file.
    fn keys() -> Vec<&'static Key>
    where
        Self: Sized;

    /// Holds each value against the range of its key.
    ///
    /// # Errors
    /// [`BadValue`] for the first that cannot be used.
    fn obeys(&self) -> Result<(), BadValue> {
        let mut found = Ok(());
        self.each(&mut |key, value| {
            if found.is_ok() {
                found = value.obeys(key);
            }
        });
        found
    }
}

/// Defines the struct of a table by its keys: field, type, default, unit, range and meaning. What stands behind `with` are
/// tables and lists of tables within it. The forms without defaults are of tables that only a project gives, and of
/// structs that are defined elsewhere.
macro_rules! keys {
    (
        $(#[$meta:meta])*
        pub struct $name:ident in $table:literal {
            $( $(#[$attribute:meta])* $field:ident: $type:ty = $default:expr, $unit:literal, $range:expr, $help:literal; )*
        }
        $(with { $( $(#[$inner_attribute:meta])* $inner:ident: $inner_type:ty = $inner_default:expr; )* })?
    ) => {
        $(#[$meta])*
        pub struct $name {
            $( #[doc = $help] $(#[$attribute])* pub $field: $type, )*
            $( $( $(#[$inner_attribute])* pub $inner: $inner_type, )* )?
        }

        impl Default for $name {
            fn default() -> Self {
                Self {
                    $( $field: $default, )*
                    $( $( $inner: $inner_default, )* )?
                }
            }
        }

        $crate::project::keys::keys! { $name in $table { $( $field, $unit, $range, $help; )* } }
    };
    (
        $(#[$meta:meta])*
        pub struct $name:ident in $table:literal {
            $( $(#[$attribute:meta])* $field:ident: $type:ty, $unit:literal, $range:expr, $help:literal; )*
        }
        $(with { $( $(#[$inner_attribute:meta])* $inner:ident: $inner_type:ty; )* })?
    ) => {
        $(#[$meta])*
        pub struct $name {
            $( #[doc = $help] $(#[$attribute])* pub $field: $type, )*
            $( $( $(#[$inner_attribute])* pub $inner: $inner_type, )* )?
        }

        $crate::project::keys::keys! { $name in $table { $( $field, $unit, $range, $help; )* } }
    };
    ($name:ident in $table:literal { $( $field:ident, $unit:literal, $range:expr, $help:literal; )* }) => {
        impl $name {
            $(
                #[doc = concat!("The key `", $table, ".", stringify!($field), "`.")]
                #[must_use]
                pub fn $field() -> &'static $crate::project::key::Key {
                    static KEY: $crate::project::key::Key = $crate::project::key::Key {
                        path: concat!($table, ".", stringify!($field)),
                        unit: $unit,
                        range: $range,
                        help: $help,
                    };
                    &KEY
                }
            )*
        }

        impl $crate::project::keys::KeyTable for $name {
            fn name(&self) -> &'static str {
                $table
            }

            fn each(
                &self,
                see: &mut dyn FnMut(
                    &'static $crate::project::key::Key,
                    &dyn $crate::project::value::Value,
                ),
            ) {
                $( see(Self::$field(), &self.$field); )*
            }

            fn keys() -> Vec<&'static $crate::project::key::Key> {
                vec![$( Self::$field() ),*]
            }
        }
    };
}
pub(super) use keys;
