//! One register of NEON, which every AArch64 processor has.

use super::num::{all_below, methods, scalars};
use super::{Num, Whole};
use core::arch::aarch64::{
    float32x4_t, uint32x4_t, vabsq_f32, vaddq_f32, vaddq_u32, vaddvq_u32, vandq_u32, vbslq_f32, vcgtq_f32, vcleq_f32,
    vcltq_f32, vcvtq_f32_s32, vcvtq_s32_f32, vdivq_f32, vdupq_n_f32, vdupq_n_u32, veorq_u32, vextq_f32, vld1q_f32,
    vld1q_u32, vmulq_f32, vmulq_u32, vorrq_u32, vrbitq_u8, vreinterpretq_f32_f64, vreinterpretq_f32_u32,
    vreinterpretq_f64_f32, vreinterpretq_s32_u32, vreinterpretq_u8_u32, vreinterpretq_u32_f32, vreinterpretq_u32_s32,
    vreinterpretq_u32_u8, vrev32q_u8, vshlq_n_u32, vshrq_n_u32, vsqrtq_f32, vst1q_f32, vst1q_u32, vsubq_f32, vtstq_u32,
    vzip1q_f32, vzip1q_f64, vzip2q_f32, vzip2q_f64,
};
use core::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Sub};

/// Four numbers.
#[derive(Clone, Copy, Debug)]
pub struct N4(float32x4_t);

/// Four whole numbers; as a mask, each 0 or all ones.
#[derive(Clone, Copy, Debug)]
pub struct U4(uint32x4_t);

macro_rules! operators {
    ($name:ident: $($operator:ident $method:ident $instruction:ident),*) => {$(
        impl $operator for $name {
            type Output = $name;

            #[inline(always)]
            fn $method(self, b: $name) -> $name {
                // SAFETY: NEON is part of AArch64; so below.
                $name(unsafe { $instruction(self.0, b.0) })
            }
        }
    )*};
}

operators!(N4: Add add vaddq_f32, Sub sub vsubq_f32, Mul mul vmulq_f32, Div div vdivq_f32);
operators!(U4: Add add vaddq_u32, Mul mul vmulq_u32);
operators!(U4: BitAnd bitand vandq_u32, BitOr bitor vorrq_u32, BitXor bitxor veorq_u32);
scalars!(N4);

impl Whole for U4 {
    methods! { unsafe
        splat(x: u32) -> U4 = U4(vdupq_n_u32(x));
        shl<N>(self) -> U4 = U4(vshlq_n_u32::<N>(self.0));
        shr<N>(self) -> U4 = U4(vshrq_n_u32::<N>(self.0));
        reverse_bits(self) -> U4 = U4(vreinterpretq_u32_u8(vrev32q_u8(vrbitq_u8(vreinterpretq_u8_u32(self.0)))));
    }
}

impl Num for N4 {
    const WIDTH: usize = 4;
    type Mask = U4;
    type Whole = U4;
    type Floats = [f32; 4];
    type Ints = [u32; 4];

    methods! {
        // As below the maximum: the instructions treat NaN and -0 otherwise.
        min(self, b: N4) -> N4 = N4::select(self.lt(b), self, b);
        only(mask: U4, a: N4) -> N4 = N4::from_bits(mask & a.to_bits());
        and(a: U4, b: U4) -> U4 = a & b;
        or(a: U4, b: U4) -> U4 = a | b;
    }

    methods! { unsafe
        splat(x: f32) -> N4 = N4(vdupq_n_f32(x));
        load(lanes: [f32; 4]) -> N4 = N4(vld1q_f32(lanes.as_ptr()));
        whole(ints: [u32; 4]) -> U4 = U4(vld1q_u32(ints.as_ptr()));
        to_bits(self) -> U4 = U4(vreinterpretq_u32_f32(self.0));
        from_bits(bits: U4) -> N4 = N4(vreinterpretq_f32_u32(bits.0));
        to_whole(self) -> U4 = U4(vreinterpretq_u32_s32(vcvtq_s32_f32(self.0)));
        of_whole(whole: U4) -> N4 = N4(vcvtq_f32_s32(vreinterpretq_s32_u32(whole.0)));
        sqrt(self) -> N4 = N4(vsqrtq_f32(self.0));
        abs(self) -> N4 = N4(vabsq_f32(self.0));
        copysign(self, sign: N4) -> N4 = N4(vbslq_f32(vdupq_n_u32(1 << 31), sign.0, self.0));
        max(self, b: N4) -> N4 = N4::select(U4(vcgtq_f32(self.0, b.0)), self, b);
        lt(self, b: N4) -> U4 = U4(vcltq_f32(self.0, b.0));
        le(self, b: N4) -> U4 = U4(vcleq_f32(self.0, b.0));
        select(mask: U4, a: N4, b: N4) -> N4 = N4(vbslq_f32(mask.0, a.0, b.0));
        bits(mask: U4) -> u32 = vaddvq_u32((mask & N4::whole([1, 2, 4, 8])).0);
        sign_bits(whole: U4) -> u32 = N4::bits(U4(vtstq_u32(whole.0, vdupq_n_u32(1 << 31))));
        up(self) -> N4 = N4(vextq_f32::<3>(vdupq_n_f32(0.0), self.0));
    }

    #[inline(always)]
    fn store(self) -> [f32; 4] {
        let mut lanes = [0.0; 4];
        // SAFETY: NEON is part of AArch64; the store is to the array.
        unsafe { vst1q_f32(lanes.as_mut_ptr(), self.0) };
        lanes
    }

    #[inline(always)]
    fn ints_of(whole: U4) -> [u32; 4] {
        let mut lanes = [0; 4];
        // SAFETY: NEON is part of AArch64; the store is to the array.
        unsafe { vst1q_u32(lanes.as_mut_ptr(), whole.0) };
        lanes
    }

    #[inline(always)]
    fn sums(self) -> N4 {
        // SAFETY: NEON is part of AArch64.
        unsafe {
            let two = self + self.up();
            N4(vaddq_f32(two.0, vextq_f32::<2>(vdupq_n_f32(0.0), two.0)))
        }
    }

    #[inline(always)]
    fn rows(table: &[[f32; 4]], index: U4) -> [N4; 4] {
        let (none, start) = ([0.0; 4], table.as_ptr());
        let inside = all_below::<N4>(index, table.len());
        let row = |i: u32| if inside { start.wrapping_add(i as usize).cast() } else { none.as_ptr() };
        // SAFETY: NEON is part of AArch64; each row is one of the table, or zeros.
        unsafe {
            let [a, b, c, d] = N4::ints_of(index).map(|i| vld1q_f32(row(i)));
            let pairs = |a, b| (vreinterpretq_f64_f32(vzip1q_f32(a, b)), vreinterpretq_f64_f32(vzip2q_f32(a, b)));
            let ((ab_low, ab_high), (cd_low, cd_high)) = (pairs(a, b), pairs(c, d));
            let columns = [
                vzip1q_f64(ab_low, cd_low),
                vzip2q_f64(ab_low, cd_low),
                vzip1q_f64(ab_high, cd_high),
                vzip2q_f64(ab_high, cd_high),
            ];
            columns.map(|column| N4(vreinterpretq_f32_f64(column)))
        }
    }
}
