//! The engine's module tree: which file is which module, and which of them exist only in tests.

use super::{Finding, Source};
use std::collections::HashMap;

/// A source file of the engine and its place in the module tree.
pub struct Module<'a> {
    /// The file.
    pub source: &'a Source,
    /// Names from the crate's root; empty for `lib.rs`.
    pub path: Vec<String>,
    /// Whether `#[cfg(test)]` stands on it or on a module around it.
    pub test: bool,
}

/// Follows the `mod` declarations from `root_file`. Files that no declaration reaches are findings.
pub fn tree<'a>(sources: &'a [Source], root_file: &str) -> (Vec<Module<'a>>, Vec<Finding>) {
    let folder = root_file.rsplit_once('/').map_or("", |(folder, _)| folder);
    let mut unreached: HashMap<&str, &Source> = sources
        .iter()
        .filter(|s| s.path.starts_with(&format!("{folder}/")))
        .map(|s| (s.path.as_str(), s))
        .collect();
    let mut modules = Vec::new();
    let mut open: Vec<(String, Vec<String>, bool)> = vec![(root_file.to_string(), Vec::new(), false)];
    while let Some((file, path, test)) = open.pop() {
        let Some(source) = unreached.remove(file.as_str()) else { continue };
        let mut declared = Vec::new();
        declarations(&source.syntax.items, &path, test, &mut declared);
        for (child, test) in declared {
            let base = format!("{folder}/{}", child.join("/"));
            let file = [format!("{base}.rs"), format!("{base}/mod.rs")]
                .into_iter()
                .find(|file| unreached.contains_key(file.as_str()));
            if let Some(file) = file {
                open.push((file, child, test));
            }
        }
        modules.push(Module { source, path, test });
    }
    let orphans = unreached.keys().map(|path| Finding {
        path: path.to_string(),
        line: 0,
        message: "no `mod` declaration leads here; declare it or delete it".into(),
    });
    let orphans = orphans.collect();
    modules.sort_by(|a, b| a.source.path.cmp(&b.source.path));
    (modules, orphans)
}

/// Modules that `items` declare in files of their own, inline modules included.
fn declarations(items: &[syn::Item], path: &[String], test: bool, found: &mut Vec<(Vec<String>, bool)>) {
    for item in items {
        let syn::Item::Mod(module) = item else { continue };
        let test = test || is_test(&module.attrs);
        let mut child = path.to_vec();
        child.push(module.ident.to_string());
        match &module.content {
            Some((_, items)) => declarations(items, &child, test, found),
            None => found.push((child, test)),
        }
    }
}

/// Whether `#[cfg(test)]` (alone or within `all(…)`) is among `attributes`.
pub fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let syn::Meta::List(list) = &attribute.meta else { return false };
        let condition = list.tokens.to_string().replace(' ', "");
        list.path.is_ident("cfg") && (condition == "test" || condition.starts_with("all(test,"))
    })
}
