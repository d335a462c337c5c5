//! What a call answers, and where the fault is when it cannot do what was asked.

use core::ffi::CStr;

/// The answer of every call that can fail.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Status {
    /// The call did what was asked.
    Ok = 0,
    /// A pointer that must not be null is null.
    NullPointer = 1,
    /// A value is outside the range that its comment states, or a stride is shorter than an element.
    InvalidArgument = 2,
    /// The `size` of a struct is not set, or the header is of another version.
    InvalidStructSize = 3,
    /// The memory is shorter than the size query said.
    MemoryTooSmall = 4,
    /// A pointer or stride is not aligned to what it points to: 16 for blocks, 4 for floats, 2 for 16-bit floats.
    Misaligned = 5,
    /// Sizes overflow or exceed what the format can address, or a result exceeds its type.
    Overflow = 6,
    /// A texel is NaN or infinite (see WIS_ENVIRONMENT_SANITISE); a pixel of a tree also if it is negative.
    InvalidTexel = 7,
    /// A matrix is not a rotation or reflection within 1e-4, a direction is not of unit length within 1e-3, or the tangent
    /// that an anisotropic lobe needs is 0 or parallel to the normal.
    InvalidTransform = 8,
    /// The product was prepared with another environment, or the memory does not hold such an object.
    Mismatch = 9,
    /// Not an object that this version wrote: `field` of the diagnostic is `magic`; null if bytes were changed.
    Corrupt = 10,
    /// The density of that direction is 0: no u leads there.
    ZeroDensity = 11,
    /// A callback failed or returned a value that is NaN, infinite or negative.
    CallbackFailed = 12,
    /// The object was not built, or built without what the call needs (RGB, the compensated distribution).
    NotBuilt = 13,
    /// The density there is above 0, but numbers u of 24 bits do not reach it.
    Unreachable = 14,
}

impl Status {
    /// A sentence for a log, in English.
    pub const fn message(self) -> &'static CStr {
        match self {
            Status::Ok => c"ok",
            Status::NullPointer => c"a pointer that must not be null is null",
            Status::InvalidArgument => c"an argument or a field is outside its documented range",
            Status::InvalidStructSize => c"the size field of a struct is not set to the size of this version",
            Status::MemoryTooSmall => c"the memory is shorter than the size query said",
            Status::Misaligned => c"a pointer or stride is not aligned as documented",
            Status::Overflow => c"the requested sizes or the results overflow",
            Status::InvalidTexel => c"a texel is NaN or infinite: the flag SANITISE of a light replaces it; or a pixel of a tree is negative",
            Status::InvalidTransform => {
                c"a matrix is no rotation or reflection, a direction not of unit length, or a tangent along the normal"
            }
            Status::Mismatch => c"the product was prepared with another environment",
            Status::Corrupt => c"the bytes are not a valid object of this version",
            Status::ZeroDensity => c"the density of the direction is zero",
            Status::CallbackFailed => c"a callback failed or returned an invalid value",
            Status::NotBuilt => c"the object was not built, or built without what the call needs",
            Status::Unreachable => c"no u of 24 bits leads to the direction",
        }
    }
}

impl Status {
    /// The status with this number.
    pub fn from_code(code: u32) -> Option<Status> {
        const ALL: [Status; 15] = [
            Status::Ok,
            Status::NullPointer,
            Status::InvalidArgument,
            Status::InvalidStructSize,
            Status::MemoryTooSmall,
            Status::Misaligned,
            Status::Overflow,
            Status::InvalidTexel,
            Status::InvalidTransform,
            Status::Mismatch,
            Status::Corrupt,
            Status::ZeroDensity,
            Status::CallbackFailed,
            Status::NotBuilt,
            Status::Unreachable,
        ];
        ALL.get(code as usize).copied()
    }
}

/// What is wrong with a field of a struct.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Other than [`Status::Ok`].
    pub status: Status,
    /// The field's name in C.
    pub field: &'static CStr,
}

impl Fault {
    /// A field out of its range.
    pub const fn range(field: &'static CStr) -> Fault {
        Fault { status: Status::InvalidArgument, field }
    }

    /// Checks fields, each with whether it is in its range.
    ///
    /// # Errors
    /// The first one that is not.
    pub fn first<const N: usize>(fields: [(bool, &'static CStr); N]) -> core::result::Result<(), Fault> {
        match fields.into_iter().find(|(holds, _)| !holds) {
            Some((_, field)) => Err(Fault::range(field)),
            None => Ok(()),
        }
    }

    /// A field that is no direction, or no matrix.
    pub const fn transform(field: &'static CStr) -> Fault {
        Fault { status: Status::InvalidTransform, field }
    }
}

/// `Ok(value)` or a status other than [`Status::Ok`].
pub type Result<T> = core::result::Result<T, Status>;
