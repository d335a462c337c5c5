//! The page of a paper: its claims beside what a run measured, then the sections. Each verdict follows from the numbers of the
//! run that writes the page.

use crate::images::Sheet;
use crate::page;
use anyhow::{Context, Result};
use std::fmt::Write;
use std::path::PathBuf;

/// What is written.
pub struct Paper {
    file: PathBuf,
    /// The commit that it is written at.
    commit: String,
    /// The folder of the pictures.
    pub pictures: PathBuf,
    /// The sections.
    pub text: String,
    pub claims: Claims,
}

impl Paper {
    /// A page at the path that is the first argument of the program; pictures go to the folder of its name.
    ///
    /// # Errors
    /// There is no argument, or the folder cannot be made.
    pub fn from_arguments() -> Result<Paper> {
        let file = PathBuf::from(std::env::args().nth(1).context("which page is to be written?")?);
        // Before pictures of the run before are replaced.
        let commit = page::commit();
        let pictures = file.with_extension("");
        if pictures.exists() {
            std::fs::remove_dir_all(&pictures)?;
        }
        std::fs::create_dir_all(&pictures)?;
        Ok(Paper { file, commit, pictures, text: String::new(), claims: Claims::default() })
    }

    /// Whether a section is to be written: all are, unless arguments after the first name some.
    pub fn wants(&self, section: &str) -> bool {
        std::env::args().len() < 3 || std::env::args().skip(2).any(|name| name == section)
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

    /// Writes the page: title and introduction, in which {commit} is replaced, the claims, the sections.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(self, instrument: &str, title: &str, introduction: &str) -> Result<()> {
        let mut text = format!("# {title}\n\n{}\n", introduction.replace("{commit}", &self.commit));
        self.claims.write(&mut text)?;
        text += &self.text;
        writeln!(text, "\n<!-- {} -->", page::made_from(instrument)?)?;
        print!("{text}");
        Ok(std::fs::write(self.file, text)?)
    }
}

/// The claims of a page, in the order of the paper.
#[derive(Default)]
pub struct Claims(Vec<Claim>);

struct Claim {
    claim: String,
    paper: String,
    here: String,
    holds: bool,
    /// Why it does not hold, if it does not, and where the page shows that.
    cause: String,
}

impl Claims {
    /// Adds a claim: its words, what the paper says, what was measured, whether it holds, and why if it does not.
    pub fn add(&mut self, claim: &str, paper: &str, here: String, holds: bool, cause: &str) {
        let [claim, paper, cause] = [claim, paper, cause].map(String::from);
        self.0.push(Claim { claim, paper, here, holds, cause });
    }

    /// How many hold, those that do not with their causes, then the others.
    ///
    /// # Errors
    /// None: writing to a string does not fail.
    pub fn write(&self, out: &mut String) -> Result<()> {
        let fails = || self.0.iter().filter(|claim| !claim.holds);
        writeln!(out, "{} of the paper's {} claims hold.", self.0.len() - fails().count(), self.0.len())?;
        if fails().count() > 0 {
            writeln!(out, "\nWhat does not hold, and why:\n")?;
            writeln!(out, "| claim | paper | measured | verdict | cause |\n|---|---|---|---|---|")?;
            for Claim { claim, paper, here, cause, .. } in fails() {
                writeln!(out, "| {claim} | {paper} | {here} | **does not hold** | {cause} |")?;
            }
        }
        writeln!(out, "\nWhat holds:\n\n| claim | paper | measured | verdict |\n|---|---|---|---|")?;
        for Claim { claim, paper, here, .. } in self.0.iter().filter(|claim| claim.holds) {
            writeln!(out, "| {claim} | {paper} | {here} | holds |")?;
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
        claims.add("a", "1", "2".into(), true, "c");
        claims.add("b", "3", "4".into(), false, "d");
        claims.write(&mut out).unwrap();
        assert!(out.starts_with("1 of the paper's 2 claims hold."));
        assert!(out.contains("| b | 3 | 4 | **does not hold** | d |") && out.contains("| a | 1 | 2 | holds |"));
    }
}
