//! Classes, functions and types in the sources of the extension module.

use crate::structure::rust_files;
use std::collections::BTreeMap;
use std::fmt;
use syn::parse::{Parse, ParseStream};
use syn::{
    Attribute, Expr, ExprLit, FnArg, Ident, ImplItem, Item, Lit, LitStr, Meta, Pat, Token, Type, UseTree,
    parenthesized,
};

/// Sources of the extension module.
#[derive(Default)]
pub(super) struct Source {
    /// Names of the module, in its order.
    pub(super) exports: Vec<String>,
    /// Constants of the module with their types.
    pub(super) constants: Vec<(String, Type)>,
    pub(super) functions: BTreeMap<String, Function>,
    pub(super) classes: BTreeMap<String, Class>,
    /// Types of Python by their names in Rust.
    pub(super) types: BTreeMap<String, String>,
}

/// Class of Python.
#[derive(Default)]
pub(super) struct Class {
    pub(super) doc: String,
    /// True if pyo3 makes `==` and `!=`.
    pub(super) has_equality: bool,
    pub(super) methods: Vec<Function>,
}

/// Function or method of Python.
pub(super) struct Function {
    pub(super) name: String,
    pub(super) doc: String,
    pub(super) decorators: Vec<String>,
    /// Name of the first parameter of a method.
    pub(super) receiver: Option<&'static str>,
    /// Arguments from Python with their types in Rust.
    pub(super) arguments: Vec<(String, Type)>,
    /// Type of the value in Rust.
    pub(super) returns: Option<Type>,
    pub(super) annotations: Annotations,
}

impl fmt::Display for Function {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "python/src, function `{}`", self.name)
    }
}

/// Content of the attributes `#[pyo3(...)]` of a function.
#[derive(Default)]
pub(super) struct Annotations {
    pub(super) name: Option<String>,
    pub(super) parameters: Option<Vec<StatedParameter>>,
    pub(super) returns: Option<String>,
    pub(super) text_signature: Option<String>,
}

/// Parameter in a `signature`, or the `*` before parameters by keyword.
pub(super) struct StatedParameter {
    pub(super) name: String,
    pub(super) annotation: Option<String>,
    /// Default, in Python.
    pub(super) default: Option<String>,
}

impl Source {
    pub(super) fn read() -> Self {
        let mut source = Self::default();
        let mut files = rust_files("python/src");
        files.sort();
        for path in files {
            let text = std::fs::read_to_string(oracle::root().join(&path)).expect("a source");
            let file = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            file.items.into_iter().for_each(|item| source.add(item));
        }
        source
    }

    fn add(&mut self, item: Item) {
        match item {
            Item::Struct(item) => {
                if let Some(attribute) = attribute(&item.attrs, "pyclass") {
                    let options: Options = attribute.parse_args().expect("options of a class");
                    let class = self.classes.entry(item.ident.to_string()).or_default();
                    class.doc = doc(&item.attrs);
                    class.has_equality = options.0.iter().any(|option| option == "eq");
                    assert!(
                        options.0.iter().all(|option| option != "subclass"),
                        "the stub has final classes only"
                    );
                }
            }
            Item::Impl(item) if attribute(&item.attrs, "pymethods").is_some() => {
                let Type::Path(class) = &*item.self_ty else { panic!("a class has a name") };
                let name = class.path.require_ident().expect("a class has a name").to_string();
                let methods = item.items.into_iter().filter_map(|item| match item {
                    ImplItem::Fn(method) => Some(Function::new(&method.attrs, method.sig, true)),
                    _ => None,
                });
                self.classes.entry(name).or_default().methods.extend(methods);
            }
            Item::Fn(item) if attribute(&item.attrs, "pyfunction").is_some() => {
                let function = Function::new(&item.attrs, item.sig, false);
                self.functions.insert(function.name.clone(), function);
            }
            Item::Mod(item) if attribute(&item.attrs, "pymodule").is_some() => {
                for item in item.content.expect("the module is in place").1 {
                    match item {
                        Item::Use(item) => names(&item.tree, &mut self.exports),
                        Item::Const(item) => self.constants.push((item.ident.to_string(), *item.ty)),
                        _ => panic!("the module has imports and constants only"),
                    }
                }
            }
            Item::Macro(item) if item.mac.path.is_ident("python_types") => {
                let types: NamedTypes = item.mac.parse_body().expect("names of types");
                self.types.extend(types.0);
            }
            _ => {}
        }
    }
}

impl Function {
    fn new(attributes: &[Attribute], signature: syn::Signature, is_method: bool) -> Self {
        let mut annotations = Annotations::default();
        for attribute in attributes.iter().filter(|one| one.path().is_ident("pyo3")) {
            let own: Annotations =
                attribute.parse_args().unwrap_or_else(|error| panic!("`{}`: {error}", signature.ident));
            annotations.name = annotations.name.or(own.name);
            annotations.parameters = annotations.parameters.or(own.parameters);
            annotations.returns = annotations.returns.or(own.returns);
            annotations.text_signature = annotations.text_signature.or(own.text_signature);
        }
        let rust = signature.ident.to_string();
        let is_new = attribute(attributes, "new").is_some();
        let getter = attribute(attributes, "getter");
        let stated = getter.filter(|one| matches!(one.meta, Meta::List(_)));
        let stated = stated.map(|one| one.parse_args::<Ident>().expect("a name").to_string());
        let name = match (is_new, &annotations.name) {
            (true, _) => "__new__".to_owned(),
            (false, Some(name)) => name.clone(),
            (false, None) => stated.unwrap_or(rust),
        };
        let is_static = attribute(attributes, "staticmethod").is_some();
        let decorators = [(getter.is_some(), "property"), (is_static, "staticmethod")];
        let mut arguments = Vec::new();
        for argument in signature.inputs {
            let FnArg::Typed(argument) = argument else { continue };
            let Pat::Ident(name) = &*argument.pat else { panic!("an argument has a name") };
            // The interpreter, and the object of a method, are no arguments from Python.
            let is_object = is_method && name.ident == "this";
            let is_interpreter = matches!(&*argument.ty, Type::Path(path)
                if path.path.segments.last().is_some_and(|last| last.ident == "Python"));
            if !is_object && !is_interpreter {
                arguments.push((name.ident.to_string(), *argument.ty));
            }
        }
        let object = if is_new { "cls" } else { "self" };
        Self {
            name,
            doc: doc(attributes),
            decorators: decorators
                .iter()
                .filter(|(has, _)| *has)
                .map(|(_, name)| (*name).to_owned())
                .collect(),
            receiver: (is_method && !is_static).then_some(object),
            arguments,
            returns: match signature.output {
                syn::ReturnType::Default => None,
                syn::ReturnType::Type(_, ty) => Some(*ty),
            },
            annotations,
        }
    }
}

/// Returns the attribute of this name.
fn attribute<'a>(attributes: &'a [Attribute], name: &str) -> Option<&'a Attribute> {
    attributes.iter().find(|one| one.path().is_ident(name))
}

/// Returns the docstring as pyo3 makes it: the lines of the doc comment without the space that begins them.
fn doc(attributes: &[Attribute]) -> String {
    let mut lines = Vec::new();
    for one in attributes {
        if let Meta::NameValue(meta) = &one.meta
            && meta.path.is_ident("doc")
            && let Expr::Lit(ExprLit { lit: Lit::Str(line), .. }) = &meta.value
        {
            let line = line.value();
            lines.push(line.strip_prefix(' ').unwrap_or(&line).to_owned());
        }
    }
    lines.join("\n")
}

/// Adds the names that a `use` imports.
fn names(tree: &UseTree, found: &mut Vec<String>) {
    match tree {
        UseTree::Path(path) => names(&path.tree, found),
        UseTree::Group(group) => group.items.iter().for_each(|one| names(one, found)),
        UseTree::Name(name) => found.push(name.ident.to_string()),
        _ => panic!("a name of the module is that of its item"),
    }
}

/// Names of the options of an attribute.
struct Options(Vec<String>);

impl Parse for Options {
    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        let mut found = Vec::new();
        while !input.is_empty() {
            found.push(input.parse::<Ident>()?.to_string());
            if input.parse::<Option<Token![=]>>()?.is_some() {
                input.parse::<Expr>()?;
            }
            input.parse::<Option<Token![,]>>()?;
        }
        Ok(Self(found))
    }
}

/// Content of `python_types!`: names in Rust and types of Python.
struct NamedTypes(Vec<(String, String)>);

impl Parse for NamedTypes {
    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        let mut found = Vec::new();
        while !input.is_empty() {
            Attribute::parse_outer(input)?;
            let name: Ident = input.parse()?;
            let class;
            parenthesized!(class in input);
            class.parse::<Type>()?;
            input.parse::<Token![=]>()?;
            found.push((name.to_string(), input.parse::<LitStr>()?.value()));
            input.parse::<Token![;]>()?;
        }
        Ok(Self(found))
    }
}

impl Parse for Annotations {
    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        let mut found = Self::default();
        while !input.is_empty() {
            let option: Ident = input.parse()?;
            input.parse::<Token![=]>()?;
            if option == "signature" {
                let content;
                parenthesized!(content in input);
                let all = content.parse_terminated(StatedParameter::parse, Token![,])?;
                found.parameters = Some(all.into_iter().collect());
                if input.parse::<Option<Token![->]>>()?.is_some() {
                    found.returns = Some(input.parse::<LitStr>()?.value());
                }
            } else if option == "text_signature" {
                found.text_signature = Some(input.parse::<LitStr>()?.value());
            } else if option == "name" {
                found.name = Some(input.parse::<LitStr>()?.value());
            } else {
                return Err(syn::Error::new(option.span(), "an option that the stub does not know"));
            }
            input.parse::<Option<Token![,]>>()?;
        }
        Ok(found)
    }
}

impl Parse for StatedParameter {
    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        if input.parse::<Option<Token![*]>>()?.is_some() {
            return Ok(Self { name: "*".to_owned(), annotation: None, default: None });
        }
        let name: Ident = input.parse()?;
        let annotation = match input.parse::<Option<Token![:]>>()? {
            Some(_) => Some(input.parse::<LitStr>()?.value()),
            None => None,
        };
        let default = match input.parse::<Option<Token![=]>>()? {
            Some(_) => {
                let unknown = || syn::Error::new(name.span(), "state the default in `text_signature`");
                Some(in_python(&input.parse()?).ok_or_else(unknown)?)
            }
            None => None,
        };
        Ok(Self { name: name.to_string(), annotation, default })
    }
}

/// Returns a default in Python; None for one that is neither `None` nor a bool.
fn in_python(default: &Expr) -> Option<String> {
    match default {
        Expr::Path(path) if path.path.is_ident("None") => Some("None".to_owned()),
        Expr::Lit(ExprLit { lit: Lit::Bool(value), .. }) => {
            Some(if value.value { "True" } else { "False" }.to_owned())
        }
        _ => None,
    }
}
