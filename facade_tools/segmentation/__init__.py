"""TSKP10: pixel classifier and shape-grammar parsing of rectified photographs."""
