//! The `.onl` solution container: named chunks behind a version and checksums.
//!
//! ```text
//! 0    magic "ONDELETTE\r\n\x1a\n\0\0\0"     16 bytes; line endings and the DOS end-of-file mark betray text transfer
//! 16   format version                    u32
//! 20   number of chunks n                u32
//! 24   length of the whole file          u64
//! 32   xxh3-64 of bytes 0..32, 40..64 and of the table   u64
//! 40   zeros
//! 64   table: n times (name 8 bytes, offset u64, length u64, xxh3-64 of the chunk u64)
//! ...  chunks in table order, each at the next multiple of 64, zeros between; the file ends with the last chunk
//! ```
//!
//! Integers and floats are little-endian. There is one layout for given chunks, so equal solutions are equal files, and
//! every byte is covered by a checksum or known to be zero. Nothing but the caller's chunks enters: no clock, thread
//! count or path. [`write_solution`] and [`read_solution`] know what the chunks of a solution
//! mean; `docs/formats/onl.md` lists them.

mod error;
mod kept;
mod read;
mod solution;
mod write;

pub use error::OnlError;
pub use read::ChunkFile;
pub use solution::{read_solution, solution_bytes, solution_of, write_solution};
pub use write::ChunkWriter;

/// Version of the format that this program writes and reads.
pub const VERSION: u32 = 5;

const MAGIC: &[u8; 16] = b"ONDELETTE\r\n\x1a\n\0\0\0";
const HEADER: usize = 64;
const ENTRY: usize = 32;
const ALIGNMENT: usize = 64;

#[cfg(target_endian = "big")]
compile_error!("chunks are little-endian and are copied as they are: big-endian machines need a conversion here");

/// Checksum of the header (its own field left out) and the table.
fn table_checksum(header: &[u8], table: &[u8]) -> u64 {
    let mut hash = xxhash_rust::xxh3::Xxh3::new();
    hash.update(&header[..32]);
    hash.update(&header[40..HEADER]);
    hash.update(table);
    hash.digest()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use serde::{Deserialize, Serialize};

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Settings {
        basis: String,
        error: f64,
        levels: Vec<u32>,
    }

    fn settings() -> Settings {
        Settings { basis: "m2".into(), error: 0.01, levels: vec![1, 2, 3] }
    }

    fn sample() -> ChunkWriter<'static> {
        let mut writer = ChunkWriter::new();
        writer.add_struct("settings", &settings()).unwrap();
        writer.add_array("coeffs", &[1.5f64, -0.0, 1e-300]);
        writer.add_array("empty", &[0u32; 0]);
        writer.add_array("nodes", &[7u32, 8, 9, 10, 11]);
        writer
    }

    fn open(bytes: Vec<u8>) -> Result<ChunkFile, OnlError> {
        ChunkFile::from_bytes("test.onl".as_ref(), bytes)
    }

    #[test]
    fn what_is_written_is_read_back_to_the_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.onl");
        sample().write(&path).unwrap();
        let file = ChunkFile::read(&path).unwrap();
        assert_eq!(file.names().collect::<Vec<_>>(), ["settings", "coeffs", "empty", "nodes"]);
        assert_eq!(file.structure::<Settings>("settings").unwrap(), settings());
        let bits: Vec<u64> = file.finite_f64("coeffs").unwrap().iter().map(|c| c.to_bits()).collect();
        assert_eq!(bits, [1.5f64, -0.0, 1e-300].map(f64::to_bits));
        assert_eq!(file.array::<u32>("nodes").unwrap(), [7, 8, 9, 10, 11]);
        assert!(file.array::<u32>("empty").unwrap().is_empty());
        assert_eq!(std::fs::read(&path).unwrap(), sample().to_bytes());
    }

    #[test]
    fn chunks_start_at_multiples_of_64_so_that_other_programs_can_map_them() {
        let bytes = sample().to_bytes();
        for entry in bytes[HEADER..HEADER + 4 * ENTRY].chunks(ENTRY) {
            let offset = u64::from_le_bytes(entry[8..16].try_into().unwrap());
            assert_eq!(offset % 64, 0);
        }
    }

    #[test]
    fn a_container_without_chunks_is_a_container() {
        assert_eq!(open(ChunkWriter::new().to_bytes()).unwrap().names().count(), 0);
    }

    #[test]
    fn each_kind_of_damage_has_its_own_message() {
        let good = sample().to_bytes();
        let message = |bytes: Vec<u8>| open(bytes).unwrap_err().to_string();

        assert!(message(b"not one".to_vec()).contains("not an Ondelette solution"));
        assert!(message(vec![]).contains("not an Ondelette solution"));
        let mut text_mode = good.clone();
        text_mode.remove(9);
        assert!(message(text_mode).contains("not an Ondelette solution"));

        let mut future = good.clone();
        future[16] += 1;
        let said = message(future);
        assert!(said.contains("version 6") && said.contains("reads version 5"), "{said}");

        let said = message(good[..good.len() - 1].to_vec());
        assert!(said.contains("cut short") && said.contains(&good.len().to_string()), "{said}");
        let mut longer = good.clone();
        longer.push(0);
        assert!(message(longer).contains("goes on"));

        let mut table = good.clone();
        table[HEADER + 9] ^= 1;
        assert!(message(table).contains("header"));
        let mut chunk = good.clone();
        *chunk.last_mut().unwrap() ^= 1;
        let said = message(chunk);
        assert!(said.contains("nodes") && said.contains("test.onl"), "{said}");
    }

    #[test]
    fn a_chunk_of_the_wrong_kind_is_refused_by_name() {
        let mut writer = sample();
        writer.add_array("odd", &[1u8, 2, 3]);
        writer.add_array("bad", &[1.0, f64::NAN]);
        let file = open(writer.to_bytes()).unwrap();
        assert!(matches!(file.bytes("links"), Err(OnlError::MissingChunk { .. })));
        assert!(file.array::<f64>("odd").unwrap_err().to_string().contains("3 bytes"));
        assert!(file.finite_f64("bad").unwrap_err().to_string().contains("number 1"));
        assert!(file.structure::<Settings>("nodes").is_err());
        // a structure followed by left-over bytes is another structure
        assert!(file.structure::<u8>("settings").unwrap_err().to_string().contains("left over"));
    }

    #[test]
    #[should_panic(expected = "twice")]
    fn a_name_used_twice_is_our_own_mistake() {
        sample().add_array("nodes", &[1u32]);
    }

    /// The table's checksum made right again after `change`: what a careful forger would leave.
    fn forge(change: impl Fn(&mut [u8])) -> Vec<u8> {
        let mut bytes = sample().to_bytes();
        change(&mut bytes);
        let count = u32::from_le_bytes(bytes[20..24].try_into().unwrap()) as usize;
        let end = (HEADER + count.min(4) * ENTRY).min(bytes.len());
        let sum = table_checksum(&bytes[..HEADER], &bytes[HEADER..end]);
        bytes[32..40].copy_from_slice(&sum.to_le_bytes());
        bytes
    }

    #[test]
    fn forged_tables_are_refused_without_large_allocations() {
        let put = |at: usize, value: u64| forge(move |b| b[at..at + 8].copy_from_slice(&value.to_le_bytes()));
        assert!(open(forge(|b| b[20..24].copy_from_slice(&u32::MAX.to_le_bytes()))).is_err());
        for value in [0, 1, 64, 200, u64::MAX, u64::MAX - 63, 1 << 40] {
            assert!(open(put(HEADER + 8, value)).is_err(), "offset {value}");
            assert!(open(put(HEADER + ENTRY + 16, value)).is_err(), "length {value}");
        }
        // two chunks of one name, and a name that is no word
        assert!(open(forge(|b| b.copy_within(HEADER..HEADER + 8, HEADER + ENTRY))).is_err());
        assert!(open(forge(|b| b[HEADER] = b'\n')).is_err());
        assert!(open(forge(|b| b[HEADER..HEADER + 8].fill(0))).is_err());
    }

    proptest! {
        #[test]
        fn any_changed_byte_is_refused(at in any::<prop::sample::Index>(), flip in 1u8..) {
            let mut bytes = sample().to_bytes();
            let at = at.index(bytes.len());
            bytes[at] ^= flip;
            prop_assert!(open(bytes).is_err(), "byte {} changed unseen", at);
        }

        #[test]
        fn any_truncation_is_refused(keep in any::<prop::sample::Index>()) {
            let mut bytes = sample().to_bytes();
            bytes.truncate(keep.index(bytes.len()));
            prop_assert!(open(bytes).is_err());
        }

        #[test]
        fn any_forged_table_is_refused_or_read_without_panic(
            at in 20usize..HEADER + 4 * ENTRY, with in any::<u64>(),
        ) {
            let bytes = forge(|b| b[at..at + 8].copy_from_slice(&with.to_le_bytes()));
            if let Ok(file) = open(bytes) {
                for name in file.names() {
                    prop_assert!(file.bytes(name).is_ok());
                }
            }
        }
    }

    #[test]
    fn every_single_bit_is_covered() {
        let good = sample().to_bytes();
        for at in 0..good.len() {
            let mut bytes = good.clone();
            bytes[at] ^= 0x10;
            assert!(open(bytes).is_err(), "byte {at} changed unseen");
        }
    }
}
