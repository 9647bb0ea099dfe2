//! A `//!` line in every file, files of at most 800 lines, functions of at most 70.
//!
//! Functions that are longer stand in `xtask/long_functions.txt` with their length, a ratchet: an entry may
//! shrink or go, never grow or come. A file may be longer if its `//!` says `long because …`; a kernel, if a
//! comment above it or at its start does.

use super::{Finding, Source};
use anyhow::{Context, Result};
use std::collections::BTreeMap;
use std::path::Path;
use syn::spanned::Spanned;
use syn::visit::{self, Visit};

const FUNCTION_LINES: usize = 70;
const FILE_LINES: usize = 800;
const RATCHET: &str = "xtask/long_functions.txt";
const REASON: &str = "long because ";

/// The `//!` line and the length of each file.
pub fn check_files(sources: &[Source]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for source in sources {
        let mut wrong = |message: String| {
            findings.push(Finding { path: source.path.clone(), line: 1, message });
        };
        let header: Vec<&str> = source.text.lines().take_while(|l| l.starts_with("//!")).collect();
        if header.first().is_none_or(|line| line.len() <= "//! ".len()) {
            wrong("the file does not open with a `//!` line; say there what it guarantees".into());
        }
        let lines = source.text.lines().count();
        if lines > FILE_LINES && !header.iter().any(|l| l.to_lowercase().contains(REASON)) {
            wrong(format!("{lines} lines; split it, or say `{REASON}…` in its `//!` (limit {FILE_LINES})"));
        }
    }
    findings
}

/// The functions' lengths against the ratchet. With `lower`, writes the ratchet where functions shrank.
pub fn check_functions(root: &Path, sources: &[Source], lower: bool) -> Result<Vec<Finding>> {
    let text =
        std::fs::read_to_string(root.join(RATCHET)).with_context(|| format!("cannot read {RATCHET}"))?;
    let recorded = parse_ratchet(&text)?;
    let long = long_functions(sources);
    if lower {
        let lowered: BTreeMap<&String, usize> = recorded
            .iter()
            .filter_map(|(name, &allowed)| long.get(name).map(|f| (name, allowed.min(f.lines))))
            .collect();
        let comments = text.lines().filter(|l| l.starts_with('#')).map(|l| format!("{l}\n"));
        let entries = lowered.iter().map(|(name, lines)| format!("{name} {lines}\n"));
        std::fs::write(root.join(RATCHET), comments.chain(entries).collect::<String>())?;
        return Ok(compare(&lowered.into_iter().map(|(n, l)| (n.clone(), l)).collect(), &long));
    }
    Ok(compare(&recorded, &long))
}

struct LongFunction {
    line: usize,
    lines: usize,
}

fn compare(recorded: &BTreeMap<String, usize>, long: &BTreeMap<String, LongFunction>) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (name, function) in long {
        let path = name.split("::").next().unwrap_or_default().to_string();
        let lines = function.lines;
        let message = match recorded.get(name) {
            None => format!("{name} has {lines} lines (limit {FUNCTION_LINES}); split it"),
            Some(&allowed) if lines > allowed => {
                format!("{name} grew from {allowed} to {lines} lines; shorten it")
            }
            Some(&allowed) if lines < allowed => {
                format!("{name} shrank to {lines} lines; run `cargo xtask tidy --lower-ratchet`")
            }
            Some(_) => continue,
        };
        findings.push(Finding { path, line: function.line, message });
    }
    for name in recorded.keys().filter(|name| !long.contains_key(*name)) {
        let message = format!("{name} is no longer long; run `cargo xtask tidy --lower-ratchet`");
        findings.push(Finding { path: RATCHET.into(), line: 0, message });
    }
    findings
}

fn parse_ratchet(text: &str) -> Result<BTreeMap<String, usize>> {
    text.lines()
        .filter(|line| !line.is_empty() && !line.starts_with('#'))
        .map(|line| {
            let (name, lines) = line.rsplit_once(' ').with_context(|| format!("{RATCHET}: `{line}`"))?;
            Ok((name.to_string(), lines.parse().with_context(|| format!("{RATCHET}: `{line}`"))?))
        })
        .collect()
}

/// Functions above the limit that give no reason, by `path::Type::function`. Two of one name (in differently
/// configured modules, say) count as the longer.
fn long_functions(sources: &[Source]) -> BTreeMap<String, LongFunction> {
    let mut found: BTreeMap<String, LongFunction> = BTreeMap::new();
    for source in sources {
        let lines: Vec<&str> = source.text.lines().collect();
        let mut walk = Functions { scope: vec![source.path.clone()], lines: &lines, found: Vec::new() };
        walk.visit_file(&source.syntax);
        for (name, function) in walk.found {
            let longer = found.get(&name).is_none_or(|known| known.lines < function.lines);
            if longer {
                found.insert(name, function);
            }
        }
    }
    found
}

struct Functions<'a> {
    scope: Vec<String>,
    lines: &'a [&'a str],
    found: Vec<(String, LongFunction)>,
}

impl Functions<'_> {
    fn measure(&mut self, signature: &syn::Signature, block: &syn::Block) {
        let first = signature.span().start().line;
        let last = block.span().end().line;
        let lines = last + 1 - first;
        if lines > FUNCTION_LINES && !self.gives_reason(first) {
            let name = format!("{}::{}", self.scope.join("::"), signature.ident);
            self.found.push((name, LongFunction { line: first, lines }));
        }
    }

    /// Whether a comment directly above the function, or in the first lines of it, gives a reason.
    fn gives_reason(&self, first: usize) -> bool {
        let is_lead = |line: &str| {
            let line = line.trim_start();
            line.starts_with("//") || line.starts_with('#')
        };
        let above = self.lines[..first - 1].iter().rev().take_while(|line| is_lead(line));
        let start = self.lines[first - 1..].iter().take(12);
        above.chain(start).any(|line| {
            let comment = line.split_once("//").map_or("", |(_, comment)| comment);
            comment.split_once(REASON).is_some_and(|(_, why)| why.trim().len() > 2)
        })
    }

    fn within(&mut self, name: String, visit: impl FnOnce(&mut Self)) {
        self.scope.push(name);
        visit(self);
        self.scope.pop();
    }
}

impl<'ast> Visit<'ast> for Functions<'_> {
    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        self.within(item.ident.to_string(), |walk| visit::visit_item_mod(walk, item));
    }

    fn visit_item_impl(&mut self, item: &'ast syn::ItemImpl) {
        let name = match &*item.self_ty {
            syn::Type::Path(path) => path.path.segments.last().map(|s| s.ident.to_string()),
            _ => None,
        };
        self.within(name.unwrap_or_else(|| "_".into()), |walk| visit::visit_item_impl(walk, item));
    }

    fn visit_item_trait(&mut self, item: &'ast syn::ItemTrait) {
        self.within(item.ident.to_string(), |walk| visit::visit_item_trait(walk, item));
    }

    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        self.measure(&item.sig, &item.block);
        self.within(item.sig.ident.to_string(), |walk| visit::visit_item_fn(walk, item));
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        self.measure(&item.sig, &item.block);
        self.within(item.sig.ident.to_string(), |walk| visit::visit_impl_item_fn(walk, item));
    }

    fn visit_trait_item_fn(&mut self, item: &'ast syn::TraitItemFn) {
        if let Some(block) = &item.default {
            self.measure(&item.sig, block);
        }
        visit::visit_trait_item_fn(self, item);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(text: String) -> Source {
        let syntax = syn::parse_file(&text).unwrap();
        Source { path: "a.rs".into(), text, syntax }
    }

    fn function(comment: &str, body_lines: usize) -> Source {
        source(format!(
            "//! A.\nstruct S;\nimpl S {{\n{comment}\nfn f() {{\n{}}}\n}}\n",
            "g();\n".repeat(body_lines)
        ))
    }

    #[test]
    fn a_function_of_seventy_lines_passes_and_one_more_does_not() {
        assert!(long_functions(&[function("", 68)]).is_empty());
        let long = long_functions(&[function("", 69)]);
        assert_eq!(long["a.rs::S::f"].lines, 71);
        assert_eq!(long["a.rs::S::f"].line, 5);
    }

    #[test]
    fn a_reason_exempts_and_an_empty_one_does_not() {
        assert!(
            long_functions(&[function("// long because every case is one line of the table", 90)]).is_empty()
        );
        assert_eq!(long_functions(&[function("// long because ", 90)]).len(), 1);
    }

    #[test]
    fn the_ratchet_only_shrinks() {
        let long = long_functions(&[function("", 98)]);
        let with = |lines| compare(&BTreeMap::from([("a.rs::S::f".to_string(), lines)]), &long);
        assert!(with(100).is_empty());
        assert!(with(99)[0].message.contains("grew"));
        assert!(with(101)[0].message.contains("shrank"));
        assert_eq!(compare(&BTreeMap::new(), &long).len(), 1);
        assert_eq!(compare(&BTreeMap::from([("gone".to_string(), 80)]), &BTreeMap::new()).len(), 1);
    }

    #[test]
    fn a_file_needs_its_opening_line() {
        assert_eq!(check_files(&[source("fn f() {}\n".into())]).len(), 1);
        assert_eq!(check_files(&[source("//!\nfn f() {}\n".into())]).len(), 1);
        assert!(check_files(&[source("//! F.\nfn f() {}\n".into())]).is_empty());
        let long = format!("//! F.\n{}", "fn f() {}\n".repeat(800));
        assert_eq!(check_files(&[source(long.clone())]).len(), 1);
        assert!(check_files(&[source(long.replace("F.", "F. Long because tables."))]).is_empty());
    }
}
