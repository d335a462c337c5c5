//! One call: its arguments, where they stand, and what it may write.

use crate::call::{Answer, Word};
use crate::header::{Function, Layout, Parameter, Scalar};
use crate::maps::Map;
use crate::memory::Place;
use crate::pool::Object;
use crate::random::Random;
use crate::world::World;

/// What a call may do with a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    Input,
    /// Written if the call succeeds, else as it was.
    Result,
    /// Undefined unless the call succeeds.
    Work,
    /// Read and written.
    State,
    /// Written if the call fails.
    Diagnostic,
}

/// Elements that a call may write in a block; what stands between them stays.
#[derive(Clone, Copy, Debug)]
pub struct Span {
    pub width: usize,
    pub stride: usize,
    pub count: usize,
}

/// A block that an argument, or a pointer in its struct, points to.
#[derive(Clone, Debug)]
pub struct Given {
    pub parameter: usize,
    pub place: Place,
    pub role: Role,
    pub span: Span,
    /// What is in an element, for the check of its floats.
    pub layout: Layout,
    /// The bytes before the call, of all blocks that it may write.
    pub before: Vec<u8>,
}

impl Given {
    pub fn may_change(&self, byte: usize) -> bool {
        byte / self.span.stride < self.span.count && byte % self.span.stride < self.span.width
    }
}

/// A call that is being put together, from the first argument to the last.
pub struct Case<'w> {
    pub world: &'w World,
    pub function: &'w Function,
    /// Tells the objects of an epoch apart: the number of the case + 1.
    pub id: u64,
    pub random: Random,
    /// The parameter that is hostile.
    pub spoiled: Option<usize>,
    pub words: Vec<Word>,
    pub given: Vec<Given>,
    /// Objects that were chosen, by which later arguments are.
    pub objects: Vec<Object>,
    /// The parameter whose value is known before it is reached, such as the stride of an array.
    pub decided: Vec<(String, u64)>,
    /// Elements of a list whose length stands before it.
    pub list: Vec<u8>,
    /// The map, and its texels.
    pub map: Option<Map>,
    pub texels: usize,
    /// What the size query answered: bytes, and bytes of scratch memory.
    pub sizes: Option<[usize; 2]>,
    /// The build in parts that the call goes on with.
    pub build: Option<usize>,
    /// An object was corrupted and signed, or made with such a one: it does no harm, but need not be a distribution.
    pub is_altered: bool,
}

impl<'w> Case<'w> {
    pub fn new(world: &'w World, function: &'w Function, random: Random) -> Case<'w> {
        let mut case = Case {
            world,
            function,
            id: 1 + crate::alarm::CASE[2].load(std::sync::atomic::Ordering::Relaxed),
            random,
            spoiled: None,
            words: Vec::new(),
            given: Vec::new(),
            objects: Vec::new(),
            decided: Vec::new(),
            list: Vec::new(),
            map: None,
            texels: 0,
            sizes: None,
            build: None,
            is_altered: false,
        };
        if case.random.one_in(2) {
            case.spoiled = Some(case.random.below(function.parameters.len()));
        }
        case
    }

    /// The parameter whose value is next.
    pub fn parameter(&self) -> &'w Parameter {
        &self.function.parameters[self.words.len()]
    }

    pub fn is_spoiled(&self) -> bool {
        self.spoiled == Some(self.words.len())
    }

    /// A number among the arguments so far, or one that was decided for a later one.
    pub fn number(&self, name: &str) -> Option<usize> {
        let decided = self.decided.iter().find(|(decided, _)| decided == name).map(|(_, value)| *value as usize);
        let given = self.function.position(name).and_then(|position| self.words.get(position));
        decided.or(given.map(|word| match word {
            Word::Integer(bits) | Word::Float(bits) => *bits as usize,
        }))
    }

    pub fn decide(&mut self, name: &str, value: u64) {
        self.decided.push((name.into(), value));
    }

    pub fn push(&mut self, bits: u64) {
        let is_float = self.parameter().scalar.is_float();
        self.words.push(if is_float { Word::Float(bits) } else { Word::Integer(bits) });
    }

    /// Places a block for the next argument. A hostile one is not aligned, at times.
    pub fn give(&mut self, role: Role, bytes: &[u8], layout: Layout, span: Span) -> u64 {
        let misaligned = self.is_spoiled() && layout.align > 1 && self.random.one_in(6);
        let beside = if misaligned { 1 + self.random.below(layout.align - 1) } else { 0 };
        let memory = &self.world.memory;
        let place = memory.place(self.given.len(), bytes.len(), layout.align, beside, !self.random.one_in(4));
        memory.bytes(place).copy_from_slice(bytes);
        let before = if role == Role::Input { Vec::new() } else { bytes.to_vec() };
        self.given.push(Given { parameter: self.words.len(), place, role, span, layout, before });
        if role == Role::Input { memory.reader(place) as u64 } else { memory.writer(place) as u64 }
    }

    /// A block of elements that stand close together.
    pub fn give_packed(&mut self, role: Role, bytes: &[u8], layout: &Layout) -> u64 {
        let width = layout.size.max(1);
        let span = Span { width, stride: width, count: bytes.len() / width };
        self.give(role, bytes, layout.clone(), span)
    }

    pub fn input(&mut self, bytes: &[u8], align: usize) -> u64 {
        self.give_packed(Role::Input, bytes, &Layout { fields: Vec::new(), size: 1, align })
    }

    /// Bytes that nobody wrote.
    pub fn garbage(&mut self, len: usize) -> Vec<u8> {
        let filling = self.random.pick(&[0, 0xa5, 0xff]);
        vec![filling; len]
    }

    /// Chooses an object, which later arguments may depend on.
    pub fn choose(&mut self, among: &[Object]) -> Object {
        let chosen = self.random.pick(among);
        self.is_altered |= chosen.is_altered;
        self.objects.push(chosen);
        chosen
    }

    /// Calls another function with the arguments so far that have the names of its parameters.
    pub fn query(&self, name: &str) -> Option<[usize; 2]> {
        let function = self.world.function(name);
        let layout = &self.world.headers.layouts["wis_memory_size"];
        let place = self.world.memory.place(World::QUERY, layout.size, 8, 0, true);
        let mut words = Vec::new();
        for parameter in &function.parameters {
            words.push(match parameter.name.as_str() {
                "size" => Word::Integer(self.world.memory.writer(place) as u64),
                "diagnostic" => Word::Integer(0),
                name => Word::Integer(self.number(name)? as u64),
            });
        }
        let answer = self.world.call(function, &words, crate::call::DEFAULT_CONTROL);
        let words = self.world.memory.bytes(place);
        let word = |at: usize| u64::from_le_bytes(words[at..at + 8].try_into().expect("eight")) as usize;
        (answer.result as u32 == 0).then(|| [word(0), word(16)])
    }

    /// Makes the call.
    pub fn run(&self, control: u32) -> Answer {
        self.world.call(self.function, &self.words, control)
    }

    /// Where a sampler keeps the instructions that it uses.
    pub const LEVEL: std::ops::Range<usize> = 24..28;

    /// The instructions of any sampler, if the call has a valid one.
    pub fn level_of(&self, mut random: Random) -> Option<Vec<u8>> {
        let has_sampler = self.function.parameters.first().is_some_and(|first| first.pointee == "wis_sampler")
            && self.spoiled != Some(0);
        let samplers = self.world.pool.of("wis_sampler");
        let is_state = self.given.first().is_some_and(|given| given.parameter == 0 && given.role == Role::State);
        (has_sampler && is_state && self.function.name != "wis_sampler_fault")
            .then(|| self.world.memory.bytes(random.pick(&samplers).place)[Case::LEVEL].to_vec())
    }

    pub fn set_level(&self, level: &[u8]) {
        self.world.memory.bytes(self.given[0].place)[Case::LEVEL].copy_from_slice(level);
    }

    /// Puts back what stood in all blocks before the call.
    pub fn restore(&self) {
        for given in self.given.iter().filter(|given| given.role != Role::Input) {
            self.world.memory.bytes(given.place).copy_from_slice(&given.before);
        }
    }

    /// The block of a parameter; that of the struct itself, if it points to others.
    pub fn block(&self, name: &str) -> Option<&Given> {
        let position = self.function.position(name)?;
        self.given.iter().rev().find(|given| given.parameter == position)
    }

    pub fn bytes_of(&self, name: &str) -> Option<&[u8]> {
        self.block(name).map(|given| &*self.world.memory.bytes(given.place))
    }
}

/// A struct that is filled field by field.
pub struct Fields {
    layout: Layout,
    pub bytes: Vec<u8>,
}

impl Fields {
    /// Zeros, but for `size`.
    pub fn new(layout: &Layout) -> Fields {
        let mut fields = Fields { layout: layout.clone(), bytes: vec![0; layout.size] };
        if layout.begins_with_size() {
            fields.word("size", layout.size as u64);
        }
        fields
    }

    pub fn word(&mut self, path: &str, value: u64) {
        let field = self.layout.field(path);
        let (at, size) = (field.offset, field.scalar.size());
        self.bytes[at..at + size].copy_from_slice(&value.to_le_bytes()[..size]);
    }

    /// Points to bytes that the call reads.
    pub fn input(&mut self, case: &mut Case, path: &str, bytes: &[u8], align: usize) {
        self.word(path, case.input(bytes, align));
    }

    /// The same for an array of a wave.
    pub fn array(&mut self, case: &mut Case, path: &str, bytes: &[u8], stride: usize) {
        self.input(case, &format!("{path}.first"), bytes, 4);
        self.word(&format!("{path}.point"), stride as u64);
    }

    pub fn float(&mut self, path: &str, value: f32) {
        self.word(path, value.to_bits().into());
    }

    /// An array of floats, or the first elements of one.
    pub fn floats(&mut self, path: &str, values: &[f32]) {
        let first = self.layout.fields.iter().find(|field| field.path.starts_with(&format!("{path}[")));
        let at = first.unwrap_or_else(|| panic!("no array {path}")).offset;
        self.bytes[at..at + 4 * values.len()].copy_from_slice(&bytes_of(values));
    }

    pub fn get(&self, path: &str) -> u64 {
        let field = self.layout.field(path);
        let mut word = [0; 8];
        word[..field.scalar.size()].copy_from_slice(&self.bytes[field.offset..field.offset + field.scalar.size()]);
        u64::from_le_bytes(word)
    }

    /// Makes one field hostile.
    pub fn spoil(&mut self, random: &mut Random) {
        let field = self.layout.fields[random.below(self.layout.fields.len())].clone();
        let now = self.get(&field.path);
        let value = match field.scalar {
            Scalar::F32 => random.hard().to_bits().into(),
            Scalar::F64 => f64::from(random.hard()).to_bits(),
            // What a client's own function is handed is its own affair.
            Scalar::Pointer if field.path.ends_with("user") => now,
            Scalar::Pointer if ["row", "radiance", "target", "eval"].contains(&field.path.as_str()) => 0,
            Scalar::Pointer => random.pick(&[0, now + u64::from(now != 0)]),
            Scalar::U8 | Scalar::U32 | Scalar::U64 => {
                let near = [now.wrapping_sub(1), now + 1, now ^ 1 << random.below(32)];
                random.pick(&[0, 1, 3, 7, 100, 4097, u64::from(u32::MAX), 1 << 31, u64::MAX, near[0], near[1], near[2]])
            }
        };
        self.word(&field.path, value);
    }
}

pub fn bytes_of(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}
