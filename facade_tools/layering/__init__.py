"""IMAW15: facades designed as a stack of layers."""
