//! The boundary of `wis_wavelets.h`.

pub mod grid;
mod memory;
pub mod sparse;
pub mod table;
pub mod tree;
pub mod triple;
pub mod visibility;

use crate::ffi::{Diagnostic, Failure};

impl Failure {
    /// The same failure, in an array of arrays: the number of the element becomes the column.
    pub(crate) fn in_column(self) -> Failure {
        let Diagnostic { y, .. } = self.diagnostic;
        Failure { diagnostic: Diagnostic { x: y, y: 0, ..self.diagnostic }, ..self }
    }
}
