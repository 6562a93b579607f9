"""Learn, generate, parse and restyle building exteriors."""

__version__ = "0.1.0"
