//! Text in blocks that end at line ends: the whole map at once, or as much as is unpacked at a time.

use super::{Compression, Read};

/// Unpacked bytes per block of a compressed file.
const BLOCK: usize = 32 << 20;

/// Bytes per piece that one thread parses.
const PIECE: usize = 1 << 20;

/// Gives a file block by block.
pub(super) enum Blocks<'a> {
    /// The file as it lies on disk.
    Plain { bytes: &'a [u8], given: bool },
    /// A compressed file; `buffer[used..]` is the begin of the next line.
    Packed { stream: Box<dyn Read + 'a>, buffer: Vec<u8>, used: usize, newline: bool },
}

impl<'a> Blocks<'a> {
    pub(super) fn new(compression: Compression, bytes: &'a [u8]) -> std::io::Result<Self> {
        Ok(match compression {
            Compression::None => Self::Plain { bytes, given: false },
            _ => Self::Packed {
                stream: compression.stream(bytes)?,
                buffer: Vec::new(),
                used: 0,
                newline: true,
            },
        })
    }

    /// The next block: it ends at a line end, or at the end of the file, or (a line longer than a block)
    /// anywhere.
    pub(super) fn next(&mut self) -> std::io::Result<Option<&[u8]>> {
        match self {
            Self::Plain { bytes, given } => Ok((!std::mem::replace(given, true)).then_some(bytes)),
            Self::Packed { stream, buffer, used, newline } => {
                buffer.drain(..*used);
                let missing = BLOCK.saturating_sub(buffer.len()) as u64;
                stream.by_ref().take(missing).read_to_end(buffer)?;
                let end_of_file = buffer.len() < BLOCK;
                let last_line_end = buffer.iter().rposition(|&b| b == b'\n').map(|at| at + 1);
                *used = match last_line_end {
                    Some(at) if !end_of_file => at,
                    _ => buffer.len(),
                };
                if let Some(&last) = buffer[..*used].last() {
                    *newline = last == b'\n';
                }
                Ok((*used > 0).then_some(&buffer[..*used]))
            }
        }
    }

    /// Whether what was given so far ends with a line end.
    pub(super) fn ends_with_newline(&self) -> bool {
        match self {
            Self::Plain { bytes, .. } => bytes.last() == Some(&b'\n'),
            Self::Packed { newline, .. } => *newline,
        }
    }
}

/// Cuts a block at line ends into pieces of about [`PIECE`] bytes.
pub(super) fn line_aligned(block: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = block;
    std::iter::from_fn(move || {
        if rest.is_empty() {
            return None;
        }
        let target = PIECE.min(rest.len());
        let end = rest[target..].iter().position(|&b| b == b'\n').map_or(rest.len(), |at| target + at + 1);
        let (piece, after) = rest.split_at(end);
        rest = after;
        Some(piece)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_and_blocks_put_together_are_the_text_and_end_at_lines() {
        let mut text = String::new();
        for k in 0..3_000_000u32 {
            text += &format!("{k} {k} {k}.5\n");
        }
        text += "no line end";
        assert!(text.len() > 2 * BLOCK, "more than two blocks");
        let packed = zstd::encode_all(text.as_bytes(), 1).unwrap();
        for (compression, bytes) in [(Compression::None, text.as_bytes()), (Compression::Zstd, &packed)] {
            let mut blocks = Blocks::new(compression, bytes).unwrap();
            let mut at = 0;
            while let Some(block) = blocks.next().unwrap() {
                for piece in line_aligned(block) {
                    assert!(text.as_bytes()[at..].starts_with(piece));
                    at += piece.len();
                    assert!(piece.ends_with(b"\n") || at == text.len());
                }
            }
            assert_eq!(at, text.len());
            assert!(!blocks.ends_with_newline());
        }
    }
}
