//! Strict readers of both picture formats, written from their descriptions.

use serde_json::Value;
use std::collections::BTreeMap;

/// An array of a VTK mesh.
pub struct Array {
    /// Name of the parent element.
    pub parent: String,
    pub name: String,
    pub kind: String,
    pub components: usize,
    pub bytes: Vec<u8>,
}

impl Array {
    pub fn floats(&self) -> Vec<f64> {
        assert_eq!(self.kind, "Float64", "{}", self.name);
        self.bytes.as_chunks::<8>().0.iter().map(|own| f64::from_le_bytes(*own)).collect()
    }

    pub fn vectors(&self) -> Vec<[f64; 3]> {
        assert_eq!(self.components, 3, "{}", self.name);
        self.floats().as_chunks::<3>().0.to_vec()
    }

    pub fn integers(&self) -> Vec<i64> {
        assert_eq!((self.kind.as_str(), self.components), ("Int64", 1), "{}", self.name);
        self.bytes.as_chunks::<8>().0.iter().map(|own| i64::from_le_bytes(*own)).collect()
    }
}

/// A VTK mesh with raw binary numbers after the tags.
pub struct Vtu {
    pub points: usize,
    pub cells: usize,
    pub arrays: Vec<Array>,
    pub head: String,
}

impl Vtu {
    pub fn read(file: &[u8]) -> Self {
        let mark = b"<AppendedData encoding=\"raw\">\n_";
        let at = file.windows(mark.len()).position(|own| own == mark).expect("appended data");
        let head = std::str::from_utf8(&file[..at]).expect("UTF-8").to_owned();
        let data = &file[at + mark.len()..];
        let data = data.strip_suffix(b"\n</AppendedData>\n</VTKFile>\n").expect("an end");
        let (mut parent, mut arrays, mut used) = (String::new(), Vec::new(), 0);
        let mut sizes = BTreeMap::new();
        for line in head.lines() {
            let tag = line.trim_start_matches('<').split([' ', '>']).next().expect("a name");
            let attributes = attributes(line);
            if tag == "Piece" {
                sizes = attributes;
            } else if tag == "DataArray" {
                let get = |name: &str| attributes.get(name).unwrap_or_else(|| panic!("{line}"));
                assert_eq!(get("format"), "appended");
                let offset: usize = get("offset").parse().expect("an offset");
                let length = u64::from_le_bytes(data[offset..offset + 8].try_into().expect("a length"));
                let bytes = data[offset + 8..][..length as usize].to_vec();
                used += 8 + bytes.len();
                let (kind, name) = (get("type").clone(), get("Name").clone());
                let components = get("NumberOfComponents").parse().expect("a number");
                arrays.push(Array { parent: parent.clone(), name, kind, components, bytes });
            } else {
                parent = tag.to_owned();
            }
        }
        assert_eq!(used, data.len(), "every byte belongs to one array");
        let number = |name: &str| sizes[name].parse().expect("a number");
        Self { points: number("NumberOfPoints"), cells: number("NumberOfCells"), arrays, head }
    }

    /// Returns the only array of this name in the element `parent`.
    pub fn array(&self, parent: &str, name: &str) -> &Array {
        let found: Vec<&Array> =
            self.arrays.iter().filter(|array| array.parent == parent && array.name == name).collect();
        let [one] = found[..] else { panic!("{} of {name}", found.len()) };
        one
    }

    pub fn positions(&self) -> Vec<[f64; 3]> {
        self.array("Points", "Points").vectors()
    }

    pub fn numbers(&self) -> Vec<i64> {
        self.array("PointData", "node").integers()
    }

    /// Returns kind and points of every cell.
    pub fn cells(&self) -> Vec<(u8, Vec<usize>)> {
        let connectivity = self.array("Cells", "connectivity").integers();
        let offsets = self.array("Cells", "offsets").integers();
        let kinds = &self.array("Cells", "types").bytes;
        assert_eq!((kinds.len(), offsets.len()), (self.cells, self.cells));
        assert_eq!(offsets.last().copied().unwrap_or(0) as usize, connectivity.len());
        let mut begin = 0;
        let cell = |(kind, end): (&u8, &i64)| {
            let own = &connectivity[begin..*end as usize];
            begin = *end as usize;
            (*kind, own.iter().map(|point| usize::try_from(*point).expect("an index")).collect())
        };
        kinds.iter().zip(&offsets).map(cell).collect()
    }
}

/// Returns the attributes of a tag.
fn attributes(tag: &str) -> BTreeMap<String, String> {
    let parts: Vec<&str> = tag.split('"').collect();
    let value = |text: &str| {
        let unescaped = text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"");
        unescaped.replace("&amp;", "&")
    };
    let pairs = parts.chunks_exact(2);
    pairs
        .map(|pair| {
            let name = pair[0].trim_end_matches('=').rsplit(' ').next().expect("a name");
            (name.to_owned(), value(pair[1]))
        })
        .collect()
}

/// A binary glTF file.
pub struct Glb {
    pub json: Value,
    data: Vec<u8>,
}

impl Glb {
    pub fn read(file: &[u8]) -> Self {
        let number =
            |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().expect("four bytes")) as usize;
        assert_eq!((&file[..4], number(4), number(8)), (&b"glTF"[..], 2, file.len()));
        let first = number(12);
        assert_eq!((first % 4, &file[16..20]), (0, &b"JSON"[..]));
        let json: Value = serde_json::from_slice(&file[20..20 + first]).expect("JSON");
        let second = 20 + first;
        assert_eq!((number(second) % 4, &file[second + 4..second + 8]), (0, &b"BIN\0"[..]));
        let data = file[second + 8..].to_vec();
        assert_eq!(data.len(), number(second));
        assert_eq!(json["buffers"][0]["byteLength"].as_u64(), Some(data.len() as u64));
        let glb = Self { json, data };
        glb.check_accessors();
        glb
    }

    /// Asserts that every accessor lies in its view, every view in the buffer, and that stated bounds are
    /// correct.
    fn check_accessors(&self) {
        let mut end = 0;
        for view in self.json["bufferViews"].as_array().expect("views") {
            assert_eq!(view["byteOffset"].as_u64(), Some(end), "views follow each other");
            end += view["byteLength"].as_u64().expect("a length");
        }
        assert_eq!(end as usize, self.data.len());
        for (at, accessor) in self.json["accessors"].as_array().expect("accessors").iter().enumerate() {
            if accessor["componentType"] == 5125 {
                continue;
            }
            let (values, width) = self.floats(at);
            assert!(values.iter().all(|value| value.is_finite()));
            for (bound, pick) in [("min", f64::min as fn(f64, f64) -> f64), ("max", f64::max)] {
                let Some(stated) = accessor[bound].as_array() else { continue };
                for (k, stated) in stated.iter().enumerate() {
                    let own = values.iter().skip(k).step_by(width).copied().reduce(pick);
                    assert_eq!(own, stated.as_f64(), "{bound} of accessor {at}");
                }
            }
        }
    }

    fn bytes(&self, accessor: usize, width: usize) -> &[u8] {
        let accessor = &self.json["accessors"][accessor];
        let view = &self.json["bufferViews"][accessor["bufferView"].as_u64().expect("a view") as usize];
        let [offset, length] =
            ["byteOffset", "byteLength"].map(|name| view[name].as_u64().expect("a number"));
        let count = accessor["count"].as_u64().expect("a count");
        assert!(count > 0);
        assert_eq!(length, count * 4 * width as u64);
        &self.data[offset as usize..][..length as usize]
    }

    /// Returns the numbers of an accessor, and its number of components.
    pub fn floats(&self, accessor: usize) -> (Vec<f64>, usize) {
        let about = &self.json["accessors"][accessor];
        assert_eq!(about["componentType"], 5126);
        let width = match about["type"].as_str() {
            Some("SCALAR") => 1,
            Some("VEC3") => 3,
            Some("VEC4") => 4,
            other => panic!("{other:?}"),
        };
        let bytes = self.bytes(accessor, width).as_chunks::<4>().0;
        (bytes.iter().map(|own| f64::from(f32::from_le_bytes(*own))).collect(), width)
    }

    pub fn vectors(&self, accessor: &Value) -> Vec<[f64; 3]> {
        let (values, width) = self.floats(accessor.as_u64().expect("an accessor") as usize);
        assert_eq!(width, 3);
        values.as_chunks::<3>().0.to_vec()
    }

    pub fn indices(&self, accessor: &Value) -> Vec<usize> {
        let accessor = accessor.as_u64().expect("an accessor") as usize;
        let about = &self.json["accessors"][accessor];
        assert_eq!((&about["componentType"], about["type"].as_str()), (&Value::from(5125), Some("SCALAR")));
        let bytes = self.bytes(accessor, 1).as_chunks::<4>().0;
        bytes.iter().map(|own| u32::from_le_bytes(*own) as usize).collect()
    }

    pub fn primitives(&self) -> &[Value] {
        self.json["meshes"][0]["primitives"].as_array().expect("primitives")
    }

    /// Returns the positions of the vertices, and their displacements at weight one of every target.
    pub fn vertices(&self) -> (Vec<[f64; 3]>, Vec<Vec<[f64; 3]>>) {
        let primitive = &self.primitives()[0];
        let none = Vec::new();
        let targets = primitive["targets"].as_array().unwrap_or(&none);
        (
            self.vectors(&primitive["attributes"]["POSITION"]),
            targets.iter().map(|target| self.vectors(&target["POSITION"])).collect(),
        )
    }

    /// Returns times and values of the channel of an animation with this path.
    pub fn channel(&self, animation: usize, path: &str) -> (Vec<f64>, Vec<f64>) {
        let animation = &self.json["animations"][animation];
        let channels = animation["channels"].as_array().expect("channels");
        let channel = channels.iter().find(|own| own["target"]["path"] == path).expect("a channel");
        assert_eq!(channel["target"]["node"], 1, "the node of the body");
        let sampler = &animation["samplers"][channel["sampler"].as_u64().expect("a sampler") as usize];
        assert_eq!(sampler["interpolation"], "LINEAR");
        let values = |end: &str| self.floats(sampler[end].as_u64().expect("an accessor") as usize).0;
        let times = values("input");
        assert!(times.windows(2).all(|pair| pair[0] < pair[1]), "times ascend");
        (times, values("output"))
    }
}
