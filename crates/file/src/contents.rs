//! The content of a flex-body file as plain data, for formats that carry the same entries in another container.

use super::names;
use super::schema::{ORDER, TABLE};
use super::value::Value;
use flexbody_body::flex_body::FlexBody;

/// Elements of an array, row-major.
#[derive(Debug, Clone, PartialEq)]
pub enum Numbers {
    /// 64-bit floats.
    Floats(Vec<f64>),
    /// 64-bit integers.
    Ints(Vec<i64>),
}

/// A dataset of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedArray {
    /// Path without a leading slash: `invariants/W1`.
    pub path: String,
    /// Symbol in the theory document; empty if there is none.
    pub symbol: &'static str,
    /// Unit of the elements with the unit names of the body, for instance `kg^(1/2) m`.
    pub units: String,
    /// Description of the array.
    pub description: &'static str,
    /// Extents of the array.
    pub shape: Vec<usize>,
    /// Elements; their number is the product of the extents.
    pub values: Numbers,
}

/// Attributes of a group of the file: texts and numbers, in the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedAttributes {
    /// Path without a leading slash: `source`; `/` for the root.
    pub path: String,
    /// Names and values.
    pub values: Vec<(String, serde_json::Value)>,
}

/// Returns every array and every attribute of the flex-body file of `body` (`docs/reference/file_format.md`), in the
/// order of the file.
///
/// For a body with 32-bit floats the large arrays are rounded as in the file. Entries derived from them are not rounded
/// again.
pub fn contents(body: &FlexBody) -> (Vec<NamedAttributes>, Vec<NamedArray>) {
    let (mut attributes, mut arrays) = (Vec::new(), Vec::new());
    for group in TABLE {
        let instances = group.instances(body.parts());
        if let Some(order) = group.order(&instances) {
            let path = group.parent().trim_start_matches('/').to_owned();
            attributes.push(NamedAttributes { path, values: vec![(ORDER.to_owned(), order.into())] });
        }
        for (name, view) in instances {
            let path = group.place(name.as_deref().map(names::encode).as_deref());
            let path = path.trim_start_matches('/');
            let mut texts = Vec::new();
            for item in group.entries() {
                let mut array = |values| {
                    arrays.push(NamedArray {
                        path: format!("{path}/{}", item.name),
                        symbol: item.symbol,
                        units: item.units.concrete(&view.body.description.units),
                        description: item.description,
                        shape: item.dims(&view),
                        values,
                    });
                };
                let mut attribute = |value| texts.push((item.name.to_owned(), value));
                match item.value(&view) {
                    None => {}
                    Some(Value::Floats(values)) => array(Numbers::Floats(values)),
                    Some(Value::Ints(values)) => array(Numbers::Ints(values)),
                    Some(Value::Indices(values)) => {
                        array(Numbers::Ints(values.into_iter().map(i64::from).collect()));
                    }
                    Some(Value::Text(text)) => attribute(text.into()),
                    Some(Value::Int(value)) => attribute(value.into()),
                    Some(Value::Float(value)) => attribute(value.into()),
                    Some(Value::Named(values)) => {
                        texts.extend(values.into_iter().map(|(name, value)| (name, value.into())));
                    }
                }
            }
            if !texts.is_empty() {
                let path = if path.is_empty() { "/" } else { path };
                attributes.push(NamedAttributes { path: path.to_owned(), values: texts });
            }
        }
    }
    (attributes, arrays)
}
