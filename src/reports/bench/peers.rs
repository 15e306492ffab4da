//! Times of other programs on the same scenes: run before this benchmark where they are installed, else as measured once, with
//! machine and date.

use std::borrow::Cow;
use std::collections::BTreeMap;

use serde::Deserialize;

use crate::page::Table;
use skyduct::figure::curves::Series;
use skyduct::figure::ticks::significant;

/// Machine, date and conditions of the recorded numbers.
pub const MEASURED: &str = "21 November 2026, two shared cores with AVX-512, processor seconds of one core, single runs (about 30 % \
                            apart), errors against the same references";

/// Largest number of series of other programs in a figure; one program may be drawn by several methods.
const MOST_SERIES: usize = 5;

/// Errors and times of a program on a scene.
#[derive(Clone, Debug)]
pub struct Peer {
    pub scene: Cow<'static, str>,
    pub name: Cow<'static, str>,
    /// Relative root mean square errors in percent, each with the processor seconds to it, in ascending time and descending
    /// error.
    pub points: Cow<'static, [(f64, f64)]>,
}

/// Run of a program, in the format of the scripts that run other programs.
#[derive(Clone, Debug, Deserialize)]
pub struct Record {
    /// Name and version of the program.
    pub peer: String,
    pub scene: String,
    pub method: String,
    /// Processor seconds.
    pub cpu: f64,
    /// Relative root mean square error against the references.
    pub rel_rms: f64,
    /// Number of passes after the first, in which some programs compile; a record with none is left out.
    #[serde(default = "one")]
    pub passes: u64,
}

fn one() -> u64 {
    1
}

/// Rate of closest hits of Embree along specular chains in the mesh of S3, in millions of rays per processor second.
#[derive(Clone, Copy, Debug)]
pub struct EmbreeRate {
    /// Rate of `rtcIntersect1`.
    pub one_by_one: f64,
    /// Rate of `rtcIntersect1M`, in streams of 64.
    pub in_streams: f64,
}

/// Results of other programs that ran before this benchmark, on the same machine.
#[derive(Clone, Debug)]
pub struct Beside {
    pub peers: Vec<Peer>,
    /// Rate of Embree with its robust flag.
    pub embree: Option<EmbreeRate>,
    /// Programs that did not run, with the reasons.
    pub absent: Vec<String>,
}

impl Beside {
    /// Groups runs by scene, program and method; of each group, those that are more accurate than any shorter one are kept.
    pub fn new(records: Vec<Record>, embree: Option<EmbreeRate>, absent: Vec<String>) -> Self {
        let mut runs = BTreeMap::<_, Vec<(f64, f64)>>::new();
        for Record { peer, scene, method, cpu, rel_rms, passes } in records {
            if passes > 0 && cpu > 0.0 && rel_rms.is_finite() {
                runs.entry((scene, format!("{peer}, {method}"))).or_default().push((100.0 * rel_rms, cpu));
            }
        }
        let peers = runs.into_iter().map(|((scene, name), mut points)| {
            points.sort_by(|(_, a), (_, b)| a.total_cmp(b));
            let mut least = f64::INFINITY;
            points.retain(|(percent, _)| {
                let better = *percent < least;
                least = least.min(*percent);
                better
            });
            Peer { scene: scene.into(), name: name.into(), points: points.into() }
        });
        Self { peers: peers.collect(), embree, absent }
    }
}

/// Recorded runs; none is extrapolated. Radiance "in two stages": the rays above the diffuser are given by hand, and the
/// diffuser then is a light source, which takes an expert. "From the opening": with an own emitter, because the program has
/// none.
static RECORDED: [Peer; 14] = [
    recorded("S1", "Radiance 6.0 in two stages", &[(1.0, 0.32), (0.44, 0.88), (0.18, 5.4)]),
    recorded(
        "S1",
        "Mitsuba 3.9, light tracing from the opening",
        &[(10.0, 0.09), (5.0, 0.36), (2.0, 2.2), (1.0, 8.9), (0.65, 28.6)],
    ),
    recorded("S1", "Mitsuba 3.9, path tracing", &[(10.0, 8.8), (5.0, 35.0), (4.3, 60.0)]),
    recorded("S1", "LuxCore 2.11, path tracing", &[(16.0, 16.0)]),
    recorded("S1", "pbrt-v3, path tracing", &[(21.0, 9.2)]),
    recorded(
        "S2",
        "Mitsuba 3.9, light tracing from the opening",
        &[(10.0, 0.05), (5.0, 0.21), (2.0, 1.3), (1.0, 5.2), (0.47, 29.0)],
    ),
    recorded("S2", "LuxCore 2.11, bidirectional", &[(17.0, 16.0)]),
    recorded("S3", "Radiance 6.0 in two stages", &[(1.2, 1.6), (0.41, 2.7), (0.33, 30.0)]),
    recorded(
        "S3",
        "Mitsuba 3.9, light tracing from the opening",
        &[(10.0, 0.24), (5.0, 0.95), (2.0, 5.9), (1.1, 25.0)],
    ),
    recorded("S3", "Mitsuba 3.9, path tracing", &[(10.0, 17.0), (5.5, 59.0)]),
    recorded("S4", "Mitsuba 3.9, light tracing", &[(10.0, 11.0), (8.3, 16.6)]),
    recorded("S4", "pbrt-v3, SPPM", &[(10.0, 11.0), (7.2, 21.9)]),
    recorded("S4", "Mitsuba 3.9, path tracing", &[(8.9, 12.5)]),
    recorded("S4", "pbrt-v3, path tracing", &[(18.0, 14.0)]),
];

const fn recorded(scene: &'static str, name: &'static str, points: &'static [(f64, f64)]) -> Peer {
    Peer { scene: Cow::Borrowed(scene), name: Cow::Borrowed(name), points: Cow::Borrowed(points) }
}

/// Returns other programs on a scene as dashed series of processor seconds and percent: those that ran before the benchmark, or
/// else the recorded ones; single runs are marks alone.
pub fn series(scene: &str, beside: Option<&Beside>) -> Vec<Series> {
    let of_scene = |peer: &&Peer| peer.scene == scene;
    let mut peers: Vec<&Peer> = beside.iter().flat_map(|beside| &beside.peers).filter(of_scene).collect();
    if peers.is_empty() {
        peers = RECORDED.iter().filter(of_scene).collect();
    }
    // time to an error is proportional to its inverse square
    let price = |peer: &Peer| peer.points.iter().map(|(error, seconds)| seconds * error * error).reduce(f64::min);
    peers.sort_by(|a, b| price(a).partial_cmp(&price(b)).unwrap_or(std::cmp::Ordering::Equal));
    peers.truncate(MOST_SERIES);
    let series = peers.into_iter().map(|Peer { name, points, .. }| {
        let marks: Vec<_> = points.iter().map(|(percent, seconds)| (*seconds, *percent)).collect();
        let line = if marks.len() > 1 { marks.clone() } else { Vec::new() };
        Series { name: name.to_string(), line, marks, dashed: true, ..Series::default() }
    });
    series.collect()
}

/// Returns the sentence on other programs: whether they ran before the benchmark, and which did not.
pub fn remark(beside: Option<&Beside>) -> String {
    match beside {
        None => "Other programs were not run for this benchmark.".to_owned(),
        Some(beside) if beside.absent.is_empty() => "Other programs ran before it, on the same machine.".to_owned(),
        Some(beside) => {
            format!("Other programs ran before it, on the same machine, except {}.", beside.absent.join("; "))
        }
    }
}

/// Returns tables of all runs of other programs.
pub fn tables(beside: Option<&Beside>) -> Vec<Table> {
    let beside = beside.filter(|beside| !beside.peers.is_empty());
    let beside =
        beside.map(|beside| table("Other programs, run before this benchmark: processor seconds", &beside.peers));
    beside.into_iter().chain([table(&format!("Other programs: {MEASURED}"), &RECORDED)]).collect()
}

fn table(caption: &str, peers: &[Peer]) -> Table {
    let row = |Peer { scene, name, points }: &Peer| {
        let points = points
            .iter()
            .map(|(percent, seconds)| format!("{} % in {} s", significant(*percent, 3), significant(*seconds, 3)));
        vec![scene.to_string(), name.to_string(), points.collect::<Vec<_>>().join(", ")]
    };
    Table {
        caption: caption.to_owned(),
        head: ["scene", "program", "actual error and the time to reach it"].map(str::to_owned).into(),
        rows: peers.iter().map(row).collect(),
    }
}

/// Measured rates of Embree 3.13 (`rtcIntersect1`, robust flag) in millions of rays per processor second: on a machine with
/// AVX-512, and on shared ones.
pub const EMBREE_MEGARAYS: [f64; 2] = [3.7, 2.5];

#[cfg(test)]
mod tests {
    use super::*;

    fn record(method: &str, cpu: f64, rel_rms: f64) -> Record {
        Record {
            peer: "tracer 1.0".to_owned(),
            scene: "S1".to_owned(),
            method: method.to_owned(),
            cpu,
            rel_rms,
            passes: 1,
        }
    }

    /// Errors fall with time, and no figure has more series than there are colours beside ours.
    #[test]
    fn errors_fall_with_time() {
        for Peer { points, name, .. } in &RECORDED {
            assert!(points.windows(2).all(|pair| pair[0].0 > pair[1].0 && pair[0].1 < pair[1].1), "{name}");
        }
        for scene in ["S1", "S2", "S3", "S4"] {
            assert!((1..=MOST_SERIES).contains(&series(scene, None).len()), "{scene}");
        }
    }

    #[test]
    fn what_ran_beside_takes_the_place_of_what_is_recorded() {
        let records = vec![
            record("slow", 4.0, 0.1),
            record("fast", 2.0, 0.02),
            record("fast", 1.0, 0.03),
            record("fast", 4.0, 0.025),
            record("fast", 8.0, f64::NAN),
        ];
        let beside = Beside::new(records, None, vec!["Radiance: not installed".to_owned()]);
        assert_eq!(beside.peers.len(), 2);
        assert_eq!(*beside.peers[0].points, [(3.0, 1.0), (2.0, 2.0)]);
        let beside = Some(&beside);
        let names: Vec<String> = series("S1", beside).into_iter().map(|series| series.name).collect();
        assert_eq!(names, ["tracer 1.0, fast", "tracer 1.0, slow"]);
        assert_eq!(series("S2", beside).len(), 2);
        assert_eq!(tables(beside)[0].rows[0][2], "3.00 % in 1.00 s, 2.00 % in 2.00 s");
        assert!(remark(beside).contains("except Radiance: not installed"));
    }
}
