//! Reads the arrays of a glTF file after checking that they lie inside their buffers: the glTF
//! library takes sizes and types on trust.

use std::borrow::Cow;

use gltf::accessor::{DataType, Dimensions};
use gltf::{Accessor, Primitive, Semantic};

use super::MeshError;
use super::gltf::syntax;

/// The buffers of a glTF file.
pub(super) struct GltfData<'file> {
    pub(super) file: &'file str,
    pub(super) buffers: Vec<Cow<'file, [u8]>>,
}

impl GltfData<'_> {
    /// The vertex positions.
    pub(super) fn positions(&self, primitive: &Primitive<'_>) -> Result<Vec<[f32; 3]>, MeshError> {
        let Some(accessor) = primitive.get(&Semantic::Positions) else {
            return Err(syntax(self.file, "a primitive has no POSITION".to_owned()));
        };
        self.check(&accessor, Dimensions::Vec3, &[DataType::F32])?;
        let positions = primitive.reader(|buffer| self.bytes(&buffer)).read_positions();
        positions.map(Iterator::collect).ok_or_else(|| self.outside(&accessor))
    }

    /// The first set of texture coordinates, if any.
    pub(super) fn texture_coordinates(
        &self,
        primitive: &Primitive<'_>,
    ) -> Result<Option<Vec<[f64; 2]>>, MeshError> {
        let Some(accessor) = primitive.get(&Semantic::TexCoords(0)) else {
            return Ok(None);
        };
        let types = [DataType::F32, DataType::U8, DataType::U16];
        self.check(&accessor, Dimensions::Vec2, &types)?;
        let coordinates = primitive.reader(|buffer| self.bytes(&buffer)).read_tex_coords(0);
        let Some(coordinates) = coordinates else {
            return Err(self.outside(&accessor));
        };
        // The format puts the origin of texture space at the top, the engine and OBJ at the bottom.
        let flipped = |[u, v]: [f32; 2]| [f64::from(u), 1.0 - f64::from(v)];
        Ok(Some(coordinates.into_f32().map(flipped).collect()))
    }

    /// The vertex indices in drawing order; without an index array all vertices in turn.
    pub(super) fn indices(
        &self,
        primitive: &Primitive<'_>,
        vertex_count: usize,
    ) -> Result<Vec<u32>, MeshError> {
        let Some(accessor) = primitive.indices() else {
            return Ok((0..u32::try_from(vertex_count).unwrap_or(u32::MAX)).collect());
        };
        let types = [DataType::U8, DataType::U16, DataType::U32];
        self.check(&accessor, Dimensions::Scalar, &types)?;
        let indices = primitive.reader(|buffer| self.bytes(&buffer)).read_indices();
        indices.map(|indices| indices.into_u32().collect()).ok_or_else(|| self.outside(&accessor))
    }

    pub(super) fn bytes(&self, buffer: &gltf::Buffer<'_>) -> Option<&[u8]> {
        self.buffers.get(buffer.index()).map(AsRef::as_ref)
    }

    fn outside(&self, accessor: &Accessor<'_>) -> MeshError {
        let problem = format!("accessor {} reaches outside its buffer", accessor.index());
        syntax(self.file, problem)
    }

    pub(super) fn check(
        &self,
        accessor: &Accessor<'_>,
        dimensions: Dimensions,
        types: &[DataType],
    ) -> Result<(), MeshError> {
        let unsupported = |feature: &str| {
            Err(MeshError::Unsupported {
                file: self.file.to_owned(),
                feature: format!("{feature} in accessor {}", accessor.index()),
            })
        };
        if accessor.sparse().is_some() {
            return unsupported("sparse storage");
        }
        if accessor.dimensions() != dimensions || !types.contains(&accessor.data_type()) {
            return unsupported("an uncommon number type");
        }
        let Some(view) = accessor.view() else {
            return unsupported("no buffer view");
        };
        let size = accessor.size();
        let stride = view.stride().unwrap_or(size);
        let available = self.bytes(&view.buffer()).map_or(0, <[u8]>::len);
        let view_end = view.offset().checked_add(view.length());
        let end = accessor
            .count()
            .checked_sub(1)
            .and_then(|last| last.checked_mul(stride))
            .and_then(|bytes| bytes.checked_add(size))
            .and_then(|bytes| bytes.checked_add(accessor.offset()));
        let inside = stride >= size
            && view_end.is_some_and(|view_end| view_end <= available)
            && end.is_some_and(|end| end <= view.length());
        if inside { Ok(()) } else { Err(self.outside(accessor)) }
    }
}
