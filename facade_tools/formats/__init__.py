"""Public file formats, one module each, every one a pair of read and write functions."""
