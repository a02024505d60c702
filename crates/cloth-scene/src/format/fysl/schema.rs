//! The elements of FYSL and the keys of a scene that they stand for: one table, which the reader and
//! the writer follow in opposite directions.

/// What an attribute or a text holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Any text.
    Text,
    /// One of these words.
    Word(&'static [&'static str]),
    /// A number.
    Number,
    /// A whole number from 0.
    Count,
    /// `true` or `false`.
    Switch,
    /// Words, separated by commas; a word of digits is an index.
    Words,
    /// So many numbers.
    Numbers(usize),
    /// A place, velocity or force: y and z change places between file and engine.
    Vector,
    /// An axis of rotation, an angular velocity or a torque: as a vector, and the sign changes, since
    /// left hands turn the other way.
    Axis,
    /// Any number of vectors.
    Vectors,
    /// Four of them.
    Corners,
    /// Any number of pairs of numbers.
    Pairs,
    /// Any number of triples of whole numbers.
    Faces,
    /// Positive and unique among the siblings; names an actor within the file alone.
    Id,
    /// The id of a particle of the same group.
    Particle,
    /// Rows of a rotation matrix; read alone.
    Matrix,
}

/// An attribute.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attribute {
    pub(super) name: &'static str,
    /// Path in the table of its element.
    pub(super) key: &'static str,
    pub(super) kind: Kind,
    pub(super) required: bool,
}

/// Where the values of an element belong.
#[derive(Clone, Copy, Debug)]
pub(super) enum Target {
    /// Into the table of the element around it.
    Inline,
    /// Into a table at this path.
    Table(&'static str),
    /// Into one more table of the array at this key, at a path inside it. Keys that start with `/` are
    /// those of the scene.
    Item(&'static str, &'static str),
    /// Its first attribute alone, into the array at this key.
    Value(&'static str),
}

/// An element.
#[derive(Debug)]
pub(super) struct Element {
    pub(super) tag: &'static str,
    pub(super) target: Target,
    pub(super) attributes: &'static [Attribute],
    pub(super) children: &'static [&'static Element],
    /// Key and kind of its text.
    pub(super) text: Option<(&'static str, Kind)>,
    /// A key that always has this value.
    pub(super) constant: Option<(&'static str, &'static str)>,
    /// Keys that must come from somewhere, and what to call them; exactly one of the values they can hold.
    pub(super) needs: &'static [(&'static str, &'static str)],
}

const fn required(name: &'static str, key: &'static str, kind: Kind) -> Attribute {
    Attribute { name, key, kind, required: true }
}

const fn optional(name: &'static str, key: &'static str, kind: Kind) -> Attribute {
    Attribute { name, key, kind, required: false }
}

const fn same(name: &'static str, kind: Kind) -> Attribute {
    optional(name, name, kind)
}

const EMPTY: Element = Element {
    tag: "",
    target: Target::Inline,
    attributes: &[],
    children: &[],
    text: None,
    constant: None,
    needs: &[],
};

const fn leaf(tag: &'static str, target: Target, attributes: &'static [Attribute]) -> Element {
    Element { tag, target, attributes, ..EMPTY }
}

use Kind::{
    Axis, Corners, Count, Faces, Id, Matrix, Number, Numbers, Pairs, Particle, Switch, Text,
    Vector, Vectors, Word, Words,
};
use Target::{Inline, Item, Table, Value};

pub(super) static ROOT: Element = Element {
    tag: "fysl",
    attributes: &[required("version", "", Word(&["1.0"]))],
    children: &[&SCENE, &SIMULATION, &ACTORS, &JOINTS, &FEEDBACK],
    ..EMPTY
};

static SCENE: Element = Element {
    tag: "scene",
    attributes: &[
        required("name", "name", Text),
        same("description", Text),
        optional("units", "", Word(&["SI"])),
        same("gravity", Vector),
        optional("frame_rate", "simulation.frames_per_second", Number),
    ],
    children: &[&BOUNDS, &VIEW, &WIND, &CONTACT],
    ..EMPTY
};
static BOUNDS: Element = leaf(
    "bounds",
    Table("bounds"),
    &[required("min", "min", Vector), required("max", "max", Vector)],
);
static VIEW: Element = Element {
    tag: "view",
    target: Table("view"),
    attributes: &[
        required("eye", "eye", Vector),
        required("target", "target", Vector),
        same("field_of_view", Number),
        same("strain", Number),
        same("threads", Switch),
    ],
    children: &[&DUST],
    ..EMPTY
};
static DUST: Element = leaf(
    "dust",
    Table("dust"),
    &[
        required("count", "count", Count),
        required("min", "min", Vector),
        required("max", "max", Vector),
        required("lifetime", "lifetime", Number),
    ],
);
static WIND: Element = Element {
    tag: "wind",
    target: Table("wind"),
    attributes: &[required("velocity", "velocity", Vector), same("density", Number)],
    children: &[&GUST],
    ..EMPTY
};
static GUST: Element = leaf(
    "gust",
    Table("gust"),
    &[required("amplitude", "amplitude", Number), required("frequency", "frequency", Number)],
);
static CONTACT: Element = Element {
    tag: "contact",
    target: Table("contact"),
    attributes: &[
        same("distance", Number),
        same("response", Word(&["none"])),
        same("pinch", Word(&["refuse", "ghost"])),
        same("recover", Switch),
    ],
    children: &[&IMPULSE, &PENALTY, &CONTACT_TRIANGLES],
    ..EMPTY
};
static IMPULSE: Element = leaf(
    "impulse",
    Table("response.impulse"),
    &[same("restitution", Number), same("friction", Number)],
);
static CONTACT_TRIANGLES: Element =
    leaf("triangles", Table("response.triangles"), &[same("friction", Number)]);
static PENALTY: Element = leaf(
    "penalty",
    Table("response.penalty"),
    &[required("stiffness", "stiffness", Number), same("damping", Number)],
);

static SIMULATION: Element = Element {
    tag: "simulation",
    target: Table("simulation"),
    attributes: &[
        optional("type", "solver", Word(&["explicit", "implicit", "semi-implicit", "midpoint"])),
        optional("interval", "time_step", Number),
        optional("steps", "frames", Count),
        same("precision", Word(&["f32", "f64"])),
        same("strain_bound", Number),
    ],
    children: &[
        &STRAIN_LIMIT,
        &ADAPTIVE,
        &IMPLICIT,
        &SEMI_IMPLICIT,
        &MIDPOINT,
        &DRAG,
        &DIRECTIONAL,
        &PROCEDURAL,
        &PROCEDURAL_ENGINE,
        &RELEASE,
        &HOLD,
        &MOVE,
    ],
    ..EMPTY
};
static STRAIN_LIMIT: Element = leaf(
    "strain_limit",
    Table("strain_limit"),
    &[same("ratio", Number), same("sweeps", Count), same("classes", Words)],
);
static ADAPTIVE: Element = leaf(
    "adaptive",
    Table("adaptive"),
    &[same("strain_max", Number), same("halvings", Count), same("grow_after", Count)],
);
static IMPLICIT: Element = leaf(
    "implicit",
    Table("implicit"),
    &[
        optional("interval", "time_step", Number),
        same("linear", Word(&["cg", "jacobi", "direct"])),
        same(
            "preconditioner",
            Word(&["diagonal", "block", "incomplete-cholesky", "schwarz", "auto"]),
        ),
        same("matrix", Word(&["matrix-free", "assembled"])),
        same("stop", Word(&["residual", "energy"])),
        same("tolerance", Number),
        same("iterations", Count),
        same("warm_start", Switch),
        same("newton_iterations", Count),
        same("newton_tolerance", Number),
        same("constraint_passes", Count),
    ],
);
static SEMI_IMPLICIT: Element = leaf(
    "semi_implicit",
    Table("semi_implicit"),
    &[
        optional("interval", "time_step", Number),
        same("solve", Word(&["factorisation", "dense-inverse"])),
    ],
);
static MIDPOINT: Element = leaf(
    "midpoint",
    Table("midpoint"),
    &[optional("interval", "time_step", Number), same("weight", Number)],
);
static DRAG: Element = leaf("drag", Item("/field", "drag"), &[required("rate", "rate", Vector)]);
static DIRECTIONAL: Element = leaf(
    "directional",
    Item("/field", "uniform"),
    &[required("acceleration", "acceleration", Vector)],
);
static PROCEDURAL: Element = Element {
    tag: "procedural",
    target: Item("/field", ""),
    text: Some(("expression_left_handed", Text)),
    ..EMPTY
};
static PROCEDURAL_ENGINE: Element = Element {
    tag: "procedural_right_handed",
    target: Item("/field", ""),
    text: Some(("expression", Text)),
    ..EMPTY
};
const RELEASE_OR_HOLD: Element = Element {
    target: Item("/event", ""),
    attributes: &[
        required("time", "time", Number),
        required("group", "cloth", Text),
        required("pins", "pins", Words),
    ],
    ..EMPTY
};
static RELEASE: Element =
    Element { tag: "release", constant: Some(("action", "release")), ..RELEASE_OR_HOLD };
static HOLD: Element =
    Element { tag: "hold", constant: Some(("action", "hold")), ..RELEASE_OR_HOLD };
static MOVE: Element = leaf(
    "move",
    Item("/event", ""),
    &[
        required("time", "time", Number),
        required("group", "cloth", Text),
        required("pins", "pins", Words),
        required("offset", "action.move.offset", Vector),
        required("duration", "action.move.duration", Number),
    ],
);

static JOINTS: Element = Element {
    tag: "joints",
    children: &[&FIXED_JOINT, &BALL_JOINT, &HINGE_JOINT, &SLIDER_JOINT],
    ..EMPTY
};
const POINT_JOINT: Element = Element {
    target: Item("/rigid_joint", ""),
    attributes: &[
        required("from", "from", Text),
        same("to", Text),
        required("anchor", "anchor", Vector),
    ],
    ..EMPTY
};
static FIXED_JOINT: Element =
    Element { tag: "fixed_joint", constant: Some(("kind", "fixed")), ..POINT_JOINT };
static BALL_JOINT: Element =
    Element { tag: "ball_joint", constant: Some(("kind", "ball")), ..POINT_JOINT };
static HINGE_JOINT: Element = Element {
    tag: "hinge_joint",
    target: Item("/rigid_joint", ""),
    attributes: &[
        required("from", "from", Text),
        same("to", Text),
        required("anchor", "anchor", Vector),
        required("axis", "axis", Axis),
        same("limits", Numbers(2)),
    ],
    constant: Some(("kind", "hinge")),
    ..EMPTY
};
static SLIDER_JOINT: Element = Element {
    tag: "slider_joint",
    target: Item("/rigid_joint", ""),
    attributes: &[
        required("from", "from", Text),
        same("to", Text),
        required("anchor", "anchor", Vector),
        required("axis", "axis", Vector),
        same("limits", Numbers(2)),
    ],
    constant: Some(("kind", "slider")),
    ..EMPTY
};

static ACTORS: Element = Element { tag: "actors", children: &[&GROUP, &RIGID, &COLLIDER], ..EMPTY };

static GROUP: Element = Element {
    tag: "group",
    target: Item("/cloth", ""),
    attributes: &[
        required("id", "", Id),
        required("name", "name", Text),
        optional("type", "", Word(&["particle"])),
        same("colour", Text),
        same("pins", Words),
        same("model", Word(&["fabric", "springs"])),
        same("layer", Count),
    ],
    children: &[&LINEAR_GROUP, &GRID, &MESH_FILE, &TRIANGLES, &NETWORK, &PATTERN, &FABRIC],
    needs: &[("geometry", "<grid>, <mesh>, <mesh_file> or <particles>"), ("material", "<fabric>")],
    ..EMPTY
};
static LINEAR_GROUP: Element = leaf("linear", Inline, &[same("velocity", Vector)]);
static GRID: Element = leaf(
    "grid",
    Table("geometry.grid"),
    &[
        required("width", "columns", Count),
        required("height", "rows", Count),
        same("spacing", Number),
        same("size", Numbers(2)),
        same("origin", Vector),
        same("centre", Vector),
        optional("width_axis", "column_axis", Vector),
        optional("height_axis", "row_axis", Vector),
        optional("neighbours", "stencil", Count),
        same("meshing", Word(&["alternating", "union-jack", "one-way"])),
    ],
);
static MESH_FILE: Element = Element {
    tag: "mesh_file",
    target: Table("geometry.mesh"),
    attributes: &[
        required("file", "file", Text),
        same("scale", Number),
        same("translation", Vector),
    ],
    children: &[&ROTATION],
    ..EMPTY
};
static ROTATION: Element = leaf(
    "rotation",
    Table("rotation"),
    &[required("axis", "axis", Axis), required("degrees", "degrees", Number)],
);
static TRIANGLES: Element = Element {
    tag: "mesh",
    target: Table("geometry.triangles"),
    children: &[&VERTICES, &FACES, &UV, &UV_FACES],
    needs: &[("vertices", "<vertices>"), ("faces", "<faces>")],
    ..EMPTY
};
static VERTICES: Element = Element { tag: "vertices", text: Some(("vertices", Vectors)), ..EMPTY };
static CORNERS: Element = Element { tag: "vertices", text: Some(("vertices", Corners)), ..EMPTY };
static FACES: Element = Element { tag: "faces", text: Some(("faces", Faces)), ..EMPTY };
static UV: Element = Element { tag: "uv", text: Some(("uv", Pairs)), ..EMPTY };
static UV_FACES: Element = Element { tag: "uv_faces", text: Some(("uv_faces", Faces)), ..EMPTY };
static PATTERN: Element = Element {
    tag: "pattern",
    target: Table("pattern"),
    attributes: &[
        same("from", Word(&["uv", "shape"])),
        same("scale", Number),
        same("axis", Vector),
        same("warp", Number),
        same("imperfection", Number),
    ],
    children: &[&PANEL],
    ..EMPTY
};
static PANEL: Element = leaf(
    "panel",
    Item("panels", ""),
    &[
        required("group", "group", Text),
        same("warp", Number),
        same("preset", Text),
        same("layers", Count),
    ],
);
static NETWORK: Element = Element {
    tag: "particles",
    target: Table("geometry.network"),
    attributes: &[required("width", "width", Count), same("height", Count), same("depth", Count)],
    children: &[&PARTICLE, &PROTOTYPE, &JOINT],
    ..EMPTY
};
static PARTICLE: Element = leaf(
    "particle",
    Value("positions"),
    &[required("position", "", Vector), required("id", "", Id)],
);
static PROTOTYPE: Element = leaf(
    "prototype",
    Item("prototype", ""),
    &[
        required("type", "class", Word(&["stretch", "shear", "bend"])),
        same("stiffness", Number),
        same("damping", Number),
        same("length", Number),
    ],
);
static JOINT: Element = leaf(
    "joint",
    Item("joint", ""),
    &[
        required("type", "class", Word(&["stretch", "shear", "bend"])),
        required("from", "from", Particle),
        required("to", "to", Particle),
        same("stiffness", Number),
        same("damping", Number),
        same("length", Number),
    ],
);
static FABRIC: Element = Element {
    tag: "fabric",
    target: Table("material"),
    attributes: &[
        same("preset", Text),
        same("sheet", Text),
        same("thickness", Number),
        same("stretch_limit", Number),
        optional("density", "mass.per_area", Number),
        optional("mass", "mass.per_particle", Number),
    ],
    children: &[&STRETCH, &SHEAR, &BEND, &DAMPING, &AERODYNAMICS],
    ..EMPTY
};
static STRETCH: Element =
    leaf("stretch", Table("stretch"), &[same("stiffness", Number), same("damping", Number)]);
static SHEAR: Element =
    leaf("shear", Table("shear"), &[same("stiffness", Number), same("damping", Number)]);
static BEND: Element = leaf(
    "bend",
    Table("bend"),
    &[same("stiffness", Number), same("damping", Number), same("rigidity", Number)],
);
static DAMPING: Element =
    leaf("damping", Table("damping"), &[same("stretch", Number), same("bend", Number)]);
static AERODYNAMICS: Element = leaf(
    "aerodynamics",
    Table("aerodynamics"),
    &[same("pressure", Number), same("friction", Number)],
);

/// Of rigid bodies and colliders.
static SOLID: [Attribute; 4] = [
    required("id", "", Id),
    required("name", "name", Text),
    same("colour", Text),
    same("hidden", Switch),
];

static RIGID: Element = Element {
    tag: "rigid",
    target: Item("/rigid", ""),
    attributes: &SOLID,
    children: &[
        &TRANSFORM,
        &LINEAR,
        &ANGULAR,
        &MATTER,
        &BOX,
        &SPHERE,
        &CAPSULE,
        &MESH,
        &SOLID_FILE,
        &TETRAHEDRON,
    ],
    needs: &[
        ("shape", "<box>, <sphere>, <capsule>, <mesh>, <mesh_file> or <tetrahedron>"),
        ("mass", "<linear>"),
    ],
    ..EMPTY
};
static TRANSFORM: Element = Element {
    tag: "transform",
    attributes: &[same("translation", Vector), optional("matrix", "rotation", Matrix)],
    children: &[&ROTATION],
    ..EMPTY
};
static LINEAR: Element = leaf(
    "linear",
    Inline,
    &[
        required("mass", "mass", Number),
        same("velocity", Vector),
        same("force", Vector),
        same("centre_of_mass", Vector),
    ],
);
static ANGULAR: Element =
    leaf("angular", Inline, &[optional("omega", "angular_velocity", Axis), same("torque", Axis)]);
static MATTER: Element =
    leaf("matter", Inline, &[same("restitution", Number), same("friction", Number)]);
static BOX: Element =
    leaf("box", Table("shape.box"), &[required("half_extents", "half_extents", Vector)]);
static SPHERE: Element =
    leaf("sphere", Table("shape.sphere"), &[required("radius", "radius", Number)]);
static MESH: Element = Element {
    tag: "mesh",
    target: Table("shape.mesh"),
    attributes: &[same("scale", Number), same("translation", Vector), same("cells", Count)],
    children: &[&VERTICES, &FACES, &ROTATION],
    needs: &[("vertices", "<vertices>"), ("faces", "<faces>")],
    ..EMPTY
};
static SOLID_FILE: Element = Element {
    tag: "mesh_file",
    target: Table("shape.mesh"),
    attributes: &[
        required("file", "file", Text),
        same("scale", Number),
        same("translation", Vector),
        same("cells", Count),
    ],
    children: &[&ROTATION],
    ..EMPTY
};
static TETRAHEDRON: Element = Element {
    tag: "tetrahedron",
    target: Table("shape.tetrahedron"),
    children: &[&CORNERS],
    needs: &[("vertices", "<vertices>")],
    ..EMPTY
};

static COLLIDER: Element = Element {
    tag: "collider",
    target: Item("/collider", ""),
    attributes: &SOLID,
    children: &[
        &TRANSFORM,
        &MATTER,
        &PLANE,
        &SPHERE,
        &CAPSULE,
        &BOX,
        &MESH,
        &SOLID_FILE,
        &ANIMATION,
        &TETRAHEDRON,
        &KEYFRAME,
    ],
    needs: &[(
        "shape",
        "<plane>, <sphere>, <capsule>, <box>, <mesh>, <mesh_file>, <animation> or <tetrahedron>",
    )],
    ..EMPTY
};
static ANIMATION: Element = Element {
    tag: "animation",
    target: Table("shape.animation"),
    attributes: &[
        required("file", "file", Text),
        same("cache", Text),
        same("first", Count),
        same("frames", Count),
        same("rest", Text),
        same("blend", Number),
        same("start", Number),
        same("skin", Number),
        required("rate", "rate", Number),
        same("cells", Count),
        same("scale", Number),
        same("translation", Vector),
    ],
    children: &[&ROTATION],
    ..EMPTY
};
static PLANE: Element = leaf("plane", Table("shape.plane"), &[same("normal", Vector)]);
static CAPSULE: Element = leaf(
    "capsule",
    Table("shape.capsule"),
    &[required("half_length", "half_length", Number), required("radius", "radius", Number)],
);
static KEYFRAME: Element = Element {
    tag: "keyframe",
    target: Item("motion", ""),
    attributes: &[required("time", "time", Number), same("translation", Vector)],
    children: &[&ROTATION],
    ..EMPTY
};

/// Written by the engine; read by [`FyslFeedback`](super::FyslFeedback), of no meaning for a scene.
static FEEDBACK: Element =
    Element { tag: "feedback", target: Table("feedback"), children: &[&FRAME], ..EMPTY };
static FRAME: Element = Element {
    tag: "frame",
    target: Item("frame", ""),
    attributes: &[required("number", "number", Count), required("time", "time", Number)],
    children: &[&FRAME_GROUP, &FRAME_RIGID],
    ..EMPTY
};
static FRAME_GROUP: Element = Element {
    tag: "group",
    target: Item("group", ""),
    attributes: &[required("name", "name", Text)],
    children: &[&VERTICES],
    ..EMPTY
};
static FRAME_RIGID: Element = Element {
    tag: "rigid",
    target: Item("rigid", ""),
    attributes: &[required("name", "name", Text), required("translation", "translation", Vector)],
    children: &[&ROTATION],
    ..EMPTY
};
