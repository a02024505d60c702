//! What computes, and how finely.

use cloth::{LinearMethod, Preconditioner, scene::SceneSolver};
use eframe::egui::Ui;

use super::choice;
use crate::{
    Settings,
    window::parameters::{ITERATIONS, TIME_STEPS},
};

pub(super) fn show(ui: &mut Ui, settings: &mut Settings, backends: &[&'static str]) {
    let names = backends.iter().map(|&name| (name.to_owned(), name));
    let tip = "What computes: the processor, or a GPU through Vulkan, Metal, DirectX or CUDA\nOption: --backend";
    choice(ui, "backend", tip, &mut settings.backend, names);
    let solvers = SceneSolver::ALL.iter().map(|&solver| (solver, solver.name()));
    let tip =
        "How the state is advanced; comes with its own time step\nScene key: simulation.solver";
    choice(ui, "integrator", tip, &mut settings.solver, solvers);
    let number = SceneSolver::ALL.iter().position(|&solver| solver == settings.solver);
    TIME_STEPS[number.unwrap_or(0)].row(ui, "time step", None, &mut settings.time_step);
    // Always there, so that nothing moves; what does not matter is grey.
    ui.add_enabled_ui(settings.solver == SceneSolver::Implicit, |ui| {
        let methods = LinearMethod::ALL.iter().map(|&method| (method, method.name()));
        let tip = "Method for the linear systems of the implicit integrator\nScene key: simulation.implicit.linear";
        choice(ui, "linear solver", tip, &mut settings.linear, methods);
        let gradients = settings.linear == LinearMethod::ConjugateGradient;
        ui.add_enabled_ui(gradients, |ui| {
            let all = Preconditioner::ALL.iter().map(|&one| (one, one.name()));
            let tip = "Preconditioner of conjugate gradients\nScene key: simulation.implicit.preconditioner";
            choice(ui, "preconditioner", tip, &mut settings.preconditioner, all);
        });
        let mut iterations = f64::from(settings.iterations);
        if ITERATIONS.row(ui, "iterations", None, &mut iterations) {
            settings.iterations = iterations.round() as u32;
        }
    });
    ui.add_enabled_ui(settings.backend == "wgpu", |ui| {
        ui.checkbox(&mut settings.stage_times, "time of every stage").on_hover_text(
            "The program then waits for the device to give them, which costs speed; the processor gives them always",
        );
    });
}
