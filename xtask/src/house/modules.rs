//! Modules of a crate and what they take from each other, from the paths `crate::…`, `super::…` and `self::…` in their text.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use super::tokens::{Token, group_end, tokens};

/// Names from the crate's root to a module or an item.
pub(crate) type Name = Vec<String>;

/// Modules of one crate.
#[derive(Debug, Default)]
pub(crate) struct Modules {
    all: BTreeMap<Name, Module>,
}

#[derive(Debug, Default)]
struct Module {
    /// Whole paths named in the text, from the root.
    named: Vec<Name>,
    /// What a `use` makes known under another name: own name, path from the root.
    imports: Vec<(String, Name)>,
}

/// Siblings that need each other, and how often each names the other.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Cycle {
    /// The module that holds them, from the root; empty for the root itself.
    pub parent: String,
    /// Names of the modules, from the root.
    pub modules: Vec<String>,
    /// From, to, paths.
    pub arrows: Vec<(String, String, usize)>,
}

impl Modules {
    /// Reads the library at `src/lib.rs`, or the program at `src/main.rs`.
    pub(crate) fn read(folder: &Path) -> Self {
        let source = folder.join("src");
        let mut modules = Self::default();
        let root = ["lib.rs", "main.rs"].map(|name| source.join(name));
        if let Some(text) = root.iter().find_map(|path| fs::read_to_string(path).ok()) {
            modules.add(&tokens(&text), &Name::new(), &source);
        }
        modules
    }

    fn add(&mut self, tokens: &[Token], name: &Name, folder: &Path) {
        let mut module = Module::default();
        let mut place = 0;
        while place < tokens.len() {
            match (&tokens[place], tokens.get(place + 1), tokens.get(place + 2)) {
                (Token::Word(word), Some(Token::Word(child)), Some(end)) if word == "mod" => {
                    let (inner, own) = (folder.join(child), extended(name, child));
                    if *end == Token::Mark('{') {
                        let close = group_end(tokens, place + 2);
                        self.add(&tokens[place + 3..close.saturating_sub(1).max(place + 3)], &own, &inner);
                        place = close;
                    } else {
                        let files = [inner.with_extension("rs"), inner.join("mod.rs")];
                        if let Some(text) = files.iter().find_map(|path| fs::read_to_string(path).ok()) {
                            self.add(&super::tokens::tokens(&text), &own, &inner);
                        }
                        place += 3;
                    }
                }
                (Token::Word(word), ..) if word == "use" => {
                    let mut found = Vec::new();
                    place = import(tokens, place + 1, &Name::new(), &mut found);
                    for (known_as, path) in found {
                        let Some(path) = absolute(name, &path) else { continue };
                        module.named.push(path.clone());
                        module.imports.push((known_as, path));
                    }
                }
                (Token::Word(word), ..) if matches!(word.as_str(), "crate" | "super" | "self") => {
                    let (path, end) = path(tokens, place);
                    if path.len() > 1 {
                        module.named.extend(absolute(name, &path));
                    }
                    place = end;
                }
                _ => place += 1,
            }
        }
        self.all.insert(name.clone(), module);
    }

    /// The module that a path from the root leads to, by way of what its modules import.
    fn resolve(&self, path: &[String], depth: usize) -> Name {
        let mut module = Name::new();
        for (place, part) in path.iter().enumerate() {
            let inner = extended(&module, part);
            if self.all.contains_key(&inner) {
                module = inner;
                continue;
            }
            let imports = self.all.get(&module).map_or(&[][..], |module| &module.imports);
            if let Some((_, target)) = imports.iter().find(|(known_as, _)| known_as == part)
                && depth > 0
            {
                let whole: Name = target.iter().chain(&path[place + 1..]).cloned().collect();
                return self.resolve(&whole, depth - 1);
            }
            break;
        }
        module
    }

    /// Arrows between the children of each module: parent → (from, to) → paths that name it.
    fn arrows(&self) -> BTreeMap<Name, BTreeMap<(String, String), usize>> {
        let mut arrows: BTreeMap<Name, BTreeMap<(String, String), usize>> = BTreeMap::new();
        for (from, module) in &self.all {
            for path in &module.named {
                let to = self.resolve(path, 8);
                let common = from.iter().zip(&to).take_while(|(own, other)| own == other).count();
                if let (Some(own), Some(other)) = (from.get(common), to.get(common)) {
                    let each = arrows.entry(from[..common].to_vec()).or_default();
                    *each.entry((own.clone(), other.clone())).or_default() += 1;
                }
            }
        }
        arrows
    }

    /// For each module at the top what it takes from the others.
    pub(crate) fn at_the_top(&self) -> BTreeMap<String, BTreeSet<String>> {
        let tops = self.all.keys().filter(|name| name.len() == 1).map(|name| (name[0].clone(), BTreeSet::new()));
        let mut top: BTreeMap<String, BTreeSet<String>> = tops.collect();
        for (from, to) in self.arrows().remove(&Name::new()).unwrap_or_default().into_keys() {
            top.entry(from).or_default().insert(to);
        }
        top
    }

    /// Sets of siblings of which each needs each other, at every depth.
    pub(crate) fn cycles(&self) -> Vec<Cycle> {
        let mut cycles = Vec::new();
        for (parent, arrows) in self.arrows() {
            let full = |name: &str| extended(&parent, name).join("::");
            for set in mutual(&arrows.keys().cloned().collect()) {
                let inside = arrows.iter().filter(|((from, to), _)| set.contains(from) && set.contains(to));
                let arrows = inside.map(|((from, to), count)| (full(from), full(to), *count)).collect();
                let modules = set.iter().map(|name| full(name)).collect();
                cycles.push(Cycle { parent: parent.join("::"), modules, arrows });
            }
        }
        cycles
    }
}

fn extended(name: &[String], part: &str) -> Name {
    name.iter().cloned().chain([part.to_owned()]).collect()
}

/// Sets of more than one name in which each reaches each other.
fn mutual(arrows: &BTreeSet<(String, String)>) -> Vec<BTreeSet<String>> {
    let names: BTreeSet<&String> = arrows.iter().flat_map(|(from, to)| [from, to]).collect();
    let reached = |start: &String| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![start.clone()]);
        while let Some(next) = open.pop() {
            for (_, to) in arrows.iter().filter(|(from, _)| *from == next) {
                if seen.insert(to.clone()) {
                    open.push(to.clone());
                }
            }
        }
        seen
    };
    let reach: BTreeMap<&String, BTreeSet<String>> = names.iter().map(|name| (*name, reached(name))).collect();
    let mut sets: BTreeSet<BTreeSet<String>> = BTreeSet::new();
    for (name, far) in &reach {
        if far.contains(*name) {
            sets.insert(far.iter().filter(|other| reach[other].contains(*name)).cloned().collect());
        }
    }
    sets.into_iter().filter(|set| set.len() > 1).collect()
}

/// Words joined by `::` from `place` on, and what is behind them.
fn path(tokens: &[Token], mut place: usize) -> (Name, usize) {
    let mut path = Name::new();
    while let Some(Token::Word(word)) = tokens.get(place) {
        path.push(word.clone());
        if !joined(tokens, place + 1) {
            return (path, place + 1);
        }
        place += 3;
    }
    (path, place)
}

fn joined(tokens: &[Token], place: usize) -> bool {
    tokens.get(place..place + 2).is_some_and(|pair| *pair == [Token::Mark(':'), Token::Mark(':')])
}

/// Reads one branch of an import: a path, and behind it a list in braces, `*` or `as` another name. Returns what is behind.
fn import(tokens: &[Token], place: usize, before: &Name, found: &mut Vec<(String, Name)>) -> usize {
    let (own, mut place) = path(tokens, place);
    let mut whole: Name = before.iter().chain(&own).cloned().collect();
    match tokens.get(place) {
        Some(Token::Mark('{')) => {
            let end = group_end(tokens, place);
            place += 1;
            while place + 1 < end {
                place = import(tokens, place, &whole, found);
                if tokens.get(place) == Some(&Token::Mark(',')) {
                    place += 1;
                }
            }
            return end;
        }
        Some(Token::Mark('*')) => {
            found.push(("*".into(), whole));
            return place + 1;
        }
        Some(token) if token.is_word("as") => {
            if let Some(Token::Word(name)) = tokens.get(place + 1) {
                found.push((name.clone(), whole));
            }
            return place + 2;
        }
        _ => {}
    }
    // `a::{self, b}` names `a` itself.
    if whole.len() > 1 && whole.last().is_some_and(|last| last == "self") {
        whole.pop();
    }
    if let Some(last) = whole.last() {
        found.push((last.clone(), whole.clone()));
    }
    // What is not understood is passed over, so that the reading ends.
    if own.is_empty() { place + 1 } else { place }
}

/// A path from the root, of one as written in a module; none of one that leads above the root.
fn absolute(module: &[String], path: &[String]) -> Option<Name> {
    let (first, rest) = path.split_first()?;
    let mut base = match first.as_str() {
        "crate" => Name::new(),
        "self" => module.to_vec(),
        "super" => module[..module.len().checked_sub(1)?].to_vec(),
        // The name of a child or of another crate: below the module a child resolves, and a crate does not.
        _ => return Some(module.iter().chain(path).cloned().collect()),
    };
    for part in rest {
        if part == "super" {
            base.pop();
        } else {
            base.push(part.clone());
        }
    }
    Some(base)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::house::tests::tree;

    fn shown(modules: &Modules) -> Vec<String> {
        let shown = |(from, to): (String, BTreeSet<String>)| {
            format!("{from}: {}", to.into_iter().collect::<Vec<_>>().join(" "))
        };
        modules.at_the_top().into_iter().map(shown).collect()
    }

    #[test]
    fn paths_lead_to_modules_also_by_what_the_root_gives_on() {
        let folder = tree(&[
            ("src/lib.rs", "mod error; mod rig; mod stage; mod deep;\npub use error::{Error, Result as Outcome};\n"),
            ("src/error.rs", "pub struct Error;"),
            ("src/rig.rs", "use std::{fs, path};\nfn a() -> crate::Outcome { \"crate::stage\"; }"),
            (
                "src/stage.rs",
                "use super::{rig::{self, Rig}, error as wrong};\n#[cfg(test)]\nmod tests { use crate::deep; }",
            ),
            ("src/deep/mod.rs", "pub mod one; mod two { use super::one; use crate::stage::Stage; }"),
            ("src/deep/one.rs", "use super::super::rig;"),
        ]);
        let modules = Modules::read(&folder);
        assert_eq!(shown(&modules), ["deep: rig stage", "error: ", "rig: error", "stage: error rig"]);
        assert_eq!(modules.cycles(), []);
    }

    #[test]
    fn cycles_are_found_at_every_depth() {
        let folder = tree(&[
            ("src/lib.rs", "mod a; mod b; mod c; mod d;"),
            ("src/a.rs", "use crate::b::B; use crate::b::C;"),
            ("src/b.rs", "use crate::c;"),
            ("src/c.rs", "fn f() { crate::a::g() }"),
            ("src/d/mod.rs", "mod x; mod y; use crate::a; use x::X;"),
            ("src/d/x.rs", "use super::y;"),
            ("src/d/y.rs", "use super::X;"),
        ]);
        let cycles = Modules::read(&folder).cycles();
        assert_eq!(cycles.iter().map(|cycle| cycle.modules.join(" ")).collect::<Vec<_>>(), ["a b c", "d::x d::y"]);
        assert_eq!(cycles[0].arrows[0], ("a".into(), "b".into(), 2));
    }
}
