//! Values of accessors (\[GLTF2\] 3.6.2): any component type, strides, normalised integers and sparse replacements.
//!
//! Control side. Bounds are checked before anything is read.

use std::collections::HashMap;
use std::rc::Rc;

use super::buffers::{Buffers, missing};
use super::document::{Accessor, Document};
use crate::error::Result;
use crate::scene::io::mesh_file::Position;

/// Component types.
const I8: u32 = 5120;
const U8: u32 = 5121;
const I16: u32 = 5122;
const U16: u32 = 5123;
const U32: u32 = 5125;
const F32: u32 = 5126;

/// Largest count of components that is read: a rotation.
const MOST_COMPONENTS: usize = 4;

/// One item of an accessor; entries beyond its components are 0.
type Item = [f64; MOST_COMPONENTS];

/// Reads accessors.
pub(super) struct Accessors<'a> {
    position: Position<'a>,
    document: &'a Document,
    buffers: Buffers<'a>,
    /// Most positions, and most items of all other accessors.
    most_items: usize,
    /// Positions that were read: primitives often share an accessor.
    positions: HashMap<usize, Rc<[[f32; 3]]>>,
    position_count: u64,
    /// Items of all other accessors, each time that they were read.
    other_count: u64,
}

impl<'a> Accessors<'a> {
    pub(super) fn new(
        position: Position<'a>,
        document: &'a Document,
        buffers: Buffers<'a>,
        most_items: usize,
    ) -> Self {
        Self {
            position,
            document,
            buffers,
            most_items,
            positions: HashMap::new(),
            position_count: 0,
            other_count: 0,
        }
    }

    /// The accessor of an index.
    pub(super) fn get(&self, index: usize) -> Result<&'a Accessor> {
        let accessors = &self.document.accessors;
        let found = accessors.get(index);
        found.ok_or_else(|| missing(self.position, "accessor", index, accessors.len()))
    }

    /// Corner positions in the file's unit.
    pub(super) fn positions(&mut self, index: usize) -> Result<Rc<[[f32; 3]]>> {
        if let Some(known) = self.positions.get(&index) {
            return Ok(known.clone());
        }
        self.position_count = self.position_count.saturating_add(self.get(index)?.count);
        self.position
            .check_count(self.position_count, self.most_items, "vertices")?;
        let items = self.read_items(index, "VEC3", |[x, y, z, _]| [x, y, z].map(|n| n as f32))?;
        let items: Rc<[[f32; 3]]> = items.into();
        self.positions.insert(index, items.clone());
        Ok(items)
    }

    /// Indices of corners.
    pub(super) fn indices(&mut self, index: usize) -> Result<Vec<u32>> {
        let accessor = self.get(index)?;
        if !matches!(accessor.component_type, U8 | U16 | U32) {
            return Err(self.unfit(index, "indices that are no whole numbers"));
        }
        self.items(index, "SCALAR", |[number, ..]| number as u32)
    }

    /// All items of an accessor of a shape such as `VEC3`.
    pub(super) fn items<T: Clone>(
        &mut self,
        index: usize,
        shape: &str,
        convert: impl Fn(Item) -> T,
    ) -> Result<Vec<T>> {
        self.other_count = self.other_count.saturating_add(self.get(index)?.count);
        self.position
            .check_count(self.other_count, self.most_items, "indices or instances")?;
        self.read_items(index, shape, convert)
    }

    /// The same, of an accessor whose count has been checked.
    fn read_items<T: Clone>(
        &mut self,
        index: usize,
        shape: &str,
        convert: impl Fn(Item) -> T,
    ) -> Result<Vec<T>> {
        let accessor = self.get(index)?;
        let components = match (&*accessor.shape, shape) {
            ("SCALAR", "SCALAR") => 1,
            ("VEC3", "VEC3") => 3,
            ("VEC4", "VEC4") => 4,
            _ => return Err(self.unfit(index, &format!("a type that is not {shape}"))),
        };
        let layout = self.layout(
            index,
            accessor.component_type,
            accessor.normalized,
            components,
        )?;
        let count = accessor.count as usize;
        let mut items = match accessor.buffer_view {
            None => vec![convert([0.0; 4]); count],
            Some(view) => {
                let stride = self
                    .document
                    .buffer_views
                    .get(view)
                    .and_then(|v| v.byte_stride);
                let stride = stride.unwrap_or(layout.size() as u64);
                self.read(
                    view,
                    accessor.byte_offset,
                    accessor.count,
                    stride,
                    layout,
                    &convert,
                )?
            }
        };
        let Some(sparse) = &accessor.sparse else {
            return Ok(items);
        };
        self.position
            .check_count(sparse.count, count, "sparse replacements than items")?;
        if !matches!(sparse.indices.component_type, U8 | U16 | U32) {
            return Err(self.unfit(index, "sparse indices that are no whole numbers"));
        }
        let places = self.layout(index, sparse.indices.component_type, false, 1)?;
        let (view, offset) = (sparse.indices.buffer_view, sparse.indices.byte_offset);
        let at = |[number, ..]: Item| number as usize;
        let replaced = self.read(view, offset, sparse.count, places.size() as u64, places, at)?;
        let (view, offset) = (sparse.values.buffer_view, sparse.values.byte_offset);
        let values = self.read(
            view,
            offset,
            sparse.count,
            layout.size() as u64,
            layout,
            &convert,
        )?;
        for (at, value) in replaced.into_iter().zip(values) {
            match items.get_mut(at) {
                Some(item) => *item = value,
                None => return Err(self.unfit(index, "a sparse index beyond its items")),
            }
        }
        Ok(items)
    }

    fn layout(
        &self,
        index: usize,
        kind: u32,
        normalized: bool,
        components: usize,
    ) -> Result<Layout> {
        let size = match kind {
            I8 | U8 => 1,
            I16 | U16 => 2,
            U32 | F32 => 4,
            _ => return Err(self.unfit(index, "an unknown component type")),
        };
        Ok(Layout {
            kind,
            component_size: size,
            normalized,
            components,
        })
    }

    /// Reads items at a stride.
    fn read<T>(
        &mut self,
        view: usize,
        offset: u64,
        count: u64,
        stride: u64,
        layout: Layout,
        convert: impl Fn(Item) -> T,
    ) -> Result<Vec<T>> {
        let Some(last) = count.checked_sub(1) else {
            return Ok(Vec::new());
        };
        let size = layout.size();
        let length = last
            .checked_mul(stride)
            .and_then(|l| l.checked_add(size as u64));
        let bytes = self
            .buffers
            .view(view, offset, length.unwrap_or(u64::MAX))?;
        let item = |number: u64| {
            let start = (number * stride) as usize;
            convert(layout.item(&bytes[start..start + size]))
        };
        Ok((0..count).map(item).collect())
    }

    fn unfit(&self, index: usize, problem: &str) -> crate::error::Error {
        let problem = format!("glTF accessor {index} has {problem}");
        self.position.error(problem, super::ADVICE)
    }
}

/// How an item lies in memory.
#[derive(Clone, Copy)]
struct Layout {
    kind: u32,
    component_size: usize,
    normalized: bool,
    components: usize,
}

impl Layout {
    fn size(self) -> usize {
        self.component_size * self.components
    }

    /// The item of [`Self::size`] bytes.
    fn item(self, bytes: &[u8]) -> Item {
        let mut item = [0.0; MOST_COMPONENTS];
        for (value, bytes) in item.iter_mut().zip(bytes.chunks_exact(self.component_size)) {
            *value = match (self.kind, bytes) {
                (I8, &[a]) => self.fraction(i8::from_le_bytes([a]), 127.0),
                (U8, &[a]) => self.fraction(a, 255.0),
                (I16, &[a, b]) => self.fraction(i16::from_le_bytes([a, b]), 32_767.0),
                (U16, &[a, b]) => self.fraction(u16::from_le_bytes([a, b]), 65_535.0),
                (U32, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]).into(),
                (_, bytes) => bytes
                    .try_into()
                    .map_or(f64::NAN, |b| f32::from_le_bytes(b).into()),
            };
        }
        item
    }

    /// An integer, or its share of the largest one if it is normalised.
    fn fraction(self, number: impl Into<f64>, most: f64) -> f64 {
        let number = number.into();
        if self.normalized {
            (number / most).max(-1.0)
        } else {
            number
        }
    }
}
