"""Pure arrays: box unions, polygons, facade pieces, straight skeletons, roofs, solids."""
