//! The cheapest way to composite a component: which layers go atop which, counted in machine instructions.
//!
//! Expression (4) of [Snyder & Lengyel 1997, §8] picks any object O* and puts the picture of its occluders atop
//! it, over the picture of the rest; expression (3) sums up every object attenuated by its occluders. The rest
//! of (4) falls apart into smaller components, for each of which the choice is made anew. Up to a dozen layers
//! all choices are tried, with the best for each subset remembered; beyond that the layer with the fewest
//! occluders is picked, which is the cheapest step though perhaps not the start of the cheapest plan.

use std::collections::HashMap;

/// A term of a sum: a layer, attenuated by others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Term {
    pub(super) layer: u32,
    pub(super) out: Vec<u32>,
}

/// A step; the picture is all steps' pictures over each other, front to back.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// A layer as it is.
    Layer(u32),
    /// The sum of terms, expression (3).
    Sum(Vec<Term>),
    /// The sum of terms atop a layer, expression (4). `chain` says that the terms are an `over` of layers in
    /// this order.
    Atop { front: Vec<Term>, chain: bool, under: u32 },
}

/// Components with more layers are not searched for the best plan.
const SEARCHED: usize = 12;

/// Plans `n` layers with `arcs` among them, which may be in cycles but not both ways between two.
pub(super) fn plan(n: usize, arcs: &[(u32, u32)]) -> Vec<Step> {
    let mut occluders = vec![Vec::new(); n];
    for &(front, behind) in arcs {
        occluders[behind as usize].push(front);
    }
    occluders.iter_mut().for_each(|o| o.sort_unstable());
    let mut planner = Planner { occluders, best: HashMap::new() };
    planner.rest(&(0..n as u32).collect::<Vec<_>>())
}

/// Instructions that a step takes.
pub(super) fn cost(step: &Step) -> usize {
    let term = |t: &Term, more: usize| if t.out.is_empty() && more == 0 { 1 } else { 2 + t.out.len() + more };
    match step {
        Step::Layer(_) => 1,
        Step::Sum(terms) => 1 + terms.iter().map(|t| term(t, 0)).sum::<usize>(),
        Step::Atop { front, .. } => 1 + 2 + front.len() + front.iter().map(|t| term(t, 1)).sum::<usize>(),
    }
}

struct Planner {
    /// Ascending, for each layer.
    occluders: Vec<Vec<u32>>,
    best: HashMap<Vec<u32>, Vec<Step>>,
}

impl Planner {
    /// The plan of any set of layers: its components front to back.
    fn rest(&mut self, layers: &[u32]) -> Vec<Step> {
        let components = components(layers, &self.occluders);
        components.iter().flat_map(|c| self.component(c)).collect()
    }

    fn component(&mut self, layers: &[u32]) -> Vec<Step> {
        if let [layer] = layers {
            return vec![Step::Layer(*layer)];
        }
        if let Some(known) = self.best.get(layers) {
            return known.clone();
        }
        let total = |steps: &[Step]| steps.iter().map(cost).sum::<usize>();
        let mut best = vec![Step::Sum(self.terms(layers))];
        let picked: Vec<u32> = if layers.len() <= SEARCHED {
            layers.to_vec()
        } else {
            let fewest = layers.iter().copied().min_by_key(|&l| self.occluders_among(l, layers).len());
            fewest.into_iter().collect()
        };
        for under in picked {
            let front = self.occluders_among(under, layers);
            let parts = components(&front, &self.occluders);
            let chain = parts.iter().all(|c| c.len() == 1);
            let front = if chain { parts.concat() } else { front };
            let mut steps = vec![Step::Atop { front: self.terms(&front), chain, under }];
            let rest: Vec<u32> = layers.iter().copied().filter(|&l| l != under).collect();
            steps.extend(self.rest(&rest));
            if total(&steps) < total(&best) {
                best = steps;
            }
        }
        self.best.insert(layers.to_vec(), best.clone());
        best
    }

    fn occluders_among(&self, layer: u32, layers: &[u32]) -> Vec<u32> {
        self.occluders[layer as usize].iter().copied().filter(|o| layers.contains(o)).collect()
    }

    fn terms(&self, layers: &[u32]) -> Vec<Term> {
        layers.iter().map(|&layer| Term { layer, out: self.occluders_among(layer, layers) }).collect()
    }
}

/// The strongly connected components of some layers, each ascending, front to back (Tarjan 1972; recursion as
/// deep as there are layers in a cycle is avoided by removing what nothing occludes first).
pub(super) fn components(layers: &[u32], occluders: &[Vec<u32>]) -> Vec<Vec<u32>> {
    let mut search = Tarjan {
        member: vec![false; occluders.len()],
        index: vec![0; occluders.len()],
        low: vec![0; occluders.len()],
        open: Vec::new(),
        count: 0,
        found: Vec::new(),
    };
    layers.iter().for_each(|&l| search.member[l as usize] = true);
    for &layer in layers {
        if search.index[layer as usize] == 0 {
            search.visit(layer, occluders);
        }
    }
    search.found
}

struct Tarjan {
    member: Vec<bool>,
    /// From 1; 0: not visited.
    index: Vec<u32>,
    low: Vec<u32>,
    open: Vec<u32>,
    count: u32,
    found: Vec<Vec<u32>>,
}

impl Tarjan {
    fn visit(&mut self, root: u32, occluders: &[Vec<u32>]) {
        let mut frames = vec![(root, 0)];
        while let Some(&mut (layer, ref mut next)) = frames.last_mut() {
            let at = layer as usize;
            if *next == 0 && self.index[at] == 0 {
                self.count += 1;
                (self.index[at], self.low[at]) = (self.count, self.count);
                self.open.push(layer);
            }
            if let Some(&front) = occluders[at].get(*next) {
                *next += 1;
                if !self.member[front as usize] {
                    continue;
                }
                if self.index[front as usize] == 0 {
                    frames.push((front, 0));
                } else {
                    self.low[at] = self.low[at].min(self.index[front as usize]);
                }
                continue;
            }
            frames.pop();
            if let Some(&(below, _)) = frames.last() {
                self.low[below as usize] = self.low[below as usize].min(self.low[at]);
            }
            if self.low[at] == self.index[at] {
                let from = self.open.iter().rposition(|&l| l == layer).unwrap_or(0);
                let mut component = self.open.split_off(from);
                // What is closed is no member any more.
                component.iter().for_each(|&l| self.member[l as usize] = false);
                component.sort_unstable();
                self.found.push(component);
            }
        }
    }
}
