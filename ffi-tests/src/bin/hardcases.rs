//! Prints the table of hard cases and writes its page: hardcases <page> [--check]

use std::process::ExitCode;
use wis_ffi_tests::hardcases;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (page, check) = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [page] => (page, false),
        [page, "--check"] => (page, true),
        _ => {
            eprintln!("usage: hardcases <page> [--check]");
            return ExitCode::from(2);
        }
    };
    let table = hardcases::run();
    print!("{}", table.page());
    let written = if check { compare(&table, page) } else { std::fs::write(page, table.page()) };
    if let Err(fault) = &written {
        eprintln!("{page}: {fault}");
    }
    if written.is_ok() && table.failures() == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn compare(table: &hardcases::Table, page: &str) -> std::io::Result<()> {
    let stale = || std::io::Error::other("not what `make hardcases` writes");
    if table.matches(&std::fs::read_to_string(page)?) { Ok(()) } else { Err(stale()) }
}
