//! Colours and other numbers of the vertices of a glTF file.

use std::collections::BTreeMap;

use cloth_core::VertexAttribute;
use gltf::accessor::{DataType, Dimensions, Item, Iter};
use gltf::{Accessor, Semantic};

use super::MeshError;
use super::assembly::too_large;
use super::gltf_accessor::GltfData;

/// Names of the parts of a colour, those that PLY files give them.
const COLOUR_PARTS: [&str; 4] = ["red", "green", "blue", "alpha"];

/// Names of the parts of any other vector.
const VECTOR_PARTS: [&str; 4] = ["x", "y", "z", "w"];

/// Most attributes of a mesh: each has a number for every vertex, whether the file gives it or not.
const ATTRIBUTES_MAX: usize = 64;

/// Whether an attribute chooses pins.
pub(super) fn chooses(semantic: &Semantic) -> bool {
    matches!(semantic, Semantic::Colors(0) | Semantic::Extras(_))
}

impl GltfData<'_> {
    /// Names and values of an attribute that chooses pins. One that this reader does not understand is left out: it
    /// may mean nothing to cloth.
    pub(super) fn attribute(
        &self,
        semantic: &Semantic,
        accessor: &Accessor<'_>,
    ) -> Vec<(String, Vec<f32>)> {
        let Some(values) = self.numbers(accessor) else { return Vec::new() };
        match semantic {
            Semantic::Colors(0) => {
                let named = COLOUR_PARTS.iter().zip(values);
                named.map(|(name, values)| ((*name).to_owned(), values)).collect()
            }
            Semantic::Extras(name) => {
                let name = name.to_ascii_lowercase();
                if values.len() == 1 {
                    values.into_iter().map(|values| (name.clone(), values)).collect()
                } else {
                    let named = VECTOR_PARTS.iter().zip(values);
                    named.map(|(part, values)| (format!("{name}.{part}"), values)).collect()
                }
            }
            _ => Vec::new(),
        }
    }

    /// The numbers of an accessor, an array for each part of its vectors.
    fn numbers(&self, accessor: &Accessor<'_>) -> Option<Vec<Vec<f32>>> {
        let parts = match accessor.dimensions() {
            Dimensions::Scalar => 1,
            Dimensions::Vec2 => 2,
            Dimensions::Vec3 => 3,
            Dimensions::Vec4 => 4,
            _ => return None,
        };
        let of_type = |data_type| self.check(accessor, accessor.dimensions(), &[data_type]).is_ok();
        let data_type = accessor.data_type();
        // Whole numbers that are not parts of one are taken as they are.
        let scale = |largest: f32| if accessor.normalized() { 1.0 / largest } else { 1.0 };
        if !of_type(data_type) {
            return None;
        }
        match data_type {
            DataType::F32 => self.split::<f32>(accessor, parts, |value| value),
            DataType::U8 => {
                let scale = scale(f32::from(u8::MAX));
                self.split::<u8>(accessor, parts, |value| scale * f32::from(value))
            }
            DataType::U16 => {
                let scale = scale(f32::from(u16::MAX));
                self.split::<u16>(accessor, parts, |value| scale * f32::from(value))
            }
            _ => None,
        }
    }

    /// Reads vectors of `parts` numbers.
    fn split<T: Item + Copy>(
        &self,
        accessor: &Accessor<'_>,
        parts: usize,
        number: impl Fn(T) -> f32,
    ) -> Option<Vec<Vec<f32>>>
    where
        [T; 2]: Item,
        [T; 3]: Item,
        [T; 4]: Item,
    {
        let bytes = |buffer: gltf::Buffer<'_>| self.bytes(&buffer);
        let mut values = vec![Vec::with_capacity(accessor.count()); parts];
        let mut push = |vector: &[T]| {
            for (values, &value) in values.iter_mut().zip(vector) {
                values.push(number(value));
            }
        };
        match parts {
            1 => Iter::<T>::new(accessor.clone(), bytes)?.for_each(|value| push(&[value])),
            2 => Iter::<[T; 2]>::new(accessor.clone(), bytes)?.for_each(|value| push(&value)),
            3 => Iter::<[T; 3]>::new(accessor.clone(), bytes)?.for_each(|value| push(&value)),
            _ => Iter::<[T; 4]>::new(accessor.clone(), bytes)?.for_each(|value| push(&value)),
        }
        Some(values)
    }
}

/// Attributes of vertices, each of which can be given several times.
#[derive(Default)]
pub(super) struct AttributeMeans {
    /// For each name the sums and their numbers of terms.
    sums: BTreeMap<String, Vec<(f32, u32)>>,
}

impl AttributeMeans {
    /// Adds the value of each of `vertices`.
    pub(super) fn add(
        &mut self,
        file: &str,
        name: String,
        vertices: &[i64],
        values: &[f32],
    ) -> Result<(), MeshError> {
        let count = self.sums.len() + usize::from(!self.sums.contains_key(&name));
        if count > ATTRIBUTES_MAX {
            return Err(too_large(file, "attributes of vertices", count, ATTRIBUTES_MAX));
        }
        let sums = self.sums.entry(name).or_default();
        for (&vertex, value) in vertices.iter().zip(values) {
            let Ok(vertex) = usize::try_from(vertex) else { continue };
            if sums.len() <= vertex {
                sums.resize(vertex + 1, (0.0, 0));
            }
            let (sum, count) = &mut sums[vertex];
            *sum += value;
            *count += 1;
        }
        Ok(())
    }

    /// The means for `vertex_count` vertices; zero where a file gives none.
    pub(super) fn finish(self, vertex_count: usize) -> Vec<VertexAttribute> {
        let mean = |(sum, count): (f32, u32)| if count == 0 { 0.0 } else { sum / count as f32 };
        let attribute = |(name, mut sums): (String, Vec<_>)| {
            sums.resize(vertex_count, (0.0, 0));
            VertexAttribute { name, values: sums.into_iter().map(mean).collect() }
        };
        self.sums.into_iter().map(attribute).collect()
    }
}
