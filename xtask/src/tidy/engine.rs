//! What must not stand in the sources: in the engine, anything that touches the world outside or is unsafe;
//! anywhere, leftovers of work in progress.

use super::{Finding, Source};
use proc_macro2::{TokenStream, TokenTree};
use std::str::FromStr;

const ENGINE: &str = "crates/hither/src/";

/// Roots of the crates that hold no unsafe code.
const SAFE_ROOTS: &[&str] = &[
    "crates/hither/src/lib.rs",
    "crates/hither-io/src/lib.rs",
    "crates/hither-worlds/src/lib.rs",
    "crates/hither-cli/src/main.rs",
];

/// Modules of the standard library that the engine does without.
const OUTSIDE: &[&str] = &["fs", "net", "process", "env"];
const PRINTING: &[&str] = &["print", "println", "eprint", "eprintln"];
const LEFTOVERS: &[&str] = &["todo", "unimplemented", "dbg"];

/// Checks every file.
pub fn check(sources: &[Source]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for source in sources {
        let forbids_unsafe = source.text.lines().any(|line| line == "#![forbid(unsafe_code)]");
        if SAFE_ROOTS.contains(&source.path.as_str()) && !forbids_unsafe {
            let message = "the crate must open with `#![forbid(unsafe_code)]`".into();
            findings.push(Finding { path: source.path.clone(), line: 0, message });
        }
        let mut tokens = Vec::new();
        if let Ok(stream) = TokenStream::from_str(&source.text) {
            flatten(stream, &mut tokens);
        }
        let in_engine = source.path.starts_with(ENGINE);
        for (at, (token, line)) in tokens.iter().enumerate() {
            let follows = |i: usize, what: &str| tokens.get(at + i).is_some_and(|(t, _)| t == what);
            let message = if LEFTOVERS.contains(&token.as_str()) && follows(1, "!") {
                format!("`{token}!` is left over; finish the work")
            } else if !in_engine {
                continue;
            } else if PRINTING.contains(&token.as_str()) && follows(1, "!") {
                format!("`{token}!`: the engine prints nothing; return what there is to say")
            } else if token == "std" && follows(1, ":") && follows(2, ":") {
                let named = outside(&tokens[at + 3..]);
                let Some(named) = named else { continue };
                format!(
                    "`std::{named}`: the engine touches nothing outside; that belongs in a crate around it"
                )
            } else {
                continue;
            };
            findings.push(Finding { path: source.path.clone(), line: *line, message });
        }
    }
    findings
}

/// The first forbidden module that follows `std::`, as a name or in a group.
fn outside(after: &[(String, usize)]) -> Option<&str> {
    let names = match after.first()?.0.as_str() {
        "{" => after[1..].iter().take_while(|(t, _)| t != "}").collect::<Vec<_>>(),
        _ => vec![&after[0]],
    };
    names.into_iter().map(|(name, _)| name.as_str()).find(|name| OUTSIDE.contains(name))
}

fn flatten(stream: TokenStream, found: &mut Vec<(String, usize)>) {
    for token in stream {
        let line = token.span().start().line;
        match token {
            TokenTree::Group(group) => {
                let braces = group.delimiter() == proc_macro2::Delimiter::Brace;
                if braces {
                    found.push(("{".into(), line));
                }
                flatten(group.stream(), found);
                if braces {
                    found.push(("}".into(), line));
                }
            }
            TokenTree::Literal(_) => found.push(("\"\"".into(), line)),
            other => found.push((other.to_string(), line)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn findings(path: &str, text: &str) -> usize {
        let syntax = syn::parse_file(text).unwrap();
        check(&[Source { path: path.into(), text: text.into(), syntax }]).len()
    }

    #[test]
    fn the_engine_touches_nothing_outside() {
        let engine = "crates/hither/src/scene/mod.rs";
        assert_eq!(findings(engine, "use std::fs::File;"), 1);
        assert_eq!(findings(engine, "use std::{fmt, net::TcpStream};"), 1);
        assert_eq!(findings(engine, "fn f() { if g() { println!(\"x\"); } }"), 1);
        assert_eq!(findings(engine, "/// `std::fs` println!\nfn f() -> &'static str { \"std::fs\" }"), 0);
        assert_eq!(findings("crates/hither-io/src/read.rs", "use std::fs::File;"), 0);
    }

    #[test]
    fn leftovers_are_seen_everywhere() {
        assert_eq!(findings("crates/hither-io/src/read.rs", "fn f() { todo!() }"), 1);
        assert_eq!(findings("crates/hither-io/src/read.rs", "fn f() { g(dbg!(1)) }"), 1);
        assert_eq!(findings("crates/hither-io/src/read.rs", "fn todo() { todo() }"), 0);
    }

    #[test]
    fn safe_crates_say_so() {
        assert_eq!(findings("crates/hither-io/src/lib.rs", "mod a;"), 1);
        assert_eq!(findings("crates/hither-io/src/lib.rs", "#![forbid(unsafe_code)]\nmod a;"), 0);
    }
}
