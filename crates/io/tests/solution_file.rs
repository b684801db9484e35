//! Solutions survive the disk, and no file, however made up, does harm.

use ondelette_io::onl::{ChunkFile, ChunkWriter, OnlError, solution_bytes, solution_of};
use ondelette_radiosity::probe::Prober;
use ondelette_radiosity::scene::samples;
use ondelette_radiosity::{DirectLight, Method, Rgb, Scene, Settings, Solution, Solver};
use proptest::prelude::*;
use std::collections::BTreeSet;
use std::sync::OnceLock;

/// Two walls, a lamp and a triangle over them: quads, triangles, partial visibility.
fn corner() -> Scene {
    let grey = Rgb::grey(0.5);
    samples::quads(
        "corner",
        &[
            ([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0]], grey, Rgb::BLACK),
            ([[0.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 2.0, 2.0], [0.0, 0.0, 2.0]], grey, Rgb::BLACK),
            // not a parallelogram: two triangles
            ([[0.5, 0.5, 0.6], [1.5, 0.5, 0.6], [1.3, 1.5, 0.6], [0.5, 1.5, 0.6]], grey, Rgb::BLACK),
            ([[1.9, 0.5, 1.5], [1.9, 0.5, 1.9], [1.9, 1.5, 1.9], [1.9, 1.5, 1.5]], Rgb::BLACK, Rgb::new(3.0, 2.0, 1.0)),
        ],
    )
}

fn solve(basis: &str, error: f64) -> Solution {
    let mut solver = Solver::new(
        corner(),
        Settings { basis: basis.parse().unwrap(), method: Method::Wavelet, error, ..Settings::default() },
    )
    .unwrap();
    while solver.step().is_some() {}
    solver.solution()
}

fn open(bytes: Vec<u8>) -> Result<Solution, OnlError> {
    solution_of(&ChunkFile::from_bytes("test.onl".as_ref(), bytes)?)
}

fn sample() -> &'static [u8] {
    static BYTES: OnceLock<Vec<u8>> = OnceLock::new();
    BYTES.get_or_init(|| solution_bytes(&solve("m2", 0.1)))
}

#[test]
fn what_is_read_is_what_was_written_in_every_kind_of_basis() {
    for basis in ["haar", "m3", "f2"] {
        let solved = solve(basis, 0.1);
        let bytes = solution_bytes(&solved);
        let back = open(bytes.clone()).unwrap();
        assert_eq!(solution_bytes(&back), bytes, "{basis}");
        assert_eq!(back.forest().nodes().len(), solved.forest().nodes().len());
        for (side, at) in [(0, [0.31, 0.77]), (1, [0.5, 0.01]), (2, [0.2, 0.3])] {
            assert_eq!(back.irradiance(side, at), solved.irradiance(side, at), "{basis}, side {side}");
        }
        assert_eq!(back.statistics(), solved.statistics());
        // measures are not stored: they must come out as the solver had them
        for (a, b) in back.forest().nodes().iter().zip(solved.forest().nodes()) {
            assert_eq!((a.measure.to_bits(), a.cell), (b.measure.to_bits(), b.cell));
        }
    }
}

#[test]
fn an_interrupted_solution_is_one_of_the_states_that_the_whole_run_passes_through() {
    let settings = Settings { error: 0.05, ..Settings::default() };
    let mut whole = Solver::new(corner(), settings).unwrap();
    let mut states = vec![solution_bytes(&whole.solution())];
    while whole.step().is_some() {
        states.push(solution_bytes(&whole.solution()));
    }
    let distinct: BTreeSet<&Vec<u8>> = states.iter().collect();
    assert!(distinct.len() > 5, "{} states", distinct.len());
    for stop in [0, 1, 7, states.len() / 2, states.len() - 2] {
        let mut stopped = Solver::new(corner(), settings).unwrap();
        for _ in 0..stop {
            stopped.step();
        }
        let bytes = solution_bytes(&stopped.solution());
        assert_eq!(bytes, states[stop], "stopped after {stop} steps");
        let back = open(bytes).unwrap();
        assert!(!back.is_finished(), "after {stop} of {} steps", states.len());
    }
}

/// The sample with the bytes of one chunk changed, all checksums right: what a careful forger would leave.
fn forge(chunk: &str, change: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
    let file = ChunkFile::from_bytes("sample".as_ref(), sample().to_vec()).unwrap();
    let mut writer = ChunkWriter::new();
    for name in file.names() {
        let mut bytes = file.bytes(name).unwrap().to_vec();
        if name == chunk {
            change(&mut bytes);
        }
        writer.add_bytes(name, bytes);
    }
    writer.to_bytes()
}

/// Bytes of a stored link.
const LINK: usize = 44;

/// The stored links with the pairs of nodes (the first eight bytes) of two equal-sized neighbours exchanged.
fn swapped_records(links: &[u8]) -> Vec<u8> {
    let mut swapped = links.to_vec();
    let orders = |at: usize| &links[at + 8..at + 10];
    let same = (LINK..links.len()).step_by(LINK).find(|&k| orders(k) == orders(k - LINK)).unwrap();
    swapped.copy_within(same..same + 8, same - LINK);
    swapped[same..same + 8].copy_from_slice(&links[same - LINK..same - LINK + 8]);
    swapped
}

const CHUNKS: [&str; 7] = ["scene", "settings", "counts", "splits", "coeffs", "links", "blocks"];

#[test]
fn forged_chunks_are_refused_by_name() {
    let put = |at: usize, with: &[u8]| {
        let with = with.to_vec();
        move |b: &mut Vec<u8>| b[at..at + with.len()].copy_from_slice(&with)
    };
    let far = u32::MAX.to_le_bytes();
    let nan = f64::NAN.to_le_bytes();
    let forged = [
        ("splits", forge("splits", put(4, &far)), "not there"),
        ("splits", forge("splits", |b| b.copy_within(0..4, 4)), "split before"),
        ("coeffs", forge("splits", |b| b.truncate(b.len() - 4)), "coefficients"),
        ("coeffs", forge("coeffs", put(0, &nan)), "not finite"),
        ("links", forge("links", put(0, &far)), "joins node"),
        ("links", forge("links", put(8, &[7])), "order 7"),
        ("links", forge("links", put(10, &[9])), "flag"),
        ("links", forge("links", |b| *b = swapped_records(b)), "out of order"),
        ("blocks", forge("blocks", |b| b.truncate(b.len() - 8)), "where the links have"),
        ("blocks", forge("blocks", put(0, &nan)), "not finite"),
        ("settings", forge("settings", put(1, &[200])), ""),
    ];
    for (chunk, bytes, reason) in forged {
        let said = open(bytes).unwrap_err().to_string();
        assert!(said.contains(&format!("'{chunk}'")) && said.contains(reason), "{said}");
    }
    for chunk in CHUNKS {
        assert!(open(forge(chunk, |b| b.clear())).is_err(), "{chunk} empty");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]
    #[test]
    fn no_forged_file_panics(
        chunk in 0..CHUNKS.len(), at in any::<prop::sample::Index>(), with in any::<[u8; 4]>(), width in 1usize..5,
        cut in prop::option::weighted(0.2, any::<prop::sample::Index>()),
    ) {
        let bytes = forge(CHUNKS[chunk], |b| {
            let start = at.index(b.len());
            let end = (start + width).min(b.len());
            b[start..end].copy_from_slice(&with[..end - start]);
            if let Some(cut) = cut {
                b.truncate(cut.index(b.len() + 1));
            }
        });
        if let Ok(solution) = open(bytes) {
            // whatever was accepted can be used
            for side in 0..solution.scene().sides.len() {
                solution.irradiance(side, [0.3, 0.3]);
                solution.mean_irradiance(side);
            }
            prop_assert!(!solution_bytes(&solution).is_empty());
        }
    }
}

fn kept_sample() -> &'static [u8] {
    static BYTES: OnceLock<Vec<u8>> = OnceLock::new();
    BYTES.get_or_init(|| {
        let mut solver = Solver::new(corner(), Settings { error: 0.2, ..Settings::default() }).unwrap();
        while solver.step().is_some() {}
        solution_bytes(&solver.into_kept())
    })
}

#[test]
fn kept_samples_survive_the_disk_and_are_gone_on_from() {
    let back = open(kept_sample().to_vec()).unwrap();
    assert_eq!(solution_bytes(&back), kept_sample());
    let mut solver = Solver::resume(&back).unwrap();
    while !matches!(solver.step(), Some(ondelette_radiosity::Event::Solved { .. }) | None) {}
    let again = solver.solution();
    assert_eq!(again.statistics().rays, back.statistics().rays);
    for side in 0..back.scene().sides.len() {
        let [a, b] = [&back, &again].map(|s| s.mean_irradiance(side).sum());
        assert!((a - b).abs() <= 0.01 * (a + b) + 1e-9, "side {side}: {a} and {b}");
    }
    assert!(Solver::resume(&back.without_samples()).is_err());
    // links are always kept
    let mut linked = Solver::resume(&open(sample().to_vec()).unwrap()).unwrap();
    while !matches!(linked.step(), Some(ondelette_radiosity::Event::Solved { .. }) | None) {}
    assert!(linked.solution().mean_irradiance(0).sum() > 0.0);
}

#[test]
fn what_direct_light_is_gathered_by_survives_the_disk_without_samples() {
    let settings = Settings { error: 0.2, direct: DirectLight::Gathered, ..Settings::default() };
    let solve = |end: fn(Solver) -> Solution| {
        let mut solver = Solver::new(corner(), settings).unwrap();
        while solver.step().is_some() {}
        end(solver)
    };
    let [bare, kept] = [solve(Solver::into_solution), solve(Solver::into_kept)];
    assert_eq!(solution_bytes(&bare), solution_bytes(&kept.clone().without_samples()));
    let back = open(solution_bytes(&bare)).unwrap();
    assert_eq!(back.settings().direct, DirectLight::Gathered);
    let [a, b] = [Prober::new(&kept), Prober::new(&back)];
    for k in 0..100 {
        let at = [0.005 + f64::from(k % 10) / 10.0, 0.007 + f64::from(k / 10) / 10.0];
        assert_eq!(a.irradiance(0, at), b.irradiance(0, at), "{at:?}");
    }
    assert!(Solver::resume(&back).is_err() && Solver::resume(&kept).is_ok());
}

/// The kept sample with one chunk changed, checksums right.
fn forged(chunk: &str, change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let file = ChunkFile::from_bytes("test.onl".as_ref(), kept_sample().to_vec()).unwrap();
    let mut writer = ChunkWriter::new();
    let mut change = Some(change);
    for name in file.names() {
        let mut bytes = file.bytes(name).unwrap().to_vec();
        if name == chunk
            && let Some(change) = change.take()
        {
            change(&mut bytes);
        }
        writer.add_bytes(name, bytes);
    }
    writer.to_bytes()
}

#[test]
fn kept_samples_that_cannot_be_are_refused() {
    for chunk in ["k.groups", "k.lamps", "k.gather", "k.leaves"] {
        // an index far out of range
        let bytes = forged(chunk, |b| b[..4].copy_from_slice(&0x00ff_ffffu32.to_le_bytes()));
        assert!(open(bytes).is_err(), "{chunk}");
    }
    for chunk in ["k.direct", "k.misfit", "k.scattr", "k.lrays", "k.places", "k.ends"] {
        let bytes = forged(chunk, |b| b.iter_mut().take(8).for_each(|b| *b = 0xff));
        assert!(open(bytes).is_err(), "{chunk} with a NaN");
    }
    for chunk in ["k.direct", "k.misfit", "k.gather", "k.keys", "k.open", "k.starts", "k.leaves"] {
        let bytes = forged(chunk, |b| b.truncate(b.len() / 2 / 28 * 28));
        assert!(open(bytes).is_err(), "half of {chunk}");
    }
    assert!(open(forged("k.starts", |b| b[0] = 255)).is_err());
    assert!(open(forged("k.open", |b| b[0] = 2)).is_err());
    assert!(open(forged("k.crowd", |b| b[0] = 2)).is_err());
    assert!(open(forged("k.crowd", |b| b.truncate(1))).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    #[test]
    fn whatever_kept_samples_say_nothing_panics(
        which in 0usize..14, at in any::<prop::sample::Index>(), with in any::<[u8; 4]>(),
    ) {
        const NAMES: [&str; 14] = [
            "k.groups", "k.lamps", "k.direct", "k.misfit", "k.scattr", "k.lrays", "k.gather", "k.places", "k.keys",
            "k.open", "k.ends", "k.leaves", "k.starts", "k.crowd",
        ];
        let bytes = forged(NAMES[which], |b| {
            let at = at.index(b.len().saturating_sub(4).max(1));
            for (b, w) in b[at..].iter_mut().zip(with) {
                *b = w;
            }
        });
        if let Ok(solution) = open(bytes) {
            let mut solver = Solver::resume(&solution).unwrap();
            for _ in 0..3 {
                solver.step();
            }
        }
    }
}
