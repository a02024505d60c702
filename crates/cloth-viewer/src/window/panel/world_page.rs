//! What acts on the cloths from outside, and what they touch.

use cloth::scene::{SceneContact, SceneContactResponse, SceneGust, SceneWind};
use eframe::egui::Ui;

use super::{heading, tick};
use crate::{
    Settings,
    window::parameters::{
        AIR_DENSITY, COLLIDER_FRICTION, CONTACT_DAMPING, CONTACT_DISTANCE, CONTACT_FRICTION,
        CONTACT_STIFFNESS, GRAVITY, GUST_AMPLITUDE, GUST_FREQUENCY, RIGID_FRICTION, WIND,
    },
};

pub(super) fn show(ui: &mut Ui, settings: &mut Settings) {
    GRAVITY.row_vector(ui, ["gravity x", "gravity y", "gravity z"], &mut settings.gravity);
    ui.add_space(6.0);
    air(ui, &mut settings.air);
    ui.add_space(6.0);
    let spacing = settings.cloths.iter().map(|cloth| cloth.spacing).fold(f64::INFINITY, f64::min);
    let thickness =
        settings.cloths.iter().map(|cloth| cloth.material.thickness).fold(0.0, f64::max);
    contact(ui, &mut settings.contact, SceneContact::usual_distance(spacing, thickness));
    if !settings.surfaces.is_empty() {
        heading(ui, "Friction of");
    }
    for (number, surface) in settings.surfaces.iter_mut().enumerate() {
        let parameter = if surface.is_rigid { RIGID_FRICTION } else { COLLIDER_FRICTION };
        let mark = if number == 0 { "collider friction" } else { "" };
        let name = Some(&*surface.name);
        ui.push_id(number, |ui| {
            parameter.row_named(ui, &surface.name, mark, name, &mut surface.friction);
        });
    }
}

fn air(ui: &mut Ui, air: &mut Option<SceneWind>) {
    let mut is_on = air.is_some();
    if tick(ui, "air", "Without air nothing slows the cloth, and no wind blows", "wind", &mut is_on)
    {
        let still = SceneWind { velocity: [0.0; 3], density: 1.204, gust: None };
        *air = is_on.then_some(still);
    }
    let Some(air) = air else { return };
    AIR_DENSITY.row(ui, "air density", None, &mut air.density);
    WIND.row_vector(ui, ["wind x", "wind y", "wind z"], &mut air.velocity);
    let mut has_gusts = air.gust.is_some();
    let tip = "The wind swells and dies down: its velocity is multiplied by 1 + amplitude sin(2 π frequency t)";
    if tick(ui, "gusts", tip, "wind.gust", &mut has_gusts) {
        air.gust = has_gusts.then_some(SceneGust { amplitude: 0.25, frequency: 0.5 });
    }
    if let Some(gust) = &mut air.gust {
        GUST_AMPLITUDE.row(ui, "gust amplitude", None, &mut gust.amplitude);
        GUST_FREQUENCY.row(ui, "gust frequency", None, &mut gust.frequency);
    }
}

fn contact(ui: &mut Ui, contact: &mut Option<SceneContact>, usual_distance: f64) {
    let mut touches = contact.is_some();
    let tip = "Contact of cloths with themselves and each other";
    if tick(ui, "self-contact", tip, "contact", &mut touches) {
        *contact = touches.then(SceneContact::default);
    }
    let Some(contact) = contact else { return };
    let distance = contact.distance.get_or_insert(usual_distance);
    CONTACT_DISTANCE.row(ui, "contact distance", None, distance);
    match &mut contact.response {
        SceneContactResponse::None => {}
        SceneContactResponse::Impulse { friction, .. }
        | SceneContactResponse::Triangles { friction } => {
            CONTACT_FRICTION.row(ui, "contact friction", None, friction);
        }
        SceneContactResponse::Penalty { stiffness, damping } => {
            CONTACT_STIFFNESS.row(ui, "contact stiffness", None, stiffness);
            CONTACT_DAMPING.row(ui, "contact damping", None, damping);
        }
    }
}
