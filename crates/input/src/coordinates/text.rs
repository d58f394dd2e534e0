//! Text in blocks that end at line ends, so that at most two blocks of a file are in memory.

use super::{Compression, Read};
use flexbody_base::text::InputFile;

/// Bytes per block. Larger blocks would be newly mapped pages each time.
const BLOCK: usize = 8 << 20;

/// Bytes of the first block at the start. It grows with the text, because most files are small.
const FIRST_BLOCK: usize = 1 << 16;

/// Factor by which the first block grows. The allocator keeps the smaller blocks: doubling would leave as much as the
/// largest block again.
const GROWTH: usize = 16;

/// Bytes per piece that one thread parses.
const PIECE: usize = 1 << 20;

/// Source of a text, block by block.
pub(crate) struct Blocks<'a> {
    stream: Box<dyn Read + Send + 'a>,
    /// Beginning of the next line, which was read with the last block.
    carry: Vec<u8>,
    /// Memory of a block that is no longer used.
    spare: Vec<u8>,
    newline: bool,
}

impl<'a> Blocks<'a> {
    /// Returns the blocks of the unpacked text of a file.
    pub(crate) fn of(file: &'a InputFile, compression: Compression) -> Self {
        Self::new(compression.stream_of(file))
    }

    fn new(stream: Box<dyn Read + Send + 'a>) -> Self {
        Self { stream, carry: Vec::new(), spare: Vec::new(), newline: true }
    }

    /// Returns the next block. It ends at a line end, at the end of the file, or anywhere within a line longer than a
    /// block.
    pub(crate) fn next(&mut self) -> std::io::Result<Option<Vec<u8>>> {
        let mut block = std::mem::take(&mut self.spare);
        let (mut filled, mut ends) = (self.carry.len(), false);
        block.resize(block.len().clamp(FIRST_BLOCK.max(filled), BLOCK.max(filled)), 0);
        block[..filled].copy_from_slice(&self.carry);
        self.carry.clear();
        while !ends && filled < BLOCK {
            if filled == block.len() {
                block.resize((GROWTH * filled).min(BLOCK), 0);
            }
            let count = self.stream.read(&mut block[filled..])?;
            filled += count;
            ends = count == 0;
        }
        let end = whole_lines(&block[..filled], ends);
        self.carry.extend_from_slice(&block[end..filled]);
        block.truncate(end);
        let Some(&last) = block.last() else { return Ok(None) };
        self.newline = last == b'\n';
        Ok(Some(block))
    }

    /// Takes back the memory of a block that is no longer used.
    pub(crate) fn take_back(&mut self, block: Vec<u8>) {
        self.spare = block;
    }

    /// Returns true when the text so far ends with a line end.
    pub(crate) fn ends_with_newline(&self) -> bool {
        self.newline
    }
}

/// Returns the length of the whole lines of a block: all of it if it ends the file or has no line end.
fn whole_lines(block: &[u8], ends_file: bool) -> usize {
    match block.iter().rposition(|&b| b == b'\n') {
        Some(at) if !ends_file => at + 1,
        _ => block.len(),
    }
}

/// Returns an upper bound of the number of entries in a text: one per line, of which `1 1 1` is the shortest. Entries
/// are held until all are read, so their capacity must not exceed this bound.
pub(crate) fn most_entries(text: &[u8]) -> usize {
    (memchr::memchr_iter(b'\n', text).count() + 1).min(text.len() / 6 + 1)
}

/// Cuts a block at line ends into pieces of about [`PIECE`] bytes.
pub(crate) fn line_aligned(block: &[u8]) -> impl Iterator<Item = &[u8]> {
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
        let packed =
            ruzstd::encoding::compress_to_vec(text.as_bytes(), ruzstd::encoding::CompressionLevel::Fastest);
        for (compression, bytes) in [(Compression::None, text.as_bytes()), (Compression::Zstd, &packed)] {
            let mut blocks = Blocks::new(compression.stream(bytes));
            let mut at = 0;
            while let Some(block) = blocks.next().unwrap() {
                for piece in line_aligned(&block) {
                    assert!(text.as_bytes()[at..].starts_with(piece));
                    at += piece.len();
                    assert!(piece.ends_with(b"\n") || at == text.len());
                }
                blocks.take_back(block);
            }
            assert_eq!(at, text.len());
            assert!(!blocks.ends_with_newline());
        }
    }
}
