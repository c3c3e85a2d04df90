"""The chip's peripherals, as far as the image touches them."""
