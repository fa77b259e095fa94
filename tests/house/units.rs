//! Inside, lengths are metres, strains are strains and times are seconds; whoever reads or writes another unit turns it
//! at the edge, and says so by name ([`crate::units`] in `src`).

use proc_macro2::{TokenStream, TokenTree};
use syn::spanned::Spanned as _;
use syn::visit::{self, Visit};
use syn::{BinOp, Expr, ImplItem, Item, Lit};

use crate::layers::OUTER;
use crate::source::{File, attributes, attributes_within, is_test};

/// Where the core itself is given what has units of its own: keys and tables of files, the drawing of the bundled limb, and
/// the functions that turn them.
const EDGES: [&str; 4] = ["project", "given", "limb", "units"];

/// Products and quotients with a power of a thousand in a file of the core. Left out are test code and
/// tolerances: what stands beside a comparison, is the least or most of something, or has a name of its own.
pub fn factors(file: &File) -> Vec<String> {
    let layer = file.name.split(['/', '.']).next().unwrap_or_default();
    if OUTER.iter().any(|o| o.0 == layer) || EDGES.contains(&layer) {
        return Vec::new();
    }
    let mut found = Factors {
        file: &file.name,
        found: Vec::new(),
    };
    found.visit_file(&file.syntax);
    found.found
}

/// What one unit is of another: lengths, areas, volumes, strains, times, memory.
const POWERS: [f64; 8] = [1e-12, 1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9, 1e12];

struct Factors<'f> {
    file: &'f str,
    found: Vec<String>,
}

fn is_thousands(side: &Expr) -> bool {
    let side = match side {
        Expr::Paren(inner) => return is_thousands(&inner.expr),
        Expr::Unary(inner) => return is_thousands(&inner.expr),
        Expr::Lit(lit) => &lit.lit,
        _ => return false,
    };
    let value = match side {
        Lit::Float(f) => f.base10_parse::<f64>(),
        Lit::Int(i) => i.base10_parse::<f64>(),
        _ => return false,
    };
    POWERS.contains(&value.unwrap_or_default())
}

impl Factors<'_> {
    /// Among the tokens of a macro: the arguments of a message.
    fn scan(&mut self, tokens: &TokenStream) {
        let all: Vec<TokenTree> = tokens.clone().into_iter().collect();
        let sign = |k: Option<usize>| match k.and_then(|k| all.get(k)) {
            Some(TokenTree::Punct(p)) => matches!(p.as_char(), '*' | '/'),
            _ => false,
        };
        for (k, tree) in all.iter().enumerate() {
            match tree {
                TokenTree::Group(group) => self.scan(&group.stream()),
                TokenTree::Literal(literal) if sign(k.checked_sub(1)) || sign(Some(k + 1)) => {
                    let text = literal.to_string().replace('_', "");
                    let value = text.trim_end_matches("f64").trim_end_matches("f32").parse();
                    if POWERS.contains(&value.unwrap_or(0.0)) {
                        let line = literal.span().start().line;
                        self.found.push(format!("{}:{line}", self.file));
                    }
                }
                _ => {}
            }
        }
    }
}

impl<'ast> Visit<'ast> for Factors<'_> {
    fn visit_item(&mut self, item: &'ast Item) {
        if !is_test(attributes(item)) {
            visit::visit_item(self, item);
        }
    }

    fn visit_impl_item(&mut self, item: &'ast ImplItem) {
        if !is_test(attributes_within(item)) {
            visit::visit_impl_item(self, item);
        }
    }

    fn visit_attribute(&mut self, attribute: &'ast syn::Attribute) {
        if let syn::Meta::List(list) = &attribute.meta {
            self.scan(&list.tokens);
        }
    }

    fn visit_macro(&mut self, call: &'ast syn::Macro) {
        self.scan(&call.tokens);
    }

    fn visit_expr_method_call(&mut self, call: &'ast syn::ExprMethodCall) {
        if call.method == "max" || call.method == "min" {
            self.visit_expr(&call.receiver);
        } else {
            visit::visit_expr_method_call(self, call);
        }
    }

    fn visit_expr_binary(&mut self, product: &'ast syn::ExprBinary) {
        let is_product = matches!(
            product.op,
            BinOp::Mul(_) | BinOp::Div(_) | BinOp::MulAssign(_) | BinOp::DivAssign(_)
        );
        if is_product && (is_thousands(&product.left) || is_thousands(&product.right)) {
            let line = product.op.span().start().line;
            self.found.push(format!("{}:{line}", self.file));
        }
        let compares = matches!(
            product.op,
            BinOp::Lt(_) | BinOp::Le(_) | BinOp::Gt(_) | BinOp::Ge(_)
        );
        if !compares {
            visit::visit_expr_binary(self, product);
        }
    }
}
