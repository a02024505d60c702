//! The implicit system of a patch of fabric, by the CUDA kernels that assemble it and multiply by its matrix.

use std::{fs, process::Command, sync::Arc};

use cloth_core::{
    Backend, FabricTerms, Integrator, LinearVector, MatrixForm, Model, Neighbours, NewtonStart,
    SlicedRows, SolverConfig, State,
    contact::{ContactLaw, ContactMotion, ContactSet, ContactSurface},
    stepper::Substep,
};
use cloth_kernels::CudaModule;
use harness::{backends::cpu, bits::first_difference, checks::PatchFrames};

use crate::{compiler, replaced, scene};

/// Shared parts that these kernels do without.
const NOT_HERE: [&str; 4] = ["ptx", "sum", "schwarz", "solve"];
/// Length of the step \[s\].
const LENGTH: f64 = 0.01;

/// A folded patch in motion, and where its velocities were at the start of the step.
fn patch(triangles: bool) -> (Arc<Model>, State, State) {
    // A ball would be a body with nodes of its own.
    let explicit = PatchFrames::explicit([29, 23]);
    let patch = PatchFrames { triangles, fabric: true, collider: !triangles, ..explicit };
    let model = patch.model().expect("the patch is a model");
    let mut state = patch.start(&model);
    if !triangles {
        // Some threads jam.
        state.positions.iter_mut().for_each(|x| x[0] *= 1.14);
    }
    let positions = state.positions.clone();
    for (velocity, [x, y, z]) in state.velocities.iter_mut().zip(positions) {
        *velocity = [3.0 * y - z, 2.0 * x * y, 5.0 * x - y * y];
    }
    let mut before = state.clone();
    before.velocities.iter_mut().for_each(|velocity| velocity[2] += 0.125);
    if triangles {
        // Contacts have slipped since the start of the substep.
        for (x, v) in before.positions.iter_mut().zip(&state.velocities) {
            *x = std::array::from_fn(|k| x[k] - 2e-3 * v[k]);
        }
    }
    (model, state, before)
}

/// What the program reads. Threads take turns in an order drawn by lot with `seed`, or one after the other with 0.
fn words(
    model: &Model,
    [state, before]: [&State; 2],
    (start, seed): (NewtonStart, u32),
) -> Vec<u32> {
    let neighbours = Neighbours::new(&model.interactions().of_fabric());
    let rows = SlicedRows::new(&neighbours);
    let FabricTerms { offsets, terms } = FabricTerms::new(model.elements(), &rows);
    let folds = model.elements().folds().iter();
    let from_start = u32::from(start == NewtonStart::StepStart);
    let mut words = vec![model.particle_count() as u32, from_start, seed];
    let bits = |number: f64| (number as f32).to_bits();
    words.push(bits(LENGTH));
    words.extend(model.uniform_acceleration().map(bits));
    words.extend(scene::fabric(model));
    let masses = || model.masses().iter();
    let vectors = |vectors: &[[f64; 3]], fourth: &mut dyn Iterator<Item = u32>| {
        let with = |(&[x, y, z], w): (&[f64; 3], u32)| [bits(x), bits(y), bits(z), w];
        vectors.iter().zip(fourth).flat_map(with).collect::<Vec<_>>()
    };
    let inverse =
        |(&mass, &held): (&f64, &u8)| (if held == 0 { 1.0 / mass as f32 } else { 0.0 }).to_bits();
    let lists = [
        rows.slices,
        rows.columns,
        folds.flat_map(|fold| [fold.stiffness, fold.damping]).map(bits).collect(),
        offsets,
        terms,
        vectors(&state.positions, &mut masses().zip(&state.held).map(inverse)),
        vectors(&state.velocities, &mut masses().map(|&mass| bits(mass))),
        vectors(&before.velocities, &mut masses().map(|&mass| bits(mass))),
    ];
    let lists = lists.into_iter().chain(contacts(model, [state, before], start));
    words.extend(lists.flat_map(|list| [vec![list.len() as u32], list].concat()));
    words
}

/// Where the contacts of each particle are, and the contacts, by the functions that all backends share.
fn contacts(model: &Model, [state, before]: [&State; 2], start: NewtonStart) -> [Vec<u32>; 3] {
    let Some(contact) = model.self_contact() else { return [vec![], vec![], vec![]] };
    let surface = ContactSurface::new(model, contact);
    let single = |vectors: &[[f64; 3]]| -> Vec<[f32; 3]> {
        vectors.iter().map(|v| v.map(|x| x as f32)).collect()
    };
    let (x, v) = (single(&state.positions), single(&state.velocities));
    let from = single(&before.positions);
    let at = |i: u32| x[i as usize];
    let found = surface.candidates().map(|candidate| surface.contact(candidate, at));
    let found: Vec<_> = found.collect();
    let mut set = ContactSet::new(model.particle_count());
    let integrator = Integrator::Implicit(cloth_core::ImplicitSettings::default());
    let law = ContactLaw::new(&integrator, LENGTH, LENGTH);
    let inverse = |i: u32| {
        let is_held = state.held[i as usize] != 0;
        if is_held { 0.0 } else { 1.0 / model.masses()[i as usize] as f32 }
    };
    let velocity = |i: u32| v[i as usize];
    let from = |i: u32| from[i as usize];
    let motion = ContactMotion { position: at, velocity, start: from, inverse_mass: inverse };
    set.find(&law, &found, &motion, start);
    assert!(set.states().iter().any(|state| state.action.sticks));
    assert!(set.states().iter().any(|state| !state.action.sticks));
    let (offsets, places) = set.rows();
    let contacts = set.stencils().iter().zip(set.states()).flat_map(|(stencil, state)| {
        let action = &state.action;
        let numbers = stencil.weights.iter().chain(&action.rows).chain(&action.force);
        let numbers = numbers.chain(&[0.0; 3]).map(|number| number.to_bits());
        stencil.particles.into_iter().chain(numbers).collect::<Vec<_>>()
    });
    [offsets.to_vec(), places.to_vec(), contacts.collect()]
}

/// Right-hand side and its product with the matrix, by the kernels, their text changed by `edit`.
fn by_kernels(words: &[u32], edit: impl Fn(String) -> String) -> State {
    let find = |name| CudaModule::find(name).expect("the module exists");
    let first = find("implicit_assemble");
    let mut text = first
        .compose_with(Vec::new(), &NOT_HERE.map(|part| (part, "")))
        .expect("the module has no options");
    for name in [
        "membrane_linearise",
        "bending_forces",
        "bending_linearise",
        "matrix_apply",
        "contact_forces",
        "contact_linearise",
    ] {
        text += find(name).file();
    }
    let text = edit(text);
    let program = compiler::program(&format!(
        "#include \"runtime.h\"\n{text}\n{}\n",
        include_str!("linear.h")
    ));
    let folder = tempfile::tempdir().expect("there is room for temporary files");
    let [input, output] = ["input", "output"].map(|name| folder.path().join(name));
    fs::write(&input, bytemuck::cast_slice(words)).expect("the input can be written");
    let ran = Command::new(program).args([&input, &output]).status().expect("the program starts");
    assert!(ran.success(), "the program ended with {ran}");
    let bytes = fs::read(&output).expect("the output is there");
    scene::state(&bytemuck::pod_collect_to_vec::<u8, [f32; 4]>(&bytes))
}

/// The same by the CPU.
fn by_cpu(model: &Arc<Model>, [state, before]: [&State; 2], start: NewtonStart) -> State {
    let config = SolverConfig {
        time_step: LENGTH,
        integrator: Integrator::Implicit(cloth_core::ImplicitSettings::default()),
        ..SolverConfig::default()
    };
    let substep = Substep { length: LENGTH, step: 1, ..Substep::default() };
    let mut kernels = cpu(2).create_kernels(model.clone(), &config).expect("the CPU takes fabric");
    let mut run = || -> cloth_core::Result<State> {
        kernels.state_write(before)?;
        kernels.state_keep()?;
        kernels.start_keep()?;
        // That of the start is kept.
        kernels.velocity_add(0.0)?;
        kernels.state_write(state)?;
        kernels.field_forces()?;
        kernels.spring_linearise(&substep)?;
        kernels.membrane_linearise(&substep, start)?;
        kernels.bending_linearise(&substep, start)?;
        if model.has_triangle_contact() {
            kernels.contact_pairs(&substep)?;
            kernels.contact_geometry(&substep, start)?;
            kernels.contact_forces()?;
            kernels.contact_linearise(&substep)?;
        }
        kernels.implicit_assemble(&substep, start)?;
        kernels.matrix_apply(
            MatrixForm::MatrixFree,
            LinearVector::RightSide,
            LinearVector::Image,
        )?;
        let mut found = State { held: state.held.clone(), ..State::default() };
        kernels.vector_read(LinearVector::RightSide, &mut found.positions)?;
        kernels.vector_read(LinearVector::Image, &mut found.velocities)?;
        Ok(found)
    };
    run().expect("the CPU assembles the system")
}

#[test]
fn systems_of_fabric() {
    let (model, state, before) = patch(false);
    let states = [&state, &before];
    for (start, seed) in [(NewtonStart::StepStart, 0), (NewtonStart::Iterate, 7)] {
        let expected = by_cpu(&model, states, start);
        let words = words(&model, states, (start, seed));
        let found = by_kernels(&words, |text| text);
        assert_eq!(first_difference(&expected, &found), None, "{start:?}");
    }
    let start = NewtonStart::StepStart;
    let (expected, words) = (by_cpu(&model, states, start), words(&model, states, (start, 0)));
    // A block that is not turned around, a negative eigenvalue that stays, a vector of the wrong vertex, threads that jam too softly, a weight without its
    // root, damping left out, a block of the wrong row.
    for (right, wrong) in [
        ("is_below ? block.entries[n % 3][n / 3] :", "is_below ? block.entries[n / 3][n % 3] :"),
        ("if (largest <= 0) return {0, 0, 0};", "if (largest <= 0) return s;"),
        ("xyz(tangent[term >> 2 & 3])", "xyz(tangent[term >> 2 & 1])"),
        (
            "component(other, n % 3) * component(own, n / 3)",
            "component(own, n % 3) * component(other, n / 3)",
        ),
        ("at.slope = steep + steep;", "at.slope = steep;"),
        ("weight = root((l.length * l.length)", "weight = ((l.length * l.length)"),
        (" + l.length * stiffness.y)", ")"),
    ] {
        let found = by_kernels(&words, |text| replaced(&text, right, wrong));
        assert!(first_difference(&expected, &found).is_some(), "`{wrong}` is not found");
    }
}

#[test]
fn systems_in_contact() {
    let (model, state, before) = patch(true);
    let states = [&state, &before];
    for (start, seed) in [(NewtonStart::StepStart, 0), (NewtonStart::Iterate, 7)] {
        let expected = by_cpu(&model, states, start);
        let words = words(&model, states, (start, seed));
        let found = by_kernels(&words, |text| text);
        assert_eq!(first_difference(&expected, &found), None, "{start:?}");
    }
    let start = NewtonStart::StepStart;
    let (expected, words) = (by_cpu(&model, states, start), words(&model, states, (start, 0)));
    // The weight of another particle, a block that is not symmetric, velocities that move nothing, a force without its weight, a solve whose terms
    // are in the wrong rows.
    for (right, wrong) in [
        ("w[2] * c) + w[3] * d", "w[3] * c) + w[2] * d"),
        ("m[3] * v.x + m[1] * v.y", "m[4] * v.x + m[1] * v.y"),
        ("right + negative(sum)", "right + (real)0 * (sum)"),
        ("sum + contact.weights[table.places[k] % 4] * make_vec3", "sum + make_vec3"),
        ("table.ranks[4 * c + a]", "table.ranks[4 * c]"),
    ] {
        let found = by_kernels(&words, |text| replaced(&text, right, wrong));
        assert!(first_difference(&expected, &found).is_some(), "`{wrong}` is not found");
    }
}
