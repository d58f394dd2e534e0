//! gzip and Zstandard compression of text files, detected by their first bytes.

use super::input_file::{InputFile, failed, reading_error};
use crate::diagnostic::{Code, Diagnostic};
use ruzstd::decoding::errors::{FrameDecoderError, ReadFrameHeaderError};
use ruzstd::decoding::{BlockDecodingStrategy, FrameDecoder};
use std::error::Error;
use std::io::{self, BufRead, ErrorKind, Read};
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

// Decompressed bytes of consecutive Zstandard frames (RFC 8878).

/// Reader of all frames of a file. It skips skippable frames, and verifies the checksum of each frame that has one.
pub(super) struct ZstdFrames<R: BufRead> {
    stored: R,
    /// Frame that is being read.
    frame: Option<FrameDecoder>,
}

impl<R: BufRead> ZstdFrames<R> {
    pub(super) fn new(stored: R) -> Self {
        Self { stored, frame: None }
    }

    /// Opens the next frame with content; `None` at the end of the file.
    fn open(&mut self) -> io::Result<Option<FrameDecoder>> {
        while !self.stored.fill_buf()?.is_empty() {
            let mut frame = FrameDecoder::new();
            match frame.init(&mut self.stored) {
                Ok(()) => return Ok(Some(frame)),
                Err(FrameDecoderError::ReadFrameHeaderError(ReadFrameHeaderError::SkipFrame {
                    length,
                    ..
                })) => {
                    let length = u64::from(length);
                    if io::copy(&mut self.stored.by_ref().take(length), &mut io::sink())? < length {
                        return Err(ErrorKind::UnexpectedEof.into());
                    }
                }
                Err(error) => return Err(of_file(error)),
            }
        }
        Ok(None)
    }
}

/// Verifies the checksum of a frame that was read to its end.
fn close(frame: &FrameDecoder) -> io::Result<()> {
    let stored = frame.get_checksum_from_data();
    if stored.is_some() && stored != frame.get_calculated_checksum() {
        return Err(io::Error::new(ErrorKind::InvalidData, "the checksum of a Zstandard frame differs"));
    }
    Ok(())
}

impl<R: BufRead> Read for ZstdFrames<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if buffer.is_empty() {
            return Ok(0);
        }
        loop {
            let opened = self.frame.take().map_or_else(|| self.open(), |frame| Ok(Some(frame)))?;
            let Some(mut frame) = opened else { return Ok(0) };
            while frame.can_collect() == 0 && !frame.is_finished() {
                let one = BlockDecodingStrategy::UptoBlocks(1);
                frame.decode_blocks(&mut self.stored, one).map_err(of_file)?;
            }
            let count = frame.read(buffer)?;
            if count > 0 {
                self.frame = Some(frame);
                return Ok(count);
            }
            close(&frame)?;
        }
    }
}

/// Converts an error of the decoder to one of the file: unexpected end, or the reason of the damage.
fn of_file(error: impl Into<Box<dyn Error + Send + Sync>>) -> io::Error {
    let error = error.into();
    let mut cause: Option<&(dyn Error + 'static)> = Some(&*error);
    while let Some(one) = cause {
        if let Some(diagnostic) = one.downcast_ref::<io::Error>().and_then(reading_error) {
            return failed(diagnostic);
        }
        let ended = one.downcast_ref::<io::Error>().map(io::Error::kind) == Some(ErrorKind::UnexpectedEof);
        if ended {
            return ErrorKind::UnexpectedEof.into();
        }
        cause = one.source();
    }
    io::Error::new(ErrorKind::InvalidData, error)
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

    fn unpacked(bytes: &[u8]) -> io::Result<Vec<u8>> {
        let mut text = Vec::new();
        ZstdFrames::new(bytes).read_to_end(&mut text)?;
        Ok(text)
    }

    fn packed(text: &[u8]) -> Vec<u8> {
        compress_to_vec(text, CompressionLevel::Fastest)
    }

    #[test]
    fn frames_to_skip_are_skipped() {
        let skipped = [&[0x50, 0x2a, 0x4d, 0x18, 3, 0, 0, 0][..], b"abc"].concat();
        let file = [skipped.clone(), packed(b"one "), skipped.clone(), packed(b"two")].concat();
        assert_eq!(unpacked(&file).unwrap(), b"one two");
        let kind = unpacked(&skipped[..9]).unwrap_err().kind();
        assert_eq!(kind, ErrorKind::UnexpectedEof);
    }

    #[test]
    #[ignore = "slow"]
    fn no_cut_and_no_changed_byte_passes_for_the_file() {
        let text: Vec<u8> =
            (0..4000u32).flat_map(|i| format!("{} {}\n", i % 97, i * i).into_bytes()).collect();
        let file = packed(&text);
        assert_eq!(unpacked(&file).unwrap(), text);
        for end in 1..file.len() {
            assert_eq!(unpacked(&file[..end]).unwrap_err().kind(), ErrorKind::UnexpectedEof, "cut at {end}");
        }
        for at in 0..file.len() {
            let mut changed = file.clone();
            changed[at] ^= 0x10;
            let told = unpacked(&changed);
            assert!(told.as_ref().map_or(true, |read| *read == text), "byte {at} of {}", file.len());
        }
    }
}
