//! Rows, slices and whole images of the epipolar integrator against the exact walk through the map.

mod coloured;
mod convergence;
mod epipole_on_screen;
mod extrema;
mod instances;
mod intervals;
mod judged;
mod known_rows;
mod row_of_pixel;
mod rows;
mod slices;
