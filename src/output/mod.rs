//! Where sound goes: a sink asks for blocks.
