//! What is on record is played again: cases that broke a law, and inputs that the guided fuzzer kept.

use crate::alarm;
use crate::inputs::Inputs;
use crate::play::{Words, play};
use crate::rows::ROWS;
use crate::tally::Tally;
use crate::world::World;
use anyhow::{Context, Result, bail, ensure};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

impl Words {
    /// The words `seed:epoch:number`, or `seed:epoch:number:rows` of a case that is older than some rows.
    pub fn read(words: &str) -> Result<Words> {
        let numbers: Vec<u64> = words.split(':').map(str::parse).collect::<std::result::Result<_, _>>()?;
        let (seed, epoch, number, rows) = match numbers[..] {
            [seed, epoch, number] => (seed, epoch, number, ROWS.len()),
            [seed, epoch, number, rows] => (seed, epoch, number, rows as usize),
            _ => bail!("{words}: not seed:epoch:number"),
        };
        Ok(Words { seed, epoch, number, rows })
    }
}

/// Plays the cases of a list: words, the function that they call last, and what that call broke. # begins a comment.
pub fn replays(library: &str, list: &Path) -> Result<()> {
    let (mut world, mut tally, mut count) = (World::new(library)?, Tally::default(), 0);
    for line in fs::read_to_string(list)?.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
        let mut columns = line.split_whitespace();
        let (Some(words), Some(name)) = (columns.next(), columns.next()) else { bail!("{line}: no function") };
        let case = Words::read(words)?;
        play(&mut world, &case, &mut tally, false)?;
        let [.., last, row] = alarm::CASE.each_ref().map(|word| word.load(Ordering::Relaxed));
        let called = ROWS[row as usize].name;
        ensure!(
            last == case.number && called == name,
            "FAILED {words} calls {called}, not {name}: the generator changed"
        );
        count += 1;
    }
    println!("{count} cases that once broke a law: none does");
    Ok(())
}

/// Makes the calls of an input, or of all inputs in a folder.
pub fn corpus(library: &str, path: &Path) -> Result<()> {
    let mut inputs = Inputs::new(library)?;
    let files = if path.is_dir() { list(path)? } else { vec![path.into()] };
    for file in &files {
        let name = file.display().to_string();
        alarm::INPUT.lock().expect("no thread panics").clone_from(&name);
        inputs.run(&fs::read(file)?).map_err(|fault| anyhow::anyhow!("FAILED {fault}: --corpus {name}"))?;
    }
    println!("{} calls of {} inputs that the guided fuzzer kept", inputs.tally.total(), files.len());
    Ok(())
}

fn list(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut files: Vec<PathBuf> = entries.map(|entry| Ok(entry?.path())).collect::<Result<_>>()?;
    files.sort_unstable();
    Ok(files)
}
