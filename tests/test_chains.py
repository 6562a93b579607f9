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
    boundary_strength,
    diagonal_sums,
    gap_costs,
    line_differences,
    similarity,
)


def picture(seed: int, lines: int, width: int = 4) -> np.ndarray:
    return np.random.default_rng(seed).random((lines, width, 3))


def problem_of(lines: np.ndarray, *, gap: int, tight: bool, length: int = 4) -> ChainProblem:
    gaps = gap_costs(lines, gap) if gap else np.zeros((len(lines) + 1, 1))
    sums = diagonal_sums(line_differences(lines))
    weights = Weights(alpha=2.0, beta=3.0, boundary=0.2, gap=0.5)
    return ChainProblem(
        sums, boundary_strength(lines), (2, 4), (2, 3), gaps, length, weights, tight
    )


def direct_energy(lines: np.ndarray, chain: list[tuple[int, int]], p: ChainProblem) -> float:
    """Eq. 3 by its printed formulas."""
    b = boundary_strength(lines)
    total = sum(-p.weights.boundary * (b[s] + b[s + k]) for s, k in chain)
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
        if len(chain) == p.length:
            return
        low, high = p.first if not chain else p.other
        end = sum(chain[-1]) if chain else 0
        reach = p.gaps.shape[1] if chain else (1 if p.tight else n)
        for start in range(end, min(end + reach, n)):
            for size in range(low, min(high, n - start) + 1):
                yield from grow([*chain, (start, size)])

    for chain in grow([]):
        if chain and (not p.tight or sum(chain[-1]) == n):
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
    problem = ChainProblem(
        diagonal_sums(line_differences(lines)),
        boundary_strength(lines),
        (24, 60),
        (24, 42),
        np.zeros((n + 1, 1)),
        8,
        Weights(boundary=0.0),
        True,
    )
    found = solve(problem)
    assert found.sizes[1:] in {(30,) * 4, (30,) * 3}
    assert sum(found.sizes) == n


def test_a_height_that_no_floors_fill_is_infeasible():
    lines = picture(0, 5)
    with pytest.raises(Infeasible):
        solve(
            ChainProblem(
                diagonal_sums(line_differences(lines)), boundary_strength(lines),
                (6, 9), (6, 9), np.zeros((6, 1)), 3, Weights(), True,
            )
        )  # fmt: skip
