//! Mutants (rule 36): each rule of the design that a test can guard has one, and what it breaks is still there to be broken.

use crate::pages::{read, root};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;

/// Rules without a mutant, and why.
const WITHOUT: [(u32, &str); 10] = [
    (5, "a plain struct has no fault of its own"),
    (29, "the compiler denies unsafe code"),
    (30, "recorded bits tell platforms apart"),
    (31, "the report's"),
    (32, "the report's"),
    (34, "the report's"),
    (35, "the report's"),
    (36, "this file"),
    (37, "the report's"),
    (38, "the report's"),
];

/// A patch and the lines that it begins with.
struct Mutant {
    name: String,
    fields: BTreeMap<String, String>,
    patch: String,
}

impl Mutant {
    /// Whether it adds something, with a test that must pass.
    fn adds(&self) -> bool {
        self.fields.contains_key("Adds")
    }

    fn field(&self, name: &str) -> &str {
        self.fields.get(name).unwrap_or_else(|| panic!("{} has no line `{name}: ...`", self.name))
    }

    /// The rule that it breaks; none for what no rule of the design describes.
    fn rule(&self) -> Option<u32> {
        match self.field("Rule") {
            "none" => None,
            number => Some(number.parse().unwrap_or_else(|_| panic!("{}: rule {number}", self.name))),
        }
    }
}

fn mutants() -> Vec<Mutant> {
    let folder = fs::read_dir(root().join("tests/mutants")).expect("patches");
    let mut names: Vec<String> =
        folder.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    let mutant = |name: String| {
        let text = read(&format!("tests/mutants/{name}"));
        let (head, patch) = text.split_once("\n\n").unwrap_or_else(|| panic!("{name} has no head"));
        let fields = head.lines().map(|line| line.split_once(": ").unwrap_or_else(|| panic!("{name}: {line}")));
        let fields = fields.map(|(field, value)| (field.to_string(), value.to_string())).collect();
        Mutant { name, fields, patch: patch.to_string() }
    };
    names.into_iter().map(mutant).collect()
}

/// The numbers of the rules of the design.
fn rules() -> BTreeSet<u32> {
    let number = |line: &str| line.strip_prefix("**")?.split_once(". ")?.0.parse().ok();
    read("docs/design.md").lines().filter_map(number).collect()
}

#[test]
fn each_rule_has_a_mutant_or_a_reason() {
    let (rules, broken) = (rules(), mutants().iter().filter_map(Mutant::rule).collect::<BTreeSet<u32>>());
    assert!(rules.len() > 35, "{rules:?}");
    let excused: BTreeSet<u32> = WITHOUT.iter().map(|(rule, _)| *rule).collect();
    assert!(broken.is_subset(&rules) && excused.is_subset(&rules), "no rule of the design");
    assert!(broken.is_disjoint(&excused), "has a mutant: {:?}", broken.intersection(&excused));
    let without: Vec<&u32> = rules.iter().filter(|rule| !broken.contains(rule) && !excused.contains(rule)).collect();
    assert!(without.is_empty(), "rules without a mutant: {without:?}");
}

/// The test that is named stands in the file that its path says, in a binary that has this module.
#[test]
fn the_named_tests_are_there() {
    for mutant in mutants().into_iter().filter(|mutant| !mutant.adds()) {
        mutant.field("Fault");
        let words: Vec<&str> = mutant.field("Test").split(' ').collect();
        let ["--test", binary, path] = words[..] else { panic!("{}: Test: {words:?}", mutant.name) };
        let (modules, test) = path.rsplit_once("::").unwrap_or_else(|| panic!("{}: {path}", mutant.name));
        let first = modules.split("::").next().expect("a module");
        assert!(read(&format!("tests/{binary}.rs")).contains(&format!("mod {first};")), "{}: {path}", mutant.name);
        let file = format!("tests/{}", modules.replace("::", "/"));
        let files = [format!("{file}.rs"), format!("{file}/mod.rs")];
        let source = files.iter().find(|file| root().join(file).exists());
        let source = read(source.unwrap_or_else(|| panic!("{}: no file {file}", mutant.name)));
        assert!(source.contains(&format!("#[test]\nfn {test}()")), "{}: no test {path}", mutant.name);
    }
}

/// A hunk of a patch: what must stand in the source, but for the lines at both ends that `patch --fuzz=2` does without.
fn kept_by_fuzz<'a>(hunk: &[&'a str]) -> Vec<&'a str> {
    let old: Vec<&str> = hunk.iter().copied().filter(|line| !line.starts_with('+')).collect();
    let context =
        |lines: &mut dyn Iterator<Item = &&str>| lines.take(2).take_while(|line| line.starts_with(' ')).count();
    let (first, last) = (context(&mut old.iter()), context(&mut old.iter().rev()));
    old[first..old.len() - last].iter().map(|line| &line[1..]).collect()
}

/// A patch whose lines or whose surroundings changed breaks nothing: it has to be made anew.
#[test]
fn what_they_break_is_there() {
    for mutant in mutants() {
        let lines: Vec<&str> = mutant.patch.lines().collect();
        let mut source = String::new();
        for part in lines.chunk_by(|_, line| !line.starts_with("--- ") && !line.starts_with("@@")) {
            if part[0] == "--- /dev/null" {
                source.clear();
            } else if let Some(file) = part[0].strip_prefix("--- a/") {
                source = read(file);
            } else if part[0].starts_with("@@") && !source.is_empty() {
                let (there, wanted) = (source.lines().collect::<Vec<_>>(), kept_by_fuzz(&part[1..]));
                let found = there.windows(wanted.len()).any(|lines| lines == wanted);
                assert!(found, "{} is stale, make it anew: {wanted:#?} are not there", mutant.name);
            }
        }
        assert!(!source.is_empty(), "{} breaks nothing", mutant.name);
    }
}

/// The steps to add a lobe name each file that one takes, and no other of the kernel but what wide lobes do without.
#[test]
fn the_recipe_of_a_lobe_names_its_files() {
    let page = read("CONTRIBUTING.md");
    let (_, recipe) = page.split_once("## A lobe\n").expect("the recipe");
    let (recipe, _) = recipe.split_once("\n## ").expect("what follows");
    let lobe = mutants().into_iter().find(|mutant| mutant.adds()).expect("a patch that adds a lobe");
    let changed: BTreeSet<&str> = lobe.patch.lines().filter_map(|line| line.strip_prefix("+++ b/")).collect();
    let named = |file: &str| {
        if recipe.contains(&format!("`{file}`")) { file.to_string() } else { file.replace("cubed", "NAME") }
    };
    let missing: Vec<_> =
        changed.iter().map(|file| named(file)).filter(|file| !recipe.contains(&format!("`{file}`"))).collect();
    assert!(missing.is_empty(), "the recipe does not name {missing:?}");
    let steps = recipe.split('`').filter(|name| name.starts_with("src/") && !name.ends_with("peak.rs"));
    let unused: Vec<&str> = steps.filter(|step| !changed.contains(step.replace("NAME", "cubed").as_str())).collect();
    assert!(unused.is_empty(), "the patch does without {unused:?}");
}
