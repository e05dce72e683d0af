//! Which modules of a crate name which others, and whether any do so in a circle.
//!
//! An arrow leads from a module to the one that holds an item it names, through re-exports, tests left out. Cycles are looked for
//! among the children of one module, each with all that is in it. A module and its own parent may name each other.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use syn::visit::{self, Visit};
use syn::{Attribute, Item, UseTree, Visibility};

/// A module's path from the crate's root, which is empty.
type ModulePath = Vec<String>;

/// The modules of a crate.
#[derive(Debug, Default)]
pub(crate) struct ModuleGraph {
    modules: BTreeMap<ModulePath, Module>,
}

/// What a module names.
#[derive(Debug, Default)]
struct Module {
    /// Paths as they are written.
    named: BTreeSet<Vec<String>>,
    /// Names that it re-exports, with the paths that they stand for.
    exported: BTreeMap<String, Vec<String>>,
}

impl ModuleGraph {
    /// Reads the modules of the crate whose root is this file.
    pub(crate) fn read(crate_root: &Path) -> anyhow::Result<Self> {
        let mut graph = Self::default();
        let folder = crate_root.parent().context("a file has a folder")?;
        graph.add_file(Vec::new(), crate_root, folder)?;
        Ok(graph)
    }

    /// How many pairs of modules have an arrow.
    pub(crate) fn arrow_count(&self) -> usize {
        self.arrows().len()
    }

    /// One line for each circle that is found: the parent module, and which of its children name which.
    pub(crate) fn cycles(&self) -> Vec<String> {
        let mut among_siblings: BTreeMap<&[String], BTreeSet<(&str, &str)>> = BTreeMap::new();
        let arrows = self.arrows();
        for (from, to) in &arrows {
            let shared = from.iter().zip(to).take_while(|(a, b)| a == b).count();
            if let (Some(a), Some(b)) = (from.get(shared), to.get(shared)) {
                let siblings = among_siblings.entry(&from[..shared]).or_default();
                siblings.insert((a, b));
            }
        }
        let of_parent = |(parent, arrows): (&&[String], &BTreeSet<(&str, &str)>)| {
            let modules: BTreeSet<&str> = arrows.iter().map(|(from, _)| *from).collect();
            let mut found = BTreeSet::new();
            for module in modules {
                let circle = circle_through(module, arrows);
                if !circle.is_empty() {
                    let is_inside = |arrow: &&(&str, &str)| {
                        circle.contains(arrow.0) && circle.contains(arrow.1)
                    };
                    let named: Vec<String> = (arrows.iter().filter(is_inside))
                        .map(|(from, to)| format!("{from} names {to}"))
                        .collect();
                    let place = ["crate", &parent.join("::")].join("::");
                    found.insert(format!(
                        "{}: {}",
                        place.trim_end_matches(':'),
                        named.join(", ")
                    ));
                }
            }
            found
        };
        among_siblings.iter().flat_map(of_parent).collect()
    }

    /// All pairs of modules of which the first names an item of the second.
    fn arrows(&self) -> BTreeSet<(ModulePath, ModulePath)> {
        let mut arrows = BTreeSet::new();
        for (from, module) in &self.modules {
            for path in &module.named {
                if let Some(to) = self.resolve(from, path, 0).filter(|to| to != from) {
                    arrows.insert((from.clone(), to));
                }
            }
        }
        arrows
    }

    /// The module of this crate that a path leads to; `None` when it leads elsewhere.
    fn resolve(&self, from: &[String], path: &[String], depth: usize) -> Option<ModulePath> {
        const MOST_REEXPORTS: usize = 16;
        let (mut at, mut rest) = (from.to_vec(), path);
        match path.first()?.as_str() {
            "crate" => {
                at.clear();
                rest = &path[1..];
            }
            "self" => rest = &path[1..],
            "super" => {
                while rest.first().is_some_and(|name| name == "super") {
                    at.pop();
                    rest = &rest[1..];
                }
            }
            first => {
                let own = [from, &[first.to_owned()]].concat();
                if !self.modules.contains_key(&own) {
                    return None;
                }
            }
        }
        while let Some((name, after)) = rest.split_first() {
            at.push(name.clone());
            if self.modules.contains_key(&at) {
                rest = after;
                continue;
            }
            at.pop();
            let exported = self.modules.get(&at)?.exported.get(name);
            return match exported.filter(|_| depth < MOST_REEXPORTS) {
                Some(path) => self.resolve(&at, path, depth + 1).or(Some(at)),
                None => Some(at),
            };
        }
        Some(at)
    }

    /// Adds the module of a file, whose own modules lie in `folder`.
    fn add_file(&mut self, path: ModulePath, file: &Path, folder: &Path) -> anyhow::Result<()> {
        let text = fs::read_to_string(file)
            .with_context(|| format!("{} cannot be read", file.display()))?;
        let parsed =
            syn::parse_file(&text).with_context(|| format!("{} is not Rust", file.display()))?;
        self.add_items(path, &parsed.items, folder)
    }

    fn add_items(&mut self, path: ModulePath, items: &[Item], folder: &Path) -> anyhow::Result<()> {
        let mut module = Module::default();
        for item in items {
            if let Item::Mod(inner) = item {
                if is_test(&inner.attrs) {
                    continue;
                }
                let name = inner.ident.to_string();
                let inner_path = [&path[..], std::slice::from_ref(&name)].concat();
                let inner_folder = folder.join(&name);
                match &inner.content {
                    Some((_, items)) => self.add_items(inner_path, items, &inner_folder)?,
                    None => {
                        let file = file_of(folder, &name)?;
                        self.add_file(inner_path, &file, &inner_folder)?;
                    }
                }
            } else {
                Reader(&mut module).visit_item(item);
            }
        }
        self.modules.insert(path, module);
        Ok(())
    }
}

/// The file of a module that a folder holds.
fn file_of(folder: &Path, name: &str) -> anyhow::Result<PathBuf> {
    let files = [
        folder.join(format!("{name}.rs")),
        folder.join(name).join("mod.rs"),
    ];
    match files.into_iter().find(|file| file.is_file()) {
        Some(file) => Ok(file),
        None => bail!("{} has no file for module {name}", folder.display()),
    }
}

/// The modules from which `module` is reached and which it reaches, itself included; none where there is no circle through it.
fn circle_through<'a>(module: &'a str, arrows: &BTreeSet<(&'a str, &'a str)>) -> BTreeSet<&'a str> {
    let backwards: BTreeSet<(&str, &str)> = arrows.iter().map(|&(a, b)| (b, a)).collect();
    let ahead = reached(module, arrows);
    let circle: BTreeSet<&str> = (ahead.intersection(&reached(module, &backwards)))
        .copied()
        .collect();
    if circle.contains(module) {
        circle
    } else {
        BTreeSet::new()
    }
}

/// All that arrows lead to from `start`, which is among them only when they lead back.
fn reached<'a>(start: &'a str, arrows: &BTreeSet<(&'a str, &'a str)>) -> BTreeSet<&'a str> {
    let mut found = BTreeSet::new();
    let mut open = vec![start];
    while let Some(at) = open.pop() {
        for &(from, to) in arrows {
            if from == at && found.insert(to) {
                open.push(to);
            }
        }
    }
    found
}

/// Whether something is compiled for tests only.
fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("test")
            || attribute.path().is_ident("cfg")
                && attribute
                    .parse_args::<syn::Path>()
                    .is_ok_and(|condition| condition.is_ident("test"))
    })
}

/// Collects what an item names.
struct Reader<'a>(&'a mut Module);

impl Reader<'_> {
    fn add_use(&mut self, before: &[String], tree: &UseTree, is_exported: bool) {
        let with = |name: String| [before, &[name]].concat();
        match tree {
            UseTree::Path(path) => {
                self.add_use(&with(path.ident.to_string()), &path.tree, is_exported);
            }
            UseTree::Group(group) => {
                for tree in &group.items {
                    self.add_use(before, tree, is_exported);
                }
            }
            UseTree::Glob(_) => {
                self.0.named.insert(before.to_vec());
            }
            UseTree::Name(name) => {
                let name = name.ident.to_string();
                self.add_name(before, &name, &name, is_exported);
            }
            UseTree::Rename(rename) => {
                let alias = rename.rename.to_string();
                self.add_name(before, &rename.ident.to_string(), &alias, is_exported);
            }
        }
    }

    fn add_name(&mut self, before: &[String], name: &str, alias: &str, is_exported: bool) {
        let path = if name == "self" {
            before.to_vec()
        } else {
            [before, &[name.to_owned()]].concat()
        };
        if is_exported {
            self.0.exported.insert(alias.to_owned(), path);
        } else {
            self.0.named.insert(path);
        }
    }
}

impl<'ast> Visit<'ast> for Reader<'_> {
    fn visit_item(&mut self, item: &'ast Item) {
        let attributes = match item {
            Item::Fn(item) => &item.attrs,
            Item::Impl(item) => &item.attrs,
            Item::Use(item) => &item.attrs,
            Item::Struct(item) => &item.attrs,
            Item::Enum(item) => &item.attrs,
            Item::Const(item) => &item.attrs,
            _ => return visit::visit_item(self, item),
        };
        if !is_test(attributes) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        let is_exported = !matches!(item.vis, Visibility::Inherited);
        self.add_use(&[], &item.tree, is_exported);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let segments = path.segments.iter().map(|s| s.ident.to_string());
        self.0.named.insert(segments.collect());
        visit::visit_path(self, path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cycles of a crate of these modules in a row, each with its text.
    fn cycles(modules: &[(&str, &str)], root: &str) -> Vec<String> {
        let names: String = modules.iter().map(|(n, _)| format!("mod {n};\n")).collect();
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(format!("{name}.rs"));
        fs::write(file("lib"), names + root).unwrap();
        for (name, text) in modules {
            fs::write(file(name), text).unwrap();
        }
        ModuleGraph::read(&file("lib")).unwrap().cycles()
    }

    #[test]
    fn modules_in_a_row_are_fine() {
        let modules = [
            ("a", "use crate::b::B; pub struct A(B);"),
            ("b", "use super::c; pub struct B(c::C);"),
            ("c", "pub struct C;"),
        ];
        assert_eq!(cycles(&modules, ""), Vec::<String>::new());
    }

    #[test]
    fn two_modules_that_name_each_other_are_found() {
        let modules = [
            ("a", "use crate::b::B; pub struct A(B);"),
            ("b", "pub struct B; fn f() -> Option<super::a::A> { None }"),
        ];
        assert_eq!(cycles(&modules, ""), ["crate: a names b, b names a"]);
    }

    #[test]
    fn a_circle_through_a_reexport_and_an_inner_module_is_found() {
        let modules = [
            ("a", "mod_text!(); use crate::Shown; pub struct A(Shown);"),
            ("b", "pub mod inner { use crate::c::C; pub struct B(C); }"),
            ("c", "use crate::a; pub struct C; fn f(_: a::A) {}"),
        ];
        let root = "pub use b::inner::B as Shown;";
        assert_eq!(
            cycles(&modules, root),
            ["crate: a names b, b names c, c names a"]
        );
    }

    #[test]
    fn tests_may_name_anything() {
        let modules = [
            ("a", "use crate::b::B; pub struct A(B);"),
            (
                "b",
                "pub struct B; #[cfg(test)] mod tests { use crate::a::A; }",
            ),
        ];
        assert_eq!(cycles(&modules, ""), Vec::<String>::new());
    }
}
