//! One call and the same again under other circumstances; and many of them.

use crate::call::DEFAULT_CONTROL;
use crate::case::{Case, Given, Role};
use crate::oracle::Verdict;
use crate::random::Random;
use crate::rows::{ROWS, Row};
use crate::tally::Tally;
use crate::world::World;
use crate::{alarm, building, header, oracle, values};
use anyhow::{Result, bail};
use std::sync::atomic::Ordering;

/// Other rounding modes, with or without denormals as results and as operands.
const CONTROLS: [u32; 7] = [0x2000, 0x4000, 0x6000, 0x8040, 0xa040, 0xc000, 0x6040];

/// Valid calls of every row at the beginning of an epoch, so that there are objects of every kind.
pub const ROUNDS: usize = 3;

/// A case: the last of an epoch that is played up to it.
#[derive(Clone, Copy, Debug)]
pub struct Words {
    pub seed: u64,
    pub epoch: u64,
    pub number: u64,
}

/// Plays an epoch up to a case.
pub fn play(world: &mut World, words: &Words, tally: &mut Tally, verbose: bool) -> Result<()> {
    let &Words { seed, epoch, number: last_number } = words;
    let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ epoch << 20);
    world.begin(&mut random);
    let shares: Vec<usize> = (0..ROWS.len()).flat_map(|index| std::iter::repeat_n(index, ROWS[index].share)).collect();
    for number in 0..=last_number {
        let first = number as usize / ROUNDS < ROWS.len();
        let index = if first { number as usize % ROWS.len() } else { random.pick(&shares) };
        let (row, case_random) = (&ROWS[index], Random(random.bits()));
        if !row.is_possible(world) {
            continue;
        }
        for (slot, word) in alarm::CASE.iter().zip([seed, epoch, number, index as u64]) {
            slot.store(word, Ordering::Relaxed);
        }
        let last = verbose && number == last_number;
        if let Err(fault) = one(world, row, case_random, first, tally, last) {
            bail!("FAILED {fault}: {}", alarm::reproduce());
        }
    }
    Ok(())
}

/// One call, often followed by the same under another control word.
pub fn one(world: &mut World, row: &Row, random: Random, valid: bool, tally: &mut Tally, verbose: bool) -> Verdict {
    let mut case = Case::new(world, world.function(&row.name), random);
    if valid {
        case.spoiled = None;
    }
    while case.words.len() < case.function.parameters.len() {
        values::give(&mut case);
    }
    if verbose {
        show(&case);
    }
    let clock = alarm::seconds(libc::CLOCK_THREAD_CPUTIME_ID);
    let answer = case.run(DEFAULT_CONTROL);
    let seconds = alarm::seconds(libc::CLOCK_THREAD_CPUTIME_ID) - clock;
    let status = if case.function.answers_status { answer.result as u32 } else { 0 };
    if verbose {
        eprintln!("status {status}, {} bytes of stack, {seconds:.6} s", answer.stack);
        show(&case);
    }
    tally.add(row, status, answer.stack, seconds);
    oracle::check(&case, answer, DEFAULT_CONTROL)?;
    if status == 0 {
        row.law.map_or(Ok(()), |law| law(&case))?;
    }
    let left = if status == 0 && case.function.answers_status { building::left(&case) } else { Vec::new() };
    if seconds < 0.01 && case.random.one_in(2) {
        let before = oracle::outcome(&case, answer);
        again(&mut case, tally, row, before)?;
    }
    let mut random = case.random;
    world.keep(left, &mut random);
    Ok(())
}

/// The same call under another control word, on other instructions, and in memory of other content, has the same outcome.
fn again(case: &mut Case, tally: &mut Tally, row: &Row, before: (u64, Vec<Vec<u8>>)) -> Verdict {
    case.restore();
    for given in case.given.iter().filter(|given| given.role == Role::Work && case.build.is_none()) {
        case.world.memory.bytes(given.place).fill(case.random.bits() as u8);
    }
    let level = case.level_of(case.random);
    level.iter().for_each(|level| case.set_level(level));
    let control = DEFAULT_CONTROL | case.random.pick(&CONTROLS);
    let answer = case.run(control);
    tally.add(row, answer.result as u32, answer.stack, 0.0);
    if level.is_some() {
        case.set_level(&case.given[0].before[Case::LEVEL]);
    }
    oracle::check(case, answer, control)?;
    let after = oracle::outcome(case, answer);
    let differs = |(a, b): (&Vec<u8>, &Vec<u8>)| a != b;
    match before.1.iter().zip(&after.1).position(differs) {
        None if before.0 == after.0 && before.1.len() == after.1.len() => Ok(()),
        None => Err(format!("{} became {} under control word {control:x}", before.0, after.0)),
        Some(block) => {
            let (a, b) = (&before.1[block], &after.1[block]);
            let at = a.iter().zip(b).position(|(a, b)| a != b);
            Err(format!("byte {at:?} of {} of result {block} is another under control word {control:x}", a.len()))
        }
    }
}

/// Prints the arguments of a call, and the beginning of what they point to.
fn show(case: &Case) {
    for object in &case.objects {
        eprintln!("{} of case {}", object.kind, object.id - 1);
    }
    if let Some(map) = case.map.filter(|map| map.bytes == 4) {
        let channels = case.world.memory.bytes(map.place).chunks(4);
        eprintln!("{map:?}: {:?}", channels.map(|four| oracle::number(four, header::Scalar::F32)).collect::<Vec<_>>());
    }
    for (k, (parameter, word)) in case.function.parameters.iter().zip(&case.words).enumerate() {
        let spoiled = if case.spoiled == Some(k) { "spoiled " } else { "" };
        eprintln!("{spoiled}{} = {word:x?}", parameter.declaration);
        for given in case.given.iter().filter(|given| given.parameter == k) {
            eprintln!("    {:?} of {} bytes{}", given.role, given.place.len, content(case, given));
        }
    }
}

/// The fields of the first elements, or the first bytes.
fn content(case: &Case, given: &Given) -> String {
    let (bytes, mut text) = (&*case.world.memory.bytes(given.place), String::new());
    for (k, element) in bytes.chunks(given.span.stride).take(8).enumerate() {
        for field in given.layout.fields.iter().filter(|field| field.offset + field.scalar.size() <= element.len()) {
            let value = oracle::number(&element[field.offset..], field.scalar);
            text += &format!("\n        [{k}].{} {value:e}", field.path);
        }
    }
    if text.is_empty() { format!(": {:02x?}", &bytes[..bytes.len().min(96)]) } else { text }
}
