//! What is drawn, and pictures of it.

use cloth::StrainMeasure;
use eframe::egui::{DragValue, Ui};

use super::{PanelRequest, PanelView, heading};
use crate::{ClipFormat, window::places};

const fn measure_text(measure: StrainMeasure) -> &'static str {
    match measure {
        StrainMeasure::Stretch => "The larger principal stretch less 1",
        StrainMeasure::Warp => "Size of the Green strain along the warp",
        StrainMeasure::Weft => "Size of the Green strain along the weft",
        StrainMeasure::Shear => "Size of the Green strain between warp and weft",
    }
}

pub(super) fn show(ui: &mut Ui, view: &mut PanelView<'_>) -> Vec<PanelRequest> {
    let mut requests = Vec::new();
    let overlays = &mut *view.overlays;
    ui.checkbox(&mut overlays.surface, "surface");
    ui.checkbox(&mut overlays.wires, "wireframe").on_hover_text("The sides of all triangles (W)");
    ui.horizontal(|ui| {
        ui.checkbox(&mut overlays.strain, "strain, red at");
        let percent = DragValue::from_get_set(|value| {
            if let Some(percent) = value {
                overlays.strain_scale = percent * 0.01;
            }
            overlays.strain_scale * 100.0
        });
        let percent = percent.range(0.1..=1000.0).speed(0.1).max_decimals(1).suffix(" %");
        ui.add(percent).on_hover_text(
            "Strain: of fabric what is chosen, of springs how much longer they are than at rest",
        );
    });
    ui.horizontal(|ui| {
        for measure in StrainMeasure::ALL {
            let chosen = &mut overlays.strain_measure;
            ui.selectable_value(chosen, measure, measure.name())
                .on_hover_text(measure_text(measure));
        }
    });
    ui.checkbox(&mut overlays.threads, "warp and weft")
        .on_hover_text("Lines on fabric along its threads: warp dark, weft light");
    ui.checkbox(&mut overlays.pins, "pins").on_hover_text("Particles that are held");
    ui.checkbox(&mut overlays.contacts, "contacts")
        .on_hover_text("Particles that touch something; found on the host");
    ui.checkbox(&mut overlays.bins, "bins")
        .on_hover_text("Cells of the search for particles that touch; found on the host");
    heading(ui, "Springs");
    ui.horizontal(|ui| {
        for (slot, name) in ["stretch", "shear", "bend"].into_iter().enumerate() {
            ui.checkbox(&mut overlays.springs[slot], name);
        }
    });
    heading(ui, "Camera");
    if ui.button("back to the view of the scene").clicked() {
        requests.push(PanelRequest::View);
    }
    heading(ui, "Pictures");
    if ui.button("screenshot").on_hover_text("S").clicked() {
        requests.push(PanelRequest::Screenshot);
    }
    ui.horizontal(|ui| {
        let text = if view.is_recording { "end recording" } else { "record" };
        let response = ui.button(text).on_hover_text("V");
        places::mark("record", &response);
        if response.clicked() {
            requests.push(PanelRequest::Record);
        }
        ui.add_enabled_ui(!view.is_recording, |ui| {
            for choice in ClipFormat::ALL {
                ui.selectable_value(view.format, choice, choice.extension());
            }
        });
    });
    requests
}
