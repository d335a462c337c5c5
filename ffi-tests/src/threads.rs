//! The same for each of many items, on all threads.

use anyhow::Result;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

pub const THREADS: usize = 2;
/// Items are taken in so many portions by each thread.
const PORTIONS: usize = 32;

/// Applies a function to all items; answers are in their order.
///
/// # Errors
/// The first of the function.
///
/// # Panics
/// A thread panics.
pub fn on_threads<T: Sync, R: Send>(items: &[T], each: impl Fn(&T) -> Result<R> + Sync) -> Result<Vec<R>> {
    let portions: Vec<&[T]> = items.chunks(items.len().div_ceil(THREADS * PORTIONS).max(1)).collect();
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::with_capacity(portions.len())));
    std::thread::scope(|scope| {
        for _ in 0..THREADS {
            scope.spawn(|| {
                while let Some((number, portion)) = take(&next, &portions) {
                    let answers = portion.iter().map(&each).collect::<Result<Vec<R>>>();
                    done.lock().expect("no thread panics").push((number, answers));
                }
            });
        }
    });
    let mut done = done.into_inner().expect("no thread panics");
    done.sort_by_key(|(number, _)| *number);
    let mut all = Vec::with_capacity(items.len());
    for (_, answers) in done {
        all.extend(answers?);
    }
    Ok(all)
}

fn take<'a, T>(next: &AtomicUsize, portions: &[&'a [T]]) -> Option<(usize, &'a [T])> {
    let number = next.fetch_add(1, Ordering::Relaxed);
    Some((number, *portions.get(number)?))
}
