//! The structure of a file as JSON, without its numbers.

use super::read::open_checked;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::hdf5_file;
use hdf5::types::TypeDescriptor;
use hdf5::{LinkType, LocationType};
use hdf5_metno as hdf5;
use serde_json::{Map, Value, json};
use std::path::Path;

/// Depth of groups above which members are left out: no format version has deeper groups.
const MAX_DEPTH: usize = 8;

/// Number of members above which a file is refused. Groups may contain themselves, so that even a small file can have
/// endlessly many paths.
const MAX_MEMBERS: usize = 20_000;

/// Returns groups, datasets (type, shape and descriptive attributes) and attributes of a file, including entries
/// unknown to this version. `schemas/flexbody-file.schema.json` describes the result.
///
/// # Errors
/// The errors of [`read`](super::read) for files that cannot be opened, are not of this program or have a newer format;
/// [`BodySchema`](Code::BodySchema) if the file is damaged.
pub fn structure(path: impl AsRef<Path>) -> Result<Value> {
    let path = path.as_ref();
    let (file, _) = open_checked(path)?;
    file.as_group().and_then(|root| group(&root, 0, &mut { MAX_MEMBERS })).map_err(|e| {
        Error::from(Diagnostic::new(Code::BodySchema, format!("the file is damaged: {e}")).in_file(path))
    })
}

fn group(place: &hdf5::Group, depth: usize, left: &mut usize) -> hdf5::Result<Value> {
    let (mut groups, mut datasets) = (Map::new(), Map::new());
    for (name, link) in place.links(hdf5::IndexType::Name, hdf5::IterationOrder::Increasing)? {
        if link.link_type != LinkType::Hard || depth > MAX_DEPTH {
            continue;
        }
        *left = left.checked_sub(1).ok_or_else(|| format!("more than {MAX_MEMBERS} members"))?;
        match place.loc_type_by_name(&name)? {
            LocationType::Group => {
                groups.insert(name.clone(), group(&place.group(&name)?, depth + 1, left)?);
            }
            LocationType::Dataset => {
                datasets.insert(name.clone(), dataset(&place.dataset(&name)?)?);
            }
            _ => {}
        }
    }
    Ok(json!({ "attributes": attributes(place)?, "datasets": datasets, "groups": groups }))
}

fn dataset(place: &hdf5::Dataset) -> hdf5::Result<Value> {
    let mut out = attributes(place)?;
    let kind = place.dtype()?.to_descriptor().map_or_else(|_| "other".to_owned(), |t| t.to_string());
    out.insert("type".to_owned(), json!(kind));
    out.insert("shape".to_owned(), json!(place.get_shape()?));
    Ok(Value::Object(out))
}

/// Returns the attributes that are texts or numbers; others are left out.
fn attributes(place: &hdf5::Location) -> hdf5::Result<Map<String, Value>> {
    let mut out = Map::new();
    for name in place.attr_names()? {
        let value = match place.attr(&name)?.dtype()?.to_descriptor() {
            Ok(TypeDescriptor::Integer(_) | TypeDescriptor::Unsigned(_)) => {
                hdf5_file::int(place, &name).map(|v| json!(v))
            }
            Ok(TypeDescriptor::Float(_)) => hdf5_file::float(place, &name).map(|v| json!(v)),
            _ => hdf5_file::text(place, &name).map(|v| json!(v)),
        };
        if let Ok(value) = value {
            out.insert(name, value);
        }
    }
    Ok(out)
}
