//! The law *edge* end to end.
use super::Row;
use crate::error::Result;
pub(super) fn rows() -> Result<Vec<Row>> {
    Ok(Vec::new())
}
