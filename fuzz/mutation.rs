//! Inputs near those of a corpus.

use arbitrary::{Result, Unstructured};

/// Pieces that readers of scenes, prompts, JSON and weights look for, and some that they do not.
const PIECES: [&[u8]; 34] = [
    b"=",
    b"[",
    b"]",
    b"{",
    b"}",
    b"\"",
    b"\n",
    b".",
    b"-",
    b"1e308",
    b"-1",
    b"nan",
    b"inf",
    b"0",
    b"1.5",
    b"18446744073709551615",
    b"9223372036854775808",
    b"null",
    b"true",
    b"[ship]",
    b"ship.speed",
    b"sea.depth",
    b" m/s ",
    b" degrees",
    b" toward ",
    b" no ship ",
    b"\\u0000",
    b"\x1b[31m",
    b"\0",
    b"\xff",
    b"\xe2\x80\xae",
    b"F32",
    b"data_offsets",
    b"\xc2\xb0",
];

/// An input of the corpus, changed in a few places.
pub(crate) fn mutated(u: &mut Unstructured<'_>, corpus: &[Vec<u8>]) -> Result<Vec<u8>> {
    let mut input = u.choose(corpus)?.clone();
    for _ in 0..u.int_in_range(1..=6)? {
        let at = u.int_in_range(0..=input.len())?;
        let length = u.int_in_range(0..=(input.len() - at).min(64))?;
        match u.int_in_range(0..=7)? {
            0 => {
                input.drain(at..at + length);
            }
            1 => {
                let piece = input[at..at + length].to_vec();
                let times = u.int_in_range(1..=8)?;
                input.splice(at..at, piece.repeat(times));
            }
            2 | 3 => {
                input.splice(at..at, u.choose(&PIECES)?.iter().copied());
            }
            4 => {
                input.splice(at..at + length, u.choose(&PIECES)?.iter().copied());
            }
            5 => {
                let other = u.choose(corpus)?;
                let from = u.int_in_range(0..=other.len())?;
                input.truncate(at);
                input.extend(&other[from..]);
            }
            6 => {
                let bytes = u.bytes(length.min(u.len()))?.to_vec();
                input.splice(at..at + bytes.len(), bytes);
            }
            _ if at < input.len() => input[at] ^= 1 << u.int_in_range(0..=7)?,
            _ => {}
        }
    }
    Ok(input)
}
