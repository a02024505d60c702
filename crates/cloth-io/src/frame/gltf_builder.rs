//! Gathers arrays and objects of a glTF file.

use bytemuck::NoUninit;
use gltf_json::accessor::{Accessor, ComponentType, GenericComponentType, Type};
use gltf_json::buffer::{Buffer, Target, View};
use gltf_json::validation::Checked::Valid;
use gltf_json::validation::USize64;
use gltf_json::{Index, Root};

/// The JSON part and the binary part of a `.glb` file in the making.
pub(super) struct GltfBuilder {
    pub(super) root: Root,
    bytes: Vec<u8>,
}

impl GltfBuilder {
    pub(super) fn new() -> Self {
        let mut root = Root::default();
        root.asset.generator = Some(format!("cloth {}", env!("CARGO_PKG_VERSION")));
        Self { root, bytes: Vec::new() }
    }

    /// Adds vectors for vertices.
    pub(super) fn vectors<const N: usize>(
        &mut self,
        values: &[[f32; N]],
        type_: Type,
    ) -> Index<Accessor>
    where
        [f32; N]: NoUninit,
    {
        let (min, max) = range(values);
        let accessor = self.accessor(
            values,
            values.len(),
            ComponentType::F32,
            type_,
            Some(Target::ArrayBuffer),
        );
        self.set_range(accessor, &min, &max)
    }

    /// Adds numbers for an animation.
    pub(super) fn numbers(&mut self, values: &[f32]) -> Index<Accessor> {
        let single: Vec<[f32; 1]> = values.iter().map(|&value| [value]).collect();
        let (min, max) = range(&single);
        let count = values.len();
        let accessor = self.accessor(values, count, ComponentType::F32, Type::Scalar, None);
        self.set_range(accessor, &min, &max)
    }

    /// Adds vectors for an animation.
    pub(super) fn samples<const N: usize>(
        &mut self,
        values: &[[f32; N]],
        type_: Type,
    ) -> Index<Accessor>
    where
        [f32; N]: NoUninit,
    {
        self.accessor(values, values.len(), ComponentType::F32, type_, None)
    }

    /// Adds the vertex indices of triangles, lines or points.
    pub(super) fn indices<const N: usize>(&mut self, elements: &[[u32; N]]) -> Index<Accessor>
    where
        [u32; N]: NoUninit,
    {
        let count = N * elements.len();
        let target = Some(Target::ElementArrayBuffer);
        self.accessor(elements, count, ComponentType::U32, Type::Scalar, target)
    }

    fn set_range(&mut self, index: Index<Accessor>, min: &[f32], max: &[f32]) -> Index<Accessor> {
        let accessor = &mut self.root.accessors[index.value()];
        accessor.min = Some(min.into());
        accessor.max = Some(max.into());
        index
    }

    fn accessor<T: NoUninit>(
        &mut self,
        values: &[T],
        count: usize,
        component_type: ComponentType,
        type_: Type,
        target: Option<Target>,
    ) -> Index<Accessor> {
        let bytes: &[u8] = bytemuck::cast_slice(values);
        let view = push(
            &mut self.root.buffer_views,
            View {
                buffer: Index::new(0),
                byte_length: USize64::from(bytes.len()),
                byte_offset: Some(USize64::from(self.bytes.len())),
                byte_stride: None,
                name: None,
                target: target.map(Valid),
                extensions: None,
                extras: Default::default(),
            },
        );
        // All numbers have 4 bytes, so every array starts aligned.
        self.bytes.extend_from_slice(bytes);
        push(
            &mut self.root.accessors,
            Accessor {
                buffer_view: Some(view),
                byte_offset: None,
                count: USize64::from(count),
                component_type: Valid(GenericComponentType(component_type)),
                extensions: None,
                extras: Default::default(),
                type_: Valid(type_),
                min: None,
                max: None,
                name: None,
                normalized: false,
                sparse: None,
            },
        )
    }

    /// The finished JSON and binary parts.
    pub(super) fn finish(mut self) -> (Root, Vec<u8>) {
        self.root.buffers.push(Buffer {
            byte_length: USize64::from(self.bytes.len()),
            name: None,
            uri: None,
            extensions: None,
            extras: Default::default(),
        });
        (self.root, self.bytes)
    }
}

/// Adds `value` to `list` and returns its index.
pub(super) fn push<T>(list: &mut Vec<T>, value: T) -> Index<T> {
    list.push(value);
    Index::new((list.len() - 1) as u32)
}

fn range<const N: usize>(values: &[[f32; N]]) -> ([f32; N], [f32; N]) {
    let mut min = [f32::INFINITY; N];
    let mut max = [f32::NEG_INFINITY; N];
    for value in values {
        for slot in 0..N {
            min[slot] = min[slot].min(value[slot]);
            max[slot] = max[slot].max(value[slot]);
        }
    }
    (min, max)
}
