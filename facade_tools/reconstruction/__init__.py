"""KSTTP09: unsupervised facade parsing, and from a parse to a textured building."""
