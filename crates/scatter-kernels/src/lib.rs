//! Volumetric shadows on the GPU without a GPU API: assembled WGSL, structs, pass plans, set-up as bytes.
