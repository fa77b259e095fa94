//! The files of `src` as a parser reads them, test code left out.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::{Path, PathBuf};

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};
use syn::{Attribute, ImplItem, Item, Meta, Type, UseTree, Visibility};

/// One file.
pub struct File {
    /// Below `src`, with slashes.
    pub name: String,
    pub text: String,
    pub syntax: syn::File,
}

/// A `use`, leaf by leaf.
pub struct Use {
    pub path: Vec<String>,
    /// Whether others see it through here.
    pub is_public: bool,
}

/// An `impl` with the names of its functions.
pub struct Impl {
    pub module: usize,
    pub of: Vec<String>,
    pub is_inherent: bool,
    pub functions: Vec<String>,
}

/// What stands in a module, and what it names.
#[derive(Default)]
pub struct Module {
    pub path: Vec<String>,
    pub file: usize,
    /// The root of its crate: of the library, or of the program.
    root: usize,
    parent: Option<usize>,
    items: HashSet<String>,
    children: HashMap<String, usize>,
    imports: HashMap<String, Vec<String>>,
    globs: Vec<Vec<String>>,
    pub uses: Vec<Use>,
    pub paths: BTreeSet<Vec<String>>,
    /// Names of methods that are called.
    pub calls: BTreeSet<String>,
    /// Variables: their names are no paths.
    bound: HashSet<String>,
}

/// The library and the program.
#[derive(Default)]
pub struct Source {
    pub files: Vec<File>,
    pub modules: Vec<Module>,
    pub impls: Vec<Impl>,
    /// How often a function of a name is written in an `impl` or a trait.
    pub functions: HashMap<String, usize>,
}

/// Where a path ends: the module that defines it, the item in it (none where it is the module), and what is left.
pub struct Target {
    pub module: usize,
    pub item: Option<String>,
    pub rest: Vec<String>,
}

impl Source {
    /// The house itself.
    pub fn read() -> Self {
        Self::of(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"))
    }

    /// All files that `lib.rs` and `main.rs` of a folder lead to.
    pub fn of(root: &Path) -> Self {
        let mut source = Self::default();
        for name in ["lib.rs", "main.rs"] {
            source.load(root, name, Vec::new(), None);
        }
        source
    }

    fn load(&mut self, root: &Path, name: &str, path: Vec<String>, parent: Option<usize>) -> usize {
        let text = std::fs::read_to_string(root.join(name)).expect(name);
        let syntax = syn::parse_file(&text).expect(name);
        let file = self.files.len();
        self.files.push(File {
            name: name.to_owned(),
            text,
            syntax: syntax.clone(),
        });
        let module = self.module(file, path, parent);
        let mut reader = Reader {
            source: self,
            root,
            module,
            inline: Vec::new(),
        };
        reader.items(&syntax.items);
        module
    }

    fn module(&mut self, file: usize, path: Vec<String>, parent: Option<usize>) -> usize {
        let number = self.modules.len();
        self.modules.push(Module {
            path,
            file,
            root: parent.map_or(number, |p| self.modules[p].root),
            parent,
            ..Module::default()
        });
        number
    }

    /// Whether a module belongs to the library.
    pub fn in_library(&self, module: usize) -> bool {
        self.modules[module].root == 0
    }

    /// What a path in a module names; nothing for what other crates define, and for variables.
    pub fn resolve(&self, module: usize, path: &[String]) -> Option<Target> {
        if let [only] = path
            && self.modules[module].bound.contains(only)
        {
            return None;
        }
        self.seek(module, path, true, 0)
    }

    fn seek(&self, from: usize, path: &[String], is_first: bool, depth: usize) -> Option<Target> {
        /// Longer chains of re-exports go in a circle.
        const DEEPEST: usize = 12;
        if depth > DEEPEST {
            return None;
        }
        let (mut at, mut path) = (from, path);
        if is_first {
            at = match path.first()?.as_str() {
                "crate" => self.modules[from].root,
                "hapdef" if !self.in_library(from) => 0,
                "self" => from,
                _ => return self.climb(from, path, depth),
            };
            path = &path[1..];
        }
        self.climb(at, path, depth)
    }

    /// Up by every `super`, and then down.
    fn climb(&self, from: usize, path: &[String], depth: usize) -> Option<Target> {
        match path {
            [up, rest @ ..] if up == "super" => self.climb(self.modules[from].parent?, rest, depth),
            _ => self.descend(from, path, depth),
        }
    }

    fn descend(&self, at: usize, path: &[String], depth: usize) -> Option<Target> {
        let module = &self.modules[at];
        let Some((name, rest)) = path.split_first() else {
            return Some(Target {
                module: at,
                item: None,
                rest: Vec::new(),
            });
        };
        if let Some(&child) = module.children.get(name)
            && let Some(found) = self.seek(child, rest, false, depth + 1)
        {
            return Some(found);
        }
        if module.items.contains(name) {
            return Some(Target {
                module: at,
                item: Some(name.clone()),
                rest: rest.to_vec(),
            });
        }
        if let Some(import) = module.imports.get(name).filter(|i| i[..] != [name.clone()]) {
            let found = self.seek(at, import, true, depth + 1)?;
            return match found.item {
                None => self.seek(found.module, rest, false, depth + 1),
                Some(_) => Some(Target {
                    rest: [&found.rest[..], rest].concat(),
                    ..found
                }),
            };
        }
        module.globs.iter().find_map(|glob| {
            let found = self.seek(at, glob, true, depth + 1)?;
            let is_other = found.item.is_none() && found.module != at;
            is_other.then(|| self.seek(found.module, path, false, depth + 1))?
        })
    }
}

/// Whether attributes leave something to tests.
pub fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|a| match &a.meta {
        Meta::Path(path) => path.is_ident("test"),
        Meta::List(list) if list.path.is_ident("cfg") => {
            let when = list.tokens.to_string();
            when == "test" || when.starts_with("all (test") || when.starts_with("all(test")
        }
        _ => false,
    })
}

/// The attributes of an item.
pub fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(i) => &i.attrs,
        Item::Enum(i) => &i.attrs,
        Item::Fn(i) => &i.attrs,
        Item::Impl(i) => &i.attrs,
        Item::Macro(i) => &i.attrs,
        Item::Mod(i) => &i.attrs,
        Item::Static(i) => &i.attrs,
        Item::Struct(i) => &i.attrs,
        Item::Trait(i) => &i.attrs,
        Item::Type(i) => &i.attrs,
        Item::Union(i) => &i.attrs,
        Item::Use(i) => &i.attrs,
        _ => &[],
    }
}

/// The attributes of something in an `impl`.
pub fn attributes_within(item: &ImplItem) -> &[Attribute] {
    match item {
        ImplItem::Const(i) => &i.attrs,
        ImplItem::Fn(i) => &i.attrs,
        ImplItem::Type(i) => &i.attrs,
        ImplItem::Macro(i) => &i.attrs,
        _ => &[],
    }
}

/// The items that a macro is given, where it is given whole ones.
pub fn items_in(tokens: &TokenStream) -> Option<Vec<Item>> {
    let file: syn::File = syn::parse2(tokens.clone()).ok()?;
    (!file.items.is_empty()).then_some(file.items)
}

fn name_of(item: &Item) -> Option<String> {
    let ident = match item {
        Item::Const(i) => &i.ident,
        Item::Enum(i) => &i.ident,
        Item::Fn(i) => &i.sig.ident,
        Item::Macro(i) => return i.ident.as_ref().map(ToString::to_string),
        Item::Static(i) => &i.ident,
        Item::Struct(i) => &i.ident,
        Item::Trait(i) => &i.ident,
        Item::Type(i) => &i.ident,
        Item::Union(i) => &i.ident,
        _ => return None,
    };
    Some(ident.to_string())
}

struct Reader<'s> {
    source: &'s mut Source,
    root: &'s Path,
    module: usize,
    /// Modules within the file, from its own down to this one.
    inline: Vec<String>,
}

impl Reader<'_> {
    fn here(&mut self) -> &mut Module {
        &mut self.source.modules[self.module]
    }

    fn items(&mut self, items: &[Item]) {
        for item in items {
            self.visit_item(item);
        }
    }

    /// Where a module that is declared here lies: `a.rs` or `a/mod.rs`, beside its parent or in its folder.
    fn file_of(&self, name: &str) -> String {
        let own = &self.source.files[self.source.modules[self.module].file].name;
        let own = Path::new(own);
        let mut folder = own.parent().map_or_else(PathBuf::new, Path::to_owned);
        let stem = own.file_stem().unwrap_or_default();
        if !["lib", "main", "mod"].iter().any(|s| stem == *s) {
            folder.push(stem);
        }
        folder.extend(&self.inline);
        let beside = folder.join(format!("{name}.rs"));
        let found = if self.root.join(&beside).exists() {
            beside
        } else {
            folder.join(name).join("mod.rs")
        };
        found.to_string_lossy().replace('\\', "/")
    }

    fn declare(&mut self, item: &syn::ItemMod) {
        let name = item.ident.to_string();
        let path = [&self.here().path[..], std::slice::from_ref(&name)].concat();
        let (from, child) = (
            self.module,
            match &item.content {
                None => {
                    let file = self.file_of(&name);
                    self.source.load(self.root, &file, path, Some(self.module))
                }
                Some((_, items)) => {
                    let file = self.here().file;
                    let child = self.source.module(file, path, Some(self.module));
                    self.module = child;
                    self.inline.push(name.clone());
                    self.items(items);
                    self.inline.pop();
                    child
                }
            },
        );
        self.module = from;
        self.here().children.insert(name, child);
    }

    fn import(&mut self, tree: &UseTree, before: &[String], is_public: bool) {
        let mut path = before.to_vec();
        let (name, is_glob) = match tree {
            UseTree::Path(next) => {
                path.push(next.ident.to_string());
                return self.import(&next.tree, &path, is_public);
            }
            UseTree::Group(group) => {
                return group
                    .items
                    .iter()
                    .for_each(|t| self.import(t, before, is_public));
            }
            UseTree::Name(leaf) => (end(&mut path, &leaf.ident.to_string()), false),
            UseTree::Rename(leaf) => {
                end(&mut path, &leaf.ident.to_string());
                (leaf.rename.to_string(), false)
            }
            UseTree::Glob(_) => (String::new(), true),
        };
        let here = self.here();
        if is_glob {
            here.globs.push(path.clone());
        } else if name != "_" {
            here.imports.insert(name, path.clone());
        }
        here.uses.push(Use { path, is_public });
    }

    /// Paths and calls of methods among the tokens of a macro.
    fn scan(&mut self, tokens: &TokenStream) {
        let all: Vec<TokenTree> = tokens.clone().into_iter().collect();
        let is = |k: usize, sign: char| matches!(all.get(k), Some(TokenTree::Punct(p)) if p.as_char() == sign);
        let ident = |k: usize| match all.get(k) {
            Some(TokenTree::Ident(i)) => Some(i.to_string()),
            _ => None,
        };
        let mut k = 0;
        while k < all.len() {
            if let TokenTree::Group(group) = &all[k] {
                self.scan(&group.stream());
            }
            let Some(first) = ident(k) else {
                k += 1;
                continue;
            };
            let is_method = k > 0 && is(k - 1, '.');
            let mut path = vec![first];
            k += 1;
            while is(k, ':')
                && is(k + 1, ':')
                && let Some(next) = ident(k + 2)
            {
                path.push(next);
                k += 3;
            }
            if !is_method {
                self.here().paths.insert(path);
            } else if matches!(all.get(k), Some(TokenTree::Group(_))) {
                self.here().calls.extend(path);
            }
        }
    }

    fn implement(&mut self, item: &syn::ItemImpl) {
        let mut of = &*item.self_ty;
        while let Type::Reference(inner) = of {
            of = &inner.elem;
        }
        let functions: Vec<String> = (item.items.iter())
            .filter(|i| !is_test(attributes_within(i)))
            .filter_map(|i| match i {
                ImplItem::Fn(f) => Some(f.sig.ident.to_string()),
                _ => None,
            })
            .collect();
        for name in &functions {
            *self.source.functions.entry(name.clone()).or_default() += 1;
        }
        if let Type::Path(path) = of {
            self.source.impls.push(Impl {
                module: self.module,
                of: segments(&path.path),
                is_inherent: item.trait_.is_none(),
                functions,
            });
        }
    }
}

/// Ends a path with a name, or with nothing where that is `self`; the name that it brings.
fn end(path: &mut Vec<String>, name: &str) -> String {
    if name != "self" || path.is_empty() {
        path.push(name.to_owned());
    }
    path.last().cloned().unwrap_or_default()
}

fn segments(path: &syn::Path) -> Vec<String> {
    path.segments.iter().map(|s| s.ident.to_string()).collect()
}

impl<'ast> Visit<'ast> for Reader<'_> {
    fn visit_item(&mut self, item: &'ast Item) {
        if is_test(attributes(item)) {
            return;
        }
        if let Some(name) = name_of(item) {
            self.here().items.insert(name);
        }
        match item {
            Item::Mod(module) => return self.declare(module),
            Item::Use(item) => {
                let is_public = !matches!(item.vis, Visibility::Inherited);
                return self.import(&item.tree, &[], is_public);
            }
            Item::Impl(item) => self.implement(item),
            Item::Macro(item) if item.ident.is_none() => {
                if let Some(items) = items_in(&item.mac.tokens) {
                    return self.items(&items);
                }
                // One that makes an item is given its name first.
                if let Some(TokenTree::Ident(name)) = item.mac.tokens.clone().into_iter().next() {
                    self.here().items.insert(name.to_string());
                }
            }
            _ => {}
        }
        visit::visit_item(self, item);
    }

    fn visit_impl_item(&mut self, item: &'ast ImplItem) {
        if !is_test(attributes_within(item)) {
            visit::visit_impl_item(self, item);
        }
    }

    fn visit_trait_item_fn(&mut self, item: &'ast syn::TraitItemFn) {
        let name = item.sig.ident.to_string();
        *self.source.functions.entry(name).or_default() += 1;
        visit::visit_trait_item_fn(self, item);
    }

    fn visit_attribute(&mut self, _: &'ast Attribute) {}

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let path_here = segments(path);
        self.here().paths.insert(path_here);
        visit::visit_path(self, path);
    }

    fn visit_pat_ident(&mut self, bound: &'ast syn::PatIdent) {
        let name = bound.ident.to_string();
        self.here().bound.insert(name);
        visit::visit_pat_ident(self, bound);
    }

    fn visit_expr_method_call(&mut self, call: &'ast syn::ExprMethodCall) {
        let name = call.method.to_string();
        self.here().calls.insert(name);
        visit::visit_expr_method_call(self, call);
    }

    fn visit_macro(&mut self, call: &'ast syn::Macro) {
        let path = segments(&call.path);
        self.here().paths.insert(path);
        self.scan(&call.tokens);
    }
}

/// Whether one module path lies within another.
pub fn is_within(inner: &[String], outer: &[String]) -> bool {
    inner.len() >= outer.len() && inner[..outer.len()] == *outer
}
