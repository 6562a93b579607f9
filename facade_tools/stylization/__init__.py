"""LNSW13: the look of a textured building, captured and put onto another structure."""
