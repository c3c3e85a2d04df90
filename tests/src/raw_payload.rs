//! A payload of any bytes, to be put into a frame that is whole.

use serde::ser::SerializeTuple;
use serde::{Serialize, Serializer};

/// Serialises as the bytes, without a length: postcard puts nothing around the parts of a tuple.
pub struct RawPayload<'a>(pub &'a [u8]);

impl Serialize for RawPayload<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        self.0.iter().try_for_each(|byte| tuple.serialize_element(byte))?;
        tuple.end()
    }
}
