//! What each cloth is made of.

use cloth::{BendModel, Mass, Material, MaterialPreset};
use eframe::egui::{ComboBox, Ui};

use super::heading;
use crate::{
    Settings,
    window::{
        parameters::{
            MASS_PER_AREA, MASS_PER_PARTICLE, PRESSURE, RIGIDITY, SKIN_FRICTION, SPRINGS,
            THICKNESS, VALUE, row,
        },
        places,
    },
};

/// Names of the fields of each class of springs.
const MARKS: [[&str; 2]; 3] = [
    ["stretch stiffness", "stretch damping"],
    ["shear stiffness", "shear damping"],
    ["bend stiffness", "bend damping"],
];

pub(super) fn show(ui: &mut Ui, chosen: &mut usize, settings: &mut Settings) {
    *chosen = (*chosen).min(settings.cloths.len().saturating_sub(1));
    let several = settings.cloths.len() > 1;
    row(ui, "cloth", "The cloth whose values are shown\nScene key: cloth.name", |ui| {
        let name = settings.cloths.get(*chosen).map_or("", |cloth| &cloth.name);
        let list = ComboBox::from_id_salt("cloth").width(VALUE).truncate().selected_text(name);
        ui.add_enabled_ui(several, |ui| {
            let response = list.show_ui(ui, |ui| {
                for (number, cloth) in settings.cloths.iter().enumerate() {
                    ui.selectable_value(chosen, number, &cloth.name);
                }
            });
            places::mark("cloth", &response.response);
        });
    });
    let Some(cloth) = settings.cloths.get_mut(*chosen) else { return };
    let tip = "A fabric that was measured; choosing one sets all values below\nScene key: cloth.material.preset";
    row(ui, "preset", tip, |ui| {
        let text = cloth.preset.clone().unwrap_or_else(|| "none".into());
        let list = ComboBox::from_id_salt("preset").width(VALUE).truncate().selected_text(text);
        let response = list.show_ui(ui, |ui| {
            for preset in &MaterialPreset::ALL {
                let is_chosen = cloth.preset.as_deref() == Some(preset.name);
                let label = ui.selectable_label(is_chosen, preset.name);
                if label.on_hover_text(preset.fabric).clicked() {
                    cloth.preset_choose(preset);
                }
            }
        });
        places::mark("preset", &response.response);
    });
    let table = Some(&*cloth.name);
    let material = &mut cloth.material;
    match &mut material.mass {
        Mass::PerArea(mass) => MASS_PER_AREA.row(ui, "mass", table, mass),
        Mass::PerParticle(mass) => MASS_PER_PARTICLE.row(ui, "mass", table, mass),
    };
    THICKNESS.row(ui, "thickness", table, &mut material.thickness);
    if !cloth.is_fabric {
        springs(ui, table, material);
    }
    heading(ui, "Drag of the air");
    PRESSURE.row(ui, "air pressure", table, &mut material.aerodynamics.pressure);
    SKIN_FRICTION.row(ui, "air friction", table, &mut material.aerodynamics.friction);
}

/// The springs of a cloth that is made of them.
fn springs(ui: &mut Ui, table: Option<&str>, material: &mut Material) {
    heading(ui, "Springs");
    let springs = [&mut material.stretch, &mut material.shear, &mut material.bend];
    for ((spring, [stiffness, damping]), marks) in springs.into_iter().zip(SPRINGS).zip(MARKS) {
        stiffness.row(ui, marks[0], table, &mut spring.stiffness);
        damping.row(ui, marks[1], table, &mut spring.damping);
    }
    if let BendModel::ImmediateBuckling { rigidity } = &mut material.bend_model {
        RIGIDITY.row(ui, "rigidity", table, rigidity);
    }
}
