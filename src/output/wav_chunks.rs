//! The chunks of a WAV file that hold its format and its samples.
//!
//! Control side; blocks on the reader. RIFF pads chunks of odd length by a byte, which the reader of the crate `hound` takes
//! for the next chunk [hound 3.5.1]: it meets no other chunks here.

use std::io::{self, Chain, Cursor, Read};

/// Longest format chunk in bytes: the extensible one has 40.
const LONGEST_FORMAT: u32 = 1024;

/// A WAV file without the chunks before its samples that are not its format. Whatever is no WAV file stays as it is.
pub type WavChunks<R> = Chain<Cursor<Vec<u8>>, R>;

/// Reads up to the samples.
///
/// # Errors
/// Those of the reader; the end of the file is none.
pub fn wav_chunks<R: Read>(mut reader: R) -> io::Result<WavChunks<R>> {
    let mut kept = Vec::new();
    let begins = |bytes: &[u8]| bytes.starts_with(b"RIFF") && bytes.ends_with(b"WAVE");
    if take(&mut reader, 12, &mut kept)? && begins(&kept) {
        loop {
            let start = kept.len();
            if !take(&mut reader, 8, &mut kept)? {
                break;
            }
            let (name, length) = kept[start..].split_at(4);
            let length = length.try_into().map_or(0, u32::from_le_bytes);
            let padding = u64::from(length % 2);
            match name {
                b"data" => break,
                b"fmt " if length > LONGEST_FORMAT => break,
                b"fmt " => {
                    take(&mut reader, length.into(), &mut kept)?;
                    take(&mut reader, padding, &mut Vec::new())?;
                }
                _ => {
                    kept.truncate(start);
                    let skipped = u64::from(length) + padding;
                    io::copy(&mut reader.by_ref().take(skipped), &mut io::sink())?;
                }
            }
        }
    }
    Ok(Cursor::new(kept).chain(reader))
}

/// Appends so many bytes; returns whether there were as many.
fn take(reader: &mut impl Read, count: u64, to: &mut Vec<u8>) -> io::Result<bool> {
    Ok(reader.take(count).read_to_end(to)? as u64 == count)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLES: [i16; 3] = [1, -2, 3];

    fn chunk(name: &[u8; 4], body: &[u8]) -> Vec<u8> {
        let mut bytes = name.to_vec();
        bytes.extend((body.len() as u32).to_le_bytes());
        bytes.extend(body);
        bytes.extend(&[0u8; 1][..body.len() % 2]);
        bytes
    }

    /// A file of mono samples with chunks before and after the format.
    fn file(before: &[u8], after: &[u8]) -> Vec<u8> {
        let mut format = vec![1, 0, 1, 0];
        format.extend(44_100u32.to_le_bytes());
        format.extend(88_200u32.to_le_bytes());
        format.extend([2, 0, 16, 0]);
        let samples: Vec<u8> = SAMPLES.iter().flat_map(|s| s.to_le_bytes()).collect();
        let format = chunk(b"fmt ", &format);
        let chunks = [before, &format, after, &chunk(b"data", &samples)].concat();
        let size = (chunks.len() as u32 + 4).to_le_bytes();
        [b"RIFF", &size[..], b"WAVE", &chunks].concat()
    }

    fn samples(bytes: &[u8]) -> hound::Result<Vec<i16>> {
        hound::WavReader::new(wav_chunks(bytes)?)?
            .samples()
            .collect()
    }

    #[test]
    fn other_chunks_of_any_length_are_skipped() {
        for length in 0..6 {
            let list = chunk(b"LIST", &[b'x'; 6][..length]);
            for bytes in [file(&list, &[]), file(&[], &list), file(&list, &list)] {
                let read = samples(&bytes).expect("is a WAV file");
                assert_eq!(read, SAMPLES, "a chunk of {length} bytes");
            }
        }
        let file = file(&[], &chunk(b"LIST", b"odd"));
        assert!(hound::WavReader::new(&file[..]).is_err(), "hound reads it");
    }

    #[test]
    fn files_that_end_early_are_passed_on() {
        let whole = file(&chunk(b"LIST", b"odd"), &[]);
        for length in 0..whole.len() - 6 {
            let cut = samples(&whole[..length]);
            assert!(cut.is_err() || length >= whole.len() - 6, "{length}");
        }
        let mut passed = Vec::new();
        let other = b"MThd and more text than a header has";
        let mut chunks = wav_chunks(&other[..]).expect("reads");
        chunks.read_to_end(&mut passed).expect("reads");
        assert_eq!(passed, other);
    }
}
