//! The rooms' import rules: a room of the engine imports only from floors below its own.
//!
//! Read are `use` declarations, paths in code, and paths inside macro calls; `crate::`, `super::` and
//! `self::` are followed. `reference` has rules of its own, in both directions.

use super::modules::{Module, is_test, tree};
use super::{Finding, Source};
use anyhow::{Context, Result};
use proc_macro2::{TokenStream, TokenTree};
use std::path::Path;
use syn::visit::{self, Visit};

/// Where each room stands. `ARCHITECTURE.md` says what each is for.
const FLOORS: &[(&str, u32)] = &[
    ("conventions", 1),
    ("geometry", 2),
    ("scene", 3),
    ("raster", 3),
    ("index", 4),
    ("cull", 5),
    ("order", 5),
    ("layers", 7),
    ("hidden_line", 6),
    ("antialias", 6),
    ("classic", 6),
    ("render", 6),
];

const REFERENCE: &str = "reference";
const REFERENCE_MAY_IMPORT: &[&str] = &["conventions", "scene"];
const ENGINE: &str = "crates/hither/src/lib.rs";

/// Checks every module of the engine, and that `ARCHITECTURE.md` says the same of the floors.
pub fn check(root: &Path, sources: &[Source]) -> Result<Vec<Finding>> {
    let (modules, mut findings) = tree(sources, ENGINE);
    let text =
        std::fs::read_to_string(root.join("ARCHITECTURE.md")).context("cannot read ARCHITECTURE.md")?;
    for module in &modules {
        findings.extend(check_module(module));
    }
    let rooms = modules.iter().filter(|module| module.path.len() == 1).map(|module| &module.path[0]);
    for room in rooms {
        let floor = FLOORS.iter().find(|(name, _)| name == room).map(|(_, floor)| floor.to_string());
        let floor = floor.unwrap_or_else(|| "–".into());
        if !text.contains(&format!("| {floor} | `{room}` |")) {
            let message = format!("the table of rooms has no line `| {floor} | `{room}` | …`");
            findings.push(Finding { path: "ARCHITECTURE.md".into(), line: 0, message });
        }
    }
    Ok(findings)
}

fn check_module(module: &Module) -> Vec<Finding> {
    let Some(room) = module.path.first() else { return Vec::new() };
    let mut walk = Imports { here: module.path.clone(), test: module.test, found: Vec::new() };
    walk.visit_file(&module.source.syntax);
    let finding = |(line, message)| Finding { path: module.source.path.clone(), line, message };
    walk.found
        .into_iter()
        .filter_map(|import| refusal(room, &import.name, import.test).map(|why| (import.line, why)))
        .map(finding)
        .collect()
}

/// Why `room` may not import `name` (a room, or an item of the crate's root), if it may not.
fn refusal(room: &str, name: &str, test: bool) -> Option<String> {
    let floor = |name: &str| FLOORS.iter().find(|(room, _)| *room == name).map(|(_, floor)| *floor);
    if name == room || (name == REFERENCE && test) {
        return None;
    }
    if name == REFERENCE {
        return Some(format!("`{room}` imports `reference`; only tests may"));
    }
    let Some(theirs) = floor(name) else {
        return Some(format!("`crate::{name}` is not a room; import it from the room where it stands"));
    };
    if room == REFERENCE {
        let allowed = REFERENCE_MAY_IMPORT.contains(&name);
        return (!allowed)
            .then(|| format!("`reference` imports `{name}`; it may import only conventions and scene"));
    }
    match floor(room) {
        None => Some(format!("`{room}` has no floor; give it one in xtask/src/tidy/rooms.rs")),
        Some(ours) if theirs >= ours => Some(format!(
            "`{room}` (floor {ours}) imports `{name}` (floor {theirs}); only floors below may be"
        )),
        Some(_) => None,
    }
}

#[derive(Debug, PartialEq)]
struct Import {
    name: String,
    line: usize,
    test: bool,
}

/// Collects what a file names outside its own room.
struct Imports {
    here: Vec<String>,
    test: bool,
    found: Vec<Import>,
}

impl Imports {
    /// Notes the room that `path` leads to, where its beginning says so.
    fn note(&mut self, path: &[proc_macro2::Ident]) {
        let Some(first) = path.first() else { return };
        let mut at: Vec<String> = match first.to_string().as_str() {
            "crate" => Vec::new(),
            "super" | "self" => self.here.clone(),
            _ => return,
        };
        for name in path {
            match name.to_string().as_str() {
                "crate" | "self" => {}
                "super" => {
                    at.pop();
                }
                other => at.push(other.to_string()),
            }
        }
        let line = first.span().start().line;
        if let Some(name) = at.into_iter().next() {
            self.found.push(Import { name, line, test: self.test });
        }
    }

    fn note_use(&mut self, tree: &syn::UseTree, before: &mut Vec<proc_macro2::Ident>) {
        match tree {
            syn::UseTree::Path(path) => {
                before.push(path.ident.clone());
                self.note_use(&path.tree, before);
                before.pop();
            }
            syn::UseTree::Group(group) => {
                for tree in &group.items {
                    self.note_use(tree, before);
                }
            }
            syn::UseTree::Name(syn::UseName { ident, .. })
            | syn::UseTree::Rename(syn::UseRename { ident, .. }) => {
                before.push(ident.clone());
                self.note(before);
                before.pop();
            }
            _ => self.note(before),
        }
    }

    fn note_tokens(&mut self, tokens: TokenStream) {
        let mut path: Vec<proc_macro2::Ident> = Vec::new();
        let mut colons = 0;
        for token in tokens {
            match token {
                TokenTree::Ident(ident) => {
                    if colons != 2 {
                        self.note(&path);
                        path.clear();
                    }
                    path.push(ident);
                    colons = 0;
                }
                TokenTree::Punct(punct) if punct.as_char() == ':' => colons += 1,
                other => {
                    self.note(&path);
                    path.clear();
                    colons = 0;
                    if let TokenTree::Group(group) = other {
                        self.note_tokens(group.stream());
                    }
                }
            }
        }
        self.note(&path);
    }
}

impl<'ast> Visit<'ast> for Imports {
    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        let outer = self.test;
        self.test |= is_test(&item.attrs);
        self.here.push(item.ident.to_string());
        visit::visit_item_mod(self, item);
        self.here.pop();
        self.test = outer;
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        let outer = self.test;
        self.test |= is_test(&item.attrs);
        self.note_use(&item.tree, &mut Vec::new());
        self.test = outer;
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names: Vec<_> = path.segments.iter().map(|segment| segment.ident.clone()).collect();
        self.note(&names);
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'ast syn::Macro) {
        self.note_tokens(call.tokens.clone());
        visit::visit_macro(self, call);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(path: &str, text: &str) -> Vec<String> {
        let source =
            Source { path: "x.rs".into(), text: text.into(), syntax: syn::parse_file(text).unwrap() };
        let path = path.split("::").map(String::from).collect();
        let module = Module { source: &source, path, test: false };
        check_module(&module).into_iter().map(|f| format!("{}: {}", f.line, f.message)).collect()
    }

    #[test]
    fn a_room_may_look_down_and_not_up_or_across() {
        assert!(refused("index", "use crate::{scene::Scene, geometry::Aabb};").is_empty());
        assert_eq!(
            refused("index", "use crate::scene::Scene;\nuse crate::{geometry::Aabb, render::Frame};").len(),
            1
        );
        assert_eq!(refused("raster", "use crate::scene;").len(), 1);
        assert_eq!(refused("raster", "use crate::index;").len(), 1);
        assert!(refused("index", "use crate::index::walk;").is_empty());
    }

    #[test]
    fn every_way_to_write_an_import_is_seen() {
        assert_eq!(
            refused("raster::pyramid", "use super::super::geometry::Aabb;\nuse super::super::render::x;")
                .len(),
            1
        );
        assert!(refused("raster::pyramid", "use super::super::raster::tile;\nuse super::tile;").is_empty());
        assert_eq!(refused("scene", "fn f() { crate::index::g(); }").len(), 1);
        assert_eq!(refused("scene", "fn f(x: &crate::index::T) {}").len(), 1);
        assert_eq!(refused("scene", "fn f() { vec![a::b, crate::index::g()]; }").len(), 1);
        assert_eq!(refused("scene", "mod inner { use super::super::index::T; }").len(), 1);
        assert_eq!(refused("scene", "fn f() { crate::Renderer::new(); }").len(), 1);
        assert_eq!(refused("scene", "pub(crate) fn f() {}\npub(super) fn g() {}").len(), 0);
    }

    #[test]
    fn reference_stands_apart() {
        assert!(refused("reference", "use crate::{conventions::View, scene::Scene};").is_empty());
        assert_eq!(refused("reference", "use crate::geometry::Aabb;").len(), 1);
        assert_eq!(refused("render", "use crate::reference::cast;").len(), 1);
        assert!(refused("render", "#[cfg(test)] mod tests { use crate::reference::cast; }").is_empty());
        assert_eq!(refused("cellar", "use crate::scene::Scene;").len(), 1);
    }
}
