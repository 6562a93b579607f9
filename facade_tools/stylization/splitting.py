"""Splitting rules and how they are applied to faces of any size (LNSW13 5.2)."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..geometry.arrays import Booleans, Floats

END = 0.3  # of the wall that it stands for: the least last wall of a rule
CROWDED = 0.9  # S_r below this: more windows fit than look right
LEAST_WALLS = 0.5  # S_r below which a rule is repeated as a whole rather than regularly
TIGHT = 0.2  # of their width that the walls beside a single window keep at least
ALIKE = 0.1  # of the mean distance of windows: how far sections that repeat may differ
DENSER = 0.15  # by which windows that go on repeating may stand denser than whole repeats do
STEADY = 0.01  # by which the distances of windows may change before margins take the rest
PLAIN = 2.5  # times the median wall between windows, above which a wall is as patient as a margin
MARGINS = 0.5, 3.0  # least and most of their width that margins take


@dataclass(frozen=True, slots=True)
class SplitRule:
    """Widths in metres: scalable a_1 … a_{m+1} around insertable b_1 … b_m (eq. 8).

    once: the numbers of insertable sections that are not repeated, from 0. ends: the outermost
    walls (cornice and plinth) stand at the ends of a face only, not between repeats.
    """

    scalable: tuple[float, ...]
    insertable: tuple[float, ...] = ()
    once: tuple[int, ...] = ()
    ends: bool = False

    @property
    def size(self) -> float:
        """Σa + Σb, the size at which the rule was found (m)."""
        return math.fsum(self.scalable) + math.fsum(self.insertable)


@dataclass(frozen=True, slots=True)
class Split:
    """A face cut by a rule: its sections in order.

    sources: index of the section in the rule (even: scalable, odd: insertable). sizes: metres,
    summing to the face's. windows: S_n. stretch: S_r, the mean factor on scalable sections.
    """

    sources: tuple[int, ...]
    sizes: tuple[float, ...]
    windows: int
    stretch: float


def split(rule: SplitRule, size: float, patience: tuple[float, float] = MARGINS) -> Split:
    """Cut a face of `size` metres: repeat insertable sections, scale the others (eq. 8 and 9).

    Eq. 8 packs as many windows as fit. Where the scalable sections would be squeezed below 90% or
    stretched beyond 111%, the number of windows is taken that changes their distances and S_r
    least; rather than none, one whose walls keep a fifth of their width. Windows keep their size,
    unless the rule has no walls at all. What S_r adds or takes goes to the margins and the widest
    walls first, within their patience (least and greatest factor on them).
    """
    if not rule.insertable:
        return Split((0,), (size,), 0, size / rule.size)
    most = packed(rule, size)
    chosen = _repeated(rule, size, most)
    crowded = not chosen.windows or not CROWDED <= chosen.stretch <= 1 / CROWDED
    m = len(rule.insertable)
    if size > rule.size and (_heaped(rule) or (rule.once and (most > m or crowded))):
        return _with_single(rule, size, patience)
    if not crowded:
        regular = _row(rule, size, most)
        return _spread(rule, regular if regular.stretch > LEAST_WALLS else chosen, patience)
    options = [_spread(rule, _row(rule, size, n), patience) for n in range(most + 1, 0, -1)]
    if rule.once:
        options = [option for option in options if option.windows <= m]
    best = min((o for o in options if o.stretch > TIGHT), key=partial(_change, rule), default=None)
    return _plain(rule, size) if best is None or _bare(rule, size, best) else best


def _heaped(rule: SplitRule) -> bool:
    """Tell whether whole repeats would put a cornice or a plinth into the middle of a face."""
    return rule.ends and bool(rule.once or not repeat(rule))


def _row(rule: SplitRule, size: float, windows: int) -> Split:
    """Return a face with so many windows, those that stand once among them."""
    m = len(rule.insertable)
    if windows == m:
        return _repeated(rule, size, windows)
    fixed, heaped = set(rule.once), _heaped(rule)
    if heaped and windows > m > 1:
        fixed |= {0, m - 1} if m > 2 else {1}
    if (fixed or heaped) and fixed < set(range(m)) and len(fixed) <= windows:
        return _sequence(rule, size, _order(m, fixed, windows))
    return _regular(rule, size, windows)


def _with_single(rule: SplitRule, size: float, patience: tuple[float, float]) -> Split:
    """Return a face larger than its rule (m), parts of which stand once: windows or its ends."""
    m = len(rule.insertable)
    usual = [b for k, b in enumerate(rule.insertable) if k not in rule.once]
    single = math.fsum(rule.insertable[k] for k in rule.once)
    # what frames a single ornament is none of the row's windows
    grows = usual and (rule.ends or math.fsum(usual) >= single)
    more = len(usual) * (size - rule.size) / math.fsum(usual) if grows else 0.0
    options = (_spread(rule, _row(rule, size, m + n), patience) for n in range(math.ceil(more) + 1))
    return min((o for o in options if o.stretch > TIGHT), key=partial(_change, rule))


def _order(count: int, fixed: Collection[int], windows: int) -> list[int]:
    """Return the windows of a row: those of the rule in their order, but more of them, or fewer.

    count: windows of the rule. fixed: those that are shown once. Runs of the others grow or shrink
    in proportion; what is inserted repeats the end of a run, which then leads on as in the source.
    """
    runs: list[list[int]] = [[]]
    for k in range(count):
        if k in fixed:
            runs.append([])
        else:
            runs[-1].append(k)
    share = (windows - len(fixed)) / (count - len(fixed))
    ends = [0, *(math.floor(n * share + 0.5) for n in itertools.accumulate(map(len, runs)))]
    order: list[int] = []
    for run, single, (a, b) in zip(
        runs, [*sorted(fixed), None], itertools.pairwise(ends), strict=True
    ):
        again = [run[-1 - i % len(run)] for i in range(b - a - len(run))]
        order += [*run[: b - a], *again[::-1], *([] if single is None else [single])]
    return order


def _sequence(rule: SplitRule, size: float, order: Sequence[int]) -> Split:
    """Return a face with windows in any order, the outermost walls of the rule at its ends.

    Every window is shown with the wall before it; no other wall than an inner one stands inside.
    """
    walls = [0, *(2 * max(k, 1) for k in order[1:])]
    sections = itertools.chain.from_iterable(
        (wall, 2 * k + 1) for wall, k in zip(walls, order, strict=True)
    )
    return _arranged(rule, size, (*sections, 2 * len(rule.insertable)))


def _bare(rule: SplitRule, size: float, best: Split) -> bool:
    """Tell whether a face is nearer to its widest wall alone than to one with a window."""
    plain = abs(math.log(max(_plain(rule, size).stretch, 1e-9)))
    return best.stretch > 1 and plain < abs(math.log(best.stretch))


def _change(rule: SplitRule, done: Split) -> float:
    """Return how far a split changes the distances of windows, and half of how far S_r is off."""
    own, patient = _patient(rule, done)
    before, after = own[~patient].sum(), np.array(done.sizes)[~patient].sum()
    distances = abs(math.log(max(float(after), 1e-9) / float(before)))
    return distances + 0.5 * abs(math.log(max(done.stretch, 1e-9)))


def _patient(rule: SplitRule, done: Split) -> tuple[Floats, Booleans]:
    """Return the widths (m) of sections in the rule, and which are margins or plain walls."""
    own = np.array([_width(rule, source) for source in done.sources])
    patient = np.array(done.sources) % 2 == 0
    patient[1:-1] &= own[1:-1] > PLAIN * np.median(rule.scalable[1:-1] or [np.inf])
    return own, patient


def _spread(rule: SplitRule, done: Split, patience: tuple[float, float]) -> Split:
    """Give what S_r adds or takes to margins and plain walls as far as they can bear it.

    Walls between windows keep their width but for STEADY of the distances; the outermost walls,
    and those much wider than the usual one, take the rest, and what is left over goes to all.
    """
    own, patient = _patient(rule, done)
    steady = (np.array(done.sources) % 2 == 0) & ~patient
    ample, firm = float(own[patient].sum()), float(own[steady].sum())
    if min(ample, firm) <= 1e-9:
        return done
    room = done.stretch * (ample + firm)
    give = STEADY * float(own[~patient].sum())
    wanted = min(max(done.stretch * firm, firm - give), firm + give)
    left = min(max(room - wanted, patience[0] * ample), patience[1] * ample)
    if not 0 < left < room:
        return done
    factor = np.where(patient, left / ample, np.where(steady, (room - left) / firm, 1.0))
    return replace(done, sizes=tuple((own * factor).tolist()))


def split_rule(rule: SplitRule, size: float) -> SplitRule:
    """Return the rule of a face after the split: what a second split starts from."""
    done = split(rule, size)
    walls, windows = [0.0], []
    for source, width in zip(done.sources, done.sizes, strict=True):
        if source % 2:
            windows.append(width)
            walls.append(0.0)
        else:  # where a repeat ends and the next begins, two walls are one
            walls[-1] += width
    return SplitRule(tuple(walls), tuple(windows))


def packed(rule: SplitRule, size: float) -> int:
    """Return how many windows fit: S_n = x·m + y of eq. 8."""
    m = len(rule.insertable)
    x = math.floor(size / rule.size + 1e-9)
    rest = size - x * rule.size
    y = 0
    for width in rule.insertable:
        rest -= width
        if rest < -1e-9:
            break
        y += 1
    return x * m + y


def _repeated(rule: SplitRule, size: float, windows: int) -> Split:
    """Return x whole repeats of the rule and its first y windows, each between two walls.

    Between the last wall of a repeat and the first of the next both stay (eq. 9 counts both).
    """
    if not windows:
        return _plain(rule, size)
    m = len(rule.insertable)
    x, y = divmod(windows, m)
    tail = range(2 * y + 1) if y or not x else ()
    return _arranged(rule, size, (*(tuple(range(2 * m + 1)) * x), *tail))


def _arranged(rule: SplitRule, size: float, sources: tuple[int, ...]) -> Split:
    """Return sections in order, the walls between the windows scaled alike (eq. 9)."""
    windows = len(sources) - sum(not i % 2 for i in sources)
    fixed = math.fsum(rule.insertable[i // 2] for i in sources if i % 2)
    flexible = math.fsum(rule.scalable[i // 2] for i in sources if not i % 2)
    if flexible <= 1e-9:  # no wall between the windows: they take the stretch
        factor = size / fixed if fixed > 0 else 1.0
        return Split(sources, tuple(factor * _width(rule, i) for i in sources), windows, factor)
    stretch = (size - fixed) / flexible
    sizes = tuple(_width(rule, i) * (1.0 if i % 2 else stretch) for i in sources)
    return Split(sources, sizes, windows, stretch)


def end_wall(rule: SplitRule, done: Split) -> int:
    """Return the wall that the second half of a split's last section is to show.

    At its end a face looks as its source does at its own: the frame of a window that does not
    follow would stand there. A rule whose last wall is hardly there has no such look to give.
    """
    last = done.sources[-1] // 2
    enough = rule.scalable[-1] > END * rule.scalable[last]
    return 2 * (len(rule.insertable) if done.windows and enough else last)


def _plain(rule: SplitRule, size: float) -> Split:
    """Return a face without windows: all of it the widest wall of the rule."""
    widest = max(range(len(rule.scalable)), key=rule.scalable.__getitem__)
    stretch = size / rule.scalable[widest] if rule.scalable[widest] > 1e-9 else math.inf
    return Split((2 * widest,), (size,), 0, stretch)


def _regular(rule: SplitRule, size: float, windows: int) -> Split:
    """Return a face with so many windows that goes on as its rule does.

    A rule that repeats within itself goes on repeating, and ends with its own margin; any other
    is repeated as a whole.
    """
    m, step = len(rule.insertable), repeat(rule)
    if windows == m or not step:
        return _repeated(rule, size, windows)
    turn, gaps = m - m % step, m - 1 - (m - 1) % step
    inner = ((2 * (i % turn) + 1, 2 * (i % gaps) + 2) for i in range(windows))
    return _arranged(rule, size, (*(0, *itertools.chain.from_iterable(inner))[:-1], 2 * m))


def repeat(rule: SplitRule) -> int:
    """Return after how many windows a rule repeats within itself; 0 where it does not.

    A rule whose margins would make whole repeats much thinner or denser does not: eq. 8 counts
    windows by whole repeats.
    """
    walls, windows = np.array(rule.scalable[1:-1]), np.array(rule.insertable)
    m = len(windows)
    for step in range(1, (m + 1) // 2 + 1 if m > 1 else 1):
        pitch = (walls[: m - 1 - (m - 1) % step].mean() if m > step else 0.0) + windows.mean()
        reach = ALIKE * pitch
        alike = all(np.ptp(v[k::step]) <= reach for v in (walls, windows) for k in range(step))
        if alike and step < m and abs(rule.size / m / pitch - 1) <= DENSER:
            return step
    return 0


def _width(rule: SplitRule, index: int) -> float:
    return rule.insertable[index // 2] if index % 2 else rule.scalable[index // 2]
