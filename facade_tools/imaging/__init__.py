"""Homographies, rectification, pixel features and rendered previews."""
