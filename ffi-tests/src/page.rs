//! A page of tables, plots and pictures: a short form in Markdown with files beside it, and all of it as one HTML file that
//! needs no other.

use anyhow::{Context, Result};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use std::fmt::Write;
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
    /// A file name, PNG, and what it shows.
    Picture(String, Vec<u8>, String),
}

/// A table whose first columns are words and whose others are numbers.
pub struct Table {
    pub head: Vec<String>,
    /// Columns of words.
    pub words: usize,
    pub rows: Vec<Vec<String>>,
}

impl Table {
    pub fn new(words: usize, head: &[impl AsRef<str>]) -> Table {
        Table { head: head.iter().map(|name| name.as_ref().to_string()).collect(), words, rows: Vec::new() }
    }

    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }
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
    /// In both forms.
    pub short: Vec<Part>,
    /// In HTML alone: a summary of each group, and its parts.
    pub long: Vec<(String, Vec<Part>)>,
    /// A comment at the end of both.
    pub made_from: String,
}

impl Page {
    /// A page in short form alone, that ends with the commit and what it was made from.
    ///
    /// # Errors
    /// The script that computes that cannot be run.
    pub fn measured(title: &str, mut short: Vec<Part>, instrument: &str) -> Result<Page> {
        short.push(Part::Text(format!("Commit {}.", commit())));
        Ok(Page { title: title.into(), short, long: Vec::new(), made_from: made_from(instrument)? })
    }

    /// Writes the short form, and its plots and pictures to the folder of its name without the extension.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write_markdown(&self, file: &Path) -> Result<()> {
        if let Some(parent) = file.parent() {
            std::fs::create_dir_all(parent)?;
        }
        println!("The page is {}", file.display());
        let folder = file.with_extension("");
        if folder.exists() {
            std::fs::remove_dir_all(&folder)?;
        }
        let beside = folder.file_name().and_then(|name| name.to_str()).unwrap_or(".");
        let mut out = format!("# {}\n", self.title);
        for part in &self.short {
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
                Part::Picture(name, png, caption) => {
                    std::fs::create_dir_all(&folder)?;
                    std::fs::write(folder.join(name), png)?;
                    writeln!(out, "![{caption}]({beside}/{name})\n\n{caption}")?;
                }
            }
        }
        writeln!(out, "\n<!-- {} -->", self.made_from)?;
        Ok(std::fs::write(file, out)?)
    }

    /// Writes everything.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_html(&self, file: &Path) -> Result<()> {
        let mut out = String::from("<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n");
        writeln!(out, "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">")?;
        writeln!(out, "<title>{}</title>\n<style>\n{STYLE}</style></head>\n<body><main>", escaped(&self.title))?;
        writeln!(out, "<h1>{}</h1>", escaped(&self.title))?;
        self.short.iter().try_for_each(|part| part.html(&mut out))?;
        for (summary, parts) in &self.long {
            writeln!(out, "<details><summary>{}</summary>", inline(summary))?;
            parts.iter().try_for_each(|part| part.html(&mut out))?;
            writeln!(out, "</details>")?;
        }
        writeln!(out, "</main>\n<script>\n{SCRIPT}</script>\n<!-- {} -->\n</body></html>", self.made_from)?;
        Ok(std::fs::write(file, out)?)
    }
}

impl Part {
    fn html(&self, out: &mut String) -> std::fmt::Result {
        match self {
            Part::Heading(text) => writeln!(out, "<h2 id=\"{}\">{}</h2>", anchor(text), inline(text)),
            Part::Text(text) => writeln!(out, "<p>{}</p>", inline(text)),
            Part::List(items) => {
                writeln!(out, "<ul>")?;
                items.iter().try_for_each(|item| writeln!(out, "<li>{}</li>", inline(item)))?;
                writeln!(out, "</ul>")
            }
            Part::Table(table) => table.html(out),
            Part::Plot(_, svg, caption) => {
                writeln!(out, "<figure>{svg}<figcaption>{}</figcaption></figure>", inline(caption))
            }
            Part::Picture(_, png, caption) => {
                let (data, caption) = (BASE64_STANDARD.encode(png), inline(caption));
                write!(out, "<figure><img alt=\"{caption}\" src=\"data:image/png;base64,{data}\">")?;
                writeln!(out, "<figcaption>{caption}</figcaption></figure>")
            }
        }
    }
}

impl Table {
    fn markdown(&self, out: &mut String) -> std::fmt::Result {
        let rule = (0..self.head.len()).map(|i| if i < self.words { "---|" } else { "---:|" });
        writeln!(out, "| {} |\n|{}", self.head.join(" | "), rule.collect::<String>())?;
        self.rows.iter().try_for_each(|row| writeln!(out, "| {} |", row.join(" | ")))
    }

    fn html(&self, out: &mut String) -> std::fmt::Result {
        let class = |i: usize| if i < self.words { "" } else { " class=n" };
        write!(out, "<div class=t><table><thead><tr>")?;
        for (i, name) in self.head.iter().enumerate() {
            write!(out, "<th{}>{}", class(i), inline(name))?;
        }
        writeln!(out, "</tr></thead><tbody>")?;
        for row in &self.rows {
            write!(out, "<tr>")?;
            for (i, cell) in row.iter().enumerate() {
                write!(out, "<td{}{}>{}", class(i), tint(cell), inline(cell))?;
            }
            writeln!(out)?;
        }
        writeln!(out, "</tbody></table></div>")
    }
}

/// The background of a gain: blue where it is ahead, red where it is behind, stronger with its logarithm.
fn tint(cell: &str) -> String {
    let number = cell.split_whitespace().next().and_then(|word| word.strip_suffix('x')?.parse::<f64>().ok());
    let Some(gain) = number.filter(|gain| *gain > 0.0) else { return String::new() };
    let strength = (gain.log2().abs() * 0.16).min(0.5);
    let colour = if gain >= 1.0 { "30,110,200" } else { "210,50,30" };
    format!(" style=\"background:rgba({colour},{strength:.2})\"")
}

/// The name of a heading in links: that which Markdown gives it.
fn anchor(heading: &str) -> String {
    let kept = |c: char| c.is_alphanumeric() || " -_".contains(c);
    heading.to_lowercase().chars().filter(|&c| kept(c)).map(|c| if c == ' ' { '-' } else { c }).collect()
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Text with its `code`, **bold** and links.
fn inline(text: &str) -> String {
    let mut out = escaped(text);
    for (mark, tag) in [("**", "b"), ("`", "code")] {
        let parts: Vec<&str> = out.split(mark).collect();
        let wrapped =
            |(i, part): (usize, &&str)| if i % 2 == 1 { format!("<{tag}>{part}</{tag}>") } else { part.to_string() };
        out = parts.iter().enumerate().map(wrapped).collect();
    }
    while let Some(middle) = out.find("](") {
        let (Some(open), Some(close)) = (out[..middle].rfind('['), out[middle..].find(')')) else { break };
        let (name, place) = (out[open + 1..middle].to_string(), out[middle + 2..middle + close].to_string());
        out.replace_range(open..=middle + close, &format!("<a href=\"{place}\">{name}</a>"));
    }
    out
}

const STYLE: &str = include_str!("page.css");

/// Writes how much was loaded where a test can read it.
const SCRIPT: &str = include_str!("page.js");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_become_tags_and_gains_a_colour() {
        assert_eq!(inline("a < `b` **c** [d](e.md)"), "a &lt; <code>b</code> <b>c</b> <a href=\"e.md\">d</a>");
        assert_eq!(anchor("Ahead, undecided, behind"), "ahead-undecided-behind");
        assert!(tint("2.0x").contains("30,110,200") && tint("0.50x [0.4, 0.6]").contains("210,50,30"));
        assert!(tint("2.0").is_empty() && tint("venice").is_empty());
        assert_eq!([times(0.256), times(12.34), times(f64::NAN)], ["0.26x", "12.3x", "-"]);
    }
}
