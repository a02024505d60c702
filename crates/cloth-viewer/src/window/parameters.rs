//! The values of the panel: their names, units, bounds, and the keys of scene files that say the same.

use eframe::egui::{Align, DragValue, Label, Layout, Response, Ui, vec2};

use super::places;

/// Width of the names, of a value, and of one of three values \[point\].
const LABEL: f32 = 124.0;
pub(super) const VALUE: f32 = 3.0 * THIRD + 2.0 * GAP;
const THIRD: f32 = 54.0;
/// Between these \[point\].
const GAP: f32 = 4.0;

/// A unit as the panel shows it, and that of scene files.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Unit {
    shown: &'static str,
    /// That of scene files.
    file: &'static str,
    /// Shown values in one of the file.
    scale: f64,
}

impl Unit {
    const fn same(name: &'static str) -> Self {
        Self { shown: name, file: name, scale: 1.0 }
    }
}

const NONE: Unit = Unit::same("");
const MILLISECOND: Unit = Unit { shown: "ms", file: "s", scale: 1e3 };
const MILLIMETRE: Unit = Unit { shown: "mm", file: "m", scale: 1e3 };
const GRAM: Unit = Unit { shown: "g", file: "kg", scale: 1e3 };
const GRAM_PER_AREA: Unit = Unit { shown: "g/m²", file: "kg/m²", scale: 1e3 };
const STIFFNESS: Unit = Unit::same("N/m");
const DAMPING: Unit = Unit::same("N s/m");

/// A value of the panel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parameter {
    pub(super) label: &'static str,
    /// What it is, in a sentence.
    text: &'static str,
    unit: Unit,
    /// Least and largest value in the unit of scene files.
    range: [f64; 2],
    /// The key of scene files.
    pub(super) key: &'static str,
}

const fn parameter(
    label: &'static str,
    text: &'static str,
    unit: Unit,
    range: [f64; 2],
    key: &'static str,
) -> Parameter {
    Parameter { label, text, unit, range, key }
}

const COEFFICIENT: [f64; 2] = [0.0, 1e6];
const POSITIVE: [f64; 2] = [1e-9, 1e9];

/// Length of a substep of each integrator, in the order of `SceneSolver::ALL`.
pub(super) const TIME_STEPS: [Parameter; 4] = [
    parameter("time step", TIME_STEP, MILLISECOND, STEP, "simulation.time_step"),
    parameter("time step", TIME_STEP, MILLISECOND, STEP, "simulation.implicit.time_step"),
    parameter("time step", TIME_STEP, MILLISECOND, STEP, "simulation.semi_implicit.time_step"),
    parameter("time step", TIME_STEP, MILLISECOND, STEP, "simulation.midpoint.time_step"),
];
const TIME_STEP: &str =
    "Length of a substep. Stiff cloth needs short ones with the explicit integrator.";
const STEP: [f64; 2] = [1e-6, 0.1];
pub(super) const ITERATIONS: Parameter = parameter(
    "iterations",
    "Cap on the iterations of each linear solve.",
    NONE,
    [1.0, 1e4],
    "simulation.implicit.iterations",
);

pub(super) const MASS_PER_AREA: Parameter = parameter(
    "mass per area",
    "How heavy the fabric is.",
    GRAM_PER_AREA,
    POSITIVE,
    "cloth.material.mass.per_area",
);
pub(super) const MASS_PER_PARTICLE: Parameter = parameter(
    "mass per particle",
    "The same mass for every particle.",
    GRAM,
    POSITIVE,
    "cloth.material.mass.per_particle",
);
pub(super) const THICKNESS: Parameter = parameter(
    "thickness",
    "Colliders stop the particles at half of it.",
    MILLIMETRE,
    [1e-6, 1.0],
    "cloth.material.thickness",
);
/// Stiffness and damping of stretch, shear and bend springs.
pub(super) const SPRINGS: [[Parameter; 2]; 3] = [
    [
        parameter("stretch", STRETCH, STIFFNESS, POSITIVE, "cloth.material.stretch.stiffness"),
        parameter("  damping", DAMPED, DAMPING, COEFFICIENT, "cloth.material.stretch.damping"),
    ],
    [
        parameter("shear", SHEAR, STIFFNESS, POSITIVE, "cloth.material.shear.stiffness"),
        parameter("  damping", DAMPED, DAMPING, COEFFICIENT, "cloth.material.shear.damping"),
    ],
    [
        parameter("bend", BEND, STIFFNESS, POSITIVE, "cloth.material.bend.stiffness"),
        parameter("  damping", DAMPED, DAMPING, COEFFICIENT, "cloth.material.bend.damping"),
    ],
];
const STRETCH: &str = "Stiffness of the springs along the threads.";
const SHEAR: &str = "Stiffness of the springs across the diagonals.";
const BEND: &str = "Stiffness of the springs that resist folding.";
const DAMPED: &str = "How fast the springs above come to rest.";
pub(super) const RIGIDITY: Parameter = parameter(
    "  rigidity",
    "Flexural rigidity of one bend spring, which buckles under compression.",
    Unit::same("N m²"),
    [1e-12, 1e3],
    "cloth.material.bend.rigidity",
);
pub(super) const PRESSURE: Parameter = parameter(
    "air pressure",
    "Pressure drag coefficient: how much of the wind across the cloth it catches; 1.28 for a flat plate.",
    NONE,
    [0.0, 100.0],
    "cloth.material.aerodynamics.pressure",
);
pub(super) const SKIN_FRICTION: Parameter = parameter(
    "air friction",
    "Skin friction coefficient: how much of the wind along the cloth it catches.",
    NONE,
    [0.0, 100.0],
    "cloth.material.aerodynamics.friction",
);

pub(super) const GRAVITY: Parameter = parameter(
    "gravity",
    "Acceleration of free fall along x, y and z, which points up; -9.81 on earth.",
    Unit::same("m/s²"),
    [-100.0, 100.0],
    "gravity",
);
pub(super) const AIR_DENSITY: Parameter =
    parameter("  density", "1.204 at 20 °C.", Unit::same("kg/m³"), [0.0, 2000.0], "wind.density");
pub(super) const WIND: Parameter = parameter(
    "  wind",
    "Velocity of the air along x, y and z.",
    Unit::same("m/s"),
    [-100.0, 100.0],
    "wind.velocity",
);
pub(super) const GUST_AMPLITUDE: Parameter = parameter(
    "  amplitude",
    "Part of the velocity of the wind by which it swells and dies down.",
    NONE,
    [0.0, 10.0],
    "wind.gust.amplitude",
);
pub(super) const GUST_FREQUENCY: Parameter = parameter(
    "  frequency",
    "Gusts in a second.",
    Unit::same("Hz"),
    [0.0, 100.0],
    "wind.gust.frequency",
);

pub(super) const CONTACT_DISTANCE: Parameter = parameter(
    "  distance",
    "Particles nearer than this touch. Keep it below the spacing of the particles.",
    MILLIMETRE,
    [1e-6, 10.0],
    "contact.distance",
);
pub(super) const CONTACT_FRICTION: Parameter = parameter(
    "  friction",
    "Coulomb friction coefficient between cloths.",
    NONE,
    [0.0, 10.0],
    "contact.response.impulse.friction",
);
pub(super) const CONTACT_STIFFNESS: Parameter = parameter(
    "  stiffness",
    "Stiffness of the spring between two particles that touch.",
    STIFFNESS,
    POSITIVE,
    "contact.response.penalty.stiffness",
);
pub(super) const CONTACT_DAMPING: Parameter = parameter(
    "  damping",
    "Damping between two particles that touch.",
    DAMPING,
    COEFFICIENT,
    "contact.response.penalty.damping",
);
pub(super) const COLLIDER_FRICTION: Parameter = parameter(
    "friction",
    "Coulomb friction coefficient of this surface.",
    NONE,
    [0.0, 10.0],
    "collider.friction",
);
pub(super) const RIGID_FRICTION: Parameter = parameter(
    "friction",
    "Coulomb friction coefficient of this body.",
    NONE,
    [0.0, 10.0],
    "rigid.friction",
);

impl Parameter {
    /// What the pointer is told: what it is, its unit, and the key in scene files; of which table, if there are several.
    pub(super) fn tooltip(&self, table: Option<&str>) -> String {
        let Unit { shown, file, .. } = self.unit;
        let unit = match shown {
            "" => "Unit: none, a pure number".into(),
            shown if shown == file => format!("Unit: {shown}"),
            shown => format!("Unit: {shown}; scene files have {file}"),
        };
        let table = table.map(|name| format!(" of `{name}`")).unwrap_or_default();
        format!("{}\n{unit}\nScene key: {}{table}", self.text, self.key)
    }

    /// A field for the value, which is in the unit of scene files; whether it was changed.
    fn field(&self, ui: &mut Ui, value: &mut f64, width: f32, suffix: bool) -> (Response, bool) {
        let Unit { shown, scale, .. } = self.unit;
        let before = *value * scale;
        let mut number = before;
        let whole = self.range == ITERATIONS.range;
        // By a hundredth for each point that the pointer is dragged.
        let least = if whole { 20.0 } else { 0.1 * 10.0_f64.powf(scale.log10().min(1.0)) };
        let span = self.range[1] * scale;
        let speed = 0.01 * before.abs().max(if span <= 100.0 { 1.0 } else { least.min(span) });
        let mut drag = DragValue::new(&mut number)
            .range(self.range[0] * scale..=span)
            .clamp_existing_to_range(false)
            .speed(speed)
            .update_while_editing(false)
            .custom_formatter(|value, _| figures(value));
        if whole {
            drag = drag.max_decimals(0);
        }
        if suffix && !shown.is_empty() {
            drag = drag.suffix(format!(" {shown}"));
        }
        let height = ui.spacing().interact_size.y;
        let response = ui.add_sized(vec2(width, height), drag);
        // A field that was only looked at gives back what it shows, which has fewer figures.
        let changed = number != before && figures(number) != figures(before);
        if changed {
            *value = number / scale;
        }
        (response, changed)
    }

    /// A row of the panel with name and value; whether it was changed.
    pub(super) fn row(
        &self,
        ui: &mut Ui,
        mark: &'static str,
        table: Option<&str>,
        value: &mut f64,
    ) -> bool {
        self.row_named(ui, self.label, mark, table, value)
    }

    /// The same with another name.
    pub(super) fn row_named(
        &self,
        ui: &mut Ui,
        label: &str,
        mark: &'static str,
        table: Option<&str>,
        value: &mut f64,
    ) -> bool {
        let tooltip = self.tooltip(table);
        row(ui, label, &tooltip, |ui| {
            let (response, changed) = self.field(ui, value, VALUE, true);
            places::mark(mark, &response);
            response.on_hover_text(&tooltip);
            changed
        })
    }

    /// A row with the components of a vector.
    pub(super) fn row_vector(
        &self,
        ui: &mut Ui,
        marks: [&'static str; 3],
        vector: &mut [f64; 3],
    ) -> bool {
        let tooltip = self.tooltip(None);
        row(ui, &format!("{} [{}]", self.label, self.unit.shown), &tooltip, |ui| {
            ui.spacing_mut().item_spacing.x = GAP;
            let fields = vector.iter_mut().zip(marks).zip(["x", "y", "z"]);
            fields.fold(false, |any, ((value, mark), axis)| {
                let (response, changed) = self.field(ui, value, THIRD, false);
                places::mark(mark, &response);
                response.on_hover_text(format!("{axis}: {tooltip}"));
                any || changed
            })
        })
    }
}

/// A row of the panel: a name of fixed width, and what follows.
pub(super) fn row<T>(
    ui: &mut Ui,
    label: &str,
    tooltip: &str,
    contents: impl FnOnce(&mut Ui) -> T,
) -> T {
    ui.horizontal(|ui| {
        let size = vec2(LABEL, ui.spacing().interact_size.y);
        ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
            ui.set_min_width(LABEL);
            let label = ui.add(Label::new(label).truncate().selectable(false));
            label.on_hover_text(tooltip);
        });
        contents(ui)
    })
    .inner
}

/// Four figures at most.
pub(super) fn figures(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        return "0".into();
    }
    let text = if (1e-3..1e5).contains(&size) {
        let decimals = (3.0 - size.log10().floor()).max(0.0) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.3e}")
    };
    let (number, exponent) = text.split_at(text.find('e').unwrap_or(text.len()));
    let number = match number.contains('.') {
        true => number.trim_end_matches('0').trim_end_matches('.'),
        false => number,
    };
    format!("{number}{exponent}")
}

#[cfg(test)]
mod tests {
    use cloth::scene::Scene;

    use super::*;

    fn all() -> Vec<Parameter> {
        let single = [
            ITERATIONS,
            MASS_PER_AREA,
            MASS_PER_PARTICLE,
            THICKNESS,
            RIGIDITY,
            PRESSURE,
            SKIN_FRICTION,
            GRAVITY,
            AIR_DENSITY,
            WIND,
            GUST_AMPLITUDE,
            GUST_FREQUENCY,
            CONTACT_DISTANCE,
            CONTACT_FRICTION,
            CONTACT_STIFFNESS,
            CONTACT_DAMPING,
            COLLIDER_FRICTION,
            RIGID_FRICTION,
        ];
        TIME_STEPS.into_iter().chain(SPRINGS.into_iter().flatten()).chain(single).collect()
    }

    #[test]
    fn values_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (3.0e-5, "3e-5"),
            (0.123_46, "0.1235"),
            (12.346, "12.35"),
            (-1234.5, "-1234"),
            (5.0, "5"),
            (10.0, "10"),
            (0.537_634, "0.5376"),
            (100_000.0, "1e5"),
            (123_456.0, "1.235e5"),
        ] {
            assert_eq!(figures(value), text, "{value}");
        }
    }

    /// A scene that says everything the panel can change: a key that does not exist is refused by the reader.
    #[test]
    fn the_keys_are_those_of_scene_files() {
        for parameter in all() {
            let mut path: Vec<&str> = parameter.key.split('.').collect();
            let last = path.pop().unwrap();
            let table = match path.first() {
                Some(&("cloth" | "collider" | "rigid")) => {
                    let (first, rest) = path.split_first().unwrap();
                    let rest = rest.join(".");
                    let rest = if rest.is_empty() { String::new() } else { format!("{rest}.") };
                    format!("[[{first}]]\n{rest}")
                }
                _ if path.is_empty() => String::new(),
                _ => format!("[{}]\n", path.join(".")),
            };
            // Of the wrong kind: what is known is refused for its kind, what is not known for its name.
            let text = format!("name = \"a\"\n{table}{last} = \"no number\"\n");
            let error = Scene::from_toml(&text, "keys.toml").unwrap_err().to_string();
            assert!(error.contains("no number") && !error.contains("unknown"), "{text}: {error}");
        }
    }

    #[test]
    fn tooltips_tell_the_unit_and_the_key() {
        assert_eq!(
            THICKNESS.tooltip(Some("flag")),
            "Colliders stop the particles at half of it.\nUnit: mm; scene files have m\nScene key: \
             cloth.material.thickness of `flag`"
        );
        for parameter in all() {
            let tooltip = parameter.tooltip(None);
            assert!(tooltip.contains("\nUnit: ") && tooltip.contains(parameter.key), "{tooltip}");
            assert!(parameter.range[0] < parameter.range[1]);
        }
    }
}
