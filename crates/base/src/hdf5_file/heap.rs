//! Check of the global heaps of an HDF5 file before the HDF5 library reads them.
//!
//! Texts of variable length are stored in global heaps, the only metadata of flex-body files without a checksum. The
//! library (2.2) trusts the sizes in them: an empty object 0 causes an endless loop, and a size near 2^64 causes a read
//! beyond the buffer. The format (HDF5 File Format Specification, III.E): `GCOL`, version 1, three zero bytes, size of
//! the collection (8 bytes); then objects: index (2), references (2), zero (4), size (8), data padded to 8 bytes;
//! object 0 is the free space, its size includes its header and ends the collection.

use std::io::{Read, Result, Seek, SeekFrom};

const MAGIC: [u8; 8] = *b"GCOL\x01\0\0\0";
const HEADER_BYTES: u64 = 16;
const BLOCK_BYTES: usize = 1 << 20;

/// Largest number of objects that are checked, as a multiple of those that fit into the file. Heaps do not overlap;
/// only bytes that happen to look like a heap are checked repeatedly.
const MAX_CHECKS_PER_OBJECT: u64 = 4;

/// Returns the position of the first broken global heap: its objects do not fit into it, or too many objects were
/// checked because heaps are nested. Returns `None` if all heaps are sound.
pub fn first_broken(file: &mut (impl Read + Seek)) -> Result<Option<u64>> {
    let end = file.seek(SeekFrom::End(0))?;
    let mut looks = MAX_CHECKS_PER_OBJECT * end.div_ceil(HEADER_BYTES);
    for position in collections(file)? {
        if !is_sound(file, position, end, &mut looks)? {
            return Ok(Some(position));
        }
    }
    Ok(None)
}

/// Returns the positions of everything that looks like a collection.
fn collections(file: &mut (impl Read + Seek)) -> Result<Vec<u64>> {
    file.seek(SeekFrom::Start(0))?;
    let (mut found, mut window, mut start) = (Vec::new(), Vec::new(), 0u64);
    while file.by_ref().take(BLOCK_BYTES as u64).read_to_end(&mut window)? > 0 {
        let hits = window.windows(MAGIC.len()).enumerate().filter(|(_, bytes)| *bytes == MAGIC);
        found.extend(hits.map(|(i, _)| start + i as u64));
        // A match may begin at the end of this block.
        let keep = window.len().saturating_sub(MAGIC.len() - 1);
        start += keep as u64;
        window.drain(..keep);
    }
    Ok(found)
}

/// Returns true if the objects of the collection at `position` fill it. Returns false if they do not, or if no `looks`
/// are left.
fn is_sound(file: &mut (impl Read + Seek), position: u64, end: u64, looks: &mut u64) -> Result<bool> {
    let Some((_, size)) = header(file, position)? else { return Ok(false) };
    if size < HEADER_BYTES || size > end - position {
        return Ok(false);
    }
    let mut at = HEADER_BYTES;
    while size - at >= HEADER_BYTES {
        let Some(left) = looks.checked_sub(1) else { return Ok(false) };
        *looks = left;
        let Some((object, length)) = header(file, position + at)? else { return Ok(false) };
        let rest = size - at;
        at += match object {
            0 if length >= HEADER_BYTES && length <= rest => length,
            0 => return Ok(false),
            _ if length <= rest - HEADER_BYTES => HEADER_BYTES + length.next_multiple_of(8),
            _ => return Ok(false),
        };
        if at > size {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Returns the first two and the last eight bytes of a header of 16 bytes: index (objects) and size. Returns `None` at
/// the end of the file.
fn header(file: &mut (impl Read + Seek), position: u64) -> Result<Option<(u16, u64)>> {
    let mut bytes = [0; HEADER_BYTES as usize];
    file.seek(SeekFrom::Start(position))?;
    match file.read_exact(&mut bytes) {
        Ok(()) => {}
        Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => return Ok(None),
        Err(e) => return Err(e),
    }
    let [i0, i1, _, _, _, _, _, _, size @ ..] = bytes;
    Ok(Some((u16::from_le_bytes([i0, i1]), u64::from_le_bytes(size))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    /// Returns a collection of 64 bytes at `position`: object 1 with `size` bytes, then free space of `free` bytes.
    fn file(position: usize, size: u64, free: u64) -> Cursor<Vec<u8>> {
        let mut bytes = vec![0u8; position + 64 + 32];
        bytes[position..position + 8].copy_from_slice(&MAGIC);
        bytes[position + 8] = 64;
        bytes[position + 16] = 1;
        bytes[position + 24..position + 32].copy_from_slice(&size.to_le_bytes());
        bytes[position + 48..position + 56].copy_from_slice(&free.to_le_bytes());
        Cursor::new(bytes)
    }

    /// The free space is at 40 + 8 of the collection only for objects of 1 to 8 bytes.
    #[test]
    fn sound_heaps_pass_wherever_they_lie() {
        for position in
            (BLOCK_BYTES - 9..BLOCK_BYTES + 3).chain([0, 1, 2 * BLOCK_BYTES - 14, 3 * BLOCK_BYTES])
        {
            assert_eq!(collections(&mut file(position, 5, 24)).unwrap(), [position as u64]);
            assert_eq!(first_broken(&mut file(position, 5, 24)).unwrap(), None, "{position}");
        }
    }

    #[test]
    fn sizes_that_loop_or_leave_the_heap_are_found() {
        for (size, free) in
            [(5, 0), (5, 15), (5, 25), (5, u64::MAX), (u64::MAX, 24), (u64::MAX - 7, 24), (33, 24)]
        {
            assert_eq!(first_broken(&mut file(100, size, free)).unwrap(), Some(100), "{size} {free}");
        }
        let mut cut = file(100, 5, 24).into_inner();
        cut.truncate(150);
        assert_eq!(first_broken(&mut Cursor::new(cut)).unwrap(), Some(100));
    }

    /// Nested heaps, all of which end at the end of the file: an object of each heap is the header of the next.
    #[test]
    fn heaps_that_lie_in_each_other_are_looked_at_a_few_times() {
        let count = 20_000u64;
        let mut bytes = Vec::new();
        for i in 0..count {
            bytes.extend([1, 0, 0, 0, 0, 0, 0, 0, 16, 0, 0, 0, 0, 0, 0, 0]);
            bytes.extend(MAGIC);
            bytes.extend((32 * (count - i) - 16).to_le_bytes());
        }
        // Each heap is sound by itself; a check of every object of every heap would take two hundred million steps.
        assert!(first_broken(&mut Cursor::new(bytes)).unwrap().is_some());
    }
}
