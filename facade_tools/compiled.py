"""The one way in which inner loops are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., object])


def compiled(function: F) -> F:
    """Compile `function` with numba: cached on disk, IEEE arithmetic (no fast-math).

    The plain version stays reachable as `function.py_func`, which the tests use as oracle.
    """
    compile_ = numba.njit(cache=True, fastmath=False, nogil=True, error_model="numpy")
    return cast("F", compile_(function))
