//! One call of a function of the header: its arguments, what it may write, and what it answered.

use super::block::{Block, SENTINEL};
use super::header::{Function, Parameter};
use super::scene::{Scene, Value};
use super::table::{Entry, TABLE};
use wis::ffi::Diagnostic;
use wis::light::tables::Light;
use wis::status::Status;

/// The field that a diagnostic names.
pub fn field(diagnostic: &Diagnostic) -> Option<&'static str> {
    if diagnostic.field.is_null() {
        return None;
    }
    // SAFETY: the library gives a static string.
    Some(unsafe { std::ffi::CStr::from_ptr(diagnostic.field) }.to_str().expect("a name is ASCII"))
}

/// A call that is made with valid arguments, unless one is changed.
pub struct Call<'a> {
    function: &'a Function,
    entry: &'static Entry,
    arguments: Vec<Argument<'a>>,
}

struct Argument<'a> {
    parameter: &'a Parameter,
    word: usize,
    block: Option<Block>,
}

impl Argument<'_> {
    /// Memory that is undefined after a failure.
    fn is_work(&self) -> bool {
        self.parameter.declaration.starts_with("void *")
    }

    fn is_diagnostic(&self) -> bool {
        self.parameter.name == "diagnostic"
    }
}

impl<'a> Call<'a> {
    pub fn valid(scene: &Scene, function: &'a Function) -> Call<'a> {
        let entry = TABLE.iter().find(|entry| entry.name == function.name);
        let entry = entry.unwrap_or_else(|| panic!("{} is not in the table", function.name));
        let mut call = Call { function, entry, arguments: Vec::new() };
        for parameter in &function.parameters {
            call.arguments.push(Argument { parameter, word: 0, block: None });
            match scene.value(function, parameter) {
                Value::Number(number) => call.set(&parameter.name, number),
                Value::Bytes(bytes) => call.give(&parameter.name, Block::new(&bytes, 0)),
            }
        }
        call
    }

    fn position(&self, name: &str) -> usize {
        let found = self.arguments.iter().position(|argument| argument.parameter.name == name);
        found.unwrap_or_else(|| panic!("{} has no {name}", self.function.name))
    }

    fn argument(&mut self, name: &str) -> &mut Argument<'a> {
        let position = self.position(name);
        &mut self.arguments[position]
    }

    /// Sets a number, or a pointer that is null.
    pub fn set(&mut self, name: &str, word: usize) {
        self.argument(name).word = word;
    }

    /// Sets several numbers.
    pub fn set_all(&mut self, numbers: &[(&str, usize)]) {
        for (name, number) in numbers {
            self.set(name, *number);
        }
    }

    pub fn number(&self, name: &str) -> usize {
        self.arguments[self.position(name)].word
    }

    /// Points to a block.
    pub fn give(&mut self, name: &str, block: Block) {
        let argument = self.argument(name);
        argument.word = block.pointer() as usize;
        argument.block = Some(block);
    }

    /// Points to the same bytes, `offset` bytes behind a multiple of 16.
    pub fn misalign(&mut self, name: &str, offset: usize) {
        let block = Block::new(self.bytes(name), offset);
        self.give(name, block);
    }

    /// Edits the struct that an argument points to.
    pub fn edit<T: Copy>(&mut self, name: &str, edit: impl FnOnce(&mut T)) {
        self.argument(name).block.as_mut().expect("a pointer").edit(edit);
    }

    /// The struct that an argument points to.
    pub fn read<T: Copy>(&self, name: &str) -> T {
        let bytes = self.bytes(name);
        assert!(bytes.len() >= size_of::<T>());
        // SAFETY: long enough; the structs of the boundary are valid with any bytes that the library writes.
        unsafe { bytes.as_ptr().cast::<T>().read_unaligned() }
    }

    /// What an argument points to.
    pub fn bytes(&self, name: &str) -> &[u8] {
        self.arguments[self.position(name)].block.as_ref().expect("a pointer")
    }

    /// What a call left where an argument points to; of a sampler but for the tables that it keeps, which are addresses.
    pub fn result(&self, name: &str) -> Vec<u8> {
        /// Where those tables begin.
        const KEPT: usize = 64;
        let mut bytes = self.bytes(name).to_vec();
        if name == "sampler" {
            bytes.iter_mut().skip(KEPT).take(size_of::<(&[u8], u64, Light<'_>)>()).for_each(|byte| *byte = 0);
        }
        bytes
    }

    /// What an argument points to, as floats.
    pub fn floats(&self, name: &str) -> Vec<f32> {
        self.bytes(name).chunks_exact(4).map(|b| f32::from_ne_bytes(b.try_into().expect("four bytes"))).collect()
    }

    /// Makes the call.
    pub fn answer(&self) -> usize {
        let words: Vec<usize> = self.arguments.iter().map(|argument| argument.word).collect();
        (self.entry.call)(&words)
    }

    /// Makes the call and asserts that it does what was asked: no diagnostic is written.
    pub fn succeeds(&self, context: &str) {
        assert_eq!(self.answer(), Status::Ok as usize, "{}: {context}", self.function.name);
        let diagnostic = self.arguments.iter().find(|argument| argument.is_diagnostic());
        if let Some(block) = diagnostic.and_then(|argument| argument.block.as_ref()) {
            assert!(block.iter().all(|&byte| byte == SENTINEL), "{}: {context}: diagnostic", self.function.name);
        }
    }

    /// Makes the call and asserts that it answers `status`, blames the argument `at_fault` and writes nothing but
    /// the diagnostic; likewise without a diagnostic. Gives the diagnostic.
    pub fn fails(&mut self, context: &str, status: Status, at_fault: &str) -> Diagnostic {
        let before = self.blocks();
        self.fails_once(context, status, &before);
        let diagnostic = self.diagnostic();
        let Some(given) = self.arguments.iter().position(|argument| argument.is_diagnostic()) else {
            return diagnostic;
        };
        if at_fault != "diagnostic" {
            let blamed = diagnostic.argument as usize;
            assert_eq!(blamed, self.position(at_fault) + 1, "{}: {context}: argument", self.function.name);
            assert_eq!(diagnostic.reserved, 0);
            self.restore(&before);
            let pointer = std::mem::take(&mut self.arguments[given].word);
            self.fails_once(context, status, &before);
            self.arguments[given].word = pointer;
        }
        self.restore(&before);
        diagnostic
    }

    fn fails_once(&self, context: &str, status: Status, before: &[Vec<u8>]) {
        assert_eq!(self.answer(), status as usize, "{}: {context}", self.function.name);
        for (argument, (after, before)) in self.arguments.iter().zip(self.blocks().iter().zip(before)) {
            let name = &argument.parameter.name;
            // A sampler keeps where its last call was at fault.
            let sampler = argument.parameter.pointee == "wis_sampler";
            let may_change = argument.is_work() || sampler || (argument.is_diagnostic() && argument.word % 8 == 0);
            assert!(may_change || after == before, "{}: {context}: {name} was written", self.function.name);
        }
    }

    fn blocks(&self) -> Vec<Vec<u8>> {
        self.arguments.iter().map(|argument| argument.block.as_deref().unwrap_or(&[]).to_vec()).collect()
    }

    fn restore(&mut self, blocks: &[Vec<u8>]) {
        for (argument, bytes) in self.arguments.iter_mut().zip(blocks) {
            if let Some(block) = &mut argument.block {
                block.copy_from_slice(bytes);
            }
        }
    }

    /// What the last call wrote into its diagnostic.
    pub fn told(&self) -> Diagnostic {
        self.diagnostic()
    }

    fn diagnostic(&self) -> Diagnostic {
        let block = self.arguments.iter().find(|argument| argument.is_diagnostic()).and_then(|a| a.block.as_ref());
        let aligned = block.filter(|block| block.pointer().cast::<Diagnostic>().is_aligned());
        // SAFETY: the block holds a diagnostic and is aligned.
        aligned.map_or_else(Diagnostic::default, |block| unsafe { block.pointer().cast::<Diagnostic>().read() })
    }
}
