//! Checks the global heaps of an HDF5 file before the HDF5 library sees them.
//!
//! Texts of variable length lie in global heaps, the only metadata of our files without a checksum, and the library
//! (2.2) trusts the sizes in them: an empty object 0 makes it loop for ever, a size near 2^64 makes it read beyond its
//! buffer. The format (HDF5 File Format Specification, III.E): `GCOL`, version 1, three zero bytes, size of the
//! collection (8 bytes); then objects: index (2), references (2), zero (4), size (8), data padded to 8 bytes; object 0
//! is the free space, its size includes its header and ends the collection.

use std::io::{Read, Result, Seek, SeekFrom};

const MAGIC: [u8; 8] = *b"GCOL\x01\0\0\0";
const HEADER: u64 = 16;
const BLOCK: usize = 1 << 20;

/// Position of the first global heap whose objects do not fit into it; `None`: all are sound.
pub(super) fn first_broken(file: &mut (impl Read + Seek)) -> Result<Option<u64>> {
    for position in collections(file)? {
        if !sound(file, position)? {
            return Ok(Some(position));
        }
    }
    Ok(None)
}

/// Positions of everything that looks like a collection.
fn collections(file: &mut (impl Read + Seek)) -> Result<Vec<u64>> {
    file.seek(SeekFrom::Start(0))?;
    let (mut found, mut window, mut start) = (Vec::new(), Vec::new(), 0u64);
    while file.by_ref().take(BLOCK as u64).read_to_end(&mut window)? > 0 {
        let hits = window.windows(MAGIC.len()).enumerate().filter(|(_, bytes)| *bytes == MAGIC);
        found.extend(hits.map(|(i, _)| start + i as u64));
        // The end of this block may be the beginning of a match.
        let keep = window.len().saturating_sub(MAGIC.len() - 1);
        start += keep as u64;
        window.drain(..keep);
    }
    Ok(found)
}

fn sound(file: &mut (impl Read + Seek), position: u64) -> Result<bool> {
    let end = file.seek(SeekFrom::End(0))?;
    let header = read16(file, position)?;
    let Some(size) =
        header.map(|h| u64::from_le_bytes([h[8], h[9], h[10], h[11], h[12], h[13], h[14], h[15]]))
    else {
        return Ok(false);
    };
    if size < HEADER || size > end - position {
        return Ok(false);
    }
    let mut at = HEADER;
    while size - at >= HEADER {
        let Some(h) = read16(file, position + at)? else { return Ok(false) };
        let length = u64::from_le_bytes([h[8], h[9], h[10], h[11], h[12], h[13], h[14], h[15]]);
        let rest = size - at;
        at += match (h[0], h[1]) {
            (0, 0) if length >= HEADER && length <= rest => length,
            (0, 0) => return Ok(false),
            _ if length <= rest - HEADER => HEADER + length.next_multiple_of(8),
            _ => return Ok(false),
        };
        if at > size {
            return Ok(false);
        }
    }
    Ok(true)
}

fn read16(file: &mut (impl Read + Seek), position: u64) -> Result<Option<[u8; 16]>> {
    let mut bytes = [0; 16];
    file.seek(SeekFrom::Start(position))?;
    match file.read_exact(&mut bytes) {
        Ok(()) => Ok(Some(bytes)),
        Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => Ok(None),
        Err(e) => Err(e),
    }
}
