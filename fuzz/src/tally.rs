//! What was called, how it answered, and how much stack and time it took.

use crate::rows::{ROWS, Row};
use anyhow::{Result, bail};
use std::collections::BTreeMap;
use std::fmt::Write;

#[derive(Clone, Debug, Default)]
struct Of {
    statuses: BTreeMap<u32, u64>,
    stack: usize,
    seconds: f64,
}

/// The most bytes of stack that a call may use, with its return address.
const MOST_STACK: usize = 12288;

/// By row.
#[derive(Default)]
pub struct Tally {
    rows: BTreeMap<String, Of>,
}

impl Tally {
    pub fn add(&mut self, row: &Row, status: u32, stack: usize, seconds: f64) {
        let of = self.rows.entry(row.name.clone()).or_default();
        *of.statuses
            .entry(if row.name == "wis_status_string" || row.name == "wis_version" { 0 } else { status })
            .or_default() += 1;
        of.stack = of.stack.max(stack);
        of.seconds = of.seconds.max(seconds);
    }

    fn calls(of: &Of) -> u64 {
        of.statuses.values().sum()
    }

    pub fn total(&self) -> u64 {
        self.rows.values().map(Tally::calls).sum()
    }

    /// A line for each row.
    pub fn table(&self) -> String {
        let mut text = String::new();
        for row in ROWS.iter() {
            let of = self.rows.get(&row.name).cloned().unwrap_or_default();
            let statuses: Vec<String> = of.statuses.iter().map(|(status, count)| format!("{status}:{count}")).collect();
            let (calls, stack, ms) = (Tally::calls(&of), of.stack, 1e3 * of.seconds);
            let _ =
                writeln!(text, "{:36} {calls:>10} calls {stack:>6} B {ms:>8.2} ms  {}", row.name, statuses.join(" "));
        }
        let total = self.total();
        let _ = writeln!(text, "{total} calls of {} functions", self.rows.len());
        text
    }

    /// Fails if a row never succeeded, or a call used more than [`MOST_STACK`].
    pub fn judge(&self) -> Result<()> {
        for row in ROWS.iter() {
            let succeeded = self.rows.get(&row.name).is_some_and(|of| of.statuses.contains_key(&0));
            if !succeeded {
                bail!("FAILED {} never succeeded: its arguments are wrong", row.name);
            }
        }
        let deep = self.rows.iter().filter(|(_, of)| of.stack > MOST_STACK);
        let text: Vec<String> = deep.map(|(name, of)| format!("{name}: {}", of.stack)).collect();
        if text.is_empty() { Ok(()) } else { bail!("FAILED too many bytes of stack: {}", text.join(", ")) }
    }
}
