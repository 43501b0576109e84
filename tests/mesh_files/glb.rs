//! A writer of glTF files by the letter of the specification, apart from the library's own.

use base64::Engine;

/// A document and its binary buffer.
pub(crate) struct Model {
    /// Keys of `asset`'s siblings but buffers.
    pub(crate) rest: String,
    pub(crate) binary: Vec<u8>,
}

fn floats(points: &[[f32; 3]]) -> Vec<u8> {
    points
        .as_flattened()
        .iter()
        .flat_map(|n| n.to_le_bytes())
        .collect()
}

impl Model {
    /// A room of one mesh and one node, of 16-bit indices.
    pub(crate) fn room(size: [f32; 3]) -> Self {
        let mut binary = floats(&super::corners(size));
        let indices = super::triangles();
        binary.extend(indices.iter().flat_map(|&i| (i as u16).to_le_bytes()));
        let rest = format!(
            r#""scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3"}},
            {{"bufferView":1,"componentType":5123,"count":{},"type":"SCALAR"}}],
            "bufferViews":[{{"buffer":0,"byteLength":96}},{{"buffer":0,"byteOffset":96,"byteLength":{}}}]"#,
            indices.len(),
            2 * indices.len(),
        );
        Self { rest, binary }
    }

    /// Gives the node more keys.
    pub(crate) fn with_node(mut self, keys: &str) -> Self {
        self.rest = self
            .rest
            .replace(r#"{"mesh":0}"#, &format!(r#"{{"mesh":0,{keys}}}"#));
        self
    }

    /// Replaces a part of the document.
    pub(crate) fn with(mut self, old: &str, new: &str) -> Self {
        assert!(self.rest.contains(old), "{}", self.rest);
        self.rest = self.rest.replace(old, new);
        self
    }

    /// The document; `uri` is the buffer's.
    pub(crate) fn document(&self, uri: &str) -> String {
        let length = self.binary.len();
        format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{{{uri}"byteLength":{length}}}],{}}}"#,
            self.rest
        )
    }

    /// A document that holds its buffer.
    pub(crate) fn text(&self) -> Vec<u8> {
        let data = base64::engine::general_purpose::STANDARD.encode(&self.binary);
        let uri = format!(r#""uri":"data:application/octet-stream;base64,{data}","#);
        self.document(&uri).into_bytes()
    }

    /// A GLB file: 12 bytes, then two chunks padded to four bytes.
    pub(crate) fn glb(&self) -> Vec<u8> {
        let mut json = self.document("").into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut binary = self.binary.clone();
        binary.resize(binary.len().next_multiple_of(4), 0);
        let total = 12 + 8 + json.len() + 8 + binary.len();
        let mut file = b"glTF\x02\0\0\0".to_vec();
        file.extend((total as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", json), (b"BIN\0", binary)] {
            file.extend((chunk.len() as u32).to_le_bytes());
            file.extend(kind);
            file.extend(chunk);
        }
        file
    }
}
