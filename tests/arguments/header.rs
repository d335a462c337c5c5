//! The declarations of the headers: which functions there are, what their parameters are, which structs begin with
//! their size.

const HEADERS: &str = concat!(
    include_str!("../../include/wis.h"),
    include_str!("../../include/wis_lights.h"),
    include_str!("../../include/wis_wavelets.h")
);

/// A function as the header declares it.
pub struct Function {
    pub name: String,
    pub parameters: Vec<Parameter>,
    pub answers_status: bool,
}

/// A parameter as the header declares it.
pub struct Parameter {
    /// Without `struct`, single spaces: `const float *wi`, `const wis_environment **environment`, `float u[2]`.
    pub declaration: String,
    pub name: String,
}

impl Function {
    pub fn parameter(&self, name: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|parameter| parameter.name == name)
    }

    /// Whether a parameter is declared like this.
    pub fn takes(&self, declaration: &str) -> bool {
        self.parameters.iter().any(|parameter| parameter.declaration == declaration)
    }
}

impl Parameter {
    fn new(declaration: &str) -> Parameter {
        let name = declaration.split('[').next().unwrap_or("").rsplit([' ', '*']).next().unwrap_or("");
        Parameter { declaration: declaration.into(), name: name.into() }
    }

    pub fn is_pointer(&self) -> bool {
        self.declaration.contains(['*', '['])
    }

    /// Whether the call writes numbers through the pointer, or builds there.
    pub fn is_result(&self) -> bool {
        let handle = self.declaration.contains("**");
        self.is_pointer() && !self.declaration.starts_with("const") && !handle && self.name != "diagnostic"
    }

    /// What the pointer points to, without `const`: `float`, `wis_point`, `wis_environment *`.
    pub fn pointee(&self) -> &str {
        let declaration = self.declaration.trim_start_matches("const ");
        let end = declaration.rfind(['*', '[']).unwrap_or(declaration.len());
        declaration[..end].trim_end_matches(self.name.as_str()).trim()
    }
}

/// Every function, in the order of the headers.
pub fn functions() -> Vec<Function> {
    code().split(';').filter_map(function).collect()
}

/// The names in front of a parenthesis anywhere in the code, found without understanding declarations.
pub fn called_names() -> Vec<String> {
    let code = code();
    let pieces = code.split('(');
    let names = pieces.filter_map(|before| before.rsplit(|c: char| !c.is_alphanumeric() && c != '_').next());
    names.filter(|name| name.starts_with("wis_")).map(String::from).collect()
}

/// Whether the first field of a struct is its size.
pub fn begins_with_size(name: &str) -> bool {
    code().contains(&format!("typedef {name} {{ uint32_t size;"))
}

fn function(statement: &str) -> Option<Function> {
    let (before, parameters) = statement.split_once('(')?;
    let name = before.rsplit([' ', '*']).next().filter(|name| name.starts_with("wis_"))?;
    let parameters = parameters.trim_end_matches(')').split(", ").filter(|&parameter| parameter != "void");
    let parameters = parameters.map(Parameter::new).collect();
    Some(Function { name: name.into(), parameters, answers_status: before.contains("wis_status wis_") })
}

/// The headers without comments, preprocessor lines and `struct` and `enum`, on one line with single spaces.
fn code() -> String {
    let mut code = String::new();
    for piece in HEADERS.split("/*") {
        code.push_str(piece.split_once("*/").map_or(piece, |(_, after)| after));
    }
    let lines = code.lines().map(str::trim).filter(|line| !line.starts_with("//") && !line.starts_with('#'));
    let words = lines.flat_map(str::split_whitespace).filter(|word| !matches!(*word, "struct" | "enum"));
    words.collect::<Vec<_>>().join(" ").replace("(struct ", "(")
}
