//! Inner loops compiled for the widest vectors of the processor that runs them.

/// Defines a function whose body is compiled once for each instruction set and chosen at run time. It
/// must be a function of its own: code passed in as a closure keeps the baseline instructions. Nothing
/// here fuses or reorders arithmetic, so that the bytes do not depend on the processor.
macro_rules! wide {
    ($(#[$meta:meta])* $visibility:vis fn $name:ident<$($life:lifetime),*>($($arg:ident: $type:ty),* $(,)?) $(-> $result:ty)? $body:block) => {
        $(#[$meta])*
        $visibility fn $name<$($life),*>($($arg: $type),*) $(-> $result)? {
            struct Call<$($life),*> {
                $($arg: $type),*
            }
            impl<$($life),*> pulp::NullaryFnOnce for Call<$($life),*> {
                type Output = wide!(@result $($result)?);
                #[inline(always)]
                fn call(self) -> Self::Output {
                    let Self { $($arg),* } = self;
                    $body
                }
            }
            pulp::Arch::new().dispatch(Call { $($arg),* })
        }
    };
    (@result) => { () };
    (@result $result:ty) => { $result };
}

pub(crate) use wide;
