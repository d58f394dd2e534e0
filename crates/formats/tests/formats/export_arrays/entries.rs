//! Formats `json` and `npz` hold every array and every attribute of the flex-body file bit by bit.

use flexbody_body::flex_body::{FlexBody, Storage};
use hdf5::types::{FloatSize, IntSize, TypeDescriptor, VarLenUnicode};
use hdf5_metno as hdf5;
use oracle::exported::{bodies, file, losses};
use oracle::file_bodies::wild_body;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::io::Read;

/// Shape and bits of an array; integers and floats are distinct.
#[derive(Debug, Clone, PartialEq)]
enum Array {
    Floats(Vec<usize>, Vec<u64>),
    Ints(Vec<usize>, Vec<i64>),
}

/// Arrays with their descriptions, and attributes of groups, by path.
#[derive(Debug, Default, PartialEq)]
struct Contents {
    arrays: BTreeMap<String, Array>,
    about: BTreeMap<String, [String; 3]>,
    attributes: BTreeMap<String, Value>,
}

const ABOUT: [&str; 3] = ["symbol", "units", "description"];

/// Returns the contents of the flex-body file of the body, read by HDF5 alone, and the names of its arrays of
/// 32-bit floats.
fn of_hdf5(body: &FlexBody) -> (Contents, Vec<String>) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("body.flex.h5");
    flexbody_file::write(body, &path).expect("writes");
    let file = hdf5::File::open(&path).expect("opens");
    let mut found = Contents::default();
    let mut short = Vec::new();
    walk(&file, "", &mut found, &mut short);
    // Digests belong to the file, not to the body.
    for digest in ["@digests", "@sha256"] {
        assert!(found.attributes.remove(digest).is_some(), "{digest}");
    }
    (found, short)
}

fn walk(group: &hdf5::Group, path: &str, found: &mut Contents, short: &mut Vec<String>) {
    for name in group.attr_names().expect("attributes") {
        let key = format!("{path}@{name}");
        found.attributes.insert(key, attribute(group, &name));
    }
    for dataset in group.datasets().expect("datasets") {
        let name = dataset.name()[1..].to_owned();
        let shape = dataset.shape();
        let floats = |values: Vec<f64>| values.into_iter().map(f64::to_bits).collect();
        let array = match dataset.dtype().expect("a type").to_descriptor().expect("a known type") {
            TypeDescriptor::Float(size @ (FloatSize::U8 | FloatSize::U4)) => {
                short.extend((size == FloatSize::U4).then(|| name.clone()));
                Array::Floats(shape, floats(dataset.read_raw::<f64>().expect("numbers")))
            }
            TypeDescriptor::Integer(IntSize::U8 | IntSize::U4) => {
                Array::Ints(shape, dataset.read_raw::<i64>().expect("numbers"))
            }
            other => panic!("{name}: {other}"),
        };
        let about = ABOUT.map(|name| attribute(&dataset, name).as_str().expect("a text").to_owned());
        found.about.insert(name.clone(), about);
        found.arrays.insert(name, array);
    }
    for child in group.groups().expect("groups") {
        let name = child.name()[1..].to_owned();
        walk(&child, &name, found, short);
    }
}

fn attribute(place: &hdf5::Location, name: &str) -> Value {
    let attribute = place.attr(name).expect("an attribute");
    match attribute.dtype().expect("a type").to_descriptor().expect("a known type") {
        TypeDescriptor::Integer(_) => json!(attribute.read_scalar::<i64>().expect("an integer")),
        TypeDescriptor::Float(_) => json!(attribute.read_scalar::<f64>().expect("a float")),
        _ => json!(attribute.read_scalar::<VarLenUnicode>().expect("a text").as_str()),
    }
}

/// Returns attributes and descriptions from the JSON of either format.
fn described(document: &Value) -> Contents {
    let object = |value: &Value| -> Map<String, Value> { value.as_object().expect("an object").clone() };
    let mut found = Contents::default();
    for (group, attributes) in object(&document["attributes"]) {
        for (name, value) in object(&attributes) {
            let group = if group == "/" { "" } else { &group };
            found.attributes.insert(format!("{group}@{name}"), value);
        }
    }
    for (path, array) in object(&document["arrays"]) {
        found.about.insert(path, ABOUT.map(|name| array[name].as_str().expect("a text").to_owned()));
    }
    found
}

fn of_json(text: &[u8]) -> Contents {
    let document: Value = serde_json::from_slice(text).expect("JSON");
    let mut found = described(&document);
    for (path, array) in document["arrays"].as_object().expect("an object") {
        let shape: Vec<usize> = serde_json::from_value(array["shape"].clone()).expect("a shape");
        let mut flat = Vec::new();
        flatten(&array["values"], &shape, &mut flat);
        let array = if flat.iter().all(|value| value.is_i64()) && !flat.is_empty() {
            Array::Ints(shape, flat.iter().map(|value| value.as_i64().expect("an integer")).collect())
        } else {
            let bits = |value: &Value| value.as_f64().expect("a float").to_bits();
            Array::Floats(shape, flat.iter().map(bits).collect())
        };
        found.arrays.insert(path.clone(), array);
    }
    found
}

/// Flattens nested arrays and asserts that the nesting agrees with the shape.
fn flatten(value: &Value, shape: &[usize], flat: &mut Vec<Value>) {
    match shape {
        [] => flat.push(value.clone()),
        [extent, inner @ ..] => {
            let items = value.as_array().expect("a list");
            assert_eq!(items.len(), *extent);
            items.iter().for_each(|item| flatten(item, inner, flat));
        }
    }
}

/// Reads stored `.npy` members of version 1.0 strictly.
fn of_npz(bytes: &[u8]) -> Contents {
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(bytes)).expect("an archive");
    let mut found = Contents::default();
    for index in 0..archive.len() {
        let mut member = archive.by_index(index).expect("a member");
        assert_eq!(member.compression(), zip::CompressionMethod::Stored);
        assert_eq!(member.last_modified(), Some(zip::DateTime::default()), "no clock");
        let name = member.name().expect("UTF-8").strip_suffix(".npy").expect("an array").to_owned();
        let mut bytes = Vec::new();
        member.read_to_end(&mut bytes).expect("sound bytes");
        assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
        let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        assert_eq!((10 + length) % 64, 0);
        let header = std::str::from_utf8(&bytes[10..10 + length]).expect("a header");
        let data = &bytes[10 + length..];
        assert!(header.ends_with('\n') && header.contains("'fortran_order': False"), "{header}");
        let between = |from: &str, to: char| {
            header.split_once(from).expect("a key").1.split_once(to).expect("an end").0
        };
        let shape: Vec<usize> = between("'shape': (", ')')
            .split(',')
            .map(str::trim)
            .filter(|extent| !extent.is_empty())
            .map(|extent| extent.parse().expect("an extent"))
            .collect();
        let count = shape.iter().product::<usize>();
        let words = || data.chunks_exact(8).map(|word| word.try_into().expect("eight bytes"));
        match between("'descr': '", '\'') {
            "<f8" => {
                assert_eq!(data.len(), 8 * count);
                found.arrays.insert(name, Array::Floats(shape, words().map(u64::from_le_bytes).collect()));
            }
            "<i8" => {
                assert_eq!(data.len(), 8 * count);
                found.arrays.insert(name, Array::Ints(shape, words().map(i64::from_le_bytes).collect()));
            }
            text => {
                assert_eq!((name.as_str(), shape.len()), ("metadata", 0));
                assert_eq!(text, format!("<U{}", data.len() / 4));
                let character = |word: &[u8]| u32::from_le_bytes(word.try_into().expect("four bytes"));
                let text: String = data
                    .chunks_exact(4)
                    .map(|word| char::from_u32(character(word)).expect("a character"))
                    .collect();
                let described = described(&serde_json::from_str(&text).expect("JSON"));
                (found.about, found.attributes) = (described.about, described.attributes);
            }
        }
    }
    found
}

fn assert_whole(name: &str, body: &FlexBody) {
    let (expected, short) = of_hdf5(body);
    assert_eq!(short.is_empty(), body.storage() == Storage::F64, "{name}");
    assert!(expected.arrays.len() > 20 && expected.attributes.len() > 20, "{name}");
    for (format, read) in [("json", of_json as fn(&[u8]) -> Contents), ("npz", of_npz)] {
        let bytes = file(body, format, None);
        let mut found = read(&bytes);
        // Arrays derived from rounded arrays are rounded again in the file only.
        for array in &short {
            let Some(Array::Floats(_, bits)) = found.arrays.get_mut(array) else { panic!("{name}: {array}") };
            bits.iter_mut().for_each(|bits| *bits = f64::from(f64::from_bits(*bits) as f32).to_bits());
        }
        assert!(found == expected, "{name} as {format}");
        assert_eq!(losses(body, format), [""; 0]);
        assert_eq!(file(&body.clone(), format, None), bytes, "{name} as {format}: equal bodies, equal bytes");
    }
}

#[test]
fn every_entry_of_every_fixture_body_is_there_bit_by_bit() {
    for (name, body) in bodies() {
        assert_whole(name, body);
    }
}

/// Covers names with slashes, quotes and control characters, and subnormal and huge numbers.
#[test]
fn bodies_with_any_names_and_numbers_are_held_too() {
    for seed in 0..40 {
        assert_whole(&format!("seed {seed}"), &wild_body(seed, 3, 4, 2, 3));
    }
}

/// Readers in other languages rely on the order of the file.
#[test]
fn interfaces_keep_their_order() {
    let (_, body) = bodies().iter().find(|(name, _)| name == "satellite").expect("a fixture");
    let text = String::from_utf8(file(body, "json", None)).expect("UTF-8");
    let at = |name: &str| text.find(&format!("\"interfaces/{name}/node_id\"")).expect("an interface");
    let places: Vec<usize> = body.interfaces().iter().map(|interface| at(&interface.name)).collect();
    assert!(places.len() == 4 && places.is_sorted(), "{places:?}");
}
