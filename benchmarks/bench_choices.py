"""What each choice of `learn` brings: held-out negative log-likelihood with one of them off.

    python benchmarks/bench_choices.py real-attributes.jsonl [--train 600]

The same split for all; differences are paired. Off, one after the other: coordinates on scales
without ends and atoms by cluster (`--faithful` has neither); lateral edges; cardinalities above 2;
the steps judged after EM together; priors around what lateral parents leave (around the overall
variance instead).
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest.mock import patch

import numpy as np

from facade_tools.artifacts.store import read
from facade_tools.exteriors import learning, mixture
from facade_tools.exteriors.evaluation import negative_log_density
from facade_tools.exteriors.joint_search import joint
from facade_tools.exteriors.learning import LearnOptions, learn_model


@contextmanager
def without(choice: str) -> Iterator[LearnOptions]:
    if choice == "joint steps":
        with patch.object(learning, "settled_together", joint):
            yield LearnOptions()
    elif choice == "pooled priors":
        with patch.object(mixture, "regression", lambda task, inputs: None):
            yield LearnOptions()
    else:
        yield {
            "nothing": LearnOptions(),
            "transforms and atoms": LearnOptions(faithful=True),
            "lateral edges": LearnOptions(variant="no-lateral"),
            "cardinalities above 2": LearnOptions(largest=2),
        }[choice]


CHOICES = (
    "nothing",
    "transforms and atoms",
    "lateral edges",
    "cardinalities above 2",
    "joint steps",
    "pooled priors",
)


def main() -> None:
    """Print one line a choice."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("attributes", type=Path)
    parser.add_argument("--train", type=int, default=600)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    rows = list(read([str(options.attributes)], "attributes"))
    rows = [rows[i] for i in np.random.default_rng(0).permutation(len(rows))]
    train, test = rows[: options.train], rows[-len(rows) // 4 :]
    first = None
    for choice in CHOICES:
        start = time.process_time()
        with without(choice) as chosen:
            model = learn_model(train, rng=np.random.default_rng(0), options=chosen)
        nll = negative_log_density(model, test)
        first = nll if first is None else first
        gap, root = nll - first, len(nll) ** 0.5
        print(
            f"without {choice:<24} {nll.mean():8.3f}  {gap.mean():+.3f} ± {gap.std() / root:.3f}  "
            f"{time.process_time() - start:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    main()
