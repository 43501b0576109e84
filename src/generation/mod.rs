//! SGS: the sound generation stage.
