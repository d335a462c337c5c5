//! Numbers of every width answer the bits of scalar operations: one by one, in arrays, and in every register that this processor has.

use crate::support::Random;
use wis::numeric::{max, min, sqrt};
use wis::simd::{A4, Compute, Four, GROUP, Level, Num, REGISTERS, Whole, compute, places, sum};

/// Tries of random numbers.
const TRIES: usize = 2000;

/// A whole number below a limit.
fn below(random: &mut Random, limit: usize) -> usize {
    (random.bits() % limit as u64) as usize
}

/// An ordinary number, one of any bits, or one at which operations differ.
fn number(random: &mut Random) -> f32 {
    const SPECIAL: [f32; 12] =
        [0.0, -0.0, 1.0, -1.0, 1e-45, -1e-38, 3e38, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 0.5, 4096.0];
    match below(random, 3) {
        0 => SPECIAL[below(random, SPECIAL.len())],
        1 => f32::from_bits(word(random)),
        _ => 20.0 * random.f32() - 10.0,
    }
}

/// Any whole number, or one at a limit.
fn word(random: &mut Random) -> u32 {
    const SPECIAL: [u32; 6] = [0, 1, u32::MAX, 1 << 31, (1 << 31) - 1, 1 << 16];
    let any = random.bits() as u32;
    if below(random, 3) == 0 { SPECIAL[below(random, SPECIAL.len())] } else { any }
}

/// A NaN's bits mean nothing. Compared as numbers, since compilers may take one NaN for another.
fn bits(x: f32) -> u32 {
    const INFINITY: u32 = f32::INFINITY.to_bits();
    let bits = x.to_bits();
    if bits & !(1 << 31) > INFINITY { INFINITY + 1 } else { bits }
}

/// Runs a test on numbers of every kind.
macro_rules! on_all_numbers {
    ($test:ident) => {{
        struct Test;
        impl Compute for Test {
            type Output = ();
            fn run<F: Num>(self) {
                $test::<F>();
            }
        }
        $test::<f32>();
        $test::<A4>();
        $test::<Four>();
        compute(Level::detect(), Test);
    }};
}

fn operations<F: Num>() {
    let mut random = Random(50);
    for _ in 0..TRIES {
        let (x, y) = (F::each(|_| number(&mut random)), F::each(|_| number(&mut random)));
        let (a, b, scalar) = (x.store(), y.store(), number(&mut random));
        let (a, b) = (a.as_ref(), b.as_ref());
        let check = |name: &str, found: F, of: &dyn Fn(f32, f32) -> f32| {
            for (i, &lane) in found.store().as_ref().iter().enumerate() {
                assert_eq!(bits(lane), bits(of(a[i], b[i])), "{name} of {} and {}, {scalar}", a[i], b[i]);
            }
        };
        check("sum", x + y, &|a, b| a + b);
        check("difference", x - y, &|a, b| a - b);
        check("product", x * y, &|a, b| a * b);
        check("quotient", x / y, &|a, b| a / b);
        check("sum with one", x + scalar, &|a, _| a + scalar);
        check("difference from one", x - scalar, &|a, _| a - scalar);
        check("product with one", x * scalar, &|a, _| a * scalar);
        check("quotient by one", x / scalar, &|a, _| a / scalar);
        check("one", F::splat(scalar), &|_, _| scalar);
        check("root", x.sqrt(), &|a, _| sqrt(a));
        check("size", x.abs(), &|a, _| a.abs());
        check("sign", x.copysign(y), &|a, b| a.copysign(b));
        check("minimum", x.min(y), &min);
        check("maximum", x.max(y), &max);
        check("choice", F::select(x.le(y), x, y), &|a, b| if a <= b { a } else { b });
        check("part", F::only(x.lt(y), x), &|a, b| if a < b { a } else { 0.0 });
        check("bits", F::from_bits(x.to_bits()), &|a, _| a);
        let zero = F::splat(0.0);
        let masks = [x.lt(y), x.le(y), F::and(x.lt(y), zero.lt(y)), F::or(x.lt(y), zero.lt(y))].map(F::bits);
        for (i, (&a, &b)) in a.iter().zip(b).enumerate() {
            let expected = [a < b, a <= b, a < b && 0.0 < b, a < b || 0.0 < b];
            assert_eq!(masks.map(|mask| mask >> i & 1 == 1), expected, "{a} and {b}");
        }
        assert!(masks.iter().all(|&mask| mask >> F::WIDTH == 0));
        let up = x.up().store();
        for (i, &found) in up.as_ref().iter().enumerate() {
            assert_eq!(bits(found), bits(if i & 3 > 0 { a[i - 1] } else { 0.0 }));
        }
        let sums = x.sums().store();
        for (i, &found) in sums.as_ref().iter().enumerate() {
            let (four, at) = (&a[i & !3..], i & 3);
            // Where no zeros are moved in, a sum of -0 keeps its sign.
            let pairs = [four[0], if at > 0 { four[1] + four[0] } else { 0.0 }];
            let expected = match at {
                0 | 1 => pairs[at],
                2 => (four[2] + four[1]) + four[0],
                _ => (four[3] + four[2]) + (four[1] + four[0]),
            };
            assert_eq!(bits(found + 0.0), bits(expected + 0.0));
        }
    }
}

fn whole_numbers<F: Num>() {
    let mut random = Random(51);
    for _ in 0..TRIES {
        let (a, b) = (F::each_int(|_| word(&mut random)), F::each_int(|_| word(&mut random)));
        let (x, y) = (F::whole(a), F::whole(b));
        let check = |name: &str, found: F::Whole, of: &dyn Fn(u32, u32) -> u32| {
            for (i, &lane) in F::ints_of(found).as_ref().iter().enumerate() {
                let (a, b) = (a.as_ref()[i], b.as_ref()[i]);
                assert_eq!(lane, of(a, b), "{name} of {a} and {b}");
            }
        };
        check("sum", x + y, &u32::wrapping_add);
        check("product", x * y, &u32::wrapping_mul);
        check("both", x & y, &|a, b| a & b);
        check("either", x | y, &|a, b| a | b);
        check("one of them", x ^ y, &|a, b| a ^ b);
        check("up", x.shl::<5>(), &|a, _| a << 5);
        check("down", x.shr::<7>(), &|a, _| a >> 7);
        check("from the other end", x.reverse_bits(), &|a, _| a.reverse_bits());
        check("the same", F::Whole::splat(77), &|_, _| 77);
        for (i, &a) in a.as_ref().iter().enumerate() {
            assert_eq!(F::sign_bits(x) >> i & 1, a >> 31);
            let halves = F::halves(F::ints_of(x), 1 << 28).map(|half| half.store().as_ref()[i].to_bits());
            assert_eq!(halves, [((a & 0xffff) << 12) + (1 << 28), ((a >> 16) << 12) + (1 << 28)]);
        }
        // As documented: from 0 on, and below 2^31.
        let half = F::each_int(|lane| a.as_ref()[lane] >> 1);
        let numbers = F::of_ints(half);
        for (&number, &half) in numbers.store().as_ref().iter().zip(half.as_ref()) {
            assert_eq!(number, half as f32);
        }
        let numbers = F::each(|lane| half.as_ref()[lane] as f32 * 0.99);
        for (&found, &number) in numbers.truncate().as_ref().iter().zip(numbers.store().as_ref()) {
            assert_eq!(found, number as u32);
        }
    }
}

/// What is read from slices and written to them, also where they end.
fn memory<F: Num>() {
    let mut random = Random(52);
    let numbers: Vec<f32> = (0..21).map(|i| i as f32).collect();
    let words: Vec<u16> = (0..40).map(|i| 1000 * i).collect();
    let rows: Vec<[f32; 4]> = (0..33).map(|i| [0.0, 0.25, 0.5, 0.75].map(|x| x + i as f32)).collect();
    for first in 0..30 {
        let fits = first + F::WIDTH <= numbers.len();
        for (lane, &x) in F::at(&numbers, first).store().as_ref().iter().enumerate() {
            assert_eq!(x, if fits { numbers[first + lane] } else { 0.0 });
        }
        let ints: Vec<u32> = numbers.iter().map(|&x| x as u32).collect();
        for (lane, &x) in F::read_ints(ints.get(first..).unwrap_or(&[])).as_ref().iter().enumerate() {
            assert_eq!(x, if fits { ints[first + lane] } else { 0 });
        }
        let mut out = [-1.0; 21];
        F::each(|lane| lane as f32).write(&mut out, first);
        for (place, &x) in out.iter().enumerate() {
            let inside = fits && (first..first + F::WIDTH).contains(&place);
            assert_eq!(x, if inside { (place - first) as f32 } else { -1.0 });
        }
    }
    for _ in 0..TRIES {
        let limit = if below(&mut random, 2) == 0 { 33 } else { 45 };
        let index = F::each_int(|_| {
            if limit == 45 && below(&mut random, 9) == 0 { 1 << 31 } else { below(&mut random, limit) as u32 }
        });
        let (index, places) = (F::whole(index), index);
        let exists = places.as_ref().iter().all(|&i| (i as usize) < rows.len());
        let columns = F::rows(&rows, index).map(F::store);
        let pairs = F::ints_of(F::pairs(&words, index));
        let pair_exists = places.as_ref().iter().all(|&i| (i as usize) < words.len() - 1);
        for (lane, &i) in places.as_ref().iter().enumerate() {
            for (k, column) in columns.iter().enumerate() {
                assert_eq!(column.as_ref()[lane], if exists { rows[i as usize][k] } else { 0.0 });
            }
            let pair = |i: usize| u32::from(words[i]) | u32::from(words[i + 1]) << 16;
            assert_eq!(pairs.as_ref()[lane], if pair_exists { pair(i as usize) } else { 0 });
        }
    }
}

#[test]
fn numbers_are_scalar_operations() {
    on_all_numbers!(operations);
}

#[test]
fn whole_numbers_are_scalar_operations() {
    on_all_numbers!(whole_numbers);
}

#[test]
fn slices_are_read_and_written_inside_alone() {
    on_all_numbers!(memory);
}

/// The sum of some groups of numbers.
struct Sum<'a>(&'a [f32]);

impl Compute for Sum<'_> {
    type Output = f32;

    fn run<F: Num>(self) -> f32 {
        let mut sums = [F::splat(0.0); REGISTERS];
        for group in self.0.chunks_exact(GROUP) {
            for (first, sum) in places::<F>().zip(&mut sums) {
                *sum = *sum + F::at(group, first);
            }
        }
        sum(sums)
    }
}

#[test]
fn sums_are_the_same_in_registers_of_any_width() {
    let mut random = Random(53);
    for groups in 0..20 {
        let numbers: Vec<f32> = (0..GROUP * groups).map(|_| random.f32()).collect();
        let partial = |place: usize| numbers.iter().skip(place).step_by(GROUP).sum::<f32>();
        let expected = (0..GROUP).map(partial).sum::<f32>();
        assert_eq!(Sum(&numbers).run::<A4>(), expected);
        assert_eq!(compute(Level::BASELINE, Sum(&numbers)), expected);
        assert_eq!(compute(Level::detect(), Sum(&numbers)), expected);
    }
}
