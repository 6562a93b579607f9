"""Split rules and derivation trees, shared by both facade parsers."""
