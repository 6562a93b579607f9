"""JSON Schemas (2020-12), one per artifact, installed beside the code that reads them."""
