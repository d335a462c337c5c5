//! No `&mut` to memory that other threads may read. The types say so: `blob::Shared`, which every call on a built object
//! goes through, gives `&` alone. This test keeps the ways round those types closed.

use std::fs;
use std::path::Path;

/// Every line of code below a folder, with its file.
fn lines(folder: &Path) -> Vec<(String, String)> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let of = |path: std::path::PathBuf| {
        if path.is_dir() {
            return lines(&path);
        }
        let text = fs::read_to_string(&path).unwrap();
        let code = text.lines().map(str::trim).filter(|line| !line.starts_with("//"));
        code.map(|line| (path.display().to_string(), line.to_string())).collect()
    };
    entries.flat_map(of).collect()
}

fn holding(lines: &[(String, String)], words: &str) -> Vec<String> {
    lines.iter().filter(|(_, line)| line.contains(words)).map(|(path, line)| format!("{path}: {line}")).collect()
}

#[test]
fn what_is_given_as_const_is_never_written() {
    let lines = lines(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"));
    assert!(lines.len() > 5000);
    // A pointer to const stays one.
    for words in ["cast_mut()", "as *mut", "static mut", "transmute"] {
        assert_eq!(holding(&lines, words), [] as [String; 0], "{words}");
    }
    // Slices that can be written: results of a call, and blocks in which it builds.
    let writable = holding(&lines, "from_raw_parts_mut");
    let places = ["src/blob.rs", "src/ffi/memory.rs"];
    let once = |place: &&str| writable.iter().filter(|line| line.contains(*place)).count() == 1;
    let each_once = writable.len() == 2 && places.iter().all(once);
    assert!(each_once, "{writable:#?}");
}
