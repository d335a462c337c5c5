//! Laws of the release library, through its C interface. Modules, so that no program is built for them.

mod density;
mod unbiased;
