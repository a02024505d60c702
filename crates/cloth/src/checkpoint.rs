//! Saving where a simulation is.
//!
//! Layout, little endian: magic `CLOTHCKP`, version u32, bits of the precision u32, fingerprint of
//! the model u64, frame u64, step u64, time \[s\] f64, particle count n u64, collider count c u64,
//! halvings of the adaptive time step u32, good substeps in a row u32 (both not in version 1), size r of the
//! rigid bodies in bytes u64 (not in versions 1 and 2), fingerprint of the colliders u64 (not in versions 1 to 3), number of slips s of contacts u64 (not in versions 1 to 4), number of ghosts g u64 (not in versions 1 to 5),
//! number of broken stitches and torn edges b u64 (not in versions 1 to 6);
//! n positions \[m\] and n velocities \[m/s\] of 3 x f64, n held flags u8, c poses of 7 x f64, s slips (kind, first and second number of the contact u32, slip \[m\] 3 x f64),
//! g ghosts (particle u32, whether it is guided u32, two anchors: nodes 3 x u32, whether there is one u32, weights 3 x f64, height \[m\] f64), b numbers of stitches u32, or of torn edges, which have bit 31 set, r bytes of
//! [`RigidWorld::snapshot`](cloth_rigid::RigidWorld::snapshot); CRC-32 of all that u32. Version 3 has a number of rigid bodies in
//! place of r, and 13 x f64 for each, from which they cannot go on.

use std::{
    io::{self, BufReader, Read, Seek, Write},
    path::{Path, PathBuf},
};

use cloth_core::{
    Model, ModelError, Pose, Precision, State,
    contact::{ContactKey, ContactKind, ContactSlip, Ghost, GhostAnchor},
};
use cloth_io::{file_open, file_replace};

const MAGIC: &[u8; 8] = b"CLOTHCKP";
/// Size of the header by version, from 1.
const HEADER_SIZES: [u64; CHECKPOINT_VERSION as usize] = [64, 72, 80, 88, 96, 104, 112];
const CHECKSUM_SIZE: u64 = 4;
const PARTICLE_SIZE: u64 = 24 + 24 + 1;
const COLLIDER_SIZE: u64 = 56;
/// Size of what friction remembers of a contact.
const SLIP_SIZE: u64 = 36;
/// Size of a broken stitch and of a torn edge.
const STITCH_SIZE: u64 = 4;
/// What makes a number that of a torn edge.
const TORN: u32 = 1 << 31;
/// Size of a ghost.
const GHOST_SIZE: u64 = 8 + ANCHORS as u64 * 48;
/// Anchors of a ghost in a file.
const ANCHORS: usize = 2;
/// Slips for each particle at most: a file that asks for more is none of a run.
const SLIPS_MAX: u64 = 4096;
/// Size of a body in version 3.
const BODY_SIZE: u64 = 104;

/// Frames and substeps of the longest run: counters beyond it are damage, and would overflow.
const PROGRESS_MAX: u64 = 1 << 53;

/// What rigid bodies may take of a checkpoint: so much \[byte\], and more for each collider, many times what a body and its contacts do.
/// A file that asks for more is none of a run, however long it is.
const RIGID_BASE: u64 = 1 << 24;
const RIGID_COLLIDER: u64 = 1 << 18;

/// Version of the checkpoint format that this build writes. It reads this one and all before.
pub const CHECKPOINT_VERSION: u32 = 7;

/// A moment of a simulation, from which it can be continued.
///
/// A checkpoint belongs to a model, not to a scene: time step, number of frames and events can be
/// changed before it is continued.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// [`Model::fingerprint`] of the model.
    pub fingerprint: u64,
    /// Precision of the solver.
    pub precision: Precision,
    /// Frames computed since the start of the scene.
    pub frame: u64,
    /// The state at the end of that frame.
    pub state: State,
    /// [`Model::collider_fingerprint`] of the model; not known of a checkpoint of an earlier version.
    pub collider_fingerprint: Option<u64>,
    /// Stitches of the model that have broken, ascending.
    pub broken: Vec<u32>,
    /// Edges of the model that are torn, ascending.
    pub torn: Vec<u32>,
    /// The rigid bodies then, as [`RigidWorld::snapshot`](cloth_rigid::RigidWorld::snapshot) puts them down; empty
    /// if there are none, and in checkpoints of earlier versions.
    pub rigid: Vec<u8>,
}

/// A checkpoint that cannot be written or continued.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// The operating system could not write the file.
    #[error(
        "cannot write checkpoint `{}` ({source}); check free space and permissions",
        file.display()
    )]
    Write {
        /// The file.
        file: PathBuf,
        /// Reason given by the operating system.
        source: io::Error,
    },
    /// The operating system could not read the file.
    #[error("cannot read checkpoint `{}` ({source}); start again without it", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Reason given by the operating system.
        source: io::Error,
    },
    /// The file is something else.
    #[error("`{}` is not a checkpoint; give a file that a run wrote", file.display())]
    Magic {
        /// The file.
        file: PathBuf,
    },
    /// The file has another format version.
    #[error(
        "checkpoint `{}` has format version {found} but this program reads 1 to {CHECKPOINT_VERSION}; \
         continue with the program that wrote it, or start again without it",
        file.display()
    )]
    Version {
        /// The file.
        file: PathBuf,
        /// Its version.
        found: u32,
    },
    /// The file is shorter or longer than its header says.
    #[error(
        "checkpoint `{}` is truncated or damaged: it has {found} bytes, its header asks for \
         {expected}; start again without it",
        file.display()
    )]
    Truncated {
        /// The file.
        file: PathBuf,
        /// Bytes it has.
        found: u64,
        /// Bytes it should have; at least the size of a header.
        expected: u64,
    },
    /// The bytes are not those that were written.
    #[error(
        "checkpoint `{}` is damaged: its checksum is {expected:08x} but its content has \
         {found:08x}; start again without it",
        file.display()
    )]
    Checksum {
        /// The file.
        file: PathBuf,
        /// Checksum of the content.
        found: u32,
        /// Checksum in the file.
        expected: u32,
    },
    /// The model has another number of particles or colliders.
    #[error(
        "checkpoint `{}` has {found} {what} but the scene has {expected}; continue with the scene \
         that it was written for, or start again without it",
        file.display()
    )]
    Count {
        /// The file.
        file: PathBuf,
        /// `particles`, `colliders`, `slips of contacts`, or `bytes of rigid bodies`.
        what: &'static str,
        /// How many the file has.
        found: u64,
        /// How many the model has.
        expected: u64,
    },
    /// The run is longer than any can be.
    #[error(
        "checkpoint `{}` was written after {found} {what}, which no run has; start again without it",
        file.display()
    )]
    Progress {
        /// The file.
        file: PathBuf,
        /// `frames` or `substeps`.
        what: &'static str,
        /// How many the file has.
        found: u64,
    },
    /// The model is another one of the same size.
    #[error(
        "checkpoint `{}` was written for another model (fingerprint {found:016x}, this scene has \
         {expected:016x}); continue with the scene that it was written for, or start again without \
         it",
        file.display()
    )]
    Model {
        /// The file.
        file: PathBuf,
        /// Fingerprint in the file.
        found: u64,
        /// Fingerprint of the model.
        expected: u64,
    },
    /// The model has other colliders, as many as before.
    #[error(
        "checkpoint `{}` was written with other colliders (fingerprint {found:016x}, this scene has \
         {expected:016x}): one has another shape, place, friction or restitution; continue with the scene \
         that it was written for, or start again without it",
        file.display()
    )]
    Colliders {
        /// The file.
        file: PathBuf,
        /// Fingerprint in the file.
        found: u64,
        /// Fingerprint of the colliders of the model.
        expected: u64,
    },
    /// The run had another precision, so that it would not continue with the same bits.
    #[error(
        "checkpoint `{}` was written in precision {found} but this run has {expected}; continue \
         with precision {found}, or start again without it",
        file.display()
    )]
    Precision {
        /// The file.
        file: PathBuf,
        /// Precision in the file.
        found: String,
        /// Precision of this run.
        expected: Precision,
    },
    /// A number is not finite, or a rotation is none.
    #[error("checkpoint `{}` cannot be continued: {source}; start again without it", file.display())]
    State {
        /// The file.
        file: PathBuf,
        /// The number.
        source: ModelError,
    },
}

impl Checkpoint {
    /// Writes the checkpoint to `path`, through a temporary file: an earlier one stays until this
    /// one is complete.
    ///
    /// # Errors
    /// [`CheckpointError::Write`].
    pub fn write(&self, path: &Path) -> Result<(), CheckpointError> {
        file_replace(path, |file| {
            let mut writer = ChecksumWriter { writer: file, hasher: crc32fast::Hasher::new() };
            self.content(&mut writer)?;
            let checksum = writer.hasher.finalize();
            writer.writer.write_all(&checksum.to_le_bytes())
        })
        .map_err(|source| CheckpointError::Write { file: path.to_owned(), source })
    }

    fn content(&self, writer: &mut impl Write) -> io::Result<()> {
        let state = &self.state;
        writer.write_all(MAGIC)?;
        writer.write_all(&CHECKPOINT_VERSION.to_le_bytes())?;
        writer.write_all(&precision_bits(self.precision).to_le_bytes())?;
        let counts = [state.positions.len() as u64, state.colliders.len() as u64];
        for word in [self.fingerprint, self.frame, state.step, state.time.to_bits()]
            .into_iter()
            .chain(counts)
        {
            writer.write_all(&word.to_le_bytes())?;
        }
        for word in [state.time_step_halvings, state.time_step_good] {
            writer.write_all(&word.to_le_bytes())?;
        }
        writer.write_all(&(self.rigid.len() as u64).to_le_bytes())?;
        writer.write_all(&self.collider_fingerprint.unwrap_or_default().to_le_bytes())?;
        let gone = self.broken.len() + self.torn.len();
        for count in [state.slips.len(), state.ghosts.len(), gone] {
            writer.write_all(&(count as u64).to_le_bytes())?;
        }
        for number in state.positions.iter().chain(&state.velocities).flatten() {
            writer.write_all(&number.to_le_bytes())?;
        }
        writer.write_all(&state.held)?;
        for pose in &state.colliders {
            pose_write(writer, pose)?;
        }
        for slip in &state.slips {
            slip_write(writer, slip)?;
        }
        for ghost in &state.ghosts {
            ghost_write(writer, ghost)?;
        }
        let torn = self.torn.iter().map(|edge| edge | TORN);
        for gone in self.broken.iter().copied().chain(torn) {
            writer.write_all(&gone.to_le_bytes())?;
        }
        writer.write_all(&self.rigid)
    }

    /// Reads how the particles of `model` lie and move in a checkpoint of any run with as many, to start another run from: colliders,
    /// precision and time may be others.
    ///
    /// # Errors
    /// A [`CheckpointError`]; each of its cases says what does not fit.
    pub fn read_start(path: &Path, model: &Model) -> Result<State, CheckpointError> {
        let file = || path.to_owned();
        let read_error = |source| CheckpointError::Read { file: file(), source };
        let opened = file_open(path).map_err(read_error)?;
        let size = opened.metadata().map_err(read_error)?.len();
        let mut reader = BufReader::with_capacity(1 << 18, opened);
        let header = Header::read(path, &mut reader, size)?;
        header.check_counts(path, model, false)?;
        checksum_check(path, &mut reader, size)?;
        reader.seek(io::SeekFrom::Start(header.size)).map_err(read_error)?;
        let found = header.state(&mut reader).map_err(read_error)?;
        let mut state = model.initial_state();
        state.positions = found.positions;
        for ((own, found), held) in
            state.velocities.iter_mut().zip(found.velocities).zip(&state.held)
        {
            *own = if *held == 0 { found } else { [0.0; 3] };
        }
        state.validate(model).map_err(|source| CheckpointError::State { file: file(), source })?;
        Ok(state)
    }

    /// Reads the checkpoint in `path` and checks that a solver of `model` in `precision` can
    /// continue it.
    ///
    /// # Errors
    /// A [`CheckpointError`]; each of its cases says what does not fit.
    pub fn read(path: &Path, model: &Model, precision: Precision) -> Result<Self, CheckpointError> {
        let file = || path.to_owned();
        let read_error = |source| CheckpointError::Read { file: file(), source };
        let opened = file_open(path).map_err(read_error)?;
        let size = opened.metadata().map_err(read_error)?.len();
        let mut reader = BufReader::with_capacity(1 << 18, opened);

        let header = Header::read(path, &mut reader, size)?;
        // Before all of the file is read, which can be as long as it likes.
        header.check_counts(path, model, true)?;
        checksum_check(path, &mut reader, size)?;
        header.check(path, model, precision)?;

        reader.seek(io::SeekFrom::Start(header.size)).map_err(read_error)?;
        let state = header.state(&mut reader).map_err(read_error)?;
        let (mut broken, mut torn) = (Vec::new(), Vec::new());
        for _ in 0..header.broken {
            match u32::from_le_bytes(bytes(&mut reader).map_err(read_error)?) {
                edge if edge & TORN != 0 => torn.push(edge & !TORN),
                stitch => broken.push(stitch),
            }
        }
        for gone in [&mut broken, &mut torn] {
            gone.sort_unstable();
            gone.dedup();
        }
        let mut rigid = Vec::new();
        let room = rigid.try_reserve_exact(header.rigid as usize);
        room.map_err(|_| read_error(io::ErrorKind::OutOfMemory.into()))?;
        reader.take(header.rigid).read_to_end(&mut rigid).map_err(read_error)?;
        state.validate(model).map_err(|source| CheckpointError::State { file: file(), source })?;
        let Header { fingerprint, collider_fingerprint, frame, .. } = header;
        Ok(Self { fingerprint, precision, frame, state, collider_fingerprint, broken, torn, rigid })
    }
}

/// The fixed part of the file.
struct Header {
    /// Its size in this version of the format \[byte\].
    size: u64,
    precision_bits: u32,
    fingerprint: u64,
    frame: u64,
    step: u64,
    time: f64,
    particles: u64,
    colliders: u64,
    time_step_halvings: u32,
    time_step_good: u32,
    /// Bytes of the rigid bodies.
    rigid: u64,
    collider_fingerprint: Option<u64>,
    /// Slips of contacts.
    slips: u64,
    ghosts: u64,
    /// Broken stitches and torn edges.
    broken: u64,
}

impl Header {
    /// Reads the header, and checks that a file of `size` bytes is what it describes: only then can
    /// its counts be believed.
    fn read(path: &Path, reader: &mut impl Read, size: u64) -> Result<Self, CheckpointError> {
        let file = || path.to_owned();
        let read_error = |source| CheckpointError::Read { file: file(), source };
        let mut magic = [0; 8];
        let magic_size = size.min(8) as usize;
        reader.read_exact(&mut magic[..magic_size]).map_err(read_error)?;
        if size == 0 || magic[..magic_size] != MAGIC[..magic_size] {
            return Err(CheckpointError::Magic { file: file() });
        }
        let truncated =
            |expected| CheckpointError::Truncated { file: file(), found: size, expected };
        if size < HEADER_SIZES[0] + CHECKSUM_SIZE {
            return Err(truncated(HEADER_SIZES[0] + CHECKSUM_SIZE));
        }
        let version = u32::from_le_bytes(bytes(reader).map_err(read_error)?);
        let header_size = version.checked_sub(1).and_then(|i| HEADER_SIZES.get(i as usize));
        let Some(&header_size) = header_size else {
            return Err(CheckpointError::Version { file: file(), found: version });
        };
        if size < header_size + CHECKSUM_SIZE {
            return Err(truncated(header_size + CHECKSUM_SIZE));
        }
        let precision_bits = u32::from_le_bytes(bytes(reader).map_err(read_error)?);
        let mut word = || bytes(reader).map(u64::from_le_bytes).map_err(read_error);
        let mut header = Self {
            size: header_size,
            precision_bits,
            fingerprint: word()?,
            frame: word()?,
            step: word()?,
            time: f64::from_bits(word()?),
            particles: word()?,
            colliders: word()?,
            time_step_halvings: 0,
            time_step_good: 0,
            rigid: 0,
            collider_fingerprint: None,
            slips: 0,
            ghosts: 0,
            broken: 0,
        };
        if version > 1 {
            let mut count = || bytes(reader).map(u32::from_le_bytes).map_err(read_error);
            header.time_step_halvings = count()?;
            header.time_step_good = count()?;
        }
        // Version 3 counts bodies, which are passed over.
        let mut passed = 0_u64;
        if version > 2 {
            let count = bytes(reader).map(u64::from_le_bytes).map_err(read_error)?;
            if version == 3 {
                passed = count.saturating_mul(BODY_SIZE);
            } else {
                header.rigid = count;
            }
        }
        if version > 3 {
            header.collider_fingerprint =
                Some(bytes(reader).map(u64::from_le_bytes).map_err(read_error)?);
        }
        if version > 4 {
            header.slips = bytes(reader).map(u64::from_le_bytes).map_err(read_error)?;
        }
        if version > 5 {
            header.ghosts = bytes(reader).map(u64::from_le_bytes).map_err(read_error)?;
        }
        if version > 6 {
            header.broken = bytes(reader).map(u64::from_le_bytes).map_err(read_error)?;
        }
        let particles = header.particles.saturating_mul(PARTICLE_SIZE);
        let colliders = header.colliders.saturating_mul(COLLIDER_SIZE);
        let slips = header.slips.saturating_mul(SLIP_SIZE);
        let ghosts = header.ghosts.saturating_mul(GHOST_SIZE);
        let broken = header.broken.saturating_mul(STITCH_SIZE);
        let rigid = header.rigid.saturating_add(passed);
        let content = [colliders, slips, ghosts, broken, rigid]
            .into_iter()
            .fold(particles, u64::saturating_add);
        let expected = content.saturating_add(header_size + CHECKSUM_SIZE);
        if size == expected { Ok(header) } else { Err(truncated(expected)) }
    }

    /// Checks that the state has the size of one of `model`, and the run a length that it can have.
    fn check_counts(
        &self,
        path: &Path,
        model: &Model,
        with_colliders: bool,
    ) -> Result<(), CheckpointError> {
        let file = || path.to_owned();
        for (what, found, expected) in [
            ("particles", self.particles, model.particle_count() as u64),
            ("colliders", self.colliders, model.colliders().len() as u64),
        ] {
            if found != expected && (with_colliders || what != "colliders") {
                return Err(CheckpointError::Count { file: file(), what, found, expected });
            }
        }
        for (what, found) in [("frames", self.frame), ("substeps", self.step)] {
            if found > PROGRESS_MAX {
                return Err(CheckpointError::Progress { file: file(), what, found });
            }
        }
        let most = RIGID_BASE.saturating_add(self.colliders.saturating_mul(RIGID_COLLIDER));
        if self.rigid > most {
            let what = "bytes of rigid bodies";
            let (found, expected) = (self.rigid, most);
            return Err(CheckpointError::Count { file: file(), what, found, expected });
        }
        let most = self.particles.saturating_mul(SLIPS_MAX);
        if self.slips > most {
            let (found, expected) = (self.slips, most);
            let what = "slips of contacts";
            return Err(CheckpointError::Count { file: file(), what, found, expected });
        }
        let most = (model.seams().stitches().len() + model.tears().edges().len()) as u64;
        if with_colliders && self.broken > most {
            let (found, expected, what) = (self.broken, most, "broken stitches and torn edges");
            return Err(CheckpointError::Count { file: file(), what, found, expected });
        }
        if self.ghosts > self.particles {
            let (found, expected) = (self.ghosts, self.particles);
            let what = "ghosts";
            return Err(CheckpointError::Count { file: file(), what, found, expected });
        }
        Ok(())
    }

    /// Checks that the state belongs to `model`.
    fn check(
        &self,
        path: &Path,
        model: &Model,
        precision: Precision,
    ) -> Result<(), CheckpointError> {
        let file = || path.to_owned();
        let expected = model.fingerprint();
        if self.fingerprint != expected {
            let found = self.fingerprint;
            return Err(CheckpointError::Model { file: file(), found, expected });
        }
        let expected = model.collider_fingerprint();
        if let Some(found) = self.collider_fingerprint.filter(|found| *found != expected) {
            return Err(CheckpointError::Colliders { file: file(), found, expected });
        }
        if self.precision_bits != precision_bits(precision) {
            let found = format!("f{}", self.precision_bits);
            return Err(CheckpointError::Precision { file: file(), found, expected: precision });
        }
        Ok(())
    }

    fn state(&self, reader: &mut impl Read) -> io::Result<State> {
        let particles = self.particles as usize;
        let mut state = State {
            time: self.time,
            step: self.step,
            time_step_halvings: self.time_step_halvings,
            time_step_good: self.time_step_good,
            ..State::default()
        };
        for array in [&mut state.positions, &mut state.velocities] {
            array.reserve_exact(particles);
            for _ in 0..particles {
                array.push(vector(reader)?);
            }
        }
        state.held = vec![0; particles];
        reader.read_exact(&mut state.held)?;
        for _ in 0..self.colliders {
            state.colliders.push(pose(reader)?);
        }
        for _ in 0..self.slips {
            state.slips.push(slip(reader)?);
        }
        for _ in 0..self.ghosts {
            state.ghosts.push(ghost(reader)?);
        }
        Ok(state)
    }
}

const fn precision_bits(precision: Precision) -> u32 {
    match precision {
        Precision::F32 => 32,
        Precision::F64 => 64,
    }
}

fn bytes<const N: usize>(reader: &mut impl Read) -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    reader.read_exact(&mut bytes)?;
    Ok(bytes)
}

fn pose_write(writer: &mut impl Write, pose: &Pose) -> io::Result<()> {
    for number in pose.translation.iter().chain(&pose.rotation) {
        writer.write_all(&number.to_le_bytes())?;
    }
    Ok(())
}

fn pose(reader: &mut impl Read) -> io::Result<Pose> {
    let translation = vector(reader)?;
    let [x, y, z] = vector(reader)?;
    Ok(Pose { translation, rotation: [x, y, z, number(reader)?] })
}

fn slip_write(writer: &mut impl Write, ContactSlip { key, slip }: &ContactSlip) -> io::Result<()> {
    let kind = ContactKind::ALL.iter().position(|kind| *kind == key.kind).unwrap_or_default();
    for number in [kind as u32, key.first, key.second] {
        writer.write_all(&number.to_le_bytes())?;
    }
    slip.iter().try_for_each(|number| writer.write_all(&number.to_le_bytes()))
}

fn slip(reader: &mut impl Read) -> io::Result<ContactSlip> {
    let mut word = || bytes(reader).map(u32::from_le_bytes);
    let (kind, first, second) = (word()?, word()?, word()?);
    let kind = ContactKind::ALL.get(kind as usize);
    let kind = *kind.ok_or(io::Error::new(io::ErrorKind::InvalidData, "a contact of no kind"))?;
    Ok(ContactSlip { key: ContactKey { kind, first, second }, slip: vector(reader)? })
}

fn ghost_write(writer: &mut impl Write, ghost: &Ghost) -> io::Result<()> {
    for word in [ghost.particle, u32::from(ghost.is_guided)] {
        writer.write_all(&word.to_le_bytes())?;
    }
    let none = GhostAnchor { nodes: [0; 3], weights: [0.0; 3], height: 0.0 };
    for place in 0..ANCHORS {
        let found = ghost.anchors.get(place);
        let anchor = found.unwrap_or(&none);
        for word in anchor.nodes.into_iter().chain([u32::from(found.is_some())]) {
            writer.write_all(&word.to_le_bytes())?;
        }
        for number in anchor.weights.into_iter().chain([anchor.height]) {
            writer.write_all(&number.to_le_bytes())?;
        }
    }
    Ok(())
}

fn ghost(reader: &mut impl Read) -> io::Result<Ghost> {
    fn word(reader: &mut impl Read) -> io::Result<u32> {
        bytes(reader).map(u32::from_le_bytes)
    }
    let (particle, is_guided) = (word(reader)?, word(reader)? != 0);
    let mut anchors = Vec::new();
    for _ in 0..ANCHORS {
        let nodes = [word(reader)?, word(reader)?, word(reader)?];
        let is_one = word(reader)? != 0;
        let (weights, height) = (vector(reader)?, number(reader)?);
        anchors.extend(is_one.then_some(GhostAnchor { nodes, weights, height }));
    }
    Ok(Ghost { particle, is_guided, anchors })
}

fn vector(reader: &mut impl Read) -> io::Result<[f64; 3]> {
    Ok([number(reader)?, number(reader)?, number(reader)?])
}

fn number(reader: &mut impl Read) -> io::Result<f64> {
    bytes(reader).map(f64::from_le_bytes)
}

/// Checks that a file of `size` bytes has the checksum that its end says.
fn checksum_check(
    path: &Path,
    reader: &mut (impl Read + Seek),
    size: u64,
) -> Result<(), CheckpointError> {
    let read_error = |source| CheckpointError::Read { file: path.to_owned(), source };
    reader.rewind().map_err(read_error)?;
    let [found, expected] = checksums(reader, size).map_err(read_error)?;
    if found == expected {
        return Ok(());
    }
    Err(CheckpointError::Checksum { file: path.to_owned(), found, expected })
}

/// Checksum of a file of `size` bytes as its content has it, and as its end says.
fn checksums(reader: &mut impl Read, size: u64) -> io::Result<[u32; 2]> {
    let mut hasher = crc32fast::Hasher::new();
    let mut buffer = vec![0; 1 << 16];
    let mut left = size - CHECKSUM_SIZE;
    while left > 0 {
        let part = left.min(buffer.len() as u64) as usize;
        reader.read_exact(&mut buffer[..part])?;
        hasher.update(&buffer[..part]);
        left -= part as u64;
    }
    Ok([hasher.finalize(), u32::from_le_bytes(bytes(reader)?)])
}

struct ChecksumWriter<W> {
    writer: W,
    hasher: crc32fast::Hasher,
}

impl<W: Write> Write for ChecksumWriter<W> {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let written = self.writer.write(buffer)?;
        self.hasher.update(&buffer[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}
