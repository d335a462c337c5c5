//! Eight numbers side by side: two registers of four. Each lane has the bits of the scalar operation of the same name.

pub mod sphere;
pub mod vector;

use crate::simd::{A4, Four, Num, Whole};
use core::ops::{Add, Div, Mul, Sub};

/// The lanes that every processor of this target has.
pub type Native = Pair<Four>;
/// Lanes in arrays, which the others are tested against.
pub type Portable = Pair<A4>;

/// Numbers in a [`Lanes`].
pub const LANES: usize = 8;

/// Numbers in a half.
const HALF: usize = 4;
const ALL: u32 = (1 << LANES) - 1;

/// Eight numbers.
pub trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + 'static
{
    /// A truth value for each lane.
    type Mask: Copy;
    /// An unsigned whole number for each lane.
    type Index: Copy;

    /// The same number in all lanes.
    fn splat(x: f32) -> Self;
    /// One number for each lane.
    fn from_array(lanes: [f32; LANES]) -> Self;
    /// The numbers of all lanes.
    fn to_array(self) -> [f32; LANES];
    /// Element `k` of lane `i`'s row in lane `i` of result `k`.
    fn transpose(rows: [&[f32; 4]; LANES]) -> [Self; 4];
    /// The inverse of [`Lanes::transpose`].
    fn rows(columns: [Self; 4]) -> [[f32; 4]; LANES];
    /// The square root.
    fn sqrt(self) -> Self;
    /// The number without its sign.
    fn abs(self) -> Self;
    /// The number with the sign of another.
    fn copysign(self, sign: Self) -> Self;
    /// The next smaller number, of a positive one.
    fn before(self) -> Self;
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
    /// One whole number for each lane.
    fn index(numbers: [u32; LANES]) -> Self::Index;
    /// The whole numbers of all lanes.
    fn numbers(index: Self::Index) -> [u32; LANES];
    /// As [`Lanes::transpose`].
    fn transpose_index(rows: [&[u32; 4]; LANES]) -> [Self::Index; 4];
    /// `a` where the mask is set, elsewhere `b`.
    fn select_index(mask: Self::Mask, a: Self::Index, b: Self::Index) -> Self::Index;
    /// The sum, wrapping.
    fn add_index(a: Self::Index, b: Self::Index) -> Self::Index;
    /// Numbers with the bits of whole numbers, which mean nothing as numbers: to be moved together with some that do.
    fn with_bits(index: Self::Index) -> Self;
    /// index < bound.
    fn below(index: Self::Index, bound: u32) -> Self::Mask;
    /// The highest bits of the whole numbers as bits, lane 0 lowest.
    fn highest_bits(index: Self::Index) -> u32;
    /// Four times each number, plus 1, plus 2 where the first mask is set, plus 1 where the second is: the child of a
    /// square in heap order.
    fn child(squares: Self::Index, sides: [Self::Mask; 2]) -> Self::Index;
    /// The transposed rows of these numbers; 0 for a row that does not exist.
    fn gather(rows: &[[f32; 4]], index: Self::Index) -> [Self; 4];
    /// The mask with the lanes whose bits are set, lane 0 lowest.
    fn mask(bits: u32) -> Self::Mask;
    /// The lanes of a mask as bits, lane 0 lowest.
    fn bits(mask: Self::Mask) -> u32;

    /// `a` where the mask is set, elsewhere 0.
    #[inline(always)]
    fn only(mask: Self::Mask, a: Self) -> Self {
        Self::select(mask, a, Self::splat(0.0))
    }

    /// 1 where the mask is set, elsewhere 0.
    #[inline(always)]
    fn unit(mask: Self::Mask) -> Self {
        Self::only(mask, Self::splat(1.0))
    }
}

/// Two times four numbers.
#[derive(Clone, Copy, Debug)]
pub struct Pair<F>([F; 2]);

/// Four numbers.
pub trait Half: Num<Floats = [f32; HALF], Ints = [u32; HALF]> {}
impl<F: Num<Floats = [f32; HALF], Ints = [u32; HALF]>> Half for F {}

macro_rules! operators {
    ($($operator:ident $method:ident),*) => {$(
        impl<F: Half> $operator for Pair<F> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, b: Self) -> Self {
                Pair([self.0[0].$method(b.0[0]), self.0[1].$method(b.0[1])])
            }
        }
    )*};
}

operators!(Add add, Sub sub, Mul mul, Div div);

#[inline(always)]
fn halves<T: Copy>([a, b, c, d, e, f, g, h]: [T; LANES]) -> [[T; HALF]; 2] {
    [[a, b, c, d], [e, f, g, h]]
}

#[inline(always)]
fn whole<T: Copy>([[a, b, c, d], [e, f, g, h]]: [[T; HALF]; 2]) -> [T; LANES] {
    [a, b, c, d, e, f, g, h]
}

/// Columns of four rows.
#[inline(always)]
fn columns<F: Half>(rows: [[f32; 4]; HALF]) -> [F; 4] {
    F::rows(&rows, F::whole([0, 1, 2, 3]))
}

/// Where the highest bits are set.
#[inline(always)]
fn is_negative<F: Half>(bits: F::Whole) -> F::Mask {
    let sign = F::Whole::splat(1 << 31);
    F::from_bits(bits & sign | F::splat(1.0).to_bits()).lt(F::splat(0.0))
}

impl<F: Half> Lanes for Pair<F> {
    type Mask = [F::Mask; 2];
    type Index = [F::Whole; 2];

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Pair([F::splat(x); 2])
    }

    #[inline(always)]
    fn from_array(lanes: [f32; LANES]) -> Self {
        let [low, high] = halves(lanes);
        Pair([F::load(low), F::load(high)])
    }

    #[inline(always)]
    fn to_array(self) -> [f32; LANES] {
        whole([self.0[0].store(), self.0[1].store()])
    }

    #[inline(always)]
    fn transpose([a, b, c, d, e, f, g, h]: [&[f32; 4]; LANES]) -> [Self; 4] {
        let (low, high) = (columns([*a, *b, *c, *d]), columns([*e, *f, *g, *h]));
        [Pair([low[0], high[0]]), Pair([low[1], high[1]]), Pair([low[2], high[2]]), Pair([low[3], high[3]])]
    }

    #[inline(always)]
    fn rows([a, b, c, d]: [Self; 4]) -> [[f32; 4]; LANES] {
        let of = |half: usize| columns::<F>([a, b, c, d].map(|column| column.0[half & 1].store())).map(F::store);
        whole([of(0), of(1)])
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Pair([self.0[0].sqrt(), self.0[1].sqrt()])
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Pair([self.0[0].abs(), self.0[1].abs()])
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        Pair([self.0[0].copysign(sign.0[0]), self.0[1].copysign(sign.0[1])])
    }

    #[inline(always)]
    fn before(self) -> Self {
        let less = F::Whole::splat(u32::MAX);
        Pair([F::from_bits(self.0[0].to_bits() + less), F::from_bits(self.0[1].to_bits() + less)])
    }

    #[inline(always)]
    fn min(self, b: Self) -> Self {
        Pair([self.0[0].min(b.0[0]), self.0[1].min(b.0[1])])
    }

    #[inline(always)]
    fn max(self, b: Self) -> Self {
        Pair([self.0[0].max(b.0[0]), self.0[1].max(b.0[1])])
    }

    #[inline(always)]
    fn lt(self, b: Self) -> Self::Mask {
        [self.0[0].lt(b.0[0]), self.0[1].lt(b.0[1])]
    }

    #[inline(always)]
    fn le(self, b: Self) -> Self::Mask {
        [self.0[0].le(b.0[0]), self.0[1].le(b.0[1])]
    }

    #[inline(always)]
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self {
        Pair([F::select(mask[0], a.0[0], b.0[0]), F::select(mask[1], a.0[1], b.0[1])])
    }

    #[inline(always)]
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask {
        [F::and(a[0], b[0]), F::and(a[1], b[1])]
    }

    #[inline(always)]
    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask {
        [F::or(a[0], b[0]), F::or(a[1], b[1])]
    }

    #[inline(always)]
    fn index(numbers: [u32; LANES]) -> Self::Index {
        let [low, high] = halves(numbers);
        [F::whole(low), F::whole(high)]
    }

    #[inline(always)]
    fn numbers(index: Self::Index) -> [u32; LANES] {
        whole([F::ints_of(index[0]), F::ints_of(index[1])])
    }

    #[inline(always)]
    fn transpose_index(rows: [&[u32; 4]; LANES]) -> [Self::Index; 4] {
        Self::transpose(rows.map(bytemuck::cast_ref)).map(|of| [of.0[0].to_bits(), of.0[1].to_bits()])
    }

    #[inline(always)]
    fn select_index(mask: Self::Mask, a: Self::Index, b: Self::Index) -> Self::Index {
        let chosen = Self::select(mask, Self::with_bits(a), Self::with_bits(b));
        [chosen.0[0].to_bits(), chosen.0[1].to_bits()]
    }

    #[inline(always)]
    fn add_index(a: Self::Index, b: Self::Index) -> Self::Index {
        [a[0] + b[0], a[1] + b[1]]
    }

    #[inline(always)]
    fn with_bits(index: Self::Index) -> Self {
        Pair([F::from_bits(index[0]), F::from_bits(index[1])])
    }

    #[inline(always)]
    fn below(index: Self::Index, bound: u32) -> Self::Mask {
        // The borrow of the difference.
        let (negative, bound) = (F::Whole::splat(bound.wrapping_neg()), F::Whole::splat(bound));
        index.map(|index| {
            let not = index ^ F::Whole::splat(u32::MAX);
            is_negative::<F>(not & bound | (not | bound) & (index + negative))
        })
    }

    #[inline(always)]
    fn highest_bits(index: Self::Index) -> u32 {
        F::sign_bits(index[0]) | F::sign_bits(index[1]) << HALF
    }

    #[inline(always)]
    fn child(squares: Self::Index, sides: [Self::Mask; 2]) -> Self::Index {
        let only = |mask: F::Mask, number: u32| F::only(mask, F::from_bits(F::Whole::splat(number))).to_bits();
        let of = |half: usize| {
            let side = only(sides[0][half & 1], 2) + only(sides[1][half & 1], 1);
            squares[half & 1].shl::<2>() + F::Whole::splat(1) + side
        };
        [of(0), of(1)]
    }

    #[inline(always)]
    fn gather(rows: &[[f32; 4]], index: Self::Index) -> [Self; 4] {
        if Self::bits(Self::below(index, rows.len() as u32)) == ALL {
            let (low, high) = (F::rows(rows, index[0]), F::rows(rows, index[1]));
            return [
                Pair([low[0], high[0]]),
                Pair([low[1], high[1]]),
                Pair([low[2], high[2]]),
                Pair([low[3], high[3]]),
            ];
        }
        Self::transpose(Self::numbers(index).map(|number| rows.get(number as usize).unwrap_or(&[0.0; 4])))
    }

    #[inline(always)]
    fn mask(bits: u32) -> Self::Mask {
        let lanes = F::whole([1, 2, 4, 8]);
        let of = |bits: u32| F::splat(0.0).lt(F::of_whole(F::Whole::splat(bits) & lanes));
        [of(bits), of(bits >> HALF)]
    }

    #[inline(always)]
    fn bits(mask: Self::Mask) -> u32 {
        F::bits(mask[0]) | F::bits(mask[1]) << HALF
    }
}
