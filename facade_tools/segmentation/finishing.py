"""From a solver's layout to the derivation of a parse."""

from __future__ import annotations

import numpy as np

from ..artifacts.grammar import Node
from ..grammar.plan import Plan
from .bare_roofs import Seen, Solve, with_dormers
from .deriving import Frame, derivation
from .energy import Layout
from .railings import WINDOW, cut_railings


def finished(plan: Plan, layout: Layout, seen: Seen, frame: Frame, solve: Solve) -> Node:
    """Return the tree of a layout, with dormers in bare roofs and railings cut one by one."""
    tree = derivation(plan, layout, frame)
    if WINDOW not in seen.classes:
        return tree
    tree = with_dormers(tree, plan.grammar, seen, frame, solve)
    window = seen.belief[seen.classes.index(WINDOW)]
    return cut_railings(tree, plan.grammar, np.where(seen.hidden, np.nan, window), frame)
