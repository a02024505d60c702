//! NUMERICS §15: contact between triangles, forces and proof.
//!
//! [`tree`] has boxes around groups of triangles, [`pairs`] the list of pairs of features that may touch or meet, with the proof that
//! it is complete. What a contact is and does, and how ways are certified, is in `cloth_core::contact`.

mod pairs;
mod tree;

use cloth_core::{
    ContactStatistics, Error, ImplicitSettings, Integrator, LinearMethod, LinearSettings,
    MatrixForm, Model, NewtonStart, Preconditioner, Real, Result, SelfContact, SolverConfig, State,
    contact::{
        Candidate, Certifier, ContactLaw, ContactMotion, ContactSet, ContactSlip, ContactSurface,
        Contacts,
    },
};
use rayon::prelude::*;

use self::{
    pairs::{ListSearch, PairList},
    tree::Tree,
};
use crate::memory::{FieldView, Masses, Motion, VectorField};

/// Refuses settings for which contact of triangles has no matrix of the form that they need.
pub(crate) fn check(model: &Model, config: &SolverConfig) -> Result<()> {
    let Integrator::Implicit(ImplicitSettings { linear, .. }) = &config.integrator else {
        return Ok(());
    };
    if !model.has_triangle_contact() {
        return Ok(());
    }
    let unsupported = |what: String| {
        let feature = format!("contact of triangles with {what}");
        Err(Error::Unsupported { backend: "cpu", feature })
    };
    let LinearSettings { method, preconditioner, matrix, .. } = linear;
    if *method == LinearMethod::Direct {
        return unsupported(format!("the linear solver {method} (it has conjugate-gradient)"));
    }
    if *preconditioner == Preconditioner::IncompleteCholesky {
        return unsupported(format!("the preconditioner {preconditioner} (it has block)"));
    }
    if *matrix == MatrixForm::Assembled {
        return unsupported(format!("the matrix form {matrix} (it has matrix-free)"));
    }
    Ok(())
}

/// Contact of the triangles of a model.
#[derive(Debug)]
pub(crate) struct TriangleContact<T> {
    contact: SelfContact,
    surface: ContactSurface,
    tree: Tree<T>,
    list: PairList<T>,
    set: ContactSet<T>,
    certifier: Certifier<T>,
    /// Present positions \[m\].
    position: Vec<[T; 3]>,
    /// Another set of positions: those at the start of a substep, or where particles will be.
    other: Vec<[T; 3]>,
    newton: NewtonStart,
    statistics: ContactStatistics,
}

/// Contacts in a task.
const TASK: usize = 512;

impl<T: Real> TriangleContact<T> {
    /// That of a model, if its triangles touch.
    pub(crate) fn new(model: &Model) -> Option<Self> {
        let contact = *model.self_contact().filter(|contact| contact.is_of_triangles())?;
        let surface = ContactSurface::new(model, &contact);
        let count = model.particle_count();
        Some(Self {
            tree: Tree::new(&surface),
            list: PairList::new(contact.distance),
            set: ContactSet::new(count),
            certifier: Certifier::new(count),
            position: Vec::new(),
            other: Vec::new(),
            newton: NewtonStart::StepStart,
            statistics: ContactStatistics::default(),
            surface,
            contact,
        })
    }

    /// `contact_pairs`: completes the list for contacts at these positions, and in what is likely to follow.
    pub(crate) fn pairs(&mut self, motion: &Motion<T>, length: T) -> Result<()> {
        read(&motion.position, &mut self.position);
        if !self.list.holds(&self.position, T::from_f64(self.surface.reach())) {
            read(&motion.velocity, &mut self.other);
            for (other, x) in self.other.iter_mut().zip(&self.position) {
                *other = std::array::from_fn(|k| x[k] + length * other[k]);
            }
            let sets = [&*self.position, &*self.other];
            self.list.build((&self.surface, &mut self.tree), sets, true)?;
        }
        Ok(())
    }

    /// `contact_geometry`, after `pairs` of the same positions: contacts and what they do.
    pub(crate) fn geometry(
        &mut self,
        (motion, start): (&Motion<T>, &VectorField<T>),
        (inverse_mass, length): (&[T], f64),
        integrator: &Integrator,
        newton: NewtonStart,
    ) {
        self.newton = newton;
        let law = ContactLaw::new(&self.contact, integrator, length);
        self.set.stencils_set(law, self.list.contacts(&self.surface, &self.position));
        let (velocity, start) = (FieldView::new(&motion.velocity), FieldView::new(start));
        let position = &self.position;
        let motion = ContactMotion {
            position: |i: u32| position[i as usize],
            velocity: |i: u32| velocity.get(i as usize),
            start: |i: u32| start.get(i as usize),
            inverse_mass: |i: u32| inverse_mass[i as usize],
        };
        let set = &self.set;
        let all = (0..set.stencils().len()).into_par_iter().with_min_len(TASK);
        let states = all.filter_map(|contact| set.state(contact, &motion, newton)).collect();
        self.set.states_set(states);
        self.statistics.contacts = self.set.stencils().len() as u64;
    }

    /// Whether anything touches.
    pub(crate) fn any(&self) -> bool {
        !self.set.stencils().is_empty()
    }

    /// The force on a particle \[N\], if it touches anything.
    #[inline(always)]
    pub(crate) fn force(&self, particle: usize) -> Option<[T; 3]> {
        self.set.touches(particle).then(|| self.set.force_on(particle))
    }

    /// The contacts, and what the present system is linearised about.
    pub(crate) const fn set(&self) -> (&ContactSet<T>, NewtonStart) {
        (&self.set, self.newton)
    }

    /// `contact_certify`: shortens the ways from `start` of particles that are free.
    pub(crate) fn certify(
        &mut self,
        motion: &mut Motion<T>,
        start: &VectorField<T>,
        masses: &Masses<T>,
        length: T,
    ) -> Result<()> {
        let Self { surface, tree, list, position, other, certifier, set, statistics, .. } = self;
        read(start, other);
        read(&motion.position, position);
        let mut search = ListSearch { surface, tree, list };
        let is_held = |i: u32| masses.is_held(i as usize);
        let changed = certifier.certify(&mut search, other, position, is_held)?;
        statistics.truncated += changed;
        if changed > 0 {
            for (i, end) in position.iter().enumerate() {
                let wanted = motion.position.get(i);
                if *end != wanted && !masses.is_held(i) {
                    let v = motion.velocity.get(i);
                    let v = std::array::from_fn(|k| v[k] + (end[k] - wanted[k]) / length);
                    motion.velocity.set(i, v);
                    motion.position.set(i, *end);
                }
            }
        }
        set.settle(|i| position[i as usize], |i| other[i as usize]);
        Ok(())
    }

    /// A state has been given from outside.
    pub(crate) fn state_write(&mut self, state: &State) {
        self.certifier.positions_given();
        self.set.slips_write(&state.slips);
    }

    /// How far contacts have slipped.
    pub(crate) fn slips_read(&self, out: &mut Vec<ContactSlip>) {
        self.set.slips_read(out);
    }

    /// `state_keep`.
    pub(crate) fn keep(&mut self) {
        self.set.keep();
    }

    /// `state_restore`.
    pub(crate) fn restore(&mut self) {
        self.set.restore();
    }

    pub(crate) fn contacts_read(&self, out: &mut Contacts) {
        self.set.read(out);
    }

    /// The pairs of the list, ascending.
    pub(crate) fn list_read(&self, out: &mut Vec<Candidate>) {
        out.extend(self.list.pairs().map(|pair| pair.candidate));
        out.sort_unstable();
    }

    /// Counts since the last call.
    pub(crate) fn statistics(&mut self) -> ContactStatistics {
        ContactStatistics {
            candidates: self.list.len(),
            rebuilds: std::mem::take(&mut self.list.rebuilds),
            truncated: std::mem::take(&mut self.statistics.truncated),
            exempt: self.certifier.exempt().len() as u64,
            ..self.statistics
        }
    }
}

/// Vectors one by one.
fn read<T: Real>(field: &VectorField<T>, out: &mut Vec<[T; 3]>) {
    let view = FieldView::new(field);
    out.clear();
    out.extend((0..field.count()).map(|i| view.get(i)));
}
