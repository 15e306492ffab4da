//! What other programs took on the same scenes: measured once, and kept with machine and date.

use crate::figure::curves::Series;
use crate::reports::page::Table;

/// Where and when the numbers were measured.
pub const MEASURED: &str = "21 November 2026, two shared cores with AVX-512, processor seconds of one core, single runs (about 30 % \
                            apart), errors against the same references";

/// What a program took on a scene.
pub struct Peer {
    pub scene: &'static str,
    pub name: &'static str,
    /// Relative root mean square error in percent, and the processor seconds to it.
    pub points: &'static [(f64, f64)],
}

/// Runs that were made; none is extrapolated. Radiance "in two stages": the rays above the diffuser are given by hand, and the
/// diffuser is a lamp then, which takes an expert. "From the opening": with an emitter of its own, as the program has none.
pub const PEERS: &[Peer] = &[
    Peer { scene: "S1", name: "Radiance 6.0 in two stages", points: &[(1.0, 0.32), (0.44, 0.88), (0.18, 5.4)] },
    Peer {
        scene: "S1",
        name: "Mitsuba 3.9, light tracing from the opening",
        points: &[(10.0, 0.09), (5.0, 0.36), (2.0, 2.2), (1.0, 8.9), (0.65, 28.6)],
    },
    Peer { scene: "S1", name: "Mitsuba 3.9, path tracing", points: &[(10.0, 8.8), (5.0, 35.0), (4.3, 60.0)] },
    Peer { scene: "S1", name: "LuxCore 2.11, path tracing", points: &[(16.0, 16.0)] },
    Peer { scene: "S1", name: "pbrt-v3, path tracing", points: &[(21.0, 9.2)] },
    Peer {
        scene: "S2",
        name: "Mitsuba 3.9, light tracing from the opening",
        points: &[(10.0, 0.05), (5.0, 0.21), (2.0, 1.3), (1.0, 5.2), (0.47, 29.0)],
    },
    Peer { scene: "S2", name: "LuxCore 2.11, bidirectional", points: &[(17.0, 16.0)] },
    Peer { scene: "S3", name: "Radiance 6.0 in two stages", points: &[(1.2, 1.6), (0.41, 2.7), (0.33, 30.0)] },
    Peer {
        scene: "S3",
        name: "Mitsuba 3.9, light tracing from the opening",
        points: &[(10.0, 0.24), (5.0, 0.95), (2.0, 5.9), (1.1, 25.0)],
    },
    Peer { scene: "S3", name: "Mitsuba 3.9, path tracing", points: &[(10.0, 17.0), (5.5, 59.0)] },
    Peer { scene: "S4", name: "Mitsuba 3.9, light tracing", points: &[(10.0, 11.0), (8.3, 16.6)] },
    Peer { scene: "S4", name: "pbrt-v3, SPPM", points: &[(10.0, 11.0), (7.2, 21.9)] },
    Peer { scene: "S4", name: "Mitsuba 3.9, path tracing", points: &[(8.9, 12.5)] },
    Peer { scene: "S4", name: "pbrt-v3, path tracing", points: &[(18.0, 14.0)] },
];

/// The peers of a scene as dashed series of processor seconds and percent; single runs are marks alone.
pub fn series(scene: &str) -> Vec<Series> {
    let of_scene = PEERS.iter().filter(|peer| peer.scene == scene);
    let series = of_scene.map(|peer| {
        let marks: Vec<_> = peer.points.iter().map(|(percent, seconds)| (*seconds, *percent)).collect();
        let line = if marks.len() > 1 { marks.clone() } else { Vec::new() };
        Series { name: peer.name.to_owned(), line, marks, dashed: true, ..Series::default() }
    });
    series.collect()
}

/// All runs of others.
pub fn table() -> Table {
    let row = |peer: &Peer| {
        let points = peer.points.iter().map(|(percent, seconds)| format!("{percent} % in {seconds} s"));
        vec![peer.scene.to_owned(), peer.name.to_owned(), points.collect::<Vec<_>>().join(", ")]
    };
    Table {
        caption: format!("Other programs: {MEASURED}"),
        head: ["scene", "program", "actual error, and the time to it"].map(str::to_owned).into(),
        rows: PEERS.iter().map(row).collect(),
    }
}

/// Closest hits of Embree 3.13 (`rtcIntersect1`, robust flag) along specular chains in the mesh of S3, in millions of rays for each
/// processor second: on a quiet machine, and on a busy one.
pub const EMBREE_MEGARAYS: [f64; 2] = [3.1, 2.5];

#[cfg(test)]
mod tests {
    use super::*;

    /// More time, less error; and no figure has more series than there are colours beside ours.
    #[test]
    fn errors_fall_with_time() {
        for Peer { points, name, .. } in PEERS {
            assert!(points.windows(2).all(|pair| pair[0].0 > pair[1].0 && pair[0].1 < pair[1].1), "{name}");
        }
        for scene in ["S1", "S2", "S3", "S4"] {
            assert!((1..=5).contains(&series(scene).len()), "{scene}");
        }
    }
}
