//! A static library with the whole standard library, to be linked beside wis.

/// 1 + 2 + ... + count, by way of the heap and of a caught panic.
#[unsafe(no_mangle)]
pub extern "C" fn other_sum(count: u64) -> u64 {
    let numbers: Vec<u64> = (1..=count).collect();
    std::panic::set_hook(Box::new(|_| {}));
    let caught = std::panic::catch_unwind(|| numbers[usize::MAX]);
    if caught.is_err() { numbers.iter().sum() } else { 0 }
}
