from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facade_tools.errors import Infeasible
from facade_tools.reconstruction.chains import ChainProblem, solve
from facade_tools.reconstruction.potentials import (
    CELL,
    Weights,
    band_contents,
    best_band,
    boundary_costs,
    boundary_strength,
    diagonal_sums,
    gap_costs,
    labels,
    line_differences,
    run_contents,
    similarity,
)


def picture(seed: int, lines: int, width: int = 4) -> np.ndarray:
    return np.random.default_rng(seed).random((lines, width, 3))


FIRST, OTHER = (2, 4), (2, 3)


def problem_of(lines: np.ndarray, *, gap: int, tight: bool) -> ChainProblem:
    n = len(lines)
    gaps = gap_costs(lines, gap) if gap else np.zeros((n + 1, 1))
    sums = diagonal_sums(line_differences(lines))
    weights = Weights(alpha=2.0, beta=3.0, boundary=0.2, gap=0.5)
    unary = labels(n, FIRST, OTHER) + 0.2 * boundary_costs(boundary_strength(lines), 4)
    ends = np.full(n + 1, np.inf) if tight else picture(7, n + 1)[:, 0, 0]
    ends[n] = 0.0
    return ChainProblem(sums, unary, gaps, weights, ends, tight)


def at_line(n: int) -> np.ndarray:
    """The last element ends at line n."""
    ends = np.full(n + 1, np.inf)
    ends[n] = 0.0
    return ends


def direct_energy(lines: np.ndarray, chain: list[tuple[int, int]], p: ChainProblem) -> float:
    """Eq. 3 by its printed formulas."""
    b = boundary_strength(lines)
    total = sum(-p.weights.boundary * (b[s] + b[s + k]) for s, k in chain)
    total += p.ends[sum(chain[-1])]
    for (sa, ka), (sb, kb) in itertools.pairwise(chain):
        m = min(ka, kb)
        ssd = ((lines[sa : sa + m] - lines[sb : sb + m]) ** 2).mean(axis=(1, 2)).sum() / m
        total += p.weights.alpha * ssd + p.weights.beta * CELL * abs(ka - kb)
        region = lines[sa + ka : sb]
        if len(region):
            mirror = ((region - region[::-1]) ** 2).mean(axis=(1, 2)).sum()
            total += p.weights.gap * (mirror + len(region) * region.var(axis=(0, 1)).mean())
    return total


def all_chains(n: int, p: ChainProblem):
    def grow(chain):
        yield chain
        end = sum(chain[-1]) if chain else 0
        reach = p.gaps.shape[1] if chain else (1 if p.grounded else n)
        for start in range(end, min(end + reach, n)):
            low, high = FIRST if start == 0 else OTHER
            for size in range(low, min(high, n - start) + 1):
                yield from grow([*chain, (start, size)])

    for chain in grow([]):
        if chain and np.isfinite(p.ends[sum(chain[-1])]):
            yield chain


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 999), st.integers(4, 9), st.integers(0, 2), st.booleans())
def test_the_chain_is_the_exact_minimum(seed, n, gap, tight):
    lines = picture(seed, n)
    problem = problem_of(lines, gap=gap, tight=tight)
    found = solve(problem)
    chain = list(zip(found.starts, found.sizes, strict=True))
    least = min(direct_energy(lines, other, problem) for other in all_chains(n, problem))
    assert found.energy == pytest.approx(least, abs=1e-9)
    assert direct_energy(lines, chain, problem) == pytest.approx(least, abs=1e-9)


def test_similarity_is_the_normalised_ssd_over_the_overlap():
    lines = picture(1, 10)
    sums = diagonal_sums(line_differences(lines))
    expected = ((lines[1:4] - lines[5:8]) ** 2).mean(axis=(1, 2)).sum() / 3
    assert similarity(sums, 1, 3, 5, 5) == pytest.approx(expected)


def test_gaps_cost_nothing_where_they_are_flat():
    lines = np.full((6, 3, 3), 0.4)
    table = gap_costs(lines, 3)
    assert np.allclose(table[:4], 0, atol=1e-12)
    assert np.isinf(table[5, 2])


def test_regular_floors_are_found():
    floor = picture(3, 30, 8)
    lines = np.concatenate([picture(4, 40, 8), *[floor] * 4])
    n = len(lines)
    sums = diagonal_sums(line_differences(lines))
    unary = labels(n, (24, 60), (24, 42))
    problem = ChainProblem(sums, unary, np.zeros((n + 1, 1)), Weights(), at_line(n), True)
    found = solve(problem)
    assert found.sizes[1:] in {(30,) * 4, (30,) * 3}
    assert sum(found.sizes) == n


def test_a_height_that_no_floors_fill_is_infeasible():
    lines = picture(0, 5)
    sums = diagonal_sums(line_differences(lines))
    with pytest.raises(Infeasible):
        solve(
            ChainProblem(
                sums, labels(5, (6, 9), (6, 9)), np.zeros((6, 1)), Weights(), at_line(5), True
            )
        )


def direct_band(evidence: np.ndarray) -> tuple[float, tuple[int, int]]:
    """The best run of lines, by trying all."""
    out = [(-np.maximum(evidence, 0).sum(), (0, 0))]
    for a, b in itertools.combinations(range(len(evidence) + 1), 2):
        outside = np.concatenate([evidence[:a], evidence[b:]])
        out.append((evidence[a:b].sum() - np.maximum(outside, 0).sum(), (a, b)))
    return max(out)


@settings(deadline=None, max_examples=40)
@given(st.lists(st.floats(-1, 1), min_size=1, max_size=9), st.integers(0, 8), st.integers(1, 9))
def test_contents_are_sums_over_the_best_band(values, start, size):
    evidence = np.array(values)
    start = min(start, len(values) - 1)
    size = min(size, len(values) - start)
    inside = evidence[start : start + size]
    table = band_contents(evidence, 9)
    assert table[start, size] == pytest.approx(direct_band(inside)[0], abs=1e-9)
    low, high = best_band(inside)
    outside = np.concatenate([inside[:low], inside[high:]])
    reached = inside[low:high].sum() - np.maximum(outside, 0).sum()
    assert reached == pytest.approx(direct_band(inside)[0], abs=1e-9)
    assert run_contents(evidence, 9)[start, size] == pytest.approx(inside.sum())
