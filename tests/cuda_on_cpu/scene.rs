//! What the program reads: 32-bit words, whole numbers and single precision numbers, in the order of `frame.h`.

use cloth_core::{
    ColliderShape, ColourRegions, Colouring, ContactResponse, FabricTriangle, Incidence,
    InteractionKind, Model, NONE, SelfContact, SpringColouring, State,
    fabric::{Fabric, Locking},
};
use harness::checks::PatchFrames;

/// Rows and columns to the later of 12 neighbours, as in `patch/stencil.cuh`.
const STENCIL: [[i64; 2]; 6] = [[0, 1], [0, 2], [1, -1], [1, 0], [1, 1], [2, 0]];

/// The words of a patch from its start on; regions of the strain limit have so many particles, or there are none.
pub(crate) fn words(patch: &PatchFrames, region: Option<usize>) -> Vec<u32> {
    let model = patch.model().expect("the patch is a model");
    let state = patch.start(&model);
    let mut words =
        vec![patch.columns, patch.rows, u32::from(patch.fabric), patch.frames.len() as u32];
    words.extend(patch.frames);
    let mut push = |numbers: &[f64]| words.extend(numbers.iter().map(|&a| (a as f32).to_bits()));
    push(&[patch.time_step()]);
    push(&model.uniform_acceleration());
    push(&model.drag_rate());
    push(&[0.5 * model.cloths()[0].thickness]);
    for kind in kinds(&model, i64::from(patch.columns)) {
        push(&kind);
    }
    let ball = &model.colliders()[0];
    let ColliderShape::Sphere { radius } = ball.shape else { panic!("the collider is a ball") };
    push(&ball.pose.translation);
    push(&[radius, ball.friction]);
    let contact = model.self_contact().map_or([0.0; 3], |contact| match contact.response {
        ContactResponse::Penalty { stiffness, damping } => [contact.distance, stiffness, damping],
        ContactResponse::Impulse { restitution, friction } => {
            [contact.distance, restitution, friction]
        }
        ContactResponse::Triangles { .. } => panic!("frames have no contact of triangles"),
    });
    push(&contact);
    push(&[SelfContact::recovery(patch.time_step())]);
    words.push(u32::from(patch.impulses));
    words.extend(limits(patch, &model, region));
    if patch.fabric {
        words.extend(fabric(&model));
    }
    let particles = state.positions.iter().zip(&state.held).zip(model.masses());
    words.extend(particles.flat_map(|((x, &held), &mass)| {
        let [x, y, z] = x.map(|a| a as f32);
        [x, y, z, if held == 0 { 1.0 / mass as f32 } else { 0.0 }].map(f32::to_bits)
    }));
    let particles = state.velocities.iter().zip(model.masses());
    words.extend(
        particles.flat_map(|(v, &mass)| [v[0], v[1], v[2], mass].map(|a| (a as f32).to_bits())),
    );
    let rest = model.positions().iter();
    words.extend(rest.flat_map(|&[x, y, z]| [x, y, z, 0.0].map(|a| (a as f32).to_bits())));
    words
}

/// The strain limit: sweeps and colours; for each kind the largest length; regions; then lists that begin with their lengths: the regions, their
/// particles, rows, springs of regions, springs by colour, where each colour begins, the same two of triangles; their largest stretch.
fn limits(patch: &PatchFrames, model: &Model, region: Option<usize>) -> Vec<u32> {
    let Some(limit) = patch.strain_limit() else { return vec![0] };
    let springs = model.springs();
    let count = model.particle_count();
    let colouring = SpringColouring::greedy(springs, count, &limit.classes);
    let regions = region.map_or_else(ColourRegions::default, |size| {
        let order = model.particle_groups(32);
        ColourRegions::new(&colouring, &order, size, count, count).expect("few colours")
    });
    let mut words = vec![limit.sweeps, colouring.len() as u32];
    let mut list = |entries: Vec<u32>| {
        words.push(entries.len() as u32);
        words.extend(entries);
    };
    let longest = |length: f64| (limit.ratio as f32 * length as f32).to_bits();
    list(springs.kinds().iter().map(|kind| longest(kind.rest_length)).collect());
    let headers = regions.regions.iter();
    list(headers.flat_map(|r| [r.first_particle, r.owned, r.particles, 0]).collect());
    list(regions.particles.clone());
    let colours = || (0..colouring.len()).map(|colour| colouring.colour(colour));
    let ends = colours().scan(0, |end, springs| {
        *end += springs.len() as u32;
        Some(*end)
    });
    list(regions.rows.clone());
    list(regions.springs.iter().flat_map(|&[i, j, kind]| [i | (j << 16), kind]).collect());
    list(colours().flatten().flat_map(|&[i, j, kind]| [i, j, kind, 0]).collect());
    list([0].into_iter().chain(ends).collect());
    let triangles = Colouring::of_triangles(model.elements().triangles(), count);
    let colours = || (0..triangles.len()).map(|colour| triangles.colour(colour));
    let ends = colours().scan(0, |end, triangles| {
        *end += triangles.len() as u32;
        Some(*end)
    });
    list(colours().flatten().copied().collect());
    list([0].into_iter().chain(ends).collect());
    words.push((limit.ratio as f32).to_bits());
    words
}

/// Triangles of fabric, as lists that begin with their lengths: laws, membranes, what patches make of their folds, and where the rows of
/// triangles around particles start and these rows; then the folds.
pub(crate) fn fabric(model: &Model) -> Vec<u32> {
    let elements = model.elements();
    let bits = |number: f64| (number as f32).to_bits();
    let law = |fabric: &Fabric| {
        let curves = [fabric.warp, fabric.weft];
        let curves = curves.iter().flat_map(|curve| [curve.linear, curve.cubic, curve.end]);
        let Locking { onset, range, rise } = fabric.locking();
        let others = [fabric.coupling, fabric.shear, fabric.damping[0], onset, range, rise];
        curves.chain(others).map(bits).collect::<Vec<_>>()
    };
    let membrane = |triangle: &FabricTriangle| {
        let rest = triangle.rest.inverse.into_iter().flatten().chain([triangle.rest.area]);
        let names = triangle.particles.into_iter().chain([triangle.fabric]);
        names.chain(rest.map(bits)).collect::<Vec<_>>()
    };
    let plate = |triangle: &FabricTriangle| {
        let damping = elements.fabrics()[triangle.fabric as usize].damping[1];
        let rooted = triangle.bending.rooted::<f32>().into_iter().flatten();
        rooted.chain([damping as f32]).map(f32::to_bits).collect::<Vec<_>>()
    };
    let triangles = elements.triangles();
    let mut lists: Vec<Vec<u32>> = vec![
        elements.fabrics().iter().flat_map(law).collect(),
        triangles.iter().flat_map(membrane).collect(),
        transposed(&triangles.iter().map(plate).collect::<Vec<_>>()),
    ];
    let interactions = model.interactions();
    let list = interactions.list(InteractionKind::Membrane).expect("there are triangles");
    let count = model.particle_count();
    let rows = Incidence::new(list, count);
    lists.extend([rows.offsets().to_vec(), rows.entries().to_vec()]);
    let (folds, of_patches) = (elements.folds(), elements.patch_folds());
    let vertices: Vec<_> = folds.iter().map(|fold| fold.particles).collect();
    let around = Incidence::of(&vertices, model.particle_count());
    let place = |place: u32| {
        let arity = of_patches[0].len() as u32;
        let none = arity * triangles.len() as u32;
        if place == NONE { none } else { place % arity * triangles.len() as u32 + place / arity }
    };
    let places: Vec<_> =
        elements.fold_places().iter().map(|places| places.map(place).to_vec()).collect();
    let none = folds.len() as u32;
    let there =
        |patch: &[u32; 9]| patch.map(|fold| if fold == NONE { none } else { fold }).to_vec();
    lists.extend([
        vertices.concat(),
        folds.iter().map(|fold| bits(fold.angle)).collect(),
        transposed(&of_patches.iter().map(there).collect::<Vec<_>>()),
        transposed(&places),
        around.offsets().to_vec(),
        around.entries().to_vec(),
    ]);
    lists.into_iter().flat_map(|list| [vec![list.len() as u32], list].concat()).collect()
}

/// The first number of each row, then the second ones.
fn transposed(rows: &[Vec<u32>]) -> Vec<u32> {
    (0..rows[0].len()).flat_map(|k| rows.iter().map(move |row| row[k])).collect()
}

/// Rest length, stiffness and damping of the springs to each of the later neighbours.
fn kinds(model: &Model, columns: i64) -> [[f64; 3]; 6] {
    let springs = model.springs();
    if springs.iter().next().is_none() {
        return [[0.0; 3]; 6];
    }
    STENCIL.map(|offset| {
        let is_this = |[i, j]: [u32; 2]| {
            let [[a, b], [c, d]] = [i, j].map(|i| [i64::from(i) / columns, i64::from(i) % columns]);
            [c - a, d - b] == offset
        };
        let spring = springs.iter().find(|spring| is_this(spring.particles));
        let kind = springs.kinds()[spring.expect("the patch has such a spring").kind as usize];
        [kind.rest_length, kind.stiffness, kind.damping]
    })
}

/// The state that the program has written, as positions with inverse masses and velocities with masses.
pub(crate) fn state(numbers: &[[f32; 4]]) -> State {
    let (positions, velocities) = numbers.split_at(numbers.len() / 2);
    let vectors = |numbers: &[[f32; 4]]| {
        numbers.iter().map(|&[x, y, z, _]| [x, y, z].map(f64::from)).collect()
    };
    State {
        positions: vectors(positions),
        velocities: vectors(velocities),
        held: positions.iter().map(|entry| u8::from(entry[3] == 0.0)).collect(),
        ..State::default()
    }
}
