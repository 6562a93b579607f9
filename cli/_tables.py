"""What stages call by the kind of an artifact, or by a method's name.

A new kind of artifact is a row in each table of what can be done with it. A row names a function,
`module:name`, whose module loads when it is called for: `--help` loads none.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

# parse-image: function(ReadOptions) that returns a Method (facade_tools.grammar.reading)
METHODS = {
    "both": f"{__package__}._parsing:both_methods",
    "forest": "facade_tools.segmentation.parsing:forest_method",
    "mrf": "facade_tools.reconstruction.mrf:mrf_method",
}

# view: function(artifact) that returns a Scene or an RGB picture (h, w, 3) uint8
DRAWINGS = {
    "building": "facade_tools.geometry.details:building_sketch",
    "footprint": "facade_tools.geometry.details:footprint_scene",
    "layout": "facade_tools.layering.drawing:layout_picture",
    "attributes": "facade_tools.imaging.attribute_glyphs:attribute_glyph",
    "model": "facade_tools.exteriors.picture:model_picture",
    "blocks": "facade_tools.stylization.drawing:blocks_scene",
    "stylesheet": "facade_tools.stylization.drawing:sheet_picture",
    "parse": "facade_tools.imaging.label_views:parse_view",
    "derivation": "facade_tools.reconstruction.records:derivation_scene",
    "shape-grammar": "facade_tools.reconstruction.records:grammar_scene",
}
WITH_FILES = ("stylesheet",)  # whose function takes the artifact's folder too

# export to GLB and OBJ: function(artifact) that returns a Scene
SCENES = {
    "building": "facade_tools.geometry.details:building_scene",
    "footprint": "facade_tools.geometry.details:footprint_scene",
    "parse": "facade_tools.grammar.relief:parse_scene",
    "layout": "facade_tools.layering.scene:layout_scene",
    "derivation": "facade_tools.reconstruction.records:derivation_scene",
}

# export to CityJSON: function(artifact) that returns a CityModel
CITY = {
    "building": "facade_tools.formats.city:building_model",
    "footprint": "facade_tools.formats.city:footprint_model",
}

# validate: function(artifact) that yields JSON pointer and message of what the schema cannot see
RULES = {
    "attributes": "facade_tools.exteriors.relations:contradictions",
    "blocks": "facade_tools.stylization.bases:blocks_problems",
    "building": "facade_tools.geometry.checks:building_problems",
    "footprint": "facade_tools.geometry.checks_plan:footprint_problems",
    "parse": "facade_tools.geometry.checks_plan:parse_problems",
    "derivation": "facade_tools.reconstruction.records:derivation_problems",
    "layout": "facade_tools.layering.assets:layout_problems",
    "stylesheet": "facade_tools.formats.style_folder:sheet_problems",
    "shape-grammar": "facade_tools.reconstruction.rules:grammar_problems",
}


def load(target: str) -> Callable[..., Any]:
    """Return the function that `module:name` names, importing it now."""
    module, name = target.split(":")
    function: Callable[..., Any] = getattr(import_module(module), name)
    return function
