//! The source files of a crate and which of them uses which: its modules, read with `syn`.
//!
//! A use is a path that begins with `crate`, `self`, `super` or the name of a module declared beside it, in a `use` or
//! anywhere else. It counts for the file that defines what it names: re-exports are followed. Re-exporting itself is no use,
//! and what stands under `cfg(test)` does not count. Paths built by macros are not seen.

use crate::repository::Failure;
use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use syn::{Item, UseTree, Visibility};

/// Path of a module from the root of its crate, or of an item from a module.
type Names = Vec<String>;

/// One module.
#[derive(Default)]
struct Module {
    /// Its file, or that of the module it stands in.
    file: PathBuf,
    /// Modules declared in it.
    children: BTreeSet<String>,
    /// Names it defines.
    items: BTreeSet<String>,
    /// Names it imports or re-exports, and their paths.
    imports: BTreeMap<String, Names>,
    /// Modules all of whose names it imports or re-exports.
    globs: Vec<Names>,
    /// Paths it uses.
    uses: BTreeSet<Names>,
}

/// The modules of a crate.
#[derive(Default)]
pub struct Modules(BTreeMap<Names, Module>);

/// The files of a crate, and for each the files it uses with an example of a path.
pub type Uses = BTreeMap<PathBuf, BTreeMap<PathBuf, String>>;

impl Modules {
    /// Reads a crate from its root file, such as `src/lib.rs`.
    pub fn read(root: &Path) -> Result<Self, Failure> {
        let mut modules = Self::default();
        let folder = root.parent().unwrap_or(Path::new(""));
        modules.read_file(root, folder, Vec::new())?;
        Ok(modules)
    }

    /// `folder` is where the module's own modules are looked for.
    fn read_file(&mut self, path: &Path, folder: &Path, name: Names) -> Result<(), Failure> {
        let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
        let file = syn::parse_file(&text).map_err(|e| format!("{}: {e}", path.display()))?;
        self.read_items(&file.items, path, folder, name)
    }

    fn read_items(&mut self, items: &[Item], path: &Path, folder: &Path, module_name: Names) -> Result<(), Failure> {
        let mut module = Module { file: path.to_owned(), ..Module::default() };
        let items: Vec<&Item> = items.iter().filter(|item| !is_test(item)).collect();
        for item in &items {
            if let Item::Mod(child) = item {
                let child_name = child.ident.to_string();
                let child_folder = folder.join(&child_name);
                let child_module = |name: &str| [module_name.as_slice(), &[name.to_owned()]].concat();
                module.children.insert(child_name.clone());
                let own_paths = own_paths(&child.attrs);
                if let Some((_, items)) = &child.content {
                    self.read_items(items, path, &child_folder, child_module(&child_name))?;
                } else if own_paths.is_empty() {
                    let flat = child_folder.with_extension("rs");
                    let file = if flat.exists() { flat } else { child_folder.join("mod.rs") };
                    self.read_file(&file, &child_folder, child_module(&child_name))?;
                }
                // One for each platform, say. Only the first is found under the module's name.
                for (number, own) in own_paths.iter().enumerate() {
                    let file = path.parent().unwrap_or(folder).join(own);
                    let name = if number == 0 { child_name.clone() } else { format!("{child_name} {number}") };
                    self.read_file(&file, file.parent().unwrap_or(folder), child_module(&name))?;
                }
            }
        }
        for item in items {
            match item {
                Item::Use(item) => {
                    let is_private = matches!(item.vis, Visibility::Inherited);
                    module.import(&item.tree, &mut Vec::new(), is_private);
                }
                Item::Mod(_) => {}
                item => {
                    module.items.extend(defined_name(item));
                    scan(item.to_token_stream(), &module.children, &mut module.uses);
                }
            }
        }
        self.0.insert(module_name, module);
        Ok(())
    }

    /// Which file uses which.
    pub fn uses(&self) -> Uses {
        let mut uses: Uses = self.0.values().map(|module| (module.file.clone(), BTreeMap::new())).collect();
        for (name, module) in &self.0 {
            for path in &module.uses {
                let Some(target) = self.resolve(name, path, 0).and_then(|name| self.0.get(&name)) else { continue };
                if target.file != module.file {
                    uses.entry(module.file.clone())
                        .or_default()
                        .entry(target.file.clone())
                        .or_insert_with(|| path.join("::"));
                }
            }
        }
        uses
    }

    /// The module that defines what this path names, seen from a module.
    fn resolve(&self, from: &[String], path: &[String], depth: usize) -> Option<Names> {
        // A cycle of re-exports does not compile.
        if depth > 16 {
            return None;
        }
        let mut module = from.to_vec();
        let mut rest = path;
        while let Some((first, after)) = rest.split_first() {
            match first.as_str() {
                "crate" => module.clear(),
                "super" => drop(module.pop()),
                "self" => {}
                _ => break,
            }
            rest = after;
        }
        for (index, segment) in rest.iter().enumerate() {
            let after = &rest[index + 1..];
            let here = self.0.get(&module)?;
            if here.children.contains(segment) {
                module.push(segment.clone());
            } else if let Some(import) = here.imports.get(segment) {
                return self.resolve(&module, &[import, after].concat(), depth + 1).or(Some(module));
            } else if here.items.contains(segment) {
                return Some(module);
            } else {
                let globs = here.globs.iter().filter_map(|glob| self.resolve(&module, glob, depth + 1));
                let found = globs
                    .filter(|glob| *glob != module)
                    .find(|glob| self.0.get(glob).is_some_and(|glob| glob.names(segment)));
                return match found {
                    Some(glob) => self.resolve(&glob, &rest[index..], depth + 1),
                    None => Some(module),
                };
            }
        }
        Some(module)
    }
}

impl Module {
    fn names(&self, name: &str) -> bool {
        self.children.contains(name) || self.items.contains(name) || self.imports.contains_key(name)
    }

    /// Notes what a `use` imports, and unless it re-exports, that the module uses it.
    fn import(&mut self, tree: &UseTree, path: &mut Names, is_use: bool) {
        let leaf = |module: &mut Self, path: &mut Names, name: String, as_name: String| {
            let full = if name == "self" { path.clone() } else { [path.as_slice(), &[name]].concat() };
            let as_name = if as_name == "self" { full.last().cloned().unwrap_or_default() } else { as_name };
            // Names of other crates lead nowhere.
            if !module.is_inside(&full) {
                return;
            }
            if is_use {
                module.uses.insert(full.clone());
            }
            if full.last() != Some(&as_name) || full.len() > 1 {
                module.imports.insert(as_name, full);
            }
        };
        match tree {
            UseTree::Path(inner) => {
                path.push(inner.ident.to_string());
                self.import(&inner.tree, path, is_use);
                path.pop();
            }
            UseTree::Name(name) => leaf(self, path, name.ident.to_string(), name.ident.to_string()),
            UseTree::Rename(name) => leaf(self, path, name.ident.to_string(), name.rename.to_string()),
            UseTree::Glob(_) => {
                if self.is_inside(path) {
                    self.globs.push(path.clone());
                    if is_use {
                        self.uses.insert(path.clone());
                    }
                }
            }
            UseTree::Group(group) => group.items.iter().for_each(|tree| self.import(tree, path, is_use)),
        }
    }

    /// Does the path stay in this crate?
    fn is_inside(&self, path: &[String]) -> bool {
        let first = path.first().map(String::as_str);
        first.is_some_and(|first| matches!(first, "crate" | "self" | "super") || self.children.contains(first))
    }
}

/// Notes every path in the tokens that begins inside the crate.
fn scan(tokens: TokenStream, children: &BTreeSet<String>, uses: &mut BTreeSet<Names>) {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    let is = |index: usize, sign: char| matches!(tokens.get(index), Some(TokenTree::Punct(punct)) if punct.as_char() == sign);
    let mut index = 0;
    while index < tokens.len() {
        match &tokens[index] {
            TokenTree::Group(group) => scan(group.stream(), children, uses),
            TokenTree::Ident(ident) => {
                let first = ident.to_string();
                let continues = index > 0 && (is(index - 1, ':') || is(index - 1, '.'));
                let begins = matches!(first.as_str(), "crate" | "self" | "super") || children.contains(&first);
                let mut path = vec![first];
                while is(index + 1, ':') && is(index + 2, ':') {
                    let Some(TokenTree::Ident(next)) = tokens.get(index + 3) else { break };
                    path.push(next.to_string());
                    index += 3;
                }
                if begins && !continues && path.len() > 1 {
                    uses.insert(path);
                }
            }
            _ => {}
        }
        index += 1;
    }
}

/// Is the item compiled for tests only?
fn is_test(item: &Item) -> bool {
    let attributes = match item {
        Item::Mod(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        _ => return false,
    };
    attributes.iter().any(|attribute| attribute.meta.to_token_stream().to_string().replace(' ', "") == "cfg(test)")
}

/// The files that `#[path = "…"]` names, under `cfg_attr` as well.
fn own_paths(attributes: &[syn::Attribute]) -> Vec<String> {
    let text = |attribute: &syn::Attribute| attribute.meta.to_token_stream().to_string();
    let paths = attributes.iter().map(text).filter_map(|text| {
        let (before, after) = text.split_once("path = \"")?;
        let is_path = before.is_empty() || before.starts_with("cfg_attr");
        is_path.then(|| after.split('"').next().map(str::to_owned))?
    });
    paths.collect()
}

/// The name that an item defines.
fn defined_name(item: &Item) -> Option<String> {
    Some(match item {
        Item::Const(item) => item.ident.to_string(),
        Item::Enum(item) => item.ident.to_string(),
        Item::Fn(item) => item.sig.ident.to_string(),
        Item::Static(item) => item.ident.to_string(),
        Item::Struct(item) => item.ident.to_string(),
        Item::Trait(item) => item.ident.to_string(),
        Item::Type(item) => item.ident.to_string(),
        Item::Union(item) => item.ident.to_string(),
        Item::Macro(item) => item.ident.as_ref()?.to_string(),
        _ => return None,
    })
}

/// Groups of files that use each other, directly or through others of the group.
pub fn cycles(uses: &Uses) -> Vec<BTreeSet<PathBuf>> {
    let reached: BTreeMap<&PathBuf, BTreeSet<&PathBuf>> = uses
        .keys()
        .map(|start| {
            let (mut seen, mut open) = (BTreeSet::new(), vec![start]);
            while let Some(file) = open.pop() {
                open.extend(uses.get(file).into_iter().flat_map(BTreeMap::keys).filter(|next| seen.insert(*next)));
            }
            (start, seen)
        })
        .collect();
    let mut cycles: Vec<BTreeSet<PathBuf>> = Vec::new();
    for (file, from_here) in &reached {
        let group: BTreeSet<PathBuf> = from_here
            .iter()
            .filter(|other| reached.get(*other).is_some_and(|back| back.contains(file)))
            .map(|other| (*other).clone())
            .collect();
        if group.len() > 1 && !cycles.contains(&group) {
            cycles.push(group);
        }
    }
    cycles
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cycles of a crate of these files, by their names.
    fn found(name: &str, files: &[(&str, &str)]) -> Vec<Vec<String>> {
        let folder = std::env::temp_dir().join(format!("modules-{name}-{}", std::process::id()));
        for (name, text) in files {
            let path = folder.join(name);
            std::fs::create_dir_all(path.parent().expect("in a folder")).expect("a folder");
            std::fs::write(path, text).expect("a file");
        }
        let cycles = cycles(&Modules::read(&folder.join("lib.rs")).expect("sources").uses());
        std::fs::remove_dir_all(&folder).expect("it is ours");
        let names = |group: BTreeSet<PathBuf>| {
            group
                .iter()
                .filter_map(|path| Some(path.strip_prefix(&folder).ok()?.to_string_lossy().into_owned()))
                .collect()
        };
        cycles.into_iter().map(names).collect()
    }

    #[test]
    fn a_cycle_of_three_files_is_found() {
        let files = [
            ("lib.rs", "mod a;\nmod b;\nmod c;\npub use a::A;"),
            ("a.rs", "use crate::b::B;\npub struct A(B);"),
            ("b.rs", "pub struct B;\nfn f() { super::c::g() }"),
            ("c.rs", "pub fn g(_: &crate::A) {}"),
        ];
        assert_eq!(found("three", &files), [["a.rs", "b.rs", "c.rs"]]);
    }

    #[test]
    fn a_line_of_files_is_no_cycle() {
        let files = [
            ("lib.rs", "mod a;\nmod b;\npub use a::A;\npub use b::*;"),
            ("a.rs", "use crate::B;\npub struct A(B);"),
            ("b.rs", "pub struct B;\n#[cfg(test)]\nmod tests {\n    use crate::A;\n}"),
        ];
        assert_eq!(found("line", &files), Vec::<Vec<String>>::new());
    }

    #[test]
    fn a_folder_may_re_export_but_not_use_what_uses_it() {
        let child = ("m/child.rs", "use super::Parent;\npub struct Child(Parent);\npub fn make() {}");
        let re_exports =
            [("lib.rs", "mod m;"), ("m/mod.rs", "mod child;\npub use child::Child;\npub struct Parent;"), child];
        assert!(found("re-exports", &re_exports).is_empty());
        let calls =
            [("lib.rs", "mod m;"), ("m/mod.rs", "mod child;\npub struct Parent;\nfn f() { child::make() }"), child];
        assert_eq!(found("calls", &calls), [["m/child.rs", "m/mod.rs"]]);
    }

    #[test]
    fn names_imported_by_the_parent_belong_to_where_they_come_from() {
        let files = [
            ("lib.rs", "mod m;\nmod b;"),
            ("m.rs", "mod child;\nuse crate::b::B;\npub struct Parent(B);"),
            ("m/child.rs", "use super::B;\npub fn f(_: B) {}"),
            ("b.rs", "pub struct B;\nfn f() { println!(\"{}\", crate::m::child::f as usize) }"),
        ];
        assert_eq!(found("parents", &files), [["b.rs", "m/child.rs"]]);
    }
}
