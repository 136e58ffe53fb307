//! Which file of a crate names what of which other, read from the syntax of the code.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use syn::spanned::Spanned;
use syn::visit::{self, Visit};
use syn::{Attribute, Item, ItemUse, UseTree, Visibility};

/// Names from the root of a crate to a module, or to something in one; the root is empty.
pub(crate) type Names = Vec<String>;

/// The files of one crate, by the modules that they are.
pub(crate) struct Crate {
    pub(crate) files: BTreeMap<Names, File>,
}

/// What one file says outside its tests.
#[derive(Default)]
pub(crate) struct File {
    pub(crate) path: PathBuf,
    /// Lines outside tests.
    pub(crate) lines: usize,
    /// What `use` calls by a name of its own, and where it comes from.
    names: BTreeMap<String, Names>,
    /// Everything named, re-exports excepted: a table of contents depends on nothing.
    paths: BTreeSet<Names>,
}

impl Crate {
    /// Reads the sources below a folder, files of tests excepted.
    pub(crate) fn read(src: &Path) -> Self {
        let mut paths = Vec::new();
        sources(src, &mut paths);
        let files = paths.into_iter().map(|path| {
            let mut module: Names = path
                .strip_prefix(src)
                .expect("below src")
                .iter()
                .map(text)
                .collect();
            let stem = path.file_stem().map(text).expect("a name");
            module.pop();
            if !["mod", "lib", "main"].contains(&stem.as_str()) {
                module.push(stem);
            }
            (module, File::read(path))
        });
        Self {
            files: files.collect(),
        }
    }

    /// The files whose definitions a file names, itself excepted.
    pub(crate) fn imports(&self, module: &Names) -> BTreeSet<Names> {
        let paths = self.files[module].paths.iter();
        let mut found: BTreeSet<Names> = paths
            .filter_map(|path| self.home(module, path, 0))
            .collect();
        found.remove(module);
        found
    }

    /// The file that defines what `from` calls `path`, through all re-exports; `None`: not one of this crate.
    fn home(&self, from: &Names, path: &[String], depth: usize) -> Option<Names> {
        assert!(
            depth < 32,
            "{path:?} in {from:?} leads round in a circle of re-exports"
        );
        let (first, mut rest) = path.split_first()?;
        let mut at = from.clone();
        match first.as_str() {
            "crate" => at.clear(),
            "self" => {}
            "super" => drop(at.pop()),
            _ => rest = path,
        }
        let mut named = ["crate", "self", "super"].contains(&first.as_str());
        while let Some((next, after)) = rest.split_first() {
            let file = self.files.get(&at);
            let module = child(&at, next);
            let is_module = self.files.contains_key(&module);
            let renamed = file.and_then(|file| file.names.get(next));
            match renamed.filter(|target| target.as_slice() != path) {
                _ if next == "super" => drop(at.pop()),
                // A module and a function may share a name: what follows tells which is meant.
                _ if is_module && !after.is_empty() => at = module,
                Some(target) => {
                    let whole: Names = target.iter().chain(after).cloned().collect();
                    return self.home(&at, &whole, depth + 1);
                }
                None if is_module => at = module,
                None => break,
            }
            named = true;
            rest = after;
        }
        named.then_some(at)
    }

    /// Whether a file names an item of this crate by the path `crate::…` that ends so.
    pub(crate) fn names_item(&self, module: &Names, item: &[&str]) -> bool {
        let file = &self.files[module];
        let mut all = file.paths.iter().chain(file.names.values());
        all.any(|path| path[0] == "crate" && path[1..] == *item)
    }

    /// Files that import each other round in a circle: each such set.
    pub(crate) fn circles(&self) -> Vec<Vec<Names>> {
        let reach: BTreeMap<&Names, BTreeSet<Names>> = self
            .files
            .keys()
            .map(|module| (module, self.reached(module)))
            .collect();
        let mut found: BTreeSet<Vec<Names>> = BTreeSet::new();
        for (module, reached) in &reach {
            if reached.contains(*module) {
                let both = reached
                    .iter()
                    .filter(|other| reach[other].contains(*module));
                found.insert(both.cloned().collect());
            }
        }
        found.into_iter().collect()
    }

    /// All files that a file depends on, over others too.
    fn reached(&self, module: &Names) -> BTreeSet<Names> {
        let mut reached = BTreeSet::new();
        let mut open = vec![module.clone()];
        while let Some(module) = open.pop() {
            for next in self.imports(&module) {
                if reached.insert(next.clone()) {
                    open.push(next);
                }
            }
        }
        reached
    }
}

impl File {
    fn read(path: PathBuf) -> Self {
        let text = fs::read_to_string(&path).expect("a readable file");
        Self::parse(path, &text)
    }

    /// Reads the text of a file.
    pub(crate) fn parse(path: PathBuf, text: &str) -> Self {
        let syntax = syn::parse_file(text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let mut file = Self {
            path,
            lines: text.lines().count(),
            ..Self::default()
        };
        file.visit_file(&syntax);
        file
    }
}

impl<'a> Visit<'a> for File {
    fn visit_item(&mut self, item: &'a Item) {
        if attributes(item).iter().any(is_for_tests) {
            let span = item.span();
            self.lines -= span.end().line + 1 - span.start().line;
        } else {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'a ItemUse) {
        let mut leaves = Vec::new();
        flatten(&item.tree, &mut Vec::new(), &mut leaves);
        for (name, path) in leaves {
            if matches!(item.vis, Visibility::Inherited) {
                self.paths.insert(path.clone());
            }
            self.names.insert(name, path);
        }
    }

    /// `pub(super)` names nothing that the file needs.
    fn visit_visibility(&mut self, _: &'a Visibility) {}

    fn visit_path(&mut self, path: &'a syn::Path) {
        let names: Names = path
            .segments
            .iter()
            .map(|segment| segment.ident.to_string())
            .collect();
        self.paths.insert(names);
        visit::visit_path(self, path);
    }

    /// What stands in a macro is no syntax yet: paths are found by their look.
    fn visit_macro(&mut self, item: &'a syn::Macro) {
        let tokens = item.tokens.to_string().replace(" :: ", "::");
        let words = tokens.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'));
        let paths = words.filter(|word| word.contains("::"));
        self.paths
            .extend(paths.map(|word| word.split("::").map(str::to_owned).collect()));
        visit::visit_macro(self, item);
    }
}

/// The leaves of a `use` tree: the name that each gets, and its whole path.
pub(crate) fn flatten(tree: &UseTree, before: &mut Names, leaves: &mut Vec<(String, Names)>) {
    match tree {
        UseTree::Path(path) => {
            before.push(path.ident.to_string());
            flatten(&path.tree, before, leaves);
            before.pop();
        }
        UseTree::Group(group) => group
            .items
            .iter()
            .for_each(|tree| flatten(tree, before, leaves)),
        UseTree::Name(name) if name.ident == "self" => {
            leaves.push((before.last().expect("a module").clone(), before.clone()));
        }
        UseTree::Name(name) => leaves.push((
            name.ident.to_string(),
            child(before, &name.ident.to_string()),
        )),
        UseTree::Rename(rename) => leaves.push((
            rename.rename.to_string(),
            child(before, &rename.ident.to_string()),
        )),
        UseTree::Glob(_) => leaves.push((format!("{}::*", before.join("::")), before.clone())),
    }
}

/// Whether an item is compiled for tests only.
fn is_for_tests(attribute: &Attribute) -> bool {
    let text = match &attribute.meta {
        syn::Meta::List(list) if list.path.is_ident("cfg") => list.tokens.to_string(),
        _ => return false,
    };
    let words: Vec<&str> = text
        .split(|c: char| !(c.is_alphanumeric() || c == '_'))
        .collect();
    words.contains(&"test") && !words.contains(&"not") && !words.contains(&"any")
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Macro(item) => &item.attrs,
        Item::Mod(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

fn child(parent: &[String], name: &str) -> Names {
    parent
        .iter()
        .map(String::as_str)
        .chain([name])
        .map(str::to_owned)
        .collect()
}

fn text(name: &std::ffi::OsStr) -> String {
    name.to_string_lossy().into_owned()
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") && !is_test(&path) {
            found.push(path);
        }
    }
}

/// Whether a file holds nothing but the tests of its neighbour, or of that of its folder.
fn is_test(path: &Path) -> bool {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let inside = path
        .parent()
        .is_some_and(|folder| folder.ends_with("tests"));
    inside || stem == "tests" || stem.ends_with("_tests")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crate_of(files: &[(&str, &str)]) -> Crate {
        let file = |&(module, text): &(&str, &str)| {
            let module = module
                .split('/')
                .filter(|name| !name.is_empty())
                .map(str::to_owned);
            (module.collect(), File::parse(PathBuf::new(), text))
        };
        Crate {
            files: files.iter().map(file).collect(),
        }
    }

    fn imports(code: &Crate, module: &str) -> Vec<String> {
        let module = module.split('/').map(str::to_owned).collect();
        code.imports(&module)
            .iter()
            .map(|names| names.join("/"))
            .collect()
    }

    /// Nested braces, code behind tests, macros, renamed modules and re-exports are seen; tests and visibilities are not.
    #[test]
    fn imports_are_found_wherever_they_stand() {
        let code = crate_of(&[
            (
                "",
                "mod a; mod b; mod c; mod d; mod e; pub use a::deep as flat;",
            ),
            ("a", "pub mod deep; pub use deep::Thing;"),
            ("a/deep", "pub struct Thing;"),
            ("b", "use crate::{a::{self, deep::{Thing}}, c::x};"),
            (
                "c",
                "#[cfg(test)]\nmod tests { use crate::b::y; }\npub(super) fn x() { crate::d::z(); }",
            ),
            (
                "d",
                "use super::flat as f; pub fn z() { println!(\"{}\", crate::e::w()); f::Thing; }",
            ),
            ("e", "use crate::a::Thing; pub fn w() {}"),
        ]);
        assert_eq!(imports(&code, "b"), ["a", "a/deep", "c"]);
        assert_eq!(imports(&code, "c"), ["d"]);
        assert_eq!(imports(&code, "d"), ["a/deep", "e"]);
        assert_eq!(imports(&code, "e"), ["a/deep"]);
        assert!(imports(&code, "a").is_empty() && code.circles().is_empty());
        let lines = code.files[&vec!["c".to_owned()]].lines;
        assert_eq!(lines, 1);
    }

    #[test]
    fn circles_are_found_over_other_files() {
        let code = crate_of(&[
            ("", ""),
            ("a", "use crate::b::B; pub struct A;"),
            ("b", "use crate::c::C; pub struct B;"),
            ("c", "use crate::a::A; pub struct C;"),
            ("d", "use crate::a::A;"),
        ]);
        let circle: Vec<Names> = ["a", "b", "c"].map(|name| vec![name.to_owned()]).into();
        assert_eq!(code.circles(), [circle]);
    }
}
