//! Rays and triangles; deaf.
