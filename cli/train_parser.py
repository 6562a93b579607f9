"""`facade train-parser`: the pixel classifier of parse-image."""

from __future__ import annotations

import click

from . import _options


@click.command()
@click.argument("images", metavar="IMAGES_DIR")
@click.argument("labels", metavar="LABELS_DIR")
@_options.output
@_options.seed
@click.option(
    "--classes", default="ecp", show_default=True, metavar="NAME|JSON",
    help="Convention of the label maps: ecp, cmp, labelmefacade, or a classes.json.",
)  # fmt: skip
@click.option(
    "--features", type=click.Choice(["context", "patch"]), default="context", show_default=True,
    help="context: boosted trees with auto-context and a network; patch: the forest of TSKP10.",
)  # fmt: skip
@click.option("--stages", type=click.IntRange(1, 6), default=4, show_default=True,
              help="Stages of auto-context; the last two see the picture itself.")  # fmt: skip
@click.option("--rounds", type=click.IntRange(1, 2000), default=80, show_default=True,
              help="Trees a class of the last two stages.")  # fmt: skip
@click.option("--pixels", type=click.IntRange(10, 10**6), default=2000, show_default=True,
              help="Pixels sampled a picture, variant and stage.")  # fmt: skip
@click.option("--height", type=click.IntRange(32, 2000), default=576, show_default=True,
              help="Working resolution: rows of a picture, pixels.")  # fmt: skip
@click.option("--coarse", type=click.IntRange(32, 2000),
              help="Rows that all stages but the last two see.  "
              "[default: 288; at most --height]")  # fmt: skip
@click.option("--augment", type=click.IntRange(0, 20), default=1, show_default=True,
              help="Varied copies a picture: mirror, light, blur, perspective.")  # fmt: skip
@click.option("--balance", type=_options.FiniteRange(0, 1), default=0.0, show_default=True,
              help="0 weighs pixels equally, 1 classes.")  # fmt: skip
@click.option("--steps", type=click.IntRange(0, 10**6), default=7000, show_default=True,
              help="Views that train the network beside the trees; 0: trees alone.")  # fmt: skip
@click.option("--start", metavar="NPZ",
              help="Classifier of other pictures whose network goes on here.")  # fmt: skip
@click.option("--trees", type=click.IntRange(1, 500), default=10, show_default=True,
              help="Trees of the patch forest.")  # fmt: skip
@click.option("--depth", type=click.IntRange(1, 30), default=18, show_default=True,
              help="Depth of the patch forest.")  # fmt: skip
@click.option("--patch", type=click.IntRange(3, 51), default=15, show_default=True,
              help="Side of the patches, pixels.")  # fmt: skip
def command(images: str, labels: str, output: str | None, seed: int, **values: object) -> None:
    """Train the classifier from pictures and label maps (PNG) of the same names.

    \b
    Example: facade train-parser ecp/images ecp/labels --classes ecp -o ecp.npz
    """
    from ._training import run_training

    run_training(images, labels, output, seed, values)
