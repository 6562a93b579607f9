"""The body of `facade train-parser`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from facade_tools.artifacts.writing import write_bytes
from facade_tools.errors import InvalidInput
from facade_tools.randomness import item_generator
from facade_tools.segmentation.boosting import BoostOptions
from facade_tools.segmentation.classifier import save
from facade_tools.segmentation.conventions import convention
from facade_tools.segmentation.network_training import NetworkOptions
from facade_tools.segmentation.patches import ForestOptions
from facade_tools.segmentation.training import TrainOptions, load_start, read_pairs, train

from ._options import refuse_overwriting
from ._stream import to_stdout

COARSE = 288  # rows


def run_training(
    images: str, labels: str, output: str | None, seed: int, values: Mapping[str, Any]
) -> None:
    """Read the pairs, train, write the npz."""
    if output is None or (output != "-" and Path(output).suffix.lower() != ".npz"):
        raise click.UsageError("Option '-o': name a .npz file.")
    coarse, height = values["coarse"], values["height"]
    if coarse is not None and coarse > height:
        raise click.UsageError(f"--coarse {coarse} is above --height {height}")
    refuse_overwriting([images, labels, values["start"]], [output])
    start = None if values["start"] is None else load_start(values["start"])
    options = TrainOptions(
        features=values["features"], stages=values["stages"], height=height,
        coarse=min(COARSE, height) if coarse is None else coarse,
        pixels=values["pixels"], augment=values["augment"], balance=values["balance"],
        boost=BoostOptions(rounds=values["rounds"]),
        forest=ForestOptions(values["trees"], values["depth"], values["patch"]),
        network=NetworkOptions(steps=values["steps"]), start=start,
    )  # fmt: skip
    pairs = read_pairs(images, labels, convention(values["classes"]))
    try:
        data = save(train(pairs, options, rng=item_generator(seed, "train-parser")))
    except InvalidInput as error:
        raise error.at(images) from None
    if output == "-":
        to_stdout("", data)
    else:
        write_bytes(Path(output), data)
