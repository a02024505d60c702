//! Scenes that together use every key.

use std::path::Path;

use serde_json::Value;

/// The texts.
pub(super) const SCENES: [&str; 9] = [
    r##"name = "triangles"
contact = { distance = 0.002, pinch = "ghost", recover = true, response.triangles.friction = 0.3, rule = [{ between = ["a"], distance = 0.001, friction = 0.5, forces = false }] }
[[cloth]]
name = "a"
layer = 1
folds = [{ lines = ["column-1"], angle = 45.5 }]
material.preset = "jersey"
geometry.grid = { columns = 4, rows = 3, spacing = 0.1, centre = [0.0, 0.0, 1.0] }
"##,
    r##"name = "springs"
description = "every key of cloths, solvers and surroundings"
gravity = [0.0, 0.0, -9.8]
simulation.frames = 3
simulation.frames_per_second = 24.0
simulation.time_step = 1e-3
simulation.solver = "explicit"
simulation.precision = "f64"
simulation.strain_bound = 5.0
simulation.strain_limit = { ratio = 1.1, sweeps = 2, classes = ["stretch", "bend"] }
simulation.adaptive = { strain_max = 0.25, halvings = 3, grow_after = 2 }
simulation.implicit = { time_step = 0.01, linear = "cg", preconditioner = "block", matrix = "assembled", stop = "residual", tolerance = 0.1, iterations = 30, warm_start = true, newton_iterations = 2, newton_tolerance = 0.5, constraint_passes = 3 }
simulation.semi_implicit = { time_step = 0.01, solve = "dense-inverse" }
simulation.midpoint = { time_step = 0.01, weight = 0.75 }
field = [{ uniform.acceleration = [0.5, 0.0, 0.0] }, { drag.rate = [0.5, 0.25, 0.0] }, { expression = "m * v" }, { expression_left_handed = "m * x" }]
wind = { velocity = [1.0, 0.0, 0.0], density = 1.25, gust = { amplitude = 0.5, frequency = 2.0 } }
contact = { distance = 0.02, response.penalty = { stiffness = 10.0, damping = 0.5 } }
bounds = { min = [0.0, 0.0, 0.0], max = [1.0, 1.0, 1.0] }
view = { eye = [1.0, 2.0, 3.0], target = [0.0, 0.5, 0.0], field_of_view = 35.0, strain = 0.05, strain_of = "warp", threads = true, dust = { count = 10, min = [0.0, 0.0, 0.0], max = [1.0, 1.0, 0.5], lifetime = 2.0 } }
[[cloth]]
name = "a"
pins = [0, "corners"]
velocity = [0.0, 1.0, 2.0]
colour = "#102030"
geometry.grid = { columns = 4, rows = 3, spacing = 0.1, origin = [0.5, 0.25, 1.5], column_axis = [1.0, 0.0, 0.0], row_axis = [0.0, 1.0, 0.0], stencil = 24 }
material = { preset = "denim", thickness = 0.001, mass.per_area = 0.3, stretch = { stiffness = 9.0, damping = 0.1 }, shear = { stiffness = 8.0, damping = 0.1 }, bend = { stiffness = 2.5, damping = 0.125, rigidity = 1e-4 }, aerodynamics = { pressure = 1.5, friction = 0.1 } }
[[cloth]]
name = "b"
material.preset = "jersey"
geometry.grid = { columns = 4, rows = 3, size = [0.3, 0.2], centre = [0.5, 0.25, 2.5] }
[[event]]
time = 0.5
cloth = "a"
pins = ["corners"]
action.move = { offset = [0.0, 0.5, 1.0], duration = 0.75 }
[[event]]
time = 0.75
cloth = "a"
pins = [0]
action = "release"
[[event]]
time = 1.0
cloth = "a"
pins = [0]
action = "hold"
"##,
    r##"name = "networks"
contact = { distance = 0.02, response.impulse = { restitution = 0.1, friction = 0.2 } }
[[cloth]]
name = "n"
material = { preset = "denim", mass.per_particle = 0.5 }
[cloth.geometry.network]
width = 2
height = 2
depth = 1
positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]]
prototype = [{ class = "stretch", stiffness = 5.0, damping = 0.1, length = 1.0 }]
joint = [{ from = 0, to = 3, class = "shear", stiffness = 5.0, damping = 0.1, length = 1.4 }]
[[cloth]]
name = "t"
material.preset = "denim"
geometry.triangles = { vertices = [[0.0, 0.0, 5.0], [1.0, 0.0, 5.0], [0.0, 1.0, 5.0]], faces = [[0, 1, 2]] }
[[cloth]]
name = "m"
material.preset = "denim"
pins = [{ attribute = "pin", above = 0.5 }]
geometry.mesh = { file = "sheet.ply", scale = 2.0, rotation = { axis = [0.0, 0.0, 1.0], degrees = 30.0 }, translation = [0.0, 0.0, 9.0] }
[[event]]
time = 0.5
cloth = "m"
pins = [{ attribute = "pin", above = 0.5 }]
action = "release"
"##,
    r##"name = "fabrics"
[[cloth]]
name = "grid"
model = "fabric"
pattern = { warp = 30.5, imperfection = 0.5 }
geometry.grid = { columns = 4, rows = 3, spacing = 0.1, meshing = "union-jack" }
material = { preset = "cotton-broad", thickness = 0.001, stretch_limit = 1.2, maps = [{ by = "left", of = "bend", range = [1.0, 5.5] }], mass.per_area = 0.3, damping = { stretch = 1e-5, bend = 1e-3 }, aerodynamics = { pressure = 1.5, friction = 0.1 } }
[[cloth]]
name = "triangles"
model = "fabric"
pattern = { from = "uv", scale = 0.5 }
material.sheet = "sheet.toml"
geometry.triangles = { vertices = [[0.0, 0.0, 5.0], [1.0, 0.0, 5.0], [0.0, 1.0, 5.0]], faces = [[0, 1, 2]], uv = [[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]], uv_faces = [[0, 1, 2]] }
[[cloth]]
name = "mesh"
pattern = { from = "shape", axis = [0.5, 1.0, 0.0], warp = 10.5, panels = [{ group = "panel", warp = 45.5, preset = "cotton-broad", layers = 2 }] }
material.preset = "drape-001"
geometry.mesh = { file = "panels.obj", translation = [0.0, 0.0, 9.0] }
"##,
    r##"name = "sewn"
contact.response = "none"
start.from = "out/drape"
[[phase]]
name = "sew"
duration = 1.5
gravity = [0.0, 0.0, 0.5]
time_step = 0.001
bending = 20.5
[[cloth]]
name = "shirt"
material.preset = "drape-001"
inflate = { pressure = 10.5, rise = [0.5, 1.5] }
tear = { strain = 0.25 }
geometry.panels = { file = "pieces.svg", edge = 0.25, unit = 0.5, pieces = [{ outline = "a" }, { outline = "a", name = "b", mirror = true, folded = true, warp = 45.5, radius = 0.75, rotation = { axis = [0.0, 0.0, 1.0], degrees = 30.0 }, translation = [0.0, 0.0, 5.0] }] }
[[cloth]]
name = "panels"
pattern.from = "uv"
material.preset = "drape-001"
geometry.mesh = { file = "sewn.obj", translation = [0.0, 0.0, 9.0] }
[[seam]]
name = "side"
cloth = "shirt"
lines = [["a:0"], ["b:0"]]
reverse = true
gather = 1.0
close = [0.0, 1.5]
stiffness = 50.5
damping = 0.5
end = "weld"
[[seam]]
name = "pairs"
cloth = "shirt"
to = "panels"
stitches = [[0, 1]]
end = "hold"
[[seam]]
name = "points"
cloth = "panels"
points = [{ vertex = 2, edge = [3, 5], place = 0.5 }]
end = "hold"
strength = 50.5
[[elastic]]
name = "waist"
cloth = "shirt"
line = ["b:2"]
ratio = 0.75
stiffness = 10.5
close = [0.0, 1.5]
[[seam]]
name = "file"
cloth = "panels"
file = true
file_seams = [0]
"##,
    r##"name = "attached"
[[cloth]]
name = "band"
material.preset = "denim"
geometry.grid = { columns = 4, rows = 3, spacing = 0.1 }
[[cloth]]
name = "button"
material.preset = "denim"
geometry.grid = { columns = 2, rows = 2, spacing = 0.1, centre = [0.0, 0.0, 0.01] }
[[collider]]
name = "ball"
shape.sphere.radius = 0.5
[[attachment]]
name = "thread"
cloth = "button"
vertices = [0, "corners"]
to = "band"
stiffness = 50.5
damping = 0.5
reach = 25.5
[[cloth]]
name = "sheet"
material.preset = "denim"
geometry.mesh.file = "sheet.ply"
[[attachment]]
name = "hands"
cloth = "sheet"
vertices = [{ attribute = "pin", above = 0.25 }]
to = "ball"
stiffness = 10.5
weights = "pin"
reach = 25.5
[[attachment]]
name = "waist"
cloth = "band"
vertices = ["top"]
to = "ball"
reach = 1.5
release = 2.5
"##,
    r##"name = "solids"
[[cloth]]
name = "c"
material.preset = "denim"
geometry.grid = { columns = 2, rows = 2, spacing = 0.1 }
[[collider]]
name = "sphere"
shape.sphere.radius = 0.5
translation = [0.0, 0.0, 1.0]
rotation = { axis = [0.0, 1.0, 1.0], degrees = 30.5 }
friction = 0.25
restitution = 0.5
colour = "#102030"
hidden = true
motion = [{ time = 1.5, translation = [1.0, 2.5, 3.0], rotation = { axis = [1.0, 0.0, 0.5], degrees = 400.0 } }]
[[collider]]
name = "plane"
shape.plane.normal = [0.0, 0.5, 1.0]
[[collider]]
name = "capsule"
shape.capsule = { half_length = 0.5, radius = 0.25 }
[[collider]]
name = "box"
shape.box.half_extents = [0.5, 1.5, 2.5]
[[collider]]
name = "tetrahedron"
shape.tetrahedron.vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
[[collider]]
name = "mesh"
shape.mesh = { vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], scale = 2.0, rotation = { axis = [0.0, 0.0, 1.0], degrees = 30.0 }, translation = [0.0, 0.0, 1.0], cells = 5 }
[[collider]]
name = "file"
shape.mesh = { file = "solid1.obj", cells = 5 }
[[collider]]
name = "mannequin"
shape.mannequin = { height = 1.75, neck = 0.37, chest = 1.0, waist = 0.85, hips = 1.05, shoulders = 0.375, edge = 0.03, rate = 1.5, cells = 5, pose = [{ time = 0.5, shoulder_left = { raise = 60.5, forwards = 5.5 }, shoulder_right = { raise = 60.5, forwards = 5.5 }, elbow_left = 5.5, elbow_right = 5.5, hip_left = { raise = 5.5, forwards = 5.5 }, hip_right = { raise = 5.5, forwards = 5.5 }, knee_left = 5.5, knee_right = 5.5, head = 5.5 }] }
[[collider]]
name = "animation"
shape.animation = { file = "solid{}.obj", first = 1, frames = 2, rate = 2.0, rest = "solid1.obj", blend = 0.5, start = 0.25, skin = 0.01, cells = 5, scale = 2.0, rotation = { axis = [0.0, 0.0, 1.0], degrees = 30.0 }, translation = [0.0, 0.0, 1.0] }
"##,
    r##"name = "cached"
[[cloth]]
name = "c"
material.preset = "denim"
geometry.grid = { columns = 2, rows = 2, spacing = 0.1 }
[[collider]]
name = "animation"
shape.animation = { file = "solid1.obj", cache = "solid.pc2", rate = 2.0, cells = 5 }
"##,
    r##"name = "bodies"
[[cloth]]
name = "c"
material.preset = "denim"
geometry.grid = { columns = 2, rows = 2, spacing = 0.1 }
[[rigid]]
name = "ball"
shape.sphere.radius = 0.5
translation = [0.0, 0.0, 1.0]
rotation = { axis = [0.0, 1.0, 1.0], degrees = 30.5 }
mass = 2.0
velocity = [0.0, 0.0, 1.0]
force = [0.0, 0.0, 1.0]
centre_of_mass = [0.0, 0.0, 0.1]
angular_velocity = [0.0, 0.0, 1.0]
torque = [0.0, 0.0, 1.0]
friction = 0.25
restitution = 0.5
hidden = true
colour = "#102030"
[[rigid]]
name = "box"
mass = 1.0
shape.box.half_extents = [0.5, 0.5, 0.5]
translation = [5.0, 0.0, 0.0]
[[rigid]]
name = "mesh"
mass = 1.0
shape.mesh = { vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], scale = 2.0, rotation = { axis = [0.0, 0.0, 1.0], degrees = 30.0 }, translation = [0.0, 0.0, 1.0], cells = 5 }
translation = [9.0, 0.0, 0.0]
[[rigid]]
name = "file"
mass = 1.0
shape.mesh = { file = "solid1.obj", cells = 5 }
translation = [19.0, 0.0, 0.0]
[[rigid]]
name = "capsule"
mass = 1.0
shape.capsule = { half_length = 0.5, radius = 0.25 }
translation = [0.0, 15.0, 0.0]
[[rigid]]
name = "tetrahedron"
mass = 1.0
shape.tetrahedron.vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
translation = [0.0, 9.0, 0.0]
[[rigid_joint]]
kind = "hinge"
from = "ball"
to = "box"
anchor = [2.5, 0.0, 0.0]
axis = [0.0, 0.0, 1.0]
limits = [-10.0, 90.0]
"##,
];

/// The scenes as trees of values.
pub(super) fn scenes() -> Vec<Value> {
    let read = |text: &&str| {
        let table: toml::Table = toml::from_str(text).unwrap();
        serde_json::to_value(table).unwrap()
    };
    SCENES.iter().map(read).collect()
}

/// Writes the mesh files that they name.
pub(super) fn meshes_write(folder: &Path) {
    let sheet = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property float pin\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0 9\n1 0 0 9\n0 1 0 0\n3 0 1 2\n";
    let solid = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    let panels = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\ng panel\nf 1 2 3\ng other\nf 1 3 4\n";
    let pieces = "<svg><rect id=\"a\" width=\"2\" height=\"2\"/></svg>";
    let sewn = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nvt 0 0\nvt 1 0\nvt 0 1\n\
        f 1/1 2/2 3/3\nf 4/1 5/2 6/3\nstitch 1 4\n";
    let laboratory = "W = 12\n[warp]\noverhang = 40\n";
    for (name, text) in [
        ("pieces.svg", pieces),
        ("sewn.obj", sewn),
        ("sheet.toml", laboratory),
        ("panels.obj", panels),
        ("sheet.ply", sheet),
        ("solid1.obj", solid),
        ("solid2.obj", solid),
    ] {
        std::fs::write(folder.join(name), text).unwrap();
    }
    let mut cache = b"POINTCACHE2\0".to_vec();
    let numbers = [1.0_f32, 2.0, 3.0];
    cache.extend([1_i32, 4].into_iter().flat_map(i32::to_le_bytes));
    cache.extend([0.0_f32, 1.0].into_iter().flat_map(f32::to_le_bytes));
    cache.extend(3_i32.to_le_bytes());
    for size in numbers {
        let corners = [[0.0; 3], [size, 0.0, 0.0], [0.0, size, 0.0], [0.0, 0.0, size]];
        cache.extend(corners.into_iter().flatten().flat_map(f32::to_le_bytes));
    }
    std::fs::write(folder.join("solid.pc2"), cache).unwrap();
}
