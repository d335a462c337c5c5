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
    /// The memory holds no such object, or one that is not finished; or the product was prepared with another environment.
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
    /// All of them by their numbers, each with a sentence.
    const ALL: [(Status, &'static CStr); 15] = [
        (Status::Ok, c"ok"),
        (Status::NullPointer, c"a pointer that must not be null is null"),
        (Status::InvalidArgument, c"an argument or a field is outside its documented range"),
        (Status::InvalidStructSize, c"the size field of a struct is not set to the size of this version"),
        (Status::MemoryTooSmall, c"the memory is shorter than the size query said"),
        (Status::Misaligned, c"a pointer or stride is not aligned as documented"),
        (Status::Overflow, c"the requested sizes or the results overflow"),
        (
            Status::InvalidTexel,
            c"a texel is NaN or infinite: the flag SANITISE of a light replaces it; trees want 0 and more",
        ),
        (
            Status::InvalidTransform,
            c"a matrix is no rotation or reflection, a direction not of unit length, or a tangent along the normal",
        ),
        (Status::Mismatch, c"no such object, one that is not finished, or a product of another environment"),
        (Status::Corrupt, c"the bytes are not a valid object of this version"),
        (Status::ZeroDensity, c"the density of the direction is zero"),
        (Status::CallbackFailed, c"a callback failed or returned an invalid value"),
        (Status::NotBuilt, c"the object was not built, or built without what the call needs"),
        (Status::Unreachable, c"no u of 24 bits leads to the direction"),
    ];

    /// A sentence for a log, in English.
    pub fn message(self) -> &'static CStr {
        Status::ALL.get(self as usize).map_or(c"", |(_, message)| message)
    }

    /// The status with this number.
    pub fn from_code(code: u32) -> Option<Status> {
        Status::ALL.get(code as usize).map(|(status, _)| *status)
    }
}

/// A status other than [`Status::Ok`], and where the fault is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Error {
    /// Other than [`Status::Ok`].
    pub status: Status,
    /// The number of the argument in C, 1 = first; 0: not known.
    pub argument: u32,
    /// The field of the argument's struct, by its name in C.
    pub field: Option<&'static CStr>,
    /// The column of a texel; the number of an element in an inner array.
    pub x: u32,
    /// The row of a texel; the number of an element in an array.
    pub y: u32,
    /// [`Status::MemoryTooSmall`]: the bytes that are needed.
    pub bytes: usize,
}

impl Error {
    /// An argument that is at fault.
    pub const fn new(status: Status, argument: u32) -> Error {
        Error { status, argument, field: None, x: 0, y: 0, bytes: 0 }
    }

    /// A field out of its range.
    pub const fn range(field: &'static CStr) -> Error {
        Error::new(Status::InvalidArgument, 0).of(field)
    }

    /// A field that is no direction, or no matrix.
    pub const fn transform(field: &'static CStr) -> Error {
        Error::new(Status::InvalidTransform, 0).of(field)
    }

    /// A block that is shorter than so many bytes.
    pub const fn too_small(argument: u32, bytes: usize) -> Error {
        Error { bytes, ..Error::new(Status::MemoryTooSmall, argument) }
    }

    /// The same at a field of the struct that the argument points to.
    pub const fn of(self, field: &'static CStr) -> Error {
        Error { field: Some(field), ..self }
    }

    /// The same of another argument.
    pub const fn instead(self, argument: u32) -> Error {
        Error { argument, ..self }
    }

    /// The same of another argument: of `memory` if that is too small, else of `input`.
    pub fn of_build(self, [input, memory]: [u32; 2]) -> Error {
        self.instead(if self.status == Status::MemoryTooSmall { memory } else { input })
    }

    /// The same at a texel.
    pub const fn at(self, x: u32, y: u32) -> Error {
        Error { x, y, ..self }
    }

    /// The same at an element of an array.
    pub fn in_row(self, row: usize) -> Error {
        Error { y: u32::try_from(row).unwrap_or(u32::MAX), ..self }
    }

    /// Checks fields of a struct, each with whether it is in its range.
    ///
    /// # Errors
    /// The first one that is not.
    pub fn first<const N: usize>(fields: [(bool, &'static CStr); N]) -> core::result::Result<(), Error> {
        match fields.into_iter().find(|(holds, _)| !holds) {
            Some((_, field)) => Err(Error::range(field)),
            None => Ok(()),
        }
    }
}

impl From<Status> for Error {
    fn from(status: Status) -> Error {
        Error::new(status, 0)
    }
}

/// `Ok(value)` or a status other than [`Status::Ok`].
pub type Result<T> = core::result::Result<T, Status>;
