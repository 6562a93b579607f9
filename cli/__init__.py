"""The facade command: one thin module a stage."""
