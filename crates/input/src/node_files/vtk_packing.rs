//! Packing of the arrays in XML files of VTK: lengths, blocks of zlib, and base64.

use crate::number_type::digits;
use flexbody_base::memory::left;
use std::io::{Error, ErrorKind, Read};

/// Result of reading an array. The error is a clause about the array for a message.
pub(super) type Unpacked<T> = Result<T, String>;

/// Packing of the arrays of an XML file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Packing {
    pub big_endian: bool,
    /// Number of bytes of the length in front of an array.
    pub header_bytes: usize,
    pub zlib: bool,
}

impl Packing {
    /// Returns the bytes of the array at the beginning of the stream, at most `most`.
    pub(super) fn unpack(self, mut stream: impl Read, most: u64) -> Unpacked<Vec<u8>> {
        if !self.zlib {
            let length = self.header(&mut stream)?;
            return exactly(&mut stream, length);
        }
        // The header holds the number of blocks, their size, and the size of an incomplete last block (0 if there is
        // none).
        let [blocks, size, last] =
            [self.header(&mut stream)?, self.header(&mut stream)?, self.header(&mut stream)?];
        let whole = if last == 0 { blocks } else { blocks.saturating_sub(1) };
        let total = whole.saturating_mul(size).saturating_add(last);
        if total > most {
            return Err(format!("unpacks to {total} bytes, {most} are expected"));
        }
        if left().is_some_and(|left| total > left) {
            return Err(format!("unpacks to {total} bytes, more than fit the memory"));
        }
        // The packed length of every block precedes the blocks.
        let lengths = blocks.checked_mul(self.header_bytes as u64).ok_or(ENDS)?;
        let lengths = exactly(&mut stream, lengths)?;
        let mut unpacked = Vec::new();
        for (k, length) in lengths.chunks_exact(self.header_bytes).enumerate() {
            let packed = exactly(&mut stream, digits(length, self.big_endian))?;
            let before = unpacked.len();
            let is_last = k as u64 + 1 == blocks;
            let expected = if is_last && last != 0 { last } else { size };
            let decoder = flate2::read::ZlibDecoder::new(packed.as_slice());
            let read = decoder.take(expected.saturating_add(1)).read_to_end(&mut unpacked);
            read.map_err(|error| format!("is damaged: {error}"))?;
            if (unpacked.len() - before) as u64 != expected {
                return Err(format!("is damaged: its block {} does not have {expected} bytes", k + 1));
            }
        }
        Ok(unpacked)
    }

    fn header(self, stream: &mut impl Read) -> Unpacked<u64> {
        exactly(stream, self.header_bytes as u64).map(|bytes| digits(&bytes, self.big_endian))
    }
}

const ENDS: &str = "ends before its data do: the file may be cut off";

fn exactly(stream: &mut impl Read, length: u64) -> Unpacked<Vec<u8>> {
    let mut bytes = Vec::new();
    stream.take(length).read_to_end(&mut bytes).map_err(|error| format!("is damaged: {error}"))?;
    if bytes.len() as u64 == length { Ok(bytes) } else { Err(ENDS.to_owned()) }
}

/// Decoder of a text in base64. The text may consist of several pieces, each with padding.
pub(super) struct Base64<'a> {
    text: &'a [u8],
    group: [u8; 3],
    /// Number of bytes in the group, and number of those already read.
    count: usize,
    given: usize,
}

impl<'a> Base64<'a> {
    pub(super) fn new(text: &'a [u8]) -> Self {
        Self { text, group: [0; 3], count: 0, given: 0 }
    }

    /// Returns the number of characters that were not decoded yet.
    pub(super) fn n_unread(&self) -> usize {
        self.text.len()
    }

    /// Decodes the next four characters. Returns false at the end.
    fn next_group(&mut self) -> std::io::Result<bool> {
        let wrong = |what: &str| Err(Error::new(ErrorKind::InvalidData, what));
        let (mut bits, mut characters, mut padding) = (0u32, 0, 0);
        while characters < 4 {
            let Some((&character, rest)) = self.text.split_first() else { break };
            self.text = rest;
            let value = match character {
                b'A'..=b'Z' => character - b'A',
                b'a'..=b'z' => character - b'a' + 26,
                b'0'..=b'9' => character - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                b'=' => 0,
                _ if character.is_ascii_whitespace() => continue,
                _ => return wrong("a character does not belong to base64"),
            };
            if padding > 0 && character != b'=' {
                return wrong("padding of base64 is within the text");
            }
            padding += usize::from(character == b'=');
            bits = bits << 6 | u32::from(value);
            characters += 1;
        }
        match (characters, padding) {
            (0, _) => return Ok(false),
            (4, 0..=2) => {}
            _ => return wrong("base64 is cut off"),
        }
        let [_, group @ ..] = bits.to_be_bytes();
        (self.group, self.count, self.given) = (group, 3 - padding, 0);
        Ok(true)
    }
}

impl Read for Base64<'_> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        let mut written = 0;
        while written < out.len() {
            if self.given == self.count && !self.next_group()? {
                break;
            }
            let unread = &self.group[self.given..self.count];
            let length = unread.len().min(out.len() - written);
            out[written..written + length].copy_from_slice(&unread[..length]);
            (written, self.given) = (written + length, self.given + length);
        }
        Ok(written)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_pieces_is_read_as_one_text() {
        let read = |text: &[u8]| {
            let mut bytes = Vec::new();
            Base64::new(text).read_to_end(&mut bytes).map(|_| bytes)
        };
        assert_eq!(read(b" aGVs\nbG8= IHdvcmxk\n").expect("text"), b"hello world");
        assert_eq!(read(b"aA==aQ==").expect("text"), b"hi");
        for bad in [&b"aGV"[..], b"a===", b"aG=s", b"aG*s"] {
            assert!(read(bad).is_err(), "{}", bad.escape_ascii());
        }
    }
}
