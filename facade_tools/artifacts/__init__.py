"""What is on disk: one frozen dataclass tree per artifact, their schemas, reading and writing."""
