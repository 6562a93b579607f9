"""Random generators that depend on the seed and the item, never on the order of execution."""

from __future__ import annotations

from hashlib import blake2b

import numpy as np


def item_generator(seed: int, *keys: str | int) -> np.random.Generator:
    """Return the generator of one item.

    The stream depends only on `seed` and `keys` (stage name, item id, …), so that any number of
    workers in any order draw the same numbers for the same item.

    >>> a, b = item_generator(0, "massgen", "7-1"), item_generator(0, "massgen", "7-1")
    >>> a.random() == b.random()
    True
    """
    text = "\x1f".join([str(seed), *map(str, keys)])
    digest = blake2b(text.encode(), digest_size=32).digest()
    words = np.frombuffer(digest, dtype="<u4").tolist()
    return np.random.Generator(np.random.PCG64(words))
