//! A page of tables and plots in Markdown, with files beside it.

use anyhow::{Context, Result};
use std::fmt::{Display, Write};
use std::path::Path;
use std::process::Command;

/// What a page is made of. Text may hold `code`, **bold** and [links](of.md).
pub enum Part {
    Heading(String),
    Text(String),
    List(Vec<String>),
    Table(Table),
    /// A file name, SVG, and what it shows.
    Plot(String, String, String),
}

/// A table whose first columns are words and whose others are numbers.
pub struct Table {
    pub head: Vec<String>,
    /// Columns of words.
    pub words: usize,
    pub rows: Vec<Vec<String>>,
}

/// No columns of a kind.
pub const NONE: [&str; 0] = [];

impl Table {
    /// By the heads of its columns.
    pub fn new<W: ToString, N: ToString>(
        words: impl IntoIterator<Item = W>,
        numbers: impl IntoIterator<Item = N>,
    ) -> Table {
        let words: Vec<W> = words.into_iter().collect();
        Table { words: words.len(), head: line(words, numbers), rows: Vec::new() }
    }

    pub fn row<W: ToString, N: ToString>(
        &mut self,
        words: impl IntoIterator<Item = W>,
        numbers: impl IntoIterator<Item = N>,
    ) {
        self.rows.push(line(words, numbers));
    }
}

fn line<W: ToString, N: ToString>(
    words: impl IntoIterator<Item = W>,
    numbers: impl IntoIterator<Item = N>,
) -> Vec<String> {
    let words = words.into_iter().map(|word| word.to_string());
    words.chain(numbers.into_iter().map(|number| number.to_string())).collect()
}

/// Prose of a page, in which values stand in braces: what is below each heading.
pub struct Prose(pub &'static str);

impl Prose {
    /// What stands below a heading. A paragraph and an item of a list become a line each.
    ///
    /// # Panics
    /// There is no such heading.
    pub fn part(&self, heading: &str, values: &[(&str, &dyn Display)]) -> Part {
        let (_, behind) = self.0.split_once(&format!("# {heading}\n\n")).expect(heading);
        let text = behind.split("\n\n#").next().unwrap_or_default().trim_end();
        let text = text.replace("\n- ", "\r- ").replace('\n', " ").replace('\r', "\n");
        Part::Text(values.iter().fold(text, filled))
    }

    /// A heading, what stands below it, and a table.
    pub fn section(&self, heading: &str, values: &[(&str, &dyn Display)], table: Table) -> Vec<Part> {
        vec![Part::Heading(heading.into()), self.part(heading, values), Part::Table(table)]
    }
}

/// A text with one of its braces filled in.
pub fn filled(text: String, (name, value): &(&str, &dyn Display)) -> String {
    text.replace(&format!("{{{name}}}"), &value.to_string())
}

/// A text whose braces are filled with the next values: {}, or {:.2} of a number.
///
/// # Panics
/// There are fewer values than braces.
pub fn filled_in_order<'a>(text: &str, values: &mut impl Iterator<Item = &'a &'a dyn Display>) -> String {
    let mut parts = text.split('{');
    let begin = parts.next().unwrap_or_default().to_string();
    parts.fold(begin, |filled, part| {
        let (digits, behind) = part.split_once('}').expect(text);
        let value = values.next().expect(text);
        let digits = digits.strip_prefix(":.").map(|digits| digits.parse::<usize>().expect(text));
        filled + &digits.map_or_else(|| value.to_string(), |digits| format!("{value:.digits$}")) + behind
    })
}

/// A text and a table below a heading.
pub fn section(heading: &str, text: impl Into<String>, table: Table) -> Vec<Part> {
    vec![Part::Heading(heading.into()), Part::Text(text.into()), Part::Table(table)]
}

/// A gain as pages print it: three figures and an x.
pub fn times(gain: f64) -> String {
    match gain {
        g if !g.is_finite() => "-".into(),
        g if g >= 99.5 => format!("{g:.0}x"),
        g if g >= 9.95 => format!("{g:.1}x"),
        g => format!("{g:.2}x"),
    }
}

/// The commit of the working tree, and whether files differ from it, but for the pages themselves.
pub fn commit() -> String {
    let git = |arguments: &[&str]| {
        let output = Command::new("git").args(arguments).output().ok().filter(|o| o.status.success())?;
        Some(String::from_utf8_lossy(&output.stdout).trim().to_string())
    };
    let changed =
        git(&["status", "--porcelain", "--untracked-files=no", "--", ":!docs"]).is_some_and(|lines| !lines.is_empty());
    git(&["rev-parse", "--short", "HEAD"]).unwrap_or("unknown".into()) + if changed { ", with changes" } else { "" }
}

/// What `make check-pages` compares, for the instrument of a name.
///
/// # Errors
/// The script that computes it cannot be run.
pub fn made_from(instrument: &str) -> Result<String> {
    let output = Command::new("scripts/page-hash.sh").arg(instrument).output().context("scripts/page-hash.sh")?;
    Ok(format!("made from {} by {instrument}", String::from_utf8_lossy(&output.stdout).trim()))
}

/// Parts in the order in which they are read.
pub struct Page {
    pub title: String,
    pub parts: Vec<Part>,
    /// A comment at the end.
    pub made_from: String,
}

impl Page {
    /// A page that ends with the commit and what it was made from.
    ///
    /// # Errors
    /// The script that computes that cannot be run.
    pub fn measured(title: &str, mut parts: Vec<Part>, instrument: &str) -> Result<Page> {
        parts.push(Part::Text(format!("Commit {}.", commit())));
        Ok(Page { title: title.into(), parts, made_from: made_from(instrument)? })
    }

    /// Writes it, and its plots to the folder of its name without the extension.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, file: &Path) -> Result<()> {
        if let Some(parent) = file.parent() {
            std::fs::create_dir_all(parent)?;
        }
        let folder = file.with_extension("");
        if folder.exists() {
            std::fs::remove_dir_all(&folder)?;
        }
        println!("The page is {}", file.display());
        let beside = folder.file_name().and_then(|name| name.to_str()).unwrap_or(".");
        let mut out = format!("# {}\n", self.title);
        for part in &self.parts {
            out.push('\n');
            match part {
                Part::Heading(text) => writeln!(out, "## {text}")?,
                Part::Text(text) => writeln!(out, "{text}")?,
                Part::List(items) => items.iter().try_for_each(|item| writeln!(out, "- {item}"))?,
                Part::Table(table) => table.markdown(&mut out)?,
                Part::Plot(name, svg, caption) => {
                    std::fs::create_dir_all(&folder)?;
                    std::fs::write(folder.join(name), svg)?;
                    writeln!(out, "![{caption}]({beside}/{name})")?;
                }
            }
        }
        writeln!(out, "\n<!-- {} -->", self.made_from)?;
        Ok(std::fs::write(file, out)?)
    }
}

impl Table {
    fn markdown(&self, out: &mut String) -> std::fmt::Result {
        let rule = (0..self.head.len()).map(|i| if i < self.words { "---|" } else { "---:|" });
        writeln!(out, "| {} |\n|{}", self.head.join(" | "), rule.collect::<String>())?;
        self.rows.iter().try_for_each(|row| writeln!(out, "| {} |", row.join(" | ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_have_three_figures() {
        assert_eq!([times(0.256), times(12.34), times(f64::NAN)], ["0.26x", "12.3x", "-"]);
    }

    #[test]
    fn plots_stand_beside_the_page() {
        let folder = std::env::temp_dir().join(format!("wis-page-{}", std::process::id()));
        let mut table = Table::new(["lobe"], ["gain"]);
        table.row(["Lambert"], ["2.0x"]);
        let plot = Part::Plot("p.svg".into(), "<svg/>".into(), "a plot".into());
        let parts = vec![Part::Heading("A".into()), Part::Table(table), plot];
        Page { title: "T".into(), parts, made_from: "made".into() }.write(&folder.join("a.md")).unwrap();
        let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap_or_default();
        let text =
            "# T\n\n## A\n\n| lobe | gain |\n|---|---:|\n| Lambert | 2.0x |\n\n![a plot](a/p.svg)\n\n<!-- made -->\n";
        assert_eq!([read("a.md").as_str(), &read("a/p.svg")], [text, "<svg/>"]);
        std::fs::remove_dir_all(folder).unwrap();
    }
}
