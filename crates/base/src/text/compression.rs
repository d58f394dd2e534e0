//! gzip and Zstandard compression of text files, detected by their first bytes.

use super::input_file::{InputFile, reading_error};
use super::zstd_frames::ZstdFrames;
use crate::diagnostic::{Code, Diagnostic};
use std::io::{BufRead, Read};
use std::path::Path;

/// Compression of the bytes on disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compression {
    /// No compression.
    None,
    /// gzip, one or several members (RFC 1952).
    Gzip,
    /// Zstandard, one or several frames (RFC 8878).
    Zstd,
}

impl Compression {
    /// Returns the compression that the first bytes indicate.
    pub fn of(bytes: &[u8]) -> Self {
        if bytes.starts_with(&[0x1f, 0x8b]) {
            Self::Gzip
        } else if bytes.starts_with(&[0x28, 0xb5, 0x2f, 0xfd]) {
            Self::Zstd
        } else {
            Self::None
        }
    }

    /// Returns a stream of the decompressed bytes of `stored`.
    pub fn stream<'a>(self, stored: impl BufRead + Send + 'a) -> Box<dyn Read + Send + 'a> {
        match self {
            Self::None => Box::new(stored),
            Self::Gzip => Box::new(flate2::bufread::MultiGzDecoder::new(stored)),
            Self::Zstd => Box::new(ZstdFrames::new(stored)),
        }
    }

    /// Returns a stream of the decompressed bytes of a file.
    pub fn stream_of<'a>(self, file: &'a InputFile) -> Box<dyn Read + Send + 'a> {
        match (file.loaded(), self) {
            (Some(bytes), _) => self.stream(bytes),
            // Readers of large pieces need no buffer.
            (None, Self::None) => Box::new(file.reader()),
            (None, _) => self.stream(file.buffered()),
        }
    }

    /// Returns the first decompressed bytes, at most `limit`; fewer if the file is short or damaged.
    pub fn head(self, file: &InputFile, limit: usize) -> Vec<u8> {
        first_bytes(self.stream_of(file), limit)
    }
}

fn first_bytes(stream: impl Read, limit: usize) -> Vec<u8> {
    let mut head = Vec::new();
    // A damaged stream yields the bytes before the damage; the actual read reports the error.
    let _ = stream.take(limit as u64).read_to_end(&mut head);
    head
}

/// Returns FB102 for a compressed file whose reader does not support compression. `what` names the file, such as "file
/// of nodes".
pub fn refuse_packed(file: &InputFile, what: &str) -> Result<(), Diagnostic> {
    let kind = match Compression::of(file.bytes()) {
        Compression::None => return Ok(()),
        Compression::Gzip => "gzip",
        Compression::Zstd => "Zstandard",
    };
    let message = format!("{what} is compressed ({kind}), but only matrix files may be compressed");
    Err(Diagnostic::new(Code::FileFormatUnknown, message).in_file(file.path()).with_help("unpack it"))
}

/// Returns FB103 for `path` with the reason of the decoder, or the diagnostic of the file if reading it failed.
pub fn broken(path: &Path, error: &std::io::Error) -> Diagnostic {
    if let Some(diagnostic) = reading_error(error) {
        return diagnostic;
    }
    let message = if error.kind() == std::io::ErrorKind::UnexpectedEof {
        "compressed file ends before its data does".to_owned()
    } else {
        format!("compressed file is damaged: {error}")
    };
    Diagnostic::new(Code::FileCompressionBroken, message).in_file(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ruzstd::encoding::{CompressionLevel, compress_to_vec};
    use std::io::Write;

    #[test]
    fn members_and_frames_are_read_one_after_the_other() {
        let gzip = |text: &[u8]| {
            let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
            encoder.write_all(text).unwrap();
            encoder.finish().unwrap()
        };
        let zstd = |text: &[u8]| compress_to_vec(text, CompressionLevel::Fastest);
        for (two, expected) in [
            ([gzip(b"one "), gzip(b"two")].concat(), Compression::Gzip),
            ([zstd(b"one "), zstd(b"two")].concat(), Compression::Zstd),
            (b"one two".to_vec(), Compression::None),
        ] {
            let compression = Compression::of(&two);
            assert_eq!(compression, expected);
            let mut text = String::new();
            compression.stream(&two[..]).read_to_string(&mut text).unwrap();
            assert_eq!(text, "one two");
            assert_eq!(first_bytes(compression.stream(&two[..]), 3), b"one");
        }
    }
}
