//! Arrays of numbers as elements of a page: little-endian bytes in base64.

/// A named array.
#[derive(Debug, Clone)]
pub(crate) struct Packed {
    name: &'static str,
    base64: String,
}

impl Packed {
    pub(crate) fn i16(name: &'static str, values: impl Iterator<Item = i16>) -> Self {
        Self::of_bytes(name, &values.flat_map(i16::to_le_bytes).collect::<Vec<u8>>())
    }

    /// Packs vertex indices as 16-bit integers if `vertices` is small enough, otherwise as 32-bit integers.
    pub(crate) fn indices(name: &'static str, vertices: usize, values: &[u32]) -> Self {
        let bytes: Vec<u8> = if vertices > usize::from(u16::MAX) {
            values.iter().flat_map(|value| value.to_le_bytes()).collect()
        } else {
            values.iter().flat_map(|value| value.to_le_bytes()[..2].to_vec()).collect()
        };
        Self::of_bytes(name, &bytes)
    }

    #[allow(clippy::cast_possible_truncation)] // 32 bits are enough for a picture
    #[cfg(feature = "hdf5")]
    pub(crate) fn f32(name: &'static str, values: &[f64]) -> Self {
        let bytes: Vec<u8> = values.iter().flat_map(|value| (*value as f32).to_le_bytes()).collect();
        Self::of_bytes(name, &bytes)
    }

    fn of_bytes(name: &'static str, bytes: &[u8]) -> Self {
        Self { name, base64: base64(bytes) }
    }
}

/// Returns the element of the page that holds an array.
pub(crate) fn script(array: &Packed) -> String {
    format!("<script type=\"text/plain\" id=\"data-{}\">{}</script>\n", array.name, array.base64)
}

/// Returns bytes as base64 (RFC 4648, section 4).
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let byte = |k: usize| u32::from(group.get(k).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for k in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * k)) as usize & 63];
            text.push(if k <= group.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_standard() {
        for (bytes, text) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
        ] {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
        assert_eq!(base64(&[0xfb, 0xff, 0xfe]), "+//+");
    }

    #[test]
    fn indices_have_sixteen_bits_where_these_are_enough() {
        assert_eq!(Packed::indices("", 65535, &[0x0102]).base64, base64(&[2, 1]));
        assert_eq!(Packed::indices("", 65536, &[0x0102]).base64, base64(&[2, 1, 0, 0]));
    }
}
