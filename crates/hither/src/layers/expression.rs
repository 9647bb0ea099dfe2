//! The expression that puts layers together, as text and as a tree that can be evaluated.

use super::Component;
use super::plan::{self, Step, Term};
use super::sprite::{Canvas, Sprite};
use std::fmt::Write;

/// An expression over layers, in the operators of [Porter & Duff 1984].
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Expression {
    /// A layer's picture.
    Layer(u32),
    /// Front to back.
    Over(Vec<Expression>),
    /// The first where the second is, the second where the first is not.
    Atop(Box<Expression>, Box<Expression>),
    /// The sum of layers, each outside of others.
    SumOfOuts(Vec<(u32, Vec<u32>)>),
}

impl Expression {
    /// The picture of all components, front to back, layers numbered through in the same order.
    pub fn of(components: &[Component]) -> Expression {
        let mut parts = Vec::new();
        let mut first = 0;
        for component in components {
            let steps = plan::plan(component.layers.len(), &component.arcs);
            parts.extend(steps.iter().map(|step| of_step(step, first)));
            first += component.layers.len() as u32;
        }
        Expression::Over(parts)
    }

    /// As text, with a layer's name wherever it stands; operators bind as the parentheses say.
    pub fn text(&self, name: &impl Fn(u32) -> String) -> String {
        match self {
            Expression::Layer(layer) => name(*layer),
            Expression::Over(all) if all.is_empty() => "nothing".to_owned(),
            Expression::Over(all) => {
                let parts: Vec<String> = all.iter().map(|e| e.bracketed(name)).collect();
                parts.join(" over ")
            }
            Expression::Atop(front, under) => {
                format!("{} atop {}", front.bracketed(name), under.bracketed(name))
            }
            Expression::SumOfOuts(terms) => {
                let mut text = String::new();
                for (i, (layer, out)) in terms.iter().enumerate() {
                    text.push_str(if i > 0 { " + " } else { "" });
                    text.push_str(&name(*layer));
                    out.iter().for_each(|&o| {
                        let _ = write!(text, " out {}", name(o));
                    });
                }
                text
            }
        }
    }

    fn bracketed(&self, name: &impl Fn(u32) -> String) -> String {
        match self {
            Expression::Layer(_) => self.text(name),
            Expression::Over(all) if all.len() == 1 => all[0].bracketed(name),
            _ => format!("({})", self.text(name)),
        }
    }

    /// Evaluates the tree as it stands, on whole pictures. Slow; [`Program`](super::Program) is the fast way, and
    /// the two are tested against each other.
    pub fn evaluate(&self, size: (u32, u32), layer: &impl Fn(u32) -> Option<Sprite>) -> Canvas {
        let load = |number: u32| {
            let mut canvas = Canvas::new(size.0, size.1);
            if let Some(sprite) = layer(number) {
                canvas.over(&sprite);
            }
            canvas
        };
        match self {
            Expression::Layer(number) => load(*number),
            Expression::Over(all) => {
                let mut sum = Canvas::new(size.0, size.1);
                for e in all {
                    let next = e.evaluate(size, layer);
                    sum.combine(&next, |front, behind| add(front, scale(behind, 1.0 - front[3])));
                }
                sum
            }
            Expression::Atop(front, under) => {
                let mut result = front.evaluate(size, layer);
                let under = under.evaluate(size, layer);
                result.combine(&under, |a, b| add(scale(a, b[3]), scale(b, 1.0 - a[3])));
                result
            }
            Expression::SumOfOuts(terms) => {
                let mut sum = Canvas::new(size.0, size.1);
                for (number, out) in terms {
                    let mut term = load(*number);
                    for &o in out {
                        term.combine(&load(o), |a, b| scale(a, 1.0 - b[3]));
                    }
                    sum.combine(&term, add);
                }
                sum
            }
        }
    }
}

fn scale(a: [f32; 4], by: f32) -> [f32; 4] {
    a.map(|c| c * by)
}

fn add(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]]
}

fn of_step(step: &Step, first: u32) -> Expression {
    let sum = |terms: &[Term]| {
        let terms = terms.iter().map(|t| (first + t.layer, t.out.iter().map(|o| first + o).collect()));
        Expression::SumOfOuts(terms.collect())
    };
    match step {
        Step::Layer(layer) => Expression::Layer(first + layer),
        Step::Sum(terms) => sum(terms),
        Step::Atop { front, chain, under } => {
            let front = match (chain, front.as_slice()) {
                (_, [one]) => Expression::Layer(first + one.layer),
                (true, _) => {
                    Expression::Over(front.iter().map(|t| Expression::Layer(first + t.layer)).collect())
                }
                (false, _) => sum(front),
            };
            Expression::Atop(Box::new(front), Box::new(Expression::Layer(first + under)))
        }
    }
}

/// Expression (3) of [Snyder & Lengyel 1997] for one component, layers numbered from `first`: what
/// [`Expression::of`] is compared with.
pub fn sum_of_outs(component: &Component, first: u32) -> Expression {
    let terms = (0..component.layers.len() as u32).map(|layer| {
        let occluders = component.arcs.iter().filter(|a| a.1 == layer).map(|a| first + a.0);
        (first + layer, occluders.collect())
    });
    Expression::SumOfOuts(terms.collect())
}
