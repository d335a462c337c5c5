//! Numbers of any width: one `f32`, or as many as a register holds. A kernel that is generic over [`Num`] is written once; a call
//! for one element runs it at width 1, a batch at the width of the machine, with the same bits.

use crate::numeric;
use core::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Sub};

/// Numbers that stand side by side in what is stored, and partial sums of a sum: a whole number of registers of any width.
pub const GROUP: usize = 8;

/// The most registers of a group.
pub const REGISTERS: usize = 2;

/// A computation on numbers of one kind that runs as a function of its own: what many kernels share, or few calls reach. Cold
/// code costs as much as cold tables, so it pays to have it once. What it calls must be inlined into it to be fast.
pub trait Apart<F> {
    /// What it answers.
    type Output;
    /// Computes.
    fn run(self) -> Self::Output;
}

/// A closure runs as it is. On registers that only some processors have it must be a type of its own, whose `run` is inlined: the
/// compiler may leave a closure to the baseline's instructions.
impl<F, T, C: FnOnce() -> T> Apart<F> for C {
    type Output = T;

    #[inline(always)]
    fn run(self) -> T {
        self()
    }
}

/// Runs a computation in a function of its own.
#[inline(never)]
pub(super) fn apart<F, K: Apart<F>>(computation: K) -> K::Output {
    computation.run()
}

/// A whole number of 32 bits for each lane; sums and products wrap.
pub trait Whole:
    Copy
    + Add<Output = Self>
    + Mul<Output = Self>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + BitXor<Output = Self>
    + 'static
{
    /// The same number in all lanes.
    fn splat(x: u32) -> Self;
    /// Moved up by so many bits.
    fn shl<const N: i32>(self) -> Self;
    /// Moved down by so many bits.
    fn shr<const N: i32>(self) -> Self;
    /// The bits from the other end.
    fn reverse_bits(self) -> Self;
}

/// One number, or one for each lane.
pub trait Num:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f32, Output = Self>
    + Sub<f32, Output = Self>
    + Mul<f32, Output = Self>
    + Div<f32, Output = Self>
    + 'static
{
    /// How many numbers stand side by side.
    const WIDTH: usize;
    /// A truth value for each lane.
    type Mask: Copy;
    /// A whole number for each lane, to compute with.
    type Whole: Whole;
    /// The numbers as an array.
    type Floats: Copy + Default + AsRef<[f32]> + AsMut<[f32]> + for<'a> TryFrom<&'a [f32]>;
    /// Whole numbers as an array.
    type Ints: Copy + Default + AsRef<[u32]> + AsMut<[u32]> + for<'a> TryFrom<&'a [u32]>;

    /// The same number in all lanes.
    fn splat(x: f32) -> Self;
    /// The numbers of an array.
    fn load(lanes: Self::Floats) -> Self;
    /// The numbers as an array.
    fn store(self) -> Self::Floats;
    /// The square root.
    fn sqrt(self) -> Self;
    /// The number without its sign.
    fn abs(self) -> Self;
    /// The number with the sign of another.
    fn copysign(self, sign: Self) -> Self;
    /// The smaller of two, by comparison; `b` if either is NaN.
    fn min(self, b: Self) -> Self;
    /// The larger of two, by comparison; `b` if either is NaN.
    fn max(self, b: Self) -> Self;
    /// self < b.
    fn lt(self, b: Self) -> Self::Mask;
    /// self <= b.
    fn le(self, b: Self) -> Self::Mask;
    /// `a` where the mask is set, elsewhere `b`.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// Both.
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Either.
    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// The lanes of a mask as bits, lane 0 lowest.
    fn bits(mask: Self::Mask) -> u32;
    /// The whole numbers of an array.
    fn whole(ints: Self::Ints) -> Self::Whole;
    /// Whole numbers as an array.
    fn ints_of(whole: Self::Whole) -> Self::Ints;
    /// The bits of the numbers.
    fn to_bits(self) -> Self::Whole;
    /// The numbers with these bits.
    fn from_bits(bits: Self::Whole) -> Self;
    /// The whole numbers below 2^31 in front of the fractions of numbers from 0 on; of others, anything.
    fn to_whole(self) -> Self::Whole;
    /// The numbers nearest to whole numbers below 2^31.
    fn of_whole(whole: Self::Whole) -> Self;
    /// The highest bits of whole numbers, lane 0 lowest.
    fn sign_bits(whole: Self::Whole) -> u32;
    /// Columns of the rows with these numbers, of lane i in lane i; zeros if one of them does not exist.
    fn rows(table: &[[f32; 4]], index: Self::Whole) -> [Self; 4];
    /// The pairs of 16 bits that begin at these places, the first one lower; zeros if one of them does not exist.
    #[inline(always)]
    fn pairs(table: &[u16], index: Self::Whole) -> Self::Whole {
        let (inside, places) = (all_below::<Self>(index, table.len().saturating_sub(1)), Self::ints_of(index));
        let pair = |place: u32| table.get(place as usize..).and_then(|rest| rest.first_chunk::<2>()).filter(|_| inside);
        let of = |lane: usize| places.as_ref().get(lane).and_then(|&place| pair(place));
        Self::whole(Self::each_int(|lane| of(lane).map_or(0, |&[a, b]| u32::from(a) | u32::from(b) << 16)))
    }

    /// The numbers of the lanes: 0, 1, 2 ...
    #[inline(always)]
    fn counted() -> Self::Whole {
        Self::whole(Self::each_int(|lane| lane as u32))
    }

    /// In each four lanes the sum of the first, of the first two, of three and of four; of one number, itself.
    fn sums(self) -> Self;
    /// In each four lanes 0 and the first three; of one number, 0.
    fn up(self) -> Self;

    /// The first numbers of a slice; zeros if it is too short.
    #[inline(always)]
    fn read(numbers: &[f32]) -> Self {
        Self::load(numbers.get(..Self::WIDTH).and_then(|numbers| numbers.try_into().ok()).unwrap_or_default())
    }

    /// The first numbers of a slice of short ones; zeros if it is too short.
    #[inline(always)]
    fn shorts(numbers: &[i16]) -> Self {
        let numbers = numbers.get(..Self::WIDTH).unwrap_or(&[]);
        Self::each(|lane| numbers.get(lane).map_or(0.0, |&x| x.into()))
    }

    /// The first whole numbers of a slice; zeros if it is too short.
    #[inline(always)]
    fn read_ints(numbers: &[u32]) -> Self::Ints {
        numbers.get(..Self::WIDTH).and_then(|numbers| numbers.try_into().ok()).unwrap_or_default()
    }

    /// Zeros, to be filled lane by lane.
    #[inline(always)]
    fn floats() -> Self::Floats {
        Self::Floats::default()
    }

    /// Zeros, to be filled lane by lane.
    #[inline(always)]
    fn ints() -> Self::Ints {
        Self::Ints::default()
    }

    /// As [`Num::to_whole`], as an array.
    #[inline(always)]
    fn truncate(self) -> Self::Ints {
        Self::ints_of(self.to_whole())
    }

    /// As [`Num::of_whole`], from an array.
    #[inline(always)]
    fn of_ints(ints: Self::Ints) -> Self {
        Self::of_whole(Self::whole(ints))
    }

    /// The numbers from a place on; zeros if they are too few.
    #[inline(always)]
    fn at(numbers: &[f32], first: usize) -> Self {
        Self::read(numbers.get(first..).unwrap_or(&[]))
    }

    /// Writes the numbers from a place on; nothing if they do not fit.
    #[inline(always)]
    fn write(self, out: &mut [f32], at: usize) {
        if let Some(out) = out.get_mut(at..at + Self::WIDTH) {
            out.copy_from_slice(self.store().as_ref());
        }
    }

    /// The low and the high half of each whole number, moved up by 12 bits and added to `add`: the bits of two numbers.
    #[inline(always)]
    fn halves(ints: Self::Ints, add: u32) -> [Self; 2] {
        let (of, add, low) = (Self::whole(ints), Self::Whole::splat(add), Self::Whole::splat(0xffff << 12));
        [(of.shl::<12>() & low) + add, (of.shr::<4>() & low) + add].map(Self::from_bits)
    }

    /// Runs a computation as a function of its own, compiled for these numbers.
    #[inline(always)]
    fn apart<K: Apart<Self>>(computation: K) -> K::Output {
        apart(computation)
    }

    /// `a` where the mask is set, elsewhere 0.
    #[inline(always)]
    fn only(mask: Self::Mask, a: Self) -> Self {
        Self::select(mask, a, Self::splat(0.0))
    }

    /// A number for each lane, from its place.
    #[inline(always)]
    fn each(mut of: impl FnMut(usize) -> f32) -> Self {
        let mut lanes = Self::Floats::default();
        for (lane, out) in lanes.as_mut().iter_mut().enumerate() {
            *out = of(lane);
        }
        Self::load(lanes)
    }

    /// A whole number for each lane, from its place.
    #[inline(always)]
    fn each_int(mut of: impl FnMut(usize) -> u32) -> Self::Ints {
        let mut lanes = Self::Ints::default();
        for (lane, out) in lanes.as_mut().iter_mut().enumerate() {
            *out = of(lane);
        }
        lanes
    }
}

/// Methods of one expression each, inlined; `unsafe` where the expressions are instructions.
macro_rules! methods {
    ($($name:ident $(<$number:ident>)? ($($argument:ident $(: $type:ty)?),*) -> $output:ty = $value:expr;)*) => {$(
        #[inline(always)]
        fn $name $(<const $number: i32>)? ($($argument $(: $type)?),*) -> $output {
            $value
        }
    )*};
    (unsafe $($name:ident $(<$number:ident>)? ($($argument:ident $(: $type:ty)?),*) -> $output:ty = $value:expr;)*) => {$(
        #[inline(always)]
        fn $name $(<const $number: i32>)? ($($argument $(: $type)?),*) -> $output {
            // SAFETY: whoever names a type of registers has its instructions; loads are of an array of its width.
            unsafe { $value }
        }
    )*};
}
pub(super) use methods;

impl Num for f32 {
    const WIDTH: usize = 1;
    type Mask = bool;
    type Whole = One;
    type Floats = [f32; 1];
    type Ints = [u32; 1];

    methods! {
        load(lanes: [f32; 1]) -> f32 = lanes[0];
        whole(ints: [u32; 1]) -> One = One(ints[0]);
        ints_of(whole: One) -> [u32; 1] = [whole.0];
        from_bits(bits: One) -> f32 = f32::from_bits(bits.0);
        of_whole(whole: One) -> f32 = whole.0 as i32 as f32;
        sign_bits(whole: One) -> u32 = whole.0 >> 31;
        splat(x: f32) -> f32 = x;
        store(self) -> [f32; 1] = [self];
        sqrt(self) -> f32 = super::sqrt(self);
        abs(self) -> f32 = f32::abs(self);
        copysign(self, sign: f32) -> f32 = f32::copysign(self, sign);
        min(self, b: f32) -> f32 = numeric::min(self, b);
        max(self, b: f32) -> f32 = numeric::max(self, b);
        lt(self, b: f32) -> bool = self < b;
        le(self, b: f32) -> bool = self <= b;
        select(mask: bool, a: f32, b: f32) -> f32 = numeric::select(mask, a, b);
        and(a: bool, b: bool) -> bool = a & b;
        or(a: bool, b: bool) -> bool = a | b;
        bits(mask: bool) -> u32 = mask.into();
        to_bits(self) -> One = One(f32::to_bits(self));
        to_whole(self) -> One = One(super::truncate(self));
        sums(self) -> f32 = self;
        up(self) -> f32 = 0.0;
    }

    #[inline(always)]
    fn rows(table: &[[f32; 4]], One(i): One) -> [f32; 4] {
        table.get(i as usize).copied().unwrap_or([0.0; 4])
    }

    #[inline(always)]
    fn pairs(table: &[u16], One(i): One) -> One {
        let pair = table.get(i as usize..(i as usize).wrapping_add(2));
        One(pair.map_or(0, |pair| u32::from(pair[0]) | u32::from(pair[1]) << 16))
    }
}

/// One whole number.
#[derive(Clone, Copy, Debug)]
pub struct One(u32);

/// The places in a group at which registers begin.
#[inline(always)]
pub fn places<F: Num>() -> impl Iterator<Item = usize> {
    const { assert!(GROUP % F::WIDTH == 0 && GROUP / F::WIDTH <= REGISTERS) };
    (0..GROUP).step_by(F::WIDTH)
}

/// The sum of the numbers of a group: so registers of any width have the same bits.
#[inline(always)]
pub fn sum<F: Num>(group: [F; REGISTERS]) -> f32 {
    let mut sum = 0.0;
    for register in group.iter().take(GROUP / F::WIDTH) {
        for x in register.store().as_ref() {
            sum += x;
        }
    }
    sum
}

/// Whether all whole numbers, of which none is above 2^31, are below a bound.
#[inline(always)]
pub(super) fn all_below<F: Num>(index: F::Whole, bound: usize) -> bool {
    // Below and not negative: the difference is negative, and the number is not.
    let bound = F::Whole::splat((bound.min(i32::MAX as usize) as u32).wrapping_neg());
    F::sign_bits(index + bound) == (1 << F::WIDTH) - 1 && F::sign_bits(index) == 0
}

macro_rules! one {
    ($($operator:ident $method:ident $of:path),*) => {$(
        impl $operator for One {
            type Output = One;

            #[inline(always)]
            fn $method(self, b: One) -> One {
                One($of(self.0, b.0))
            }
        }
    )*};
}

one!(Add add u32::wrapping_add, Mul mul u32::wrapping_mul);
one!(BitAnd bitand BitAnd::bitand, BitOr bitor BitOr::bitor, BitXor bitxor BitXor::bitxor);

impl Whole for One {
    methods! {
        splat(x: u32) -> One = One(x);
        reverse_bits(self) -> One = One(self.0.reverse_bits());
        shl<N>(self) -> One = One(self.0 << (N & 31));
        shr<N>(self) -> One = One(self.0 >> (N & 31));
    }
}

/// Operators with a number on the right, for lanes.
macro_rules! scalars {
    ($name:ty: $($operator:ident $method:ident),*) => {$(
        impl core::ops::$operator<f32> for $name {
            type Output = $name;

            #[inline(always)]
            fn $method(self, b: f32) -> $name {
                core::ops::$operator::$method(self, <$name as crate::simd::Num>::splat(b))
            }
        }
    )*};
    ($name:ty) => { crate::simd::num::scalars!($name: Add add, Sub sub, Mul mul, Div div); };
}
pub(super) use scalars;
