//! The page of a paper: its claims beside what a run measured, then the sections. Each verdict follows from the numbers of the
//! run that writes the page.

use crate::images::Sheet;
use crate::page;
use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use std::fmt::{Display, Write};
use std::path::{Path, PathBuf};

/// What is written.
pub struct Paper {
    file: PathBuf,
    instrument: &'static str,
    /// The sources that it is made from.
    made_from: String,
    /// Title, introduction and what stands below each heading.
    prose: &'static str,
    /// The folder of the pictures.
    pub pictures: PathBuf,
    /// The sections.
    pub text: String,
    pub claims: Claims,
}

impl Paper {
    /// A page at the path that is the first argument of the program, an instrument; pictures go to the folder of its name.
    ///
    /// # Errors
    /// There is no argument, or the folder cannot be made.
    pub fn from_arguments(instrument: &'static str, prose: &'static str) -> Result<Paper> {
        let file = PathBuf::from(std::env::args().nth(1).context("which page is to be written?")?);
        let (pictures, made_from) = (file.with_extension(""), page::made_from(instrument)?);
        std::fs::create_dir_all(&pictures)?;
        Ok(Paper { file, instrument, made_from, prose, pictures, text: String::new(), claims: Claims::default() })
    }

    /// Writes a section, or takes it from the cache if the same sources wrote it to this page before: a run that was stopped
    /// goes on where it was.
    ///
    /// # Errors
    /// Those of the section, and of the files.
    pub fn section(&mut self, name: &str, write: impl FnOnce(&mut Paper) -> Result<()>) -> Result<()> {
        if !self.wants(name) {
            return Ok(());
        }
        let key = self.made_from.split(' ').nth(2).unwrap_or_default();
        let cache = Path::new(CACHE).join(format!("{}-{name}-{key}.json", self.instrument));
        let kept = std::fs::read(&cache).ok().and_then(|bytes| serde_json::from_slice::<Section>(&bytes).ok());
        if let Some(section) = kept.filter(|section| section.file == self.file) {
            self.text += &section.text;
            self.claims.0.extend(section.claims.0);
            return Ok(());
        }
        let (text, claims) = (std::mem::take(&mut self.text), std::mem::take(&mut self.claims));
        write(self)?;
        let section = Section {
            file: self.file.clone(),
            text: std::mem::replace(&mut self.text, text),
            claims: std::mem::replace(&mut self.claims, claims),
        };
        std::fs::create_dir_all(CACHE)?;
        std::fs::write(cache, serde_json::to_vec(&section)?)?;
        eprintln!("{}: {name}", self.instrument);
        self.text += &section.text;
        self.claims.0.extend(section.claims.0);
        Ok(())
    }

    /// Whether a section is to be written: all are, unless arguments after the first name some.
    fn wants(&self, section: &str) -> bool {
        std::env::args().len() < 3 || std::env::args().skip(2).any(|name| name == section)
    }

    /// A heading of the prose, and what stands below it there.
    ///
    /// # Errors
    /// The prose has no such heading.
    pub fn heading(&mut self, heading: &str) -> Result<()> {
        let whole = format!("# {heading}\n");
        let (before, behind) = self.prose.split_once(&whole).with_context(|| format!("no heading {heading}"))?;
        let marks = &before[before.trim_end_matches('#').len()..];
        self.text += &format!("\n{marks}{whole}{}\n", behind.split("\n#").next().unwrap_or_default());
        Ok(())
    }

    /// Adds the claim of the prose whose words begin so: a row of its table, whose braces these values fill in their order. A claim without a
    /// cause has one that no experiment shows.
    ///
    /// # Panics
    /// There is no such row, or it has another number of braces.
    pub fn claim(&mut self, begin: &str, verdict: impl Into<Verdict>, values: &[&dyn Display]) {
        let row = self.prose.lines().find_map(|line| line.strip_prefix("| ").filter(|row| row.starts_with(begin)));
        let (mut cells, mut values) = (row.expect(begin).trim_end_matches('|').split(" | "), values.iter());
        let cells = [0; 4].map(|_| page::filled_in_order(cells.next().expect(begin).trim(), &mut values));
        assert!(values.next().is_none(), "{begin}: too many values");
        self.claims.add(cells, verdict.into());
    }

    /// Saves a picture and shows it.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn save(&mut self, file: &str, sheet: &Sheet) -> Result<()> {
        std::fs::write(self.pictures.join(file), sheet.png()?)?;
        writeln!(self.text, "\n![{file}]({})", self.link(file))?;
        Ok(())
    }

    /// A file of the folder, seen from the page.
    pub fn link(&self, file: &str) -> String {
        let folder = self.pictures.file_name().and_then(|n| n.to_str()).unwrap_or(".");
        format!("{folder}/{file}")
    }

    /// Writes the page: title and introduction of the prose, in which {commit} is replaced, the claims, the sections. Removes pictures that
    /// it does not show.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(self) -> Result<()> {
        let introduction = self.prose.split("\n##").next().unwrap_or_default();
        let mut text = introduction.replace("{commit}", &page::commit()) + "\n";
        self.claims.write(&mut text)?;
        text += &self.text;
        writeln!(text, "\n<!-- {} -->", self.made_from)?;
        for picture in std::fs::read_dir(&self.pictures)? {
            let picture = picture?;
            if !text.contains(&self.link(&picture.file_name().to_string_lossy())) {
                std::fs::remove_file(picture.path())?;
            }
        }
        print!("{text}");
        Ok(std::fs::write(self.file, text)?)
    }
}

/// The heads of a table, of which so many are of words.
///
/// # Errors
/// None: writing to a string does not fail.
pub fn columns(out: &mut String, words: usize, heads: &str) -> Result<()> {
    let rule = |i: usize| if i < words { "---|" } else { "---:|" };
    let rules: String = (0..heads.split(" | ").count()).map(rule).collect();
    Ok(writeln!(out, "| {heads} |\n|{rules}")?)
}

/// The least and the largest of some positive numbers; what is none does not count.
pub fn range(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    values.into_iter().fold([f64::INFINITY, 0.0], |[least, most], x| [x.min(least), x.max(most)])
}

/// Where sections are kept.
const CACHE: &str = "build/papers";

/// A section that was written.
#[derive(Serialize, Deserialize)]
struct Section {
    file: PathBuf,
    text: String,
    claims: Claims,
}

/// The claims of a page, in the order of the paper.
#[derive(Default, Serialize, Deserialize)]
pub struct Claims(Vec<Claim>);

#[derive(Serialize, Deserialize)]
struct Claim {
    claim: String,
    paper: String,
    here: String,
    verdict: Verdict,
    /// Why it does not hold, if it does not, and where the page shows that.
    cause: String,
}

/// What a run says of a claim.
#[derive(Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Verdict {
    Holds,
    /// For a cause of ours.
    Fails,
    /// The cause is shown by an experiment that isolates it, and is the claim's own.
    Refuted,
    /// What decides about the claim is not at hand: the cause tells what.
    Untested,
}

/// The root mean squared difference of displayed values, of white, from which on two pictures look different: five of 255 levels.
pub const VISIBLE: f64 = 0.02;

impl Verdict {
    /// Holds, or else this.
    pub fn unless(self, holds: bool) -> Verdict {
        if holds { Verdict::Holds } else { self }
    }

    fn name(self) -> &'static str {
        match self {
            Verdict::Holds => "holds",
            Verdict::Fails => "**does not hold**",
            Verdict::Refuted => "**refuted**",
            Verdict::Untested => "**not tested as in the paper**",
        }
    }
}

impl From<bool> for Verdict {
    fn from(holds: bool) -> Verdict {
        if holds { Verdict::Holds } else { Verdict::Fails }
    }
}

/// The cause where the run has none: pages print no cause that its numbers do not show.
const UNKNOWN: &str = "not examined";

impl Claims {
    /// Adds a claim: its words, what the paper says, what was measured, and why it does not hold, if it does not.
    fn add(&mut self, [claim, paper, here, cause]: [String; 4], verdict: Verdict) {
        let cause = if cause.is_empty() { UNKNOWN.into() } else { cause };
        self.0.push(Claim { claim, paper, here, verdict, cause });
    }

    /// How many hold, those that do not with their causes, then the others.
    ///
    /// # Errors
    /// None: writing to a string does not fail.
    pub fn write(&self, out: &mut String) -> Result<()> {
        let holds = |claim: &&Claim| claim.verdict == Verdict::Holds;
        let others = || self.0.iter().filter(|claim| !holds(claim));
        writeln!(out, "{} of the paper's {} claims hold.", self.0.iter().filter(holds).count(), self.0.len())?;
        if others().count() > 0 {
            writeln!(out, "\nWhat does not hold, and why:\n")?;
            writeln!(out, "| claim | paper | measured | verdict | cause |\n|---|---|---|---|---|")?;
            for Claim { claim, paper, here, verdict, cause } in others() {
                writeln!(out, "| {claim} | {paper} | {here} | {} | {cause} |", verdict.name())?;
            }
        }
        writeln!(out, "\nWhat holds:\n\n| claim | paper | measured | verdict |\n|---|---|---|---|")?;
        for Claim { claim, paper, here, verdict, .. } in self.0.iter().filter(holds) {
            writeln!(out, "| {claim} | {paper} | {here} | {} |", verdict.name())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_are_those_that_were_measured() {
        let (mut claims, mut out) = (Claims::default(), String::new());
        claims.add(["a", "1", "2", "c"].map(String::from), true.into());
        claims.add(["b", "3", "4", "d"].map(String::from), false.into());
        claims.add(["e", "5", "6", ""].map(String::from), Verdict::Untested);
        claims.add(["g", "7", "8", ""].map(String::from), Verdict::Refuted.unless(true));
        claims.write(&mut out).unwrap();
        assert!(out.starts_with("2 of the paper's 4 claims hold."));
        assert!(out.contains("| b | 3 | 4 | **does not hold** | d |") && out.contains("| a | 1 | 2 | holds |"));
        assert!(out.contains("| e | 5 | 6 | **not tested as in the paper** | not examined |"));
    }
}
