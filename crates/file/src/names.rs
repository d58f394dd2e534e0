//! Names that are data, as HDF5 link names. In a link name `/` separates groups, and `.` denotes the group itself.

/// Percent-encodes the characters that a link name cannot hold: `/`, `%`, control characters, and a leading dot.
pub(super) fn encode(name: &str) -> String {
    let mut out = String::with_capacity(name.len());
    for (i, c) in name.char_indices() {
        if c == '/' || c == '%' || c.is_ascii_control() || (c == '.' && i == 0) {
            out.push_str(&format!("%{:02X}", u32::from(c)));
        } else {
            out.push(c);
        }
    }
    out
}

/// Undoes [`encode`]. A `%` without two hexadecimal digits is kept.
#[cfg(any(feature = "hdf5", test))]
pub(super) fn decode(link: &str) -> String {
    let bytes = link.as_bytes();
    let (mut out, mut i) = (Vec::with_capacity(bytes.len()), 0);
    while i < bytes.len() {
        let code = (bytes[i] == b'%')
            .then(|| link.get(i + 1..i + 3))
            .flatten()
            .filter(|digits| digits.bytes().all(|b| b.is_ascii_hexdigit()))
            .and_then(|digits| u8::from_str_radix(digits, 16).ok())
            .filter(u8::is_ascii);
        out.push(code.unwrap_or(bytes[i]));
        i += if code.is_some() { 3 } else { 1 };
    }
    // Only ASCII was replaced by ASCII, so that the bytes are valid UTF-8.
    String::from_utf8_lossy(&out).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoding_is_undone_and_leaves_one_plain_link_name() {
        for name in
            ["left", ".", "..", "a/b", "/", "%2F", "50%", "a.b", "\u{1}\n\0", "Lager außen", "日本", "%"]
        {
            let link = encode(name);
            assert!(!link.contains('/') && !link.contains('\0') && !link.starts_with('.'), "{link}");
            assert_eq!(decode(&link), name);
        }
    }

    #[test]
    fn foreign_link_names_stand_for_themselves() {
        for link in ["a%", "a%2", "%zz", "%+1", "%é1"] {
            assert_eq!(decode(link), link);
        }
    }
}
