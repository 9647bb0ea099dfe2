//! Expressions for a machine with three image registers [Snyder & Lengyel 1997, fig. 15].
//!
//! `R*` accumulates products (in, out), `R+` sums, `Rover` what is finished, front to back. Each can take a
//! layer from memory; `R+` can take `R*`, and `Rover` can take `R+`. That (4) needs no more follows from writing
//! *X atop O* as the sum of every term of X in O, and O outside of everything in X: alpha of a union is one
//! minus the product of what its members let through.

use super::Component;
use super::plan::{self, Step, Term};
use super::sprite::{Canvas, Sprite};

/// A register of the machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Register {
    /// `R*`: products.
    Product,
    /// `R+`: sums; empty at the start and after it has been taken by `Rover`.
    Sum,
    /// `Rover`: the picture so far, front to back.
    Over,
}

/// What an instruction does with its register and its source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// The register becomes the source.
    Load,
    /// The register, inside the source.
    In,
    /// The register, outside the source.
    Out,
    /// The register plus the source.
    Add,
    /// The register over the source.
    Over,
}

/// Where an instruction takes its other picture from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// A layer in memory.
    Layer(u32),
    /// The register to the left: `R*` for `R+`, `R+` for `Rover`.
    Register,
}

/// One instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instruction {
    /// What is done.
    pub operation: Operation,
    /// To which register.
    pub register: Register,
    /// With what.
    pub source: Source,
}

/// A list of instructions that leaves the picture in `Rover`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Program {
    /// In order.
    pub instructions: Vec<Instruction>,
}

impl Program {
    /// Compiles components, front to back, layers numbered through in the same order.
    pub fn compile(components: &[Component]) -> Program {
        let mut program = Program::default();
        let mut first = 0;
        for component in components {
            let steps = plan::plan(component.layers.len(), &component.arcs);
            steps.iter().for_each(|step| program.step(step, first));
            first += component.layers.len() as u32;
        }
        program
    }

    fn step(&mut self, step: &Step, first: u32) {
        match step {
            Step::Layer(layer) => {
                return self.push(Operation::Over, Register::Over, Source::Layer(first + layer));
            }
            Step::Sum(terms) => terms.iter().for_each(|t| self.term(t, None, first)),
            Step::Atop { front, under, .. } => {
                front.iter().for_each(|t| self.term(t, Some(*under), first));
                let out = front.iter().map(|t| t.layer).collect();
                self.term(&Term { layer: *under, out }, None, first);
            }
        }
        self.push(Operation::Over, Register::Over, Source::Register);
    }

    /// Adds a term to `R+`, perhaps inside of a layer.
    fn term(&mut self, term: &Term, inside: Option<u32>, first: u32) {
        if term.out.is_empty() && inside.is_none() {
            return self.push(Operation::Add, Register::Sum, Source::Layer(first + term.layer));
        }
        self.push(Operation::Load, Register::Product, Source::Layer(first + term.layer));
        for out in &term.out {
            self.push(Operation::Out, Register::Product, Source::Layer(first + out));
        }
        if let Some(layer) = inside {
            self.push(Operation::In, Register::Product, Source::Layer(first + layer));
        }
        self.push(Operation::Add, Register::Sum, Source::Register);
    }

    fn push(&mut self, operation: Operation, register: Register, source: Source) {
        self.instructions.push(Instruction { operation, register, source });
    }

    /// Runs the program on pictures of `size` (width, height). A layer that is `None` is left out: it shows
    /// nothing and hides nothing, and the rest is as if it were not there.
    pub fn run<'s>(&self, size: (u32, u32), layer: impl Fn(u32) -> Option<&'s Sprite>) -> Canvas {
        let nothing = Sprite::default();
        let (mut product, mut over) = (Sprite::default(), Canvas::new(size.0, size.1));
        // The sum is kept as its terms: they overlap little, and most pictures have none.
        let mut sum: Vec<Sprite> = Vec::new();
        for i in &self.instructions {
            let memory = match i.source {
                Source::Layer(number) => layer(number).unwrap_or(&nothing),
                Source::Register => &nothing,
            };
            match (i.register, i.operation, i.source) {
                (Register::Product, Operation::In, _) => product.attenuate(memory, |alpha| alpha),
                (Register::Product, Operation::Out, _) => product.attenuate(memory, |alpha| 1.0 - alpha),
                (Register::Product, ..) => product = memory.clone(),
                (Register::Sum, _, Source::Register) => sum.push(std::mem::take(&mut product)),
                (Register::Sum, ..) => sum.push(memory.clone()),
                (Register::Over, _, Source::Register) => over.over(&added(std::mem::take(&mut sum))),
                (Register::Over, ..) => over.over(memory),
            }
        }
        over
    }
}

/// The sum of sprites, no larger than it must be.
fn added(terms: Vec<Sprite>) -> Sprite {
    let terms: Vec<Sprite> = terms.into_iter().filter(|t| !t.is_empty()).collect();
    let Some(x) = terms.iter().map(|t| t.x).min() else { return Sprite::default() };
    let y = terms.iter().map(|t| t.y).min().unwrap_or(0);
    let right = terms.iter().map(|t| t.x + t.width).max().unwrap_or(x);
    let bottom = terms.iter().map(|t| t.y + t.height).max().unwrap_or(y);
    let mut canvas = Canvas::new(right - x, bottom - y);
    for mut term in terms {
        (term.x, term.y) = (term.x - x, term.y - y);
        canvas.add(&term);
    }
    Sprite { x, y, width: canvas.width, height: canvas.height, pixels: canvas.pixels }
}
