//! The two parts of a file: a description in JSON, and the binary numbers that it refers to.

use serde_json::{Value, json};

/// Component types and targets of buffer views in the numbering of glTF.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

/// Numbers with their description.
#[derive(Default)]
pub(super) struct Binary {
    data: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Binary {
    /// Adds vectors at vertices with their bounds, and returns the number of the accessor.
    pub(super) fn vertices(&mut self, vectors: &[[f32; 3]]) -> usize {
        let accessor = self.floats("VEC3", vectors, Some(VERTICES));
        self.bound(accessor, vectors);
        accessor
    }

    /// Adds vectors at vertices without bounds, and returns the number of the accessor.
    pub(super) fn directions(&mut self, vectors: &[[f32; 3]]) -> usize {
        self.floats("VEC3", vectors, Some(VERTICES))
    }

    /// Adds vertex indices, and returns the number of the accessor.
    pub(super) fn indices(&mut self, indices: &[u32]) -> usize {
        let bytes = indices.iter().flat_map(|index| index.to_le_bytes());
        let view = self.view(bytes, Some(INDICES));
        self.accessor(json!({
            "bufferView": view, "componentType": UNSIGNED_INT, "count": indices.len(), "type": "SCALAR"
        }))
    }

    /// Adds times of key frames, ascending, and returns the number of the accessor.
    pub(super) fn times(&mut self, times: &[f32]) -> usize {
        let times: Vec<[f32; 1]> = times.iter().map(|time| [*time]).collect();
        let accessor = self.floats("SCALAR", &times, None);
        self.bound(accessor, &times);
        accessor
    }

    /// Adds values at key frames, and returns the number of the accessor.
    pub(super) fn keys<const N: usize>(&mut self, kind: &str, keys: &[[f32; N]]) -> usize {
        self.floats(kind, keys, None)
    }

    fn floats<const N: usize>(&mut self, kind: &str, values: &[[f32; N]], target: Option<u32>) -> usize {
        let view = self.view(values.as_flattened().iter().flat_map(|value| value.to_le_bytes()), target);
        self.accessor(
            json!({ "bufferView": view, "componentType": FLOAT, "count": values.len(), "type": kind }),
        )
    }

    fn bound<const N: usize>(&mut self, accessor: usize, values: &[[f32; N]]) {
        let each = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
            let first = values.first().copied().unwrap_or([0.0; N]);
            let fold = |own: [f32; N], x: &[f32; N]| std::array::from_fn(|k| pick(own[k], x[k]));
            values.iter().fold(first, fold).to_vec()
        };
        self.accessors[accessor]["min"] = json!(each(f32::min));
        self.accessors[accessor]["max"] = json!(each(f32::max));
    }

    /// Adds a buffer view. All numbers have four bytes, so that every view is aligned.
    fn view(&mut self, bytes: impl Iterator<Item = u8>, target: Option<u32>) -> usize {
        let offset = self.data.len();
        self.data.extend(bytes);
        let length = self.data.len() - offset;
        let mut view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Returns the bytes of the file; `None` if the file is longer than its length fields can state.
    pub(super) fn file(self, mut document: Value) -> Option<Vec<u8>> {
        document["buffers"] = json!([{ "byteLength": self.data.len() }]);
        document["bufferViews"] = Value::Array(self.views);
        document["accessors"] = Value::Array(self.accessors);
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let length = u32::try_from(12 + 8 + text.len() + 8 + self.data.len()).ok()?;
        let part = |kind: &[u8; 4], bytes: &[u8]| -> Option<Vec<u8>> {
            let length = u32::try_from(bytes.len()).ok()?;
            Some([&length.to_le_bytes()[..], kind, bytes].concat())
        };
        let mut file = [b"glTF", &2u32.to_le_bytes()[..], &length.to_le_bytes()].concat();
        file.extend(part(b"JSON", &text)?);
        file.extend(part(b"BIN\0", &self.data)?);
        Some(file)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_its_parts_in_order_and_at_multiples_of_four() {
        let mut binary = Binary::default();
        let vectors = [[1.0, -2.0, 3.0], [0.5, 4.0, -1.0]];
        assert_eq!((binary.vertices(&vectors), binary.indices(&[1, 0])), (0, 1));
        assert_eq!(binary.accessors[0]["min"], json!([0.5, -2.0, -1.0]));
        assert_eq!(binary.accessors[0]["max"], json!([1.0, 4.0, 3.0]));
        let file = binary.file(json!({ "asset": { "version": "2.0" } })).expect("a short file");
        assert_eq!(&file[..4], b"glTF");
        let number =
            |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().expect("four bytes")) as usize;
        assert_eq!((number(4), number(8), &file[16..20]), (2, file.len(), &b"JSON"[..]));
        let second = 20 + number(12);
        assert_eq!((second % 4, number(second), &file[second + 4..second + 8]), (0, 32, &b"BIN\0"[..]));
        let text: Value = serde_json::from_slice(&file[20..second]).expect("JSON");
        assert_eq!(text["buffers"][0]["byteLength"], json!(32));
    }
}
