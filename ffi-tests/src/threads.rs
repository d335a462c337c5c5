//! The same for each of many items, on all threads.

use anyhow::Result;
use std::sync::Mutex;

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
    let portions = items.chunks(items.len().div_ceil(THREADS * PORTIONS).max(1)).enumerate();
    let (portions, done) = (Mutex::new(portions), Mutex::new(Vec::new()));
    let take = || portions.lock().expect("no thread panics").next();
    let work = || {
        while let Some((number, portion)) = take() {
            let answers = portion.iter().map(&each).collect::<Result<Vec<R>>>();
            done.lock().expect("no thread panics").push((number, answers));
        }
    };
    std::thread::scope(|scope| (0..THREADS).for_each(|_| _ = scope.spawn(work)));
    let mut done = done.into_inner().expect("no thread panics");
    done.sort_by_key(|(number, _)| *number);
    Ok(done.into_iter().map(|(_, answers)| answers).collect::<Result<Vec<_>>>()?.into_iter().flatten().collect())
}
