//! What the pointer does over the picture.

use eframe::egui::{self, Event, PointerButton, Response};

use crate::{Command, OrbitCamera, Ray};

/// What the pointer asks of the simulation; the camera is turned at once. `pulled_to` is where the cloth
/// was last pulled, while it is.
pub(super) fn pointer(
    ui: &egui::Ui,
    response: &Response,
    camera: &mut OrbitCamera,
    pulled_to: &mut Option<egui::Pos2>,
) -> Vec<Command> {
    let mut commands = Vec::new();
    let rect = response.rect;
    let modifiers = ui.input(|input| input.modifiers);
    let ray = |position: egui::Pos2, camera: &OrbitCamera| -> Ray {
        let place = (position - rect.min) / rect.size();
        camera.ray([place.x.into(), place.y.into()], rect.aspect_ratio().into())
    };
    let moved = response.drag_delta() / rect.height().max(1.0);
    let (right, down) = (f64::from(moved.x), f64::from(moved.y));

    let turns = response.dragged_by(PointerButton::Primary) && modifiers.alt
        || response.dragged_by(PointerButton::Secondary) && !modifiers.shift;
    let shifts = response.dragged_by(PointerButton::Middle)
        || response.dragged_by(PointerButton::Secondary) && modifiers.shift;
    if turns {
        camera.orbit(right, down);
    } else if shifts {
        camera.pan(right, down);
    }
    if response.hovered() {
        let wheel = ui.input(|input| input.smooth_scroll_delta.y);
        camera.zoom(f64::from(wheel) / 50.0);
    }

    if response.clicked() && command_clicked(ui) {
        if let Some(position) = response.interact_pointer_pos() {
            commands.push(Command::PinToggle(ray(position, camera)));
        }
        return commands;
    }
    let plain = !modifiers.alt && !modifiers.command;
    if response.drag_started_by(PointerButton::Primary) && plain {
        // Where the button went down; the pointer has moved a little since.
        let start = ui.input(|input| input.pointer.press_origin());
        if let Some(start) = start {
            commands.push(Command::GrabBegin(ray(start, camera)));
            *pulled_to = Some(start);
        }
    }
    if let Some(told) = *pulled_to {
        match response.interact_pointer_pos() {
            Some(position) if response.dragged_by(PointerButton::Primary) => {
                if position != told {
                    commands.push(Command::GrabMove(ray(position, camera)));
                    *pulled_to = Some(position);
                }
            }
            _ => {
                commands.push(Command::GrabEnd);
                *pulled_to = None;
            }
        }
    }
    commands
}

/// Whether the control key was down when the button went up; on a slow machine it may be up again when the
/// picture is drawn.
fn command_clicked(ui: &egui::Ui) -> bool {
    ui.input(|input| {
        input.events.iter().any(|event| {
            let Event::PointerButton { button, pressed, modifiers, .. } = event else {
                return false;
            };
            *button == PointerButton::Primary && !pressed && modifiers.command
        })
    })
}
