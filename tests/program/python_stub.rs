//! The stub of the Python package, made of the sources of the extension module (`python/src`).
//!
//! Names, order, docstrings and defaults are those that pyo3 takes. A type of Python is, in this order:
//!
//! 1. the annotation in `#[pyo3(signature = (path: "_Path") -> "Body")]`, which pyo3 checks for its form and ignores;
//! 2. the text behind a name in `python_types!` (`python/src/types.rs`);
//! 3. the type of Python that pyo3 converts the type of Rust to.
//!
//! Annotations with semicolons state overloads: `form: "Literal['dict']; Literal['json']"` is the first type in the first
//! overload and the second in the second. An overload has the default of a parameter if its type admits the default.

mod source;
mod text;

use source::{Class, Function, Source};
use std::collections::BTreeMap;
use syn::{GenericArgument, PathArguments, Type};

/// First lines of the stub: imports, and types that several items use.
const HEAD: &str = r#""""Types of the extension module. Made of python/src by ./scripts/make.sh bless: change the sources instead."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _types
from ._errors import Diagnostic

_Floats = NDArray[np.float64]
_Path = _types.Path
_Source = Mapping[str, Any] | _Path
_Scene = Scene | _Source
_Cases = Scene | Sequence[Scene] | _Source
_Compressed = tuple[int, NDArray[np.int64], NDArray[np.int64], _Floats]
"#;

/// Methods that every object of Python has with the same types.
const OF_EVERY_OBJECT: [&str; 3] = ["__repr__", "__str__", "__hash__"];

/// Function of the stub, without overloads.
struct StubFunction {
    decorators: Vec<String>,
    name: String,
    parameters: Vec<String>,
    returns: String,
    doc: String,
}

/// Returns the text of `python/python/flexbody/_flexbody.pyi`.
pub(crate) fn python_stub() -> String {
    let source = Source::read();
    let mut pieces = vec![HEAD.to_owned()];
    pieces.extend(source.constants.iter().map(|(name, ty)| {
        let ty = python_type(&source, ty, None)
            .unwrap_or_else(|| panic!("{name}: a type without a type of Python"));
        format!("{name}: {ty}\n")
    }));
    for name in &source.exports {
        if let Some(function) = source.functions.get(name) {
            pieces.extend(overloads(&source, function, None).iter().map(|one| text::function(one, "")));
        }
    }
    for name in &source.exports {
        if let Some(class) = source.classes.get(name) {
            pieces.push(class_text(&source, name, class));
        }
    }
    let known = |name: &&String| source.functions.contains_key(*name) || source.classes.contains_key(*name);
    let unknown: Vec<_> = source.exports.iter().filter(|name| !known(name)).collect();
    assert!(unknown.is_empty(), "exports that are neither a class nor a function: {unknown:?}");
    pieces.join("\n")
}

/// Returns the text of a class.
fn class_text(source: &Source, name: &str, class: &Class) -> String {
    let mut members: Vec<String> = Vec::new();
    for method in class.methods.iter().filter(|method| !OF_EVERY_OBJECT.contains(&&*method.name)) {
        let stated = overloads(source, method, Some(name));
        members.extend(stated.iter().map(|one| text::function(one, "    ")));
    }
    if class.has_equality {
        let line = |name: &str| format!("    def {name}(self, other: object, /) -> bool: ...\n");
        members.extend(["__eq__", "__ne__"].map(line));
    }
    let doc = text::docstring(&class.doc, "    ");
    format!("@final\nclass {name}:\n{doc}\n{}", members.join("\n"))
}

/// Returns a function once, or once for each of its overloads.
fn overloads(source: &Source, function: &Function, class: Option<&str>) -> Vec<StubFunction> {
    let parameters = parameters(source, function, class);
    let returns = returns(source, function, class);
    let counts =
        parameters.iter().filter_map(|parameter| parameter.types.as_ref()).chain([&returns]).map(Vec::len);
    let count = counts.max().unwrap_or(1);
    let stated = |overload: usize| {
        let mut decorators: Vec<String> = function.decorators.clone();
        if count > 1 {
            decorators.insert(0, "overload".to_owned());
        }
        let receiver = function.receiver.map(str::to_owned);
        StubFunction {
            decorators,
            name: function.name.clone(),
            parameters: receiver.into_iter().chain(parameters.iter().map(|one| one.text(overload))).collect(),
            returns: of_overload(&returns, overload).to_owned(),
            doc: if overload == 0 { function.doc.clone() } else { String::new() },
        }
    };
    (0..count).map(stated).collect()
}

/// Returns the type in an overload: its own, or the single one of all overloads.
fn of_overload(types: &[String], overload: usize) -> &str {
    if types.len() == 1 { &types[0] } else { &types[overload] }
}

/// Parameter of the stub.
struct Parameter {
    /// Name, or the `*` before parameters by keyword.
    name: String,
    /// Type in all overloads, or in each; None for the `*`.
    types: Option<Vec<String>>,
    default: Option<String>,
}

impl Parameter {
    fn text(&self, overload: usize) -> String {
        let Some(types) = &self.types else { return self.name.clone() };
        let ty = of_overload(types, overload);
        let admitted = self.default.as_ref().filter(|default| types.len() == 1 || admits(ty, default));
        match admitted {
            Some(default) => format!("{}: {ty} = {default}", self.name),
            None => format!("{}: {ty}", self.name),
        }
    }
}

/// Returns true if a type admits a default, which is None or one of its literals.
fn admits(ty: &str, default: &str) -> bool {
    ty.split(" | ").any(|one| one == default || one.starts_with("Literal[") && one.contains(default))
}

/// Returns the types of an annotation, one for all overloads or one for each.
fn of_annotation(annotation: &str) -> Vec<String> {
    annotation.split("; ").map(|ty| ty.replace('\'', "\"")).collect()
}

/// Returns the parameters of a function in the order of Python.
fn parameters(source: &Source, function: &Function, class: Option<&str>) -> Vec<Parameter> {
    let rust: BTreeMap<&str, &Type> =
        function.arguments.iter().map(|(name, ty)| (name.as_str(), ty)).collect();
    let defaults = function.annotations.text_signature.as_deref().map(text::defaults);
    let parameter = |name: &str, annotation: Option<&str>, default: Option<&String>| {
        if name == "*" {
            return Parameter { name: name.to_owned(), types: None, default: None };
        }
        let ty = rust.get(name).unwrap_or_else(|| panic!("{function}: no argument `{name}`"));
        let derived = || python_type(source, ty, class).map(|ty| vec![ty]);
        let types = annotation.map(of_annotation).or_else(derived);
        let types = types.unwrap_or_else(|| panic!("{function}: annotate `{name}` in `signature`"));
        let default = default.map(|own| match &defaults {
            Some(stated) => {
                stated.get(name).unwrap_or_else(|| panic!("{function}: no default of `{name}`")).clone()
            }
            None => own.clone(),
        });
        Parameter { name: name.to_owned(), types: Some(types), default }
    };
    match &function.annotations.parameters {
        Some(stated) => stated
            .iter()
            .map(|one| parameter(&one.name, one.annotation.as_deref(), one.default.as_ref()))
            .collect(),
        None => function.arguments.iter().map(|(name, _)| parameter(name, None, None)).collect(),
    }
}

/// Returns the type of the value of a function: one for all overloads, or one for each.
fn returns(source: &Source, function: &Function, class: Option<&str>) -> Vec<String> {
    if let Some(annotation) = &function.annotations.returns {
        return of_annotation(annotation);
    }
    let Some(ty) = &function.returns else { return vec!["None".to_owned()] };
    let ty = python_type(source, ty, class);
    vec![ty.unwrap_or_else(|| panic!("{function}: the type of the value is unknown: name it in types.rs"))]
}

/// Returns the type of Python that pyo3 converts a type of Rust to; None if it is not known.
fn python_type(source: &Source, ty: &Type, class: Option<&str>) -> Option<String> {
    let own = |ty: &Type| python_type(source, ty, class);
    let path = match ty {
        Type::Reference(reference) => return own(&reference.elem),
        Type::Tuple(tuple) if tuple.elems.is_empty() => return Some("None".to_owned()),
        Type::Tuple(tuple) => {
            let elements: Option<Vec<String>> = tuple.elems.iter().map(own).collect();
            return Some(format!("tuple[{}]", elements?.join(", ")));
        }
        Type::Path(path) => path,
        _ => return None,
    };
    let last = path.path.segments.last()?;
    let inner = match &last.arguments {
        PathArguments::AngleBracketed(all) => all.args.iter().find_map(|one| match one {
            GenericArgument::Type(ty) => Some(ty),
            _ => None,
        }),
        _ => None,
    };
    let name = last.ident.to_string();
    if let Some(text) = source.types.get(&name) {
        return Some(text.clone());
    }
    if source.classes.contains_key(&name) {
        return Some(name);
    }
    Some(match (name.as_str(), inner) {
        ("Self", None) => class?.to_owned(),
        ("PyResult" | "Bound" | "Py", Some(ty)) => own(ty)?,
        ("Option", Some(ty)) => format!("{} | None", own(ty)?),
        ("Vec", Some(ty)) => format!("list[{}]", own(ty)?),
        ("PyArray1" | "PyArray2", Some(Type::Path(number))) if number.path.is_ident("i64") => {
            "NDArray[np.int64]".to_owned()
        }
        ("String" | "str", None) => "str".to_owned(),
        ("bool", None) => "bool".to_owned(),
        ("f64", None) => "float".to_owned(),
        ("u8" | "u64" | "usize" | "i64", None) => "int".to_owned(),
        _ => return None,
    })
}
