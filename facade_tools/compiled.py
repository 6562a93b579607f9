"""The one way in which inner loops are compiled."""

from __future__ import annotations

from collections.abc import Callable
from hashlib import blake2b
from pathlib import Path
from typing import TypeVar, cast

try:
    import numba
except ImportError:  # models load and sample with NumPy and SciPy alone, at the speed of Python
    numba = None  # type: ignore[assignment]

F = TypeVar("F", bound=Callable[..., object])

MARK = b"@compiled"


def compiled(function: F) -> F:
    """Compile `function` with numba: cached on disk, IEEE arithmetic (no fast-math).

    The plain version stays reachable as `function.py_func`, which the tests use as oracle. Without
    numba it is what runs.
    """
    if numba is None:
        function.py_func = function
        return function
    compile_ = numba.njit(cache=True, fastmath=False, nogil=True, error_model="numpy")
    return cast("F", compile_(function))


def _kernels_folder() -> Path:
    """Return a cache folder that changes whenever any compiled loop does.

    numba looks at the file of a function, not at those of the functions that it calls: after an
    edit or an upgrade it would go on with stale callers.
    """
    root = Path(__file__).parent
    digest = blake2b(digest_size=8)
    for path in sorted(root.rglob("*.py")):
        source = path.read_bytes()
        if MARK in source:
            digest.update(source)
    return root / "__pycache__" / f"kernels-{digest.hexdigest()}"


def _use_folder() -> None:
    """Point numba at the folder, unless the user has chosen one or it cannot be written."""
    if numba.config.CACHE_DIR:  # type: ignore[attr-defined]
        return
    folder = _kernels_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:  # a read-only installation: numba's own fall-back, the user's cache folder
        return
    numba.config.CACHE_DIR = str(folder)  # type: ignore[attr-defined]


if numba is not None:
    _use_folder()
