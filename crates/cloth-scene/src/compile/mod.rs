//! From a description to what a solver runs.

mod animation;
mod attachment;
mod check;
mod choice;
mod cloth;
mod collider;
mod fabric;
mod fold;
mod grid;
mod mannequin;
mod map;
mod material;
mod memory;
mod memory_solver;
mod mesh;
mod mesh_vertices;
mod model_error;
mod network;
mod options;
mod panels;
mod phase;
mod pins;
mod recover;
mod rigid;
mod rigid_hold;
mod seam;
mod settings;
mod solid;
mod solver;
mod timeline;
mod welds;

use std::{borrow::Cow, path::PathBuf, sync::Arc};

use cloth_core::{
    ClothMaterial, ClothRange, Collider, Inflation, Integrator, Model, ModelBuilder, SolverConfig,
    TextureMap,
};
use cloth_rigid::{RigidBody, RigidJoint};

pub use choice::SolverChoice;
pub use memory::MemoryEstimate;
pub use options::{CompileOptions, CompileProgress};
pub use phase::CompiledPhase;
pub use rigid_hold::{HeldPoint, RigidHold};
pub use welds::Welds;

use crate::{
    Scene, SceneColour, SceneError, SceneGeometry, SceneShape, SceneStart, SceneView, Timeline,
};

use attachment::{Attachments, ClothSurfaces};
use check::Check;
use solid::Plans;

/// A scene that is ready to run.
#[derive(Clone, Debug)]
pub struct CompiledScene {
    /// Name of the scene.
    pub name: String,
    /// What it shows, in words.
    pub description: String,
    /// What is simulated.
    pub model: Arc<Model>,
    /// Folder of the run that it starts from, if it is not its own start.
    pub start: Option<PathBuf>,
    /// What is simulated instead of the model, where several of its particles are one.
    pub welds: Welds,
    /// Spans of time with settings of their own, one after the other from the start.
    pub phases: Vec<CompiledPhase>,
    /// Settings for the solver; threads are left to the caller.
    pub config: SolverConfig,
    /// Which solver this is, and what was chosen for the model because the scene does not say it.
    pub choice: SolverChoice,
    /// Number of frames.
    pub frames: u32,
    /// Frames in a second of simulated time \[Hz\].
    pub frames_per_second: f64,
    /// The control of every frame.
    pub timeline: Timeline,
    /// Camera for pictures, if the scene has one.
    pub view: Option<SceneView>,
    /// What pictures show of the colliders of the model, in their order.
    pub solids: Vec<CompiledSolid>,
    /// Bodies that move by themselves; each is also one of the colliders of the model, the last ones in
    /// the same order.
    pub rigids: Vec<RigidBody>,
    /// Constraints between these bodies.
    pub rigid_joints: Vec<RigidJoint>,
    /// What cloth these bodies hold.
    pub rigid_holds: Vec<RigidHold>,
    /// What the model does not keep of each cloth, in the order of the model's cloths.
    pub cloths: Vec<CompiledCloth>,
    /// What is worth knowing of how cloths were made: what was not measured of a fabric, faces that were divided.
    pub notes: Vec<String>,
    /// What is allowed but looks like a slip.
    pub warnings: Vec<String>,
}

/// What pictures show of a collider or rigid body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CompiledSolid {
    /// Its colour, if the scene gives one.
    pub colour: Option<SceneColour>,
    /// Whether they leave it out.
    pub hidden: bool,
}

/// What the model does not keep of a cloth.
#[derive(Clone, Debug, PartialEq)]
pub struct CompiledCloth {
    /// Its name.
    pub name: String,
    /// Its colour, if the scene gives one.
    pub colour: Option<SceneColour>,
    /// Columns and rows, if it is a grid.
    pub grid: Option<[u32; 2]>,
    /// What it is made of, with the values of its preset; springs of a network may have others.
    pub material: ClothMaterial,
    /// Mean distance of neighbouring particles \[m\], at which a preset gives the values of its springs.
    pub spacing: f64,
}

impl CompiledScene {
    /// What is simulated at the start: the model, or what it is while nothing of it is torn.
    #[must_use]
    pub fn simulated(&self) -> &Arc<Model> {
        self.welds.start().map_or(&self.model, |weld| &weld.model)
    }

    /// Texture coordinates of a cloth: those of its mesh, or for a grid (0, 0) at particle 0 to
    /// (1, 1) at the last. `None` for a mesh without, or if there is no such cloth.
    #[must_use]
    pub fn texture(&self, cloth: usize) -> Option<Cow<'_, TextureMap>> {
        let own = self.model.textures().get(cloth)?.as_ref();
        match (self.cloths.get(cloth)?.grid, own) {
            (Some([columns, rows]), None) => Some(Cow::Owned(grid::texture(columns, rows))),
            // The pattern of a grid of fabric is in metres.
            (Some(_), Some(pattern)) => Some(Cow::Owned(grid::texture_of_pattern(pattern))),
            (None, own) => own.map(Cow::Borrowed),
        }
    }
}

impl Scene {
    /// The folder of the run that a scene starts from.
    fn start_folder(&self, start: &SceneStart) -> PathBuf {
        let beside = self.origin.directory.join(&start.from);
        if beside.exists() { beside } else { PathBuf::from(&start.from) }
    }

    /// Checks the scene, reads its meshes and builds the model.
    ///
    /// # Errors
    /// A [`SceneError`] that names the file and, for a scene read from a file, the line: for values
    /// that make no sense, names that do not exist, meshes that cannot be read or are not allowed,
    /// and more memory than `options` allow.
    pub fn compile(&self, options: &CompileOptions) -> Result<CompiledScene, SceneError> {
        self.compile_watched(options, &|_| ())
    }

    /// The same. `progress` is told how far it is, again and again and from several threads, while the distances of
    /// solids are sampled, which takes the longest by far. All else that can be wrong is found before.
    ///
    /// # Errors
    /// As [`Self::compile`].
    pub fn compile_watched(
        &self,
        options: &CompileOptions,
        progress: &(dyn Fn(CompileProgress) + Sync),
    ) -> Result<CompiledScene, SceneError> {
        let check = Check::new(&self.origin);
        settings::simulation_check(self, &check)?;
        if let Some(view) = &self.view {
            settings::view_check(view, &check)?;
        }
        memory::check(self, options)?;
        let mut builder = settings::surroundings(self, &check, ModelBuilder::new())?;
        // Events name pins by sets of the geometry, which the model does not keep.
        let mut pin_sets = Vec::with_capacity(self.cloths.len());
        let mut cloths = Vec::with_capacity(self.cloths.len());
        let mut notes = Vec::new();
        let mut within = seam::Sewn::default();
        let mut surfaces = ClothSurfaces::default();
        for (index, described) in self.cloths.iter().enumerate() {
            let cloth::DescribedCloth { cloth, sets, stitches, contact, tear } =
                cloth::compile((self, &check), index, described, options, &mut notes)?;
            builder = contact.into_iter().fold(builder, ModelBuilder::contact_map);
            builder = tear.into_iter().fold(builder, ModelBuilder::tear);
            within.extend(stitches);
            cloths.push(CompiledCloth::new(described, &cloth));
            if let Some(inflate) = &described.inflate {
                let key = format!("cloth[{index}].inflate");
                check.finite(&format!("{key}.pressure"), &[inflate.pressure])?;
                check.finite(&format!("{key}.rise"), &inflate.rise)?;
                if matches!(described.geometry, SceneGeometry::Network(_)) {
                    let problem =
                        "needs triangles around the gas, and a network has none: remove it";
                    return Err(check.error(&key, problem));
                }
                let (cloth, rise) = (described.name.clone(), inflate.rise);
                builder = builder.inflation(Inflation { cloth, pressure: inflate.pressure, rise });
            }
            surfaces.add(self, &cloth);
            builder = builder.cloth(cloth);
            pin_sets.push(sets);
        }
        if let Some(contact) = settings::contact(self, &cloths, &mut notes) {
            if contact.is_of_triangles() {
                let elastic = self.colliders.iter().filter(|collider| collider.restitution > 0.0);
                notes.extend(elastic.map(|collider| {
                    format!("cloth in contact of triangles does not rebound: `restitution` of {:?} does nothing to it", collider.name)
                }));
            }
            builder = builder.self_contact(contact);
            let rules = self.contact.iter().flat_map(|contact| &contact.rules);
            builder = rules.map(settings::contact_rule).fold(builder, ModelBuilder::contact_rule);
        }
        let seams = seam::compile(self, &check, within)?;
        builder = seams.into_iter().fold(builder, ModelBuilder::seam);
        let mut plans = Plans::new(self);
        let mut colliders = Vec::with_capacity(self.colliders.len());
        for (index, collider) in self.colliders.iter().enumerate() {
            colliders.push(collider::compile(&check, index, collider, options, &mut plans)?);
        }
        let rigid::Bodies { bodies: rigids, joints: rigid_joints, solids } =
            rigid::compile(self, &check, &colliders, options, &mut plans)?;
        if !rigids.is_empty() {
            builder = builder.moved_bodies();
        }
        colliders.extend(solids);
        let Attachments { seams: ties, tracks, rigid_holds } =
            attachment::compile(self, &check, (&surfaces, &pin_sets), &colliders)?;
        builder = ties.into_iter().fold(builder, ModelBuilder::seam);
        let build = |builder: ModelBuilder, colliders: Vec<Collider>| {
            let model = colliders.into_iter().fold(builder, ModelBuilder::collider).build();
            let checked = model.and_then(|model| {
                model.precision_check(settings::precision(self))?;
                Ok(model)
            });
            checked.map_err(|error| model_error::place(self, error))
        };
        if !plans.is_empty() {
            // Built with drafts first: what is wrong with it is told before minutes are spent on distances.
            let model = build(builder.clone(), colliders.clone())?;
            timeline::compile(self, &check, &model, &pin_sets)?;
            plans.carry_out(&check, &mut colliders, progress)?;
        }
        let whole = colliders.iter().cloned().fold(builder.clone(), ModelBuilder::collider);
        let (model, recovered) = recover::recovered(self, build(builder, colliders)?);
        let welds = Welds::new(whole, &model).map_err(|error| model_error::sewn(self, error))?;
        let simulated: &Model = welds.start().map_or(&model, |weld| &weld.model);
        let of_cloth = |cloth: &ClothRange| {
            let name = cloth.name.clone();
            cloth
                .warnings
                .iter()
                .map(move |warning| format!("cloth {name:?}: {warning}"))
                .collect::<Vec<_>>()
        };
        let mut warnings: Vec<_> = simulated.cloths().iter().flat_map(of_cloth).collect();
        match recovered {
            Some(found) if found.after > 0 => warnings.push(format!(
                "cloth that intersects could not be pulled apart in {} rounds: {} of {} crossing edges are left; give its cloths layers, or mend the meshes",
                found.rounds, found.after, found.before
            )),
            Some(found) if found.before > 0 => notes.push(format!(
                "cloth that intersected was pulled apart: {} crossing edges in {} rounds; particles moved by {:.1} mm at most",
                found.before,
                found.rounds,
                1e3 * found.moved
            )),
            _ => {}
        }
        let no_air = self
            .cloths
            .iter()
            .filter(|cloth| self.wind.is_none() && cloth.material.aerodynamics.is_some());
        warnings.extend(no_air.map(|cloth| {
            format!(
                "cloth {:?}: `material.aerodynamics` does nothing without air: add `[wind]`, with `velocity = [0, 0, 0]` if the air is still",
                cloth.name
            )
        }));
        let planes = self.colliders.iter().filter(|c| matches!(c.shape, SceneShape::Plane { .. }));
        warnings.extend(planes.filter(|collider| collider.colour.is_some()).map(|collider| {
            format!(
                "collider {:?}: pictures show a plane as a floor of tiles, and not its `colour`: leave it out, or take a box",
                collider.name
            )
        }));
        let choice = SolverChoice::new(self, simulated);
        let config = settings::solver_config(self, &choice, Some(simulated))?;
        if matches!(config.integrator, Integrator::Midpoint(_)) && !model.colliders().is_empty() {
            warnings.push(
                "the midpoint integrator is for cloth that flies: colliders act after its step, and cloth that hits one is stretched; \
                 use `solver = \"implicit\"` for cloth on bodies"
                    .into(),
            );
        }
        let timeline = timeline::compile(self, &check, &model, &pin_sets)?.with_attachments(tracks);
        let phases = phase::compile(self, &check, &config)?;
        if !rigid_holds.is_empty() && !matches!(config.integrator, Integrator::Implicit(_)) {
            let problem = "holds cloth by a rigid body, which feels what the solver \"implicit\" says of the hold: give `solver = \"implicit\"`, or hold it by a collider";
            return Err(check.error("attachment", problem));
        }
        let solids = self.colliders.iter().map(|collider| (collider.colour, collider.hidden));
        let solids = solids.chain(self.rigids.iter().map(|rigid| (rigid.colour, rigid.hidden)));
        let solids = solids.map(|(colour, hidden)| CompiledSolid { colour, hidden }).collect();
        Ok(CompiledScene {
            start: self.start.as_ref().map(|start| self.start_folder(start)),
            welds,
            phases,
            name: self.name.clone(),
            description: self.description.clone(),
            model: Arc::new(model),
            config,
            choice,
            frames: self.simulation.frames,
            frames_per_second: self.simulation.frames_per_second,
            timeline,
            view: self.view,
            solids,
            rigids,
            rigid_joints,
            rigid_holds,
            cloths,
            notes,
            warnings,
        })
    }
}
