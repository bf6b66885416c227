//! Rows, slices and whole images of the epipolar integrator against the exact walk through the map.

mod cascades;
mod coloured;
mod convergence;
mod direct;
mod epipole_on_screen;
mod facts;
mod fog;
mod instances;
mod intervals;
mod judged;
mod known_rows;
mod lines;
mod locate;
mod min_max_tiles;
mod row_of_pixel;
mod rows;
mod sheet_walls;
mod slices;
mod surfaces;
