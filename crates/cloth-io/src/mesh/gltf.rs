//! glTF 2.0: `.gltf` with embedded or external buffers, and `.glb`.

use std::collections::{HashMap, HashSet};
use std::path::Path;
use std::rc::Rc;

use cloth_core::TriangleMesh;
use glam::{DMat4, DVec3};
use gltf::mesh::Mode;
use gltf::{Accessor, Document, Gltf, Mesh, Node, Primitive, Semantic};

use super::assembly::{Corner, MeshAssembly};
use super::gltf_accessor::GltfData;
use super::gltf_attribute::{AttributeMeans, chooses};
use super::gltf_buffer::gltf_buffers;
use super::{MESH_COUNT_MAX, MeshError, MeshPlace};

/// Reads all triangle meshes of the default scene of a glTF 2.0 file from `bytes`; `file` is the
/// name used in errors, `folder` the place of external buffers (`None` refuses them).
///
/// Node transforms are applied, and the axes of the format, y up, become those of the engine, z up.
/// Exporters split vertices along texture seams and hard edges, so
/// within one node vertices with bitwise equal positions become one vertex again, and each corner
/// keeps its own texture coordinate. Each node with a mesh gives one vertex group. The colours
/// `COLOR_0` become the attributes `red`, `green`, `blue` and `alpha`, an attribute of the application
/// such as `_PIN` becomes `pin`; where vertices become one, the mean holds.
///
/// # Errors
///
/// [`MeshError`], see [`mesh_read`](crate::mesh_read).
pub fn mesh_read_gltf(
    file: &str,
    bytes: &[u8],
    folder: Option<&Path>,
) -> Result<TriangleMesh, MeshError> {
    let gltf = document(file, bytes)?;
    let nodes = mesh_nodes(file, &gltf.document)?;
    let held =
        gltf.buffers().fold(0, |sum: u64, buffer| sum.saturating_add(buffer.length() as u64));
    copies_check(file, &nodes, held)?;
    let meshes = nodes.iter().filter_map(|(node, _)| node.mesh());
    let buffers = gltf_buffers(file, &gltf, meshes, folder)?;
    let mut reader = GltfReader {
        file,
        data: GltfData { file, buffers },
        assembly: MeshAssembly::new(MeshPlace::Face, 0),
        face_count: 0,
        names: HashMap::new(),
        attributes: AttributeMeans::default(),
    };
    for (node, transform) in nodes {
        reader.node(&node, transform)?;
    }
    reader.assembly.attributes = reader.attributes.finish(reader.assembly.positions.len());
    reader.assembly.finish(file)
}

pub(super) fn syntax(file: &str, problem: String) -> MeshError {
    MeshError::Syntax { file: file.to_owned(), place: MeshPlace::File, problem }
}

/// Parses and validates the document. The library trusts two numbers, so they are checked first.
fn document(file: &str, bytes: &[u8]) -> Result<Gltf, MeshError> {
    const GLB_HEADER_SIZE: u32 = 12;
    if bytes.starts_with(b"glTF") {
        let length = bytes.get(8..12).and_then(|bytes| bytes.try_into().ok());
        if length.is_none_or(|length| u32::from_le_bytes(length) < GLB_HEADER_SIZE) {
            return Err(syntax(file, "the header is cut off".to_owned()));
        }
    }
    let library_error = |error: gltf::Error| syntax(file, error.to_string());
    let Gltf { document, blob } =
        Gltf::from_slice_without_validation(bytes).map_err(library_error)?;
    let json = document.into_json();
    let primitives = json.meshes.iter().flat_map(|mesh| &mesh.primitives);
    for accessor in primitives.flat_map(|primitive| primitive.attributes.values()) {
        if accessor.value() >= json.accessors.len() {
            let problem = format!("accessor {} does not exist", accessor.value());
            return Err(syntax(file, problem));
        }
    }
    let document = Document::from_json(json).map_err(library_error)?;
    Ok(Gltf { document, blob })
}

/// The nodes with meshes of the default scene, or of all roots if there is no scene, with their
/// transforms to the scene.
fn mesh_nodes<'a>(file: &str, document: &'a Document) -> Result<Vec<(Node<'a>, DMat4)>, MeshError> {
    let scene = document.default_scene().or_else(|| document.scenes().next());
    let roots: Vec<Node<'a>> = match scene {
        Some(scene) => scene.nodes().collect(),
        None => {
            let mut is_child = vec![false; document.nodes().len()];
            for child in document.nodes().flat_map(|node| node.children()) {
                is_child[child.index()] = true;
            }
            let is_root = |node: &Node<'_>| !is_child[node.index()];
            document.nodes().filter(is_root).collect()
        }
    };
    let mut seen = vec![false; document.nodes().len()];
    let mut found = Vec::new();
    let mut open: Vec<_> = roots.into_iter().rev().map(|node| (node, DMat4::IDENTITY)).collect();
    while let Some((node, parent)) = open.pop() {
        // The format wants trees, but a damaged file can hold a cycle.
        if std::mem::replace(&mut seen[node.index()], true) {
            let problem = format!("node {} is reached on two ways", node.index());
            return Err(syntax(file, problem));
        }
        let local = node.transform().matrix();
        let transform =
            parent * DMat4::from_cols_array_2d(&local.map(|column| column.map(f64::from)));
        let children: Vec<_> = node.children().collect();
        open.extend(children.into_iter().rev().map(|child| (child, transform)));
        if node.mesh().is_some() {
            found.push((node, transform));
        }
    }
    Ok(found)
}

/// What the copies of meshes may have together, of vertices as of corners of triangles: a file of a few
/// kilobytes can place one mesh any number of times.
const COPIES_MAX: u64 = 1 << 20;

/// Counts what the nodes ask for, before memory is taken for it. The buffers hold `held` bytes: what exceeds
/// one corner or vertex a byte is read more than once, by primitives or accessors that share bytes, and so is a copy.
fn copies_check(file: &str, nodes: &[(Node<'_>, DMat4)], held: u64) -> Result<(), MeshError> {
    let mut sizes: HashMap<usize, [u64; 2]> = HashMap::new();
    let mut copies = [0_u64; 2];
    let mut whole = [0_u64; 2];
    for (node, _) in nodes {
        let Some(mesh) = node.mesh() else { continue };
        let known = sizes.get(&mesh.index()).copied();
        let size = known.unwrap_or_else(|| mesh_size(&mesh));
        sizes.insert(mesh.index(), size);
        let sum = if known.is_some() { &mut copies } else { &mut whole };
        *sum = [0, 1].map(|i| sum[i].saturating_add(size[i]));
    }
    let whats = [["vertices", "vertices in copies"], ["corners", "corners in copies"]];
    for (i, [of_all, of_copies]) in whats.into_iter().enumerate() {
        let most = [MESH_COUNT_MAX, 3 * MESH_COUNT_MAX][i].min(held.saturating_add(COPIES_MAX));
        for (what, count, limit) in
            [(of_copies, copies[i], COPIES_MAX), (of_all, whole[i].saturating_add(copies[i]), most)]
        {
            if count > limit {
                let file = file.to_owned();
                return Err(MeshError::TooLarge { file, what, declared: count, limit });
            }
        }
    }
    Ok(())
}

/// Numbers of vertices that are read for a mesh, and its corners, each at least the number of its primitives, which take time too.
fn mesh_size(mesh: &Mesh<'_>) -> [u64; 2] {
    let mut seen = HashSet::new();
    let mut size = [0_u64; 2];
    for primitive in mesh.primitives() {
        let positions = primitive.get(&Semantic::Positions);
        let count = |accessor: &Accessor<'_>| accessor.count() as u64;
        let vertices = positions.as_ref().map_or(0, count);
        let corners = primitive.indices().as_ref().map_or(vertices, count);
        // Primitives of one mesh often share their vertices, which are then read once.
        let mut own = [0, corners];
        let at = positions.map(|accessor| accessor.index());
        for (semantic, accessor) in primitive.attributes() {
            let read = matches!(semantic, Semantic::Positions | Semantic::TexCoords(0));
            if (read || chooses(&semantic)) && seen.insert((at, accessor.index())) {
                own[0] = own[0].saturating_add(count(&accessor));
            }
        }
        size = [0, 1].map(|i| size[i].saturating_add(own[i].max(1)));
    }
    size
}

struct GltfReader<'file> {
    file: &'file str,
    data: GltfData<'file>,
    assembly: MeshAssembly,
    face_count: usize,
    /// How often each group name was used, to keep names unique.
    names: HashMap<String, usize>,
    /// Of the vertices so far.
    attributes: AttributeMeans,
}

/// The vertices of one node. Primitives can share accessors, which are read once.
#[derive(Default)]
struct NodeVertices {
    /// Vertex by the bits of its position.
    weld: HashMap<[u64; 3], i64>,
    /// Vertices by accessor of positions.
    welded: HashMap<usize, Rc<[i64]>>,
    /// Start and count by accessor of texture coordinates.
    textured: HashMap<usize, [usize; 2]>,
    /// Accessors of attributes, with those of positions and their names, that were read.
    attributes: HashSet<((Option<usize>, usize), String)>,
}

impl GltfReader<'_> {
    fn node(&mut self, node: &Node<'_>, transform: DMat4) -> Result<(), MeshError> {
        let Some(mesh) = node.mesh() else {
            return Ok(());
        };
        let name = node.name().or(mesh.name()).map(str::to_owned);
        let name = name.unwrap_or_else(|| format!("node {}", node.index()));
        let name = self.unique(name);
        let name = self.assembly.name(self.file, &name)?;
        self.assembly.groups_begin(vec![name]);
        let mut own = NodeVertices::default();
        for primitive in mesh.primitives() {
            self.primitive(&primitive, transform, &mut own)?;
        }
        Ok(())
    }

    fn unique(&mut self, name: String) -> String {
        let used = self.names.entry(name.clone()).or_insert(0);
        *used += 1;
        match *used {
            1 => name,
            used => format!("{name}.{used}"),
        }
    }

    fn primitive(
        &mut self,
        primitive: &Primitive<'_>,
        transform: DMat4,
        own: &mut NodeVertices,
    ) -> Result<(), MeshError> {
        let mode = primitive.mode();
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            return Ok(());
        }
        let welded = self.welded(primitive, transform, own)?;
        self.attributes(primitive, &welded, own)?;
        let indices = self.data.indices(primitive, welded.len())?;
        let [texture_start, texture_count] = self.textured(primitive, own)?;

        // A mirroring transform turns triangles inside out.
        let mirrored = transform.determinant() < 0.0;
        for triangle in triangles(mode, &indices) {
            let [a, b, c] = triangle;
            let triangle = if mirrored { [a, c, b] } else { triangle };
            let face = self.face_count;
            self.face_count += 1;
            let mut corners = [Corner { vertex: -1, texture: None }; 3];
            for (corner, index) in corners.iter_mut().zip(triangle) {
                let Some(&vertex) = welded.get(index as usize) else {
                    return Err(MeshError::Index {
                        file: self.file.to_owned(),
                        place: MeshPlace::Face(face),
                        what: "vertex",
                        index: index.into(),
                        count: welded.len(),
                    });
                };
                let textured = (index as usize) < texture_count;
                let texture = textured.then_some(texture_start as i64 + i64::from(index));
                *corner = Corner { vertex, texture };
            }
            self.assembly.polygon(self.file, face, &corners)?;
        }
        Ok(())
    }

    /// The vertex of the mesh for each position of a primitive.
    fn welded(
        &mut self,
        primitive: &Primitive<'_>,
        transform: DMat4,
        own: &mut NodeVertices,
    ) -> Result<Rc<[i64]>, MeshError> {
        let accessor = primitive.get(&Semantic::Positions).map(|accessor| accessor.index());
        if let Some(welded) = accessor.and_then(|accessor| own.welded.get(&accessor)) {
            return Ok(Rc::clone(welded));
        }
        let positions = self.data.positions(primitive)?;
        let vertex = |position| self.vertex(position, transform, &mut own.weld);
        let welded: Rc<[i64]> = positions.into_iter().map(vertex).collect();
        own.welded.extend(accessor.map(|accessor| (accessor, Rc::clone(&welded))));
        Ok(welded)
    }

    /// Adds the attributes of the vertices of a primitive.
    fn attributes(
        &mut self,
        primitive: &Primitive<'_>,
        welded: &[i64],
        own: &mut NodeVertices,
    ) -> Result<(), MeshError> {
        for (semantic, accessor) in primitive.attributes().filter(|(semantic, _)| chooses(semantic))
        {
            let pair = (primitive.get(&Semantic::Positions).map(|p| p.index()), accessor.index());
            if !own.attributes.insert((pair, semantic.to_string())) {
                continue;
            }
            for (name, values) in self.data.attribute(&semantic, &accessor) {
                self.attributes.add(self.file, name, welded, &values)?;
            }
        }
        Ok(())
    }

    /// Where the texture coordinates of a primitive start, and how many there are.
    fn textured(
        &mut self,
        primitive: &Primitive<'_>,
        own: &mut NodeVertices,
    ) -> Result<[usize; 2], MeshError> {
        let accessor = primitive.get(&Semantic::TexCoords(0)).map(|accessor| accessor.index());
        if let Some(&textured) = accessor.and_then(|accessor| own.textured.get(&accessor)) {
            return Ok(textured);
        }
        let start = self.assembly.coordinates.len();
        self.assembly
            .coordinates
            .extend(self.data.texture_coordinates(primitive)?.into_iter().flatten());
        let textured = [start, self.assembly.coordinates.len() - start];
        own.textured.extend(accessor.map(|accessor| (accessor, textured)));
        Ok(textured)
    }

    /// The index of the vertex at `position` within this node, new or welded.
    fn vertex(
        &mut self,
        position: [f32; 3],
        transform: DMat4,
        weld: &mut HashMap<[u64; 3], i64>,
    ) -> i64 {
        let position = DVec3::from(position.map(f64::from));
        let DVec3 { x, y, z } = transform.transform_point3(position);
        // From y up to z up. Adding zero makes the two zeros one.
        let position = (DVec3::new(x, -z, y) + DVec3::ZERO).to_array();
        let positions = &mut self.assembly.positions;
        *weld.entry(position.map(f64::to_bits)).or_insert_with(|| {
            positions.push(position);
            positions.len() as i64 - 1
        })
    }
}

/// The triangles that `indices` draw in `mode`. Strips repeat vertices to jump, and those
/// degenerate triangles are part of the format, so they are left out.
fn triangles(mode: Mode, indices: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => indices
            .windows(3)
            .enumerate()
            .map(|(number, t)| match number % 2 {
                0 => [t[0], t[1], t[2]],
                _ => [t[1], t[0], t[2]],
            })
            .filter(|[a, b, c]| a != b && b != c && a != c)
            .collect(),
        Mode::TriangleFan => indices
            .get(1..)
            .unwrap_or_default()
            .windows(2)
            .map(|pair| [indices[0], pair[0], pair[1]])
            .collect(),
        _ => indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
    }
}
