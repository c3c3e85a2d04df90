//! The firmware images as they are flashed, on emulated boards.

mod board_fit;
mod emulated_board;
mod image_sizes;
mod instruction_counts;
mod shipped_image;
