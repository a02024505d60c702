//! Seams: from what a scene says of them to stitches between vertices.

mod cut;
mod elastic;
mod line;

use cloth_core::{MeshStitch, Seam, TriangleMesh};
use glam::DVec3;

use crate::{Scene, SceneError, SceneSeam, SceneSeamEnd, error::SceneUnknown};

use super::{Check, pins::NAMED_MAX};

use cut::Cutter;
use line::{Line, LineProblem};

/// Difference of the lengths of two lines that needs no gathering.
const EASE: f64 = 0.05;

/// What is sewn within cloths.
#[derive(Default)]
pub(super) struct Sewn {
    /// Stitches of seams, by the number of the seam.
    stitches: Vec<(usize, Vec<[u32; 2]>)>,
    /// Edges of elastic bands.
    bands: Vec<elastic::Band>,
}

impl Sewn {
    /// Adds that of another cloth.
    pub(super) fn extend(&mut self, other: Self) {
        self.stitches.extend(other.stitches);
        self.bands.extend(other.bands);
    }
}

/// The cloth that a seam is in.
fn cloth_of<'a>(scene: &'a Scene, seam: &'a SceneSeam) -> Option<&'a str> {
    match (&seam.cloth, &scene.cloths[..]) {
        (Some(name), _) => Some(name),
        (None, [cloth]) => Some(&cloth.name),
        (None, _) => None,
    }
}

/// The stitches of the seams within the cloth called `name`, whose mesh gets vertices where stitches need them. What is worth knowing of them
/// goes to `notes`.
pub(super) fn sew(
    (scene, check): (&Scene, &Check<'_>),
    name: &str,
    mesh: &mut TriangleMesh,
    notes: &mut Vec<String>,
) -> Result<Sewn, SceneError> {
    let within =
        |(_, seam): &(usize, &SceneSeam)| cloth_of(scene, seam) == Some(name) && seam.to.is_none();
    let seams: Vec<_> = scene.seams.iter().enumerate().filter(within).collect();
    if seams.is_empty() && !elastic::are_in(scene, name) {
        return Ok(Sewn::default());
    }
    let of_file = std::mem::take(&mut mesh.stitches);
    let given = mesh.positions.len();
    let mut cutter = Cutter::new(mesh);
    let mut all = Vec::new();
    // What joins vertices alone comes first: later seams make room beside it.
    for &(index, seam) in &seams {
        let key = format!("seam[{index}]");
        let far = |vertex: u32| {
            let problem = format!(
                "names vertex {vertex}, and cloth {name:?} has {given}: vertices count from 0"
            );
            check.error(&key, &problem)
        };
        for &vertex in seam.stitches.iter().flatten() {
            if vertex as usize >= given {
                return Err(far(vertex));
            }
        }
        seam.stitches.iter().for_each(|&[a, b]| cutter.join(a, b));
        let points = seam.points.iter();
        for vertex in points.flat_map(|point| [point.vertex, point.edge[0], point.edge[1]]) {
            if vertex as usize >= given {
                return Err(far(vertex));
            }
        }
    }
    // What other seams of the scene do not name belongs to one that names none.
    let taken: Vec<u32> = seams.iter().flat_map(|(_, seam)| seam.file_seams.clone()).collect();
    for (index, seam) in seams {
        let key = format!("seam[{index}]");
        let stitches = if seam.file {
            if of_file.is_empty() {
                let problem = "asks for the stitches of the mesh file, which has none: give it lines `stitch`, or name vertices";
                return Err(check.error(&format!("{key}.file"), problem));
            }
            let of_file = file_stitches((check, &key), seam, (&of_file, &taken))?;
            // Who drew the garment is not here to mend it: where seams meet, such files stitch neighbours to each other.
            let (of_file, left_out) = without_lost_edges(&mut cutter, &of_file);
            if !left_out.is_empty() {
                notes.push(format!(
                    "cloth {name:?}: stitches of vertices {left_out:?} of its file are left out, as they would take the length of an edge; a gap as long as that stays there"
                ));
            }
            points(check, &format!("{key}.file"), &mut cutter, &of_file)?
        } else if let Some(groups) = &seam.lines {
            lines(check, &key, &mut cutter, (seam, groups))?
        } else if !seam.points.is_empty() {
            let list = seam.points.iter().enumerate();
            let mut given = Vec::with_capacity(seam.points.len());
            for (number, point) in list {
                check.share(&format!("{key}.points[{number}].place"), point.place)?;
                let crate::SceneSeamPoint { vertex, edge, place } = *point;
                given.push(MeshStitch { vertex, edge, place, seam: 0 });
            }
            points(check, &format!("{key}.points"), &mut cutter, &given)?
        } else {
            seam.stitches.clone()
        };
        all.push((index, stitches));
    }
    cutter.tips_open();
    let bands = elastic::bands((scene, check), name, &cutter)?;
    Ok(Sewn { stitches: all, bands })
}

/// The stitches of a file that belong to a seam of the scene.
fn file_stitches(
    (check, key): (&Check<'_>, &str),
    seam: &SceneSeam,
    (of_file, taken): (&[MeshStitch], &[u32]),
) -> Result<Vec<MeshStitch>, SceneError> {
    let key = format!("{key}.file_seams");
    if let Some(none) = seam.file_seams.iter().find(|n| of_file.iter().all(|s| s.seam != **n)) {
        let count = of_file.iter().map(|stitch| stitch.seam + 1).max().unwrap_or_default();
        let problem = format!(
            "names seam {none} of the mesh file, which has no stitch of it: they count from 0, and there are {count}"
        );
        return Err(check.error(&key, &problem));
    }
    let is_own = |stitch: &&MeshStitch| match seam.file_seams.is_empty() {
        true => !taken.contains(&stitch.seam),
        false => seam.file_seams.contains(&stitch.seam),
    };
    let own: Vec<MeshStitch> = of_file.iter().filter(is_own).copied().collect();
    if own.is_empty() {
        let problem =
            "is not given, and others name all seams of the mesh file: remove one of them";
        return Err(check.error(&key, problem));
    }
    Ok(own)
}

/// The stitches that leave all edges their length, and the vertices of those that do not.
fn without_lost_edges(
    cutter: &mut Cutter<'_>,
    stitches: &[MeshStitch],
) -> (Vec<MeshStitch>, Vec<u32>) {
    let (kept, left_out): (Vec<_>, Vec<_>) =
        stitches.iter().copied().partition(|stitch| cutter.joins(stitch));
    (kept, left_out.iter().map(|stitch| stitch.vertex).collect())
}

fn points(
    check: &Check<'_>,
    key: &str,
    cutter: &mut Cutter<'_>,
    stitches: &[MeshStitch],
) -> Result<Vec<[u32; 2]>, SceneError> {
    let mut found = Vec::with_capacity(stitches.len());
    for &MeshStitch { vertex, edge, place, .. } in stitches {
        let is_point = |edge: [u32; 2]| edge[0] == edge[1];
        if !is_point(edge) && !cutter.has_edge(edge) {
            let problem = format!(
                "stitches vertex {vertex} to the edge from {} to {}, which no triangle has: name the ends of an edge",
                edge[0], edge[1]
            );
            return Err(check.error(key, &problem));
        }
        let other = if is_point(edge) {
            cutter.join(vertex, edge[0]);
            edge[0]
        } else {
            cutter.point(vertex, edge, place)
        };
        found.push([vertex, other]);
    }
    Ok(found)
}

fn lines(
    check: &Check<'_>,
    key: &str,
    cutter: &mut Cutter<'_>,
    (seam, groups): (&SceneSeam, &[Vec<String>; 2]),
) -> Result<Vec<[u32; 2]>, SceneError> {
    let mut both = Vec::with_capacity(2);
    for (side, names) in groups.iter().enumerate() {
        both.push(line(check, &format!("{key}.lines[{side}]"), cutter, names)?);
    }
    let [first, second] = &mut both[..] else { return Ok(Vec::new()) };
    let at = |vertex: u32| DVec3::from(cutter.mesh().positions[vertex as usize]);
    if let (Some([a, b]), Some([c, d])) = (first.ends(), second.ends()) {
        let [straight, crossed] =
            [[c, d], [d, c]].map(|[c, d]| at(a).distance(at(c)) + at(b).distance(at(d)));
        if (crossed < straight) != seam.reverse {
            second.reverse();
        }
    }
    let lengths = [first.length(cutter), second.length(cutter)];
    let [short, long] = [lengths[0].min(lengths[1]), lengths[0].max(lengths[1])];
    let gather = seam.gather.unwrap_or(1.0);
    check.finite(&format!("{key}.gather"), &[gather])?;
    if gather < 1.0 {
        let problem = format!("is {gather}: how many times as long the longer line is, at least 1");
        return Err(check.error(&format!("{key}.gather"), &problem));
    }
    if short <= 0.0 || (long / short / gather - 1.0).abs() > EASE {
        let problem = format!(
            "are {:.4} m and {:.4} m long: give `gather = {:.3}` if one is to be gathered",
            lengths[0],
            lengths[1],
            long / short
        );
        return Err(check.error(&format!("{key}.lines"), &problem));
    }
    let lines = [first.clone(), second.clone()];
    Ok(line::stitches(cutter, &lines))
}

/// The line along the border through vertex groups with these names.
fn line(
    check: &Check<'_>,
    key: &str,
    cutter: &Cutter<'_>,
    names: &[String],
) -> Result<Line, SceneError> {
    if names.is_empty() {
        return Err(check.error(key, "is empty: name vertex groups along a border"));
    }
    let mut sets = Vec::with_capacity(names.len());
    for name in names {
        let Some(group) = cutter.mesh().group(name) else {
            let known = cutter.mesh().groups.iter().map(|group| group.name.clone()).collect();
            return Err(SceneUnknown::error(check.place(key), "group of the mesh", name, known));
        };
        sets.push(group.vertices.clone());
    }
    Line::new(cutter, &sets).map_err(|LineProblem::NoWay| {
        check.error(key, "is no way along the border: a group must hold all vertices from one end to the other, and no others")
    })
}

/// The seams for the model.
pub(super) fn compile(
    scene: &Scene,
    check: &Check<'_>,
    sewn: Sewn,
) -> Result<Vec<Seam>, SceneError> {
    let Sewn { stitches: mut within, bands } = sewn;
    let mut seams = Vec::with_capacity(scene.seams.len());
    let mut named = 0;
    // Where seams meet both have the same stitch.
    let mut seen = std::collections::HashSet::new();
    for (index, seam) in scene.seams.iter().enumerate() {
        let key = format!("seam[{index}]");
        let ways =
            [!seam.stitches.is_empty(), !seam.points.is_empty(), seam.lines.is_some(), seam.file];
        if ways.iter().filter(|is_given| **is_given).count() != 1 {
            let problem =
                "has to say where it is by one of `stitches`, `points`, `lines` and `file`";
            return Err(check.error(&key, problem));
        }
        if !seam.file && !seam.file_seams.is_empty() {
            let problem = "says which seams of a file are meant: give `file = true` with it";
            return Err(check.error(&format!("{key}.file_seams"), problem));
        }
        let Some(cloth) = cloth_of(scene, seam) else {
            return Err(check.error(&key, "does not say which cloth it is in: give `cloth`"));
        };
        for (name, key) in [(Some(cloth), "cloth"), (seam.to.as_deref(), "to")] {
            if let Some(name) = name.filter(|name| scene.cloths.iter().all(|c| c.name != **name)) {
                let known = scene.cloths.iter().map(|cloth| cloth.name.clone()).collect();
                let place = check.place(&format!("seam[{index}].{key}"));
                return Err(SceneUnknown::error(place, "cloth", name, known));
            }
        }
        if seam.to.is_some() && seam.stitches.is_empty() {
            let problem = "is another cloth, which is sewn by pairs of vertices: give `stitches`, or put both panels into one cloth";
            return Err(check.error(&format!("{key}.to"), problem));
        }
        let own = within.iter().position(|(number, _)| *number == index);
        let mut stitches = match own {
            Some(place) => within.swap_remove(place).1,
            None => seam.stitches.clone(),
        };
        named += stitches.len() as u64;
        if named > NAMED_MAX {
            let problem = format!("name more than {NAMED_MAX} stitches in all: name fewer");
            return Err(check.error(&key, &problem));
        }
        if seam.to.is_none() && stitches.iter().all(|[a, b]| a != b) {
            stitches.iter_mut().for_each(|stitch| stitch.sort_unstable());
            stitches.sort_unstable();
            stitches.dedup();
            stitches.retain(|stitch| seen.insert((cloth, *stitch)));
        }
        if let Some(strength) = seam.strength {
            check.positive(&format!("{key}.strength"), strength)?;
            if seam.end == SceneSeamEnd::Weld && seam.to.is_none() {
                let problem = "is of seams that are held, as what is welded is one cloth: give `end = \"hold\"`, or remove it";
                return Err(check.error(&format!("{key}.strength"), problem));
            }
        }
        let other = seam.to.as_deref().unwrap_or(cloth);
        seams.push(Seam {
            name: seam.name.clone(),
            cloths: [cloth.to_owned(), other.to_owned()],
            stitches,
            stiffness: seam.stiffness,
            damping: seam.damping,
            closing: seam.close,
            weld: seam.end == SceneSeamEnd::Weld && seam.to.is_none(),
            ties: Vec::new(),
            strength: seam.strength,
        });
    }
    seams.extend(elastic::compile(scene, check, bands)?);
    Ok(seams)
}
