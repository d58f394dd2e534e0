//! The unpacked bytes of Zstandard frames, one after the other (RFC 8878).

use ruzstd::decoding::errors::{FrameDecoderError, ReadFrameHeaderError};
use ruzstd::decoding::{FrameDecoder, StreamingDecoder};
use std::error::Error;
use std::io::{self, ErrorKind, Read};

/// Magic number and length of a frame that is to be skipped.
const SKIPPED_HEADER: usize = 8;

/// Reads all frames of a file, skips those that are to be skipped, and compares the checksum of each that has
/// one.
pub(super) struct ZstdFrames<'a> {
    frame: Option<StreamingDecoder<&'a [u8], FrameDecoder>>,
    /// What follows the frame, where none is open.
    rest: &'a [u8],
}

impl<'a> ZstdFrames<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { frame: None, rest: bytes }
    }

    /// Opens the next frame with contents; there is none at the end of the file.
    fn open(&mut self) -> io::Result<()> {
        while !self.rest.is_empty() {
            match StreamingDecoder::new(self.rest) {
                Ok(frame) => {
                    self.frame = Some(frame);
                    return Ok(());
                }
                Err(FrameDecoderError::ReadFrameHeaderError(ReadFrameHeaderError::SkipFrame {
                    length,
                    ..
                })) => {
                    let end = SKIPPED_HEADER + length as usize;
                    self.rest = self.rest.get(end..).ok_or(ErrorKind::UnexpectedEof)?;
                }
                Err(error) => return Err(of_file(error)),
            }
        }
        Ok(())
    }

    /// Leaves a frame that was read to its end.
    fn close(&mut self, frame: StreamingDecoder<&'a [u8], FrameDecoder>) -> io::Result<()> {
        let (rest, decoder) = frame.into_parts();
        let stored = decoder.get_checksum_from_data();
        if stored.is_some() && stored != decoder.get_calculated_checksum() {
            return Err(io::Error::new(ErrorKind::InvalidData, "the checksum of a Zstandard frame differs"));
        }
        self.rest = rest;
        Ok(())
    }
}

impl Read for ZstdFrames<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if buffer.is_empty() {
            return Ok(0);
        }
        loop {
            if self.frame.is_none() {
                self.open()?;
            }
            let Some(mut frame) = self.frame.take() else { return Ok(0) };
            let count = frame.read(buffer).map_err(|error| {
                // The decoder wraps what it says about blocks.
                error.into_inner().map_or(ErrorKind::InvalidData.into(), of_file)
            })?;
            if count > 0 {
                self.frame = Some(frame);
                return Ok(count);
            }
            self.close(frame)?;
        }
    }
}

/// An error of the decoder as one of the file: that it ends too early, or what is wrong with it.
fn of_file(error: impl Into<Box<dyn Error + Send + Sync>>) -> io::Error {
    let error = error.into();
    let mut cause: Option<&(dyn Error + 'static)> = Some(&*error);
    while let Some(one) = cause {
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
