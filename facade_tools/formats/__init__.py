"""Public file formats: a reader each, a writer where we write it, and what they share."""
