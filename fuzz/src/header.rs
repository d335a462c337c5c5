//! What the headers declare: functions, structs with the offsets of their fields, and the statuses that comments name.

use std::collections::{BTreeMap, BTreeSet};

/// Their text, one after the other.
pub const HEADERS: &str = concat!(
    include_str!("../../include/wis.h"),
    include_str!("../../include/wis_lights.h"),
    include_str!("../../include/wis_wavelets.h")
);

/// A number or a pointer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    U8,
    U32,
    U64,
    F32,
    F64,
    Pointer,
}

impl Scalar {
    /// Bytes, and the alignment.
    pub fn size(self) -> usize {
        match self {
            Scalar::U8 => 1,
            Scalar::U32 | Scalar::F32 => 4,
            Scalar::U64 | Scalar::F64 | Scalar::Pointer => 8,
        }
    }

    pub fn is_float(self) -> bool {
        matches!(self, Scalar::F32 | Scalar::F64)
    }

    fn of(name: &str) -> Option<Scalar> {
        Some(match name {
            "uint8_t" => Scalar::U8,
            "uint32_t" | "int" => Scalar::U32,
            "uint64_t" | "size_t" | "ptrdiff_t" => Scalar::U64,
            "float" => Scalar::F32,
            "double" => Scalar::F64,
            name if name.contains('*') || name.ends_with("_fn") => Scalar::Pointer,
            _ => return None,
        })
    }
}

/// A scalar in a struct: `lobe[1].a`.
#[derive(Clone, Debug)]
pub struct Field {
    pub path: String,
    pub offset: usize,
    pub scalar: Scalar,
}

/// A type that pointers point to: a struct, or a scalar as a struct of one field.
#[derive(Clone, Debug, Default)]
pub struct Layout {
    pub fields: Vec<Field>,
    pub size: usize,
    pub align: usize,
}

impl Layout {
    fn one(scalar: Scalar) -> Layout {
        let field = Field { path: String::new(), offset: 0, scalar };
        Layout { fields: vec![field], size: scalar.size(), align: scalar.size() }
    }

    /// Adds a field, or each element of an array.
    fn add(&mut self, name: &str, dimensions: &[usize], of: &Layout) {
        self.align = self.align.max(of.align);
        if let [count, rest @ ..] = dimensions {
            for index in 0..*count {
                self.add(&format!("{name}[{index}]"), rest, of);
            }
            return;
        }
        let start = self.size.next_multiple_of(of.align);
        for field in &of.fields {
            let dot = if field.path.is_empty() { "" } else { "." };
            let path = format!("{name}{dot}{}", field.path);
            self.fields.push(Field { path, offset: start + field.offset, scalar: field.scalar });
        }
        self.size = start + of.size;
    }

    /// Whether the first field is the size of the struct.
    pub fn begins_with_size(&self) -> bool {
        self.fields.first().is_some_and(|field| field.path == "size")
    }

    pub fn field(&self, path: &str) -> &Field {
        let found = self.fields.iter().find(|field| field.path == path);
        found.unwrap_or_else(|| panic!("no field {path} in {self:?}"))
    }
}

/// A parameter as the header declares it, without `struct`.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// `const float *wi`.
    pub declaration: String,
    /// `wi`.
    pub name: String,
    /// What it points to, without `const`: `float`, `wis_tree *`; empty for a number.
    pub pointee: String,
    /// The number of elements that it is declared with: 9 of `const float world_from_map[9]`.
    pub elements: Option<usize>,
    pub scalar: Scalar,
}

impl Parameter {
    fn new(declaration: &str) -> Parameter {
        let before = declaration.split('[').next().unwrap_or_default();
        let name = before.rsplit([' ', '*']).next().unwrap_or_default();
        let of = before.trim_end_matches(name).trim();
        let elements = declaration.split_once('[').and_then(|(_, rest)| rest.trim_end_matches(']').parse().ok());
        let is_pointer = of.ends_with('*') || elements.is_some();
        let pointee = of.strip_suffix('*').unwrap_or(of).trim_start_matches("const ").trim();
        Parameter {
            declaration: declaration.into(),
            name: name.into(),
            pointee: if is_pointer { pointee.into() } else { String::new() },
            elements,
            scalar: if is_pointer { Scalar::Pointer } else { Scalar::of(of).expect(declaration) },
        }
    }

    pub fn is_pointer(&self) -> bool {
        self.scalar == Scalar::Pointer
    }

    /// Whether the call writes numbers through the pointer, or builds there.
    pub fn is_result(&self) -> bool {
        let is_read = self.declaration.starts_with("const") || self.is_handle();
        self.is_pointer() && !is_read && self.name != "diagnostic"
    }

    /// Whether the call only reads behind the pointer.
    pub fn is_input(&self) -> bool {
        self.declaration.starts_with("const ") && !self.is_handle()
    }

    /// Whether the call writes the address of an object: `const wis_tree **tree`.
    pub fn is_handle(&self) -> bool {
        self.declaration.contains("**")
    }
}

/// A function as the header declares it.
#[derive(Clone, Debug)]
pub struct Function {
    pub name: String,
    pub parameters: Vec<Parameter>,
    pub answers_status: bool,
    /// The statuses that its comment names.
    pub statuses: BTreeSet<String>,
    /// What its work is at most proportional to: `count` of `Work: count.`
    pub work: Option<String>,
}

impl Function {
    pub fn position(&self, name: &str) -> Option<usize> {
        self.parameters.iter().position(|parameter| parameter.name == name)
    }

    pub fn has(&self, name: &str) -> bool {
        self.position(name).is_some()
    }

    /// The query that tells how long the blocks of a call must be.
    ///
    /// # Panics
    /// If there is none.
    pub fn size_query(&self) -> String {
        let verbs = ["_init", "_begin", "_run", "_finish", "_prepare", "_lights"];
        let object = verbs.iter().find_map(|verb| self.name.strip_suffix(verb));
        format!("{}_size", object.unwrap_or_else(|| panic!("{} has no size query", self.name)))
    }

    /// Whether a parameter is declared like this.
    pub fn takes(&self, declaration: &str) -> bool {
        self.parameters.iter().any(|parameter| parameter.declaration == declaration)
    }
}

/// Everything that the headers declare.
pub struct Headers {
    pub functions: Vec<Function>,
    pub layouts: BTreeMap<String, Layout>,
    constants: BTreeMap<String, usize>,
    /// `WIS_OK` and the others, by their numbers.
    pub statuses: Vec<String>,
}

impl Headers {
    pub fn read() -> Headers {
        let mut headers = Headers {
            functions: Vec::new(),
            layouts: BTreeMap::new(),
            constants: BTreeMap::new(),
            statuses: Vec::new(),
        };
        for scalar in ["uint8_t", "uint32_t", "uint64_t", "size_t", "float", "double"] {
            headers.layouts.insert(scalar.into(), Layout::one(Scalar::of(scalar).expect(scalar)));
        }
        let (mut statement, mut comment, mut depth) = (String::new(), String::new(), 0);
        let plain = HEADERS.split("/*").map(|piece| piece.split_once("*/").map_or(piece, |(_, after)| after));
        for line in plain.flat_map(str::lines).map(str::trim) {
            if let Some(text) = line.strip_prefix("///") {
                comment.push_str(text);
            } else if let Some(definition) = line.strip_prefix("#define ") {
                headers.constant(definition);
                comment.clear();
            } else if !line.is_empty() && !line.starts_with('#') && !line.starts_with("extern \"C\"") {
                statement = format!("{statement} {line}");
                depth += line.matches('{').count() as isize - line.matches('}').count() as isize;
                if line == "}" && depth < 0 {
                    (statement, depth) = (String::new(), 0);
                } else if line.ends_with(';') && depth == 0 {
                    headers.statement(&statement, &comment);
                    (statement, comment) = (String::new(), String::new());
                }
            }
        }
        headers
    }

    fn constant(&mut self, definition: &str) {
        if let Some((name, value)) = definition.split_once(' ') {
            let value = value.trim_matches(['(', ')']);
            let shifted =
                value.split_once(" << ").and_then(|(a, b)| Some(a.parse::<usize>().ok()? << b.parse::<u32>().ok()?));
            if let Some(value) = shifted.or_else(|| value.parse().ok()) {
                self.constants.insert(name.into(), value);
            }
        }
    }

    fn statement(&mut self, text: &str, comment: &str) {
        let of_enum = text.trim().strip_prefix("typedef enum ").and_then(|rest| rest.split_once(" {"));
        let words = text.split_whitespace().filter(|word| !matches!(*word, "struct" | "enum"));
        let text = words.collect::<Vec<_>>().join(" ").replace("(struct ", "(");
        if let Some((name, body)) = of_enum {
            let numbers = body.split([',', '}']).filter_map(|item| item.split_once(" = "));
            let named = numbers.map(|(name, number)| (name.trim().into(), number.trim().parse().expect("a number")));
            let named: Vec<(String, usize)> = named.collect();
            if name == "wis_status" {
                self.statuses = named.iter().map(|(name, _)| name.clone()).collect();
            }
            self.constants.extend(named);
        } else if let Some((name, body)) = text.strip_prefix("typedef ").and_then(|rest| rest.split_once(" {")) {
            let layout = self.layout(body.split('}').next().unwrap_or_default());
            self.layouts.insert(name.into(), layout);
        } else if !text.starts_with("typedef") {
            self.functions.extend(function(&text, comment));
        }
    }

    fn layout(&self, body: &str) -> Layout {
        let mut layout = Layout { align: 1, ..Layout::default() };
        for field in body.split(';').map(str::trim).filter(|field| !field.is_empty()) {
            let (before, after) = field.split_once('[').unwrap_or((field, ""));
            let name = before.rsplit([' ', '*']).next().unwrap_or_default();
            let of = before.trim_end_matches(name).trim();
            let number = |text: &str| text.parse().unwrap_or_else(|_| self.constants[text]);
            let sizes = after.split(['[', ']']).filter(|text| !text.is_empty());
            let dimensions: Vec<usize> = sizes.map(number).collect();
            let element = Scalar::of(of).map(Layout::one).unwrap_or_else(|| self.layouts[of].clone());
            layout.add(name, &dimensions, &element);
        }
        layout.size = layout.size.next_multiple_of(layout.align);
        layout
    }

    /// What a pointer to it points to: pointers to pointers hold a word; objects and blocks are bytes.
    pub fn pointed(&self, parameter: &Parameter) -> Layout {
        if parameter.pointee.ends_with('*') || parameter.pointee.ends_with("const") {
            return Layout::one(Scalar::Pointer);
        }
        self.layouts.get(&parameter.pointee).cloned().unwrap_or(Layout { size: 1, align: 16, fields: Vec::new() })
    }

    /// The value of a constant.
    pub fn constant_of(&self, name: &str) -> usize {
        *self.constants.get(name).unwrap_or_else(|| panic!("no constant {name}"))
    }
}

fn function(text: &str, comment: &str) -> Option<Function> {
    let (before, parameters) = text.trim_end_matches(';').split_once('(')?;
    let name = before.rsplit([' ', '*']).next().filter(|name| name.starts_with("wis_"))?;
    let parameters =
        parameters.trim_end_matches(')').split(',').map(str::trim).filter(|parameter| *parameter != "void");
    let words = comment.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
    Some(Function {
        name: name.into(),
        parameters: parameters.map(Parameter::new).collect(),
        answers_status: before.starts_with("wis_status"),
        statuses: words.filter(|word| word.starts_with("WIS_")).map(String::from).collect(),
        work: comment.split_once("Work: ").and_then(|(_, rest)| rest.split_once('.')).map(|(work, _)| work.into()),
    })
}
