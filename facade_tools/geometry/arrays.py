"""Names for the shapes of arrays, used in annotations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Points2 = NDArray[np.float64]  # (n, 2) metres, plan or a facade's frame
Points3 = NDArray[np.float64]  # (n, 3) metres, z up
Rectangles = NDArray[np.float64]  # (n, 4) metres: x0, y0, x1, y1
Triangles = NDArray[np.int64]  # (m, 3) indices of vertices, counter-clockwise from outside
Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]
