//! The animation of a glTF file.

use gltf_json::accessor::{Accessor, Type};
use gltf_json::animation::{Animation, Channel, Interpolation, Property, Sampler, Target};
use gltf_json::validation::Checked::Valid;
use gltf_json::{Index, Node};

use super::gltf_builder::GltfBuilder;

/// What moves.
#[derive(Default)]
pub(super) struct Motion {
    /// Nodes whose mesh has a morph target for each frame but the first.
    targets: Vec<Index<Node>>,
    /// Nodes of which a property has a vector for each frame.
    vectors: Vec<(Index<Node>, Property, Vectors)>,
}

/// A vector for each frame.
pub(super) enum Vectors {
    Three(Vec<[f32; 3]>),
    Four(Vec<[f32; 4]>),
}

impl Motion {
    /// The mesh of `node` goes from morph target to morph target.
    pub(super) fn targets_of(&mut self, node: Index<Node>) {
        self.targets.push(node);
    }

    /// A property of `node` takes these values, if they are not all the same.
    pub(super) fn vectors_of(&mut self, node: Index<Node>, property: Property, vectors: Vectors) {
        let moves = match &vectors {
            Vectors::Three(vectors) => vectors.windows(2).any(|pair| pair[0] != pair[1]),
            Vectors::Four(vectors) => vectors.windows(2).any(|pair| pair[0] != pair[1]),
        };
        if moves {
            self.vectors.push((node, property, vectors));
        }
    }

    /// Adds the animation of frames at these times \[s\]; it begins with the first.
    pub(super) fn finish(self, builder: &mut GltfBuilder, times: impl Iterator<Item = f64>) {
        let times: Vec<f64> = times.collect();
        let start = times.first().copied().unwrap_or_default();
        let times: Vec<f32> = times.iter().map(|time| (time - start) as f32).collect();
        let input = builder.numbers(&times);
        let mut samplers = Vec::new();
        let mut channels = Vec::new();
        if !self.targets.is_empty() {
            samplers.push(sampler(input, builder.numbers(&weights(times.len()))));
            let property = Property::MorphTargetWeights;
            channels.extend(self.targets.into_iter().map(|node| channel(0, node, property)));
        }
        for (node, property, vectors) in self.vectors {
            let output = match &vectors {
                Vectors::Three(vectors) => builder.samples(vectors, Type::Vec3),
                Vectors::Four(vectors) => builder.samples(vectors, Type::Vec4),
            };
            channels.push(channel(samplers.len() as u32, node, property));
            samplers.push(sampler(input, output));
        }
        builder.root.animations.push(Animation {
            name: Some("simulation".to_owned()),
            samplers,
            channels,
            extensions: None,
            extras: Default::default(),
        });
    }
}

/// Each target has its full weight at its frame and none at all others.
fn weights(frame_count: usize) -> Vec<f32> {
    let target_count = frame_count - 1;
    let mut weights = vec![0.0; frame_count * target_count];
    for target in 0..target_count {
        weights[(target + 1) * target_count + target] = 1.0;
    }
    weights
}

fn sampler(input: Index<Accessor>, output: Index<Accessor>) -> Sampler {
    Sampler {
        input,
        output,
        interpolation: Valid(Interpolation::Linear),
        extensions: None,
        extras: Default::default(),
    }
}

fn channel(sampler: u32, node: Index<Node>, property: Property) -> Channel {
    Channel {
        sampler: Index::new(sampler),
        target: Target {
            node,
            path: Valid(property),
            extensions: None,
            extras: Default::default(),
        },
        extensions: None,
        extras: Default::default(),
    }
}
