//! Incremental visibility sorting as it was published [Snyder & Lengyel 1997, figs. 4 and 5], step for step.
//!
//! Kept to check the engine's sort against, and to show what it costs: the search for cycles is quadratic in
//! what is marked, and the whole O(n⁴) where many parts must be pushed back.
//!
//! Notation: `list` is the paper's L, `out` its G (O in the figures); a group is a list of parts.

/// A step of the loop: the list and the output after it, as the figures write them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Step {
    /// Front to back; marked elements with an asterisk, groups in parentheses.
    pub list: String,
    /// Groups in parentheses.
    pub out: String,
}

/// What the sort did.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sorted {
    /// Groups, front to back.
    pub groups: Vec<Vec<u32>>,
    /// Every step, if asked for; the first is the initial state.
    pub steps: Vec<Step>,
    /// How often two parts were compared.
    pub tests: u64,
}

#[derive(Clone, Debug)]
struct Element {
    parts: Vec<u32>,
    marked: bool,
}

/// Sorts `list` by the relation *a occludes b*.
pub fn sort(list: &[u32], trace: bool, occludes: impl Fn(u32, u32) -> bool) -> Sorted {
    let mut list: Vec<Element> = list.iter().map(|&p| Element { parts: vec![p], marked: false }).collect();
    let mut done = Sorted::default();
    let tests = std::cell::Cell::new(0);
    let relation = |a: &Element, b: &Element| {
        a.parts.iter().any(|&a| {
            b.parts.iter().any(|&b| {
                tests.set(tests.get() + 1);
                occludes(a, b)
            })
        })
    };
    record(trace, &list, &mut done);
    while !list.is_empty() {
        let mut top = list.remove(0);
        let farthest = list.iter().rposition(|other| relation(other, &top));
        if !top.marked {
            match farthest {
                None => {
                    done.groups.push(top.parts);
                    list.iter_mut().for_each(|e| e.marked = false);
                }
                Some(at) => {
                    top.marked = true;
                    list.insert(at + 1, top);
                }
            }
        } else {
            let run = list.iter().take_while(|e| e.marked).count();
            let sequence: Vec<Element> =
                std::iter::once(top.clone()).chain(list[..run].iter().cloned()).collect();
            match (detect_cycle(&sequence, relation), farthest) {
                (Some(cycle), _) => {
                    let parts = cycle.iter().flat_map(|&i| sequence[i].parts.clone()).collect();
                    let mut at = 0;
                    list.retain(|_| {
                        at += 1;
                        !cycle.contains(&at)
                    });
                    if !cycle.contains(&0) {
                        list.insert(0, top);
                    }
                    list.insert(0, Element { parts, marked: false });
                }
                (None, Some(at)) => list.insert(at + 1, top),
                // What occluded it has since gone out in a group; nothing holds it back.
                (None, None) => {
                    done.groups.push(top.parts);
                    list.iter_mut().for_each(|e| e.marked = false);
                }
            }
        }
        record(trace, &list, &mut done);
    }
    done.tests = tests.get();
    done
}

/// Follows occluders through `sequence` until one comes again; returns the elements of that cycle.
fn detect_cycle(sequence: &[Element], relation: impl Fn(&Element, &Element) -> bool) -> Option<Vec<usize>> {
    if sequence.len() <= 1 {
        return None;
    }
    let mut chain = vec![0];
    for _ in 0..=sequence.len() {
        let last = chain[chain.len() - 1];
        if let Some(k) =
            chain[..chain.len() - 1].iter().position(|&i| relation(&sequence[i], &sequence[last]))
        {
            let mut cycle = chain[k..].to_vec();
            cycle.sort_unstable();
            return Some(cycle);
        }
        let next = (0..sequence.len()).find(|&i| i != last && relation(&sequence[i], &sequence[last]))?;
        chain.push(next);
    }
    None
}

fn record(trace: bool, list: &[Element], done: &mut Sorted) {
    if !trace {
        return;
    }
    let name = |parts: &[u32]| {
        let letters: String = parts.iter().map(|&p| char::from(b'A' + p as u8)).collect();
        if parts.len() > 1 { format!("({letters})") } else { letters }
    };
    let list = list.iter().map(|e| name(&e.parts) + if e.marked { "*" } else { "" }).collect();
    let out = done.groups.iter().map(|g| name(g)).collect();
    done.steps.push(Step { list, out });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Arcs of figure 2: (b) A → B, A → C, B → C; (c) A → B → C → A.
    const ACYCLIC: &[(u32, u32)] = &[(0, 1), (0, 2), (1, 2)];
    const CYCLE: &[(u32, u32)] = &[(0, 1), (1, 2), (2, 0)];

    fn steps(list: &[u32], arcs: &[(u32, u32)]) -> Vec<(String, String)> {
        let sorted = sort(list, true, |a, b| arcs.contains(&(a, b)));
        sorted.steps.into_iter().map(|s| (s.list, s.out)).collect()
    }

    fn expect(rows: &[(&str, &str)]) -> Vec<(String, String)> {
        rows.iter().map(|&(list, out)| (list.into(), out.into())).collect()
    }

    #[test]
    fn figure_6() {
        let rows = [("ABC", ""), ("BC", "A"), ("C", "AB"), ("", "ABC")];
        assert_eq!(steps(&[0, 1, 2], ACYCLIC), expect(&rows));
    }

    #[test]
    fn figure_7() {
        // In the figure only B occludes C, and A occludes B: C goes behind B although A also precedes it.
        let arcs = &[(0, 1), (1, 2)];
        let rows =
            [("CBA", ""), ("BC*A", ""), ("C*AB*", ""), ("AB*C*", ""), ("BC", "A"), ("C", "AB"), ("", "ABC")];
        assert_eq!(steps(&[2, 1, 0], arcs), expect(&rows));
    }

    #[test]
    fn figure_8() {
        let rows = [("ABC", ""), ("BCA*", ""), ("CA*B*", ""), ("A*B*C*", ""), ("(ABC)", ""), ("", "(ABC)")];
        assert_eq!(steps(&[0, 1, 2], CYCLE), expect(&rows));
    }

    #[test]
    fn groups_are_components_on_random_graphs() {
        let mut state = 7u32;
        let mut random = |n: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((u64::from(state) * u64::from(n)) >> 32) as u32
        };
        for _ in 0..2000 {
            let n = 2 + random(7);
            let count = random(2 * n);
            let arcs: Vec<(u32, u32)> =
                (0..count).map(|_| (random(n), random(n))).filter(|(a, b)| a != b).collect();
            let list: Vec<u32> = (0..n).collect();
            let sorted = sort(&list, false, |a, b| arcs.contains(&(a, b)));
            let mut groups = sorted.groups.clone();
            groups.iter_mut().for_each(|g| g.sort_unstable());
            groups.sort();
            assert_eq!(groups, super::super::occlusion::components(n as usize, &arcs), "{arcs:?}");
        }
    }
}
