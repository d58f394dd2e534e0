//! Decompressed bytes of consecutive Zstandard frames (RFC 8878).

use super::input_file::{failed, reading_error};
use ruzstd::decoding::errors::{FrameDecoderError, ReadFrameHeaderError};
use ruzstd::decoding::{BlockDecodingStrategy, FrameDecoder};
use std::error::Error;
use std::io::{self, BufRead, ErrorKind, Read};

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
