//! What is played again: the case of some words, and inputs that the guided fuzzer kept.

use crate::alarm;
use crate::inputs::Inputs;
use crate::play::Words;
use anyhow::{Context, Result, bail};
use std::fs;
use std::path::{Path, PathBuf};

impl Words {
    /// The words `seed:epoch:number`.
    pub fn read(words: &str) -> Result<Words> {
        let numbers: Vec<u64> = words.split(':').map(str::parse).collect::<std::result::Result<_, _>>()?;
        let [seed, epoch, number] = numbers[..] else { bail!("{words}: not seed:epoch:number") };
        Ok(Words { seed, epoch, number })
    }
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
