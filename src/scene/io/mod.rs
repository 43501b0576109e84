//!

pub mod layout_source;
pub(crate) mod material_entry;
pub mod obj;
pub(crate) mod toml_file;
