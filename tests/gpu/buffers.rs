//! Buffers that a renderer on the same device can use as they are.

use cloth_backend_wgpu::{DeviceBuffers, WgpuBackend, wgpu};
use cloth_core::{Control, PinAction, PinControl, Solver, State};
use harness::backends::gpu;

use crate::rig::{PENALTY, advance, config, model};

/// Copies a buffer to the host with the device and queue that came with it.
fn read(buffers: &DeviceBuffers, buffer: &wgpu::Buffer) -> Vec<[f32; 4]> {
    let target = buffers.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: buffer.size(),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = buffers.device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &target, 0, None);
    buffers.queue.submit([encoder.finish()]);
    target.slice(..).map_async(wgpu::MapMode::Read, |outcome| outcome.unwrap());
    buffers.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    let view = target.slice(..).get_mapped_range().unwrap();
    let number = |bytes: &[u8]| f32::from_ne_bytes(bytes.try_into().unwrap());
    view.chunks_exact(16)
        .map(|vector| std::array::from_fn(|k| number(&vector[4 * k..4 * k + 4])))
        .collect()
}

#[test]
fn a_renderer_sees_the_present_positions_and_normals() {
    // The renderer's device comes first, as in a viewer.
    let renderer = gpu();
    let queue_owner = renderer.create_wgpu_solver(model(3, None), &config()).unwrap();
    let mut queue_owner = queue_owner;
    let shared = queue_owner.device_buffers().unwrap();
    let backend = WgpuBackend::from_device(shared.device.clone(), shared.queue.clone());
    for contact in [None, Some(PENALTY)] {
        let model = model(17, contact);
        let mut solver = backend.create_wgpu_solver(model.clone(), &config()).unwrap();
        for _ in 0..3 {
            advance(&mut solver, 1);
            let buffers = solver.device_buffers().unwrap();
            let [positions, normals] =
                [&buffers.positions, &buffers.normals].map(|buffer| read(&buffers, buffer));
            let mut state = State::default();
            solver.download(&mut state).unwrap();
            let mut expected = Vec::new();
            solver.normals(&mut expected).unwrap();
            assert_eq!(positions.len(), model.particle_count());
            for particle in 0..positions.len() {
                let [x, y, z, inverse_mass] = positions[particle];
                assert_eq!([x, y, z].map(f64::from), state.positions[particle]);
                assert_eq!(inverse_mass, 1e4, "1/m");
                let [x, y, z, zero] = normals[particle];
                assert_eq!([x, y, z].map(f64::from), expected[particle]);
                assert_eq!(zero, 0.0);
            }
        }
    }
}

/// Where a particle is that is held at rest is remembered; one in flight is looked up when it is first moved.
#[test]
fn a_pin_that_moves_is_looked_up_once_at_most() {
    let renderer = gpu();
    let mut owner = renderer.create_wgpu_solver(model(3, None), &config()).unwrap();
    let shared = owner.device_buffers().unwrap();
    let backend = WgpuBackend::from_device(shared.device.clone(), shared.queue.clone());
    let model = model(17, None);
    let mut solver = backend.create_wgpu_solver(model.clone(), &config()).unwrap();
    let bytes = |solver: &mut dyn Solver, pins: Vec<PinControl>| {
        let before = backend.bytes_read();
        solver.set_control(&Control { pins, ..Control::default() }).unwrap();
        advance(solver, 1);
        backend.bytes_read() - before
    };
    let pin = |particle: u32, action: PinAction| PinControl { particle, action };
    let up = |height: f64| PinAction::MoveTo([0.1, 0.2, height]);
    let idle = bytes(&mut solver, Vec::new());
    let state = 32 * model.particle_count() as u64;
    assert_eq!(bytes(&mut solver, vec![pin(5, up(0.1))]), idle + state, "it was in flight");
    for frame in 1..4 {
        assert_eq!(bytes(&mut solver, vec![pin(5, up(0.1 + 0.01 * f64::from(frame)))]), idle);
    }
    assert_eq!(solver.particle_position(5).unwrap().map(|x| x as f32), [0.1, 0.2, 0.13]);
    bytes(&mut solver, vec![pin(5, PinAction::Release), pin(6, PinAction::Hold)]);
    assert_eq!(bytes(&mut solver, vec![pin(5, up(0.1)), pin(6, up(0.2))]), idle + state);
    assert_eq!(bytes(&mut solver, vec![pin(5, up(0.2)), pin(6, up(0.1))]), idle);
}
