"""Learn, generate, parse and restyle building exteriors: docs/python.md shows every stage."""

__version__ = "0.1.0"
