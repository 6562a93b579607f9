"""Genetic search for the layouts of a side (FW16 6.2): crossover by piece, mutation of one piece.

The energy of eq. 4 is a sum over sides and a crossover exchanges single pieces, so the four
sections of the paper's genome are searched one after another, each with its own population.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..compiled import compiled
from ..geometry.arrays import Floats, Integers
from .facade_energy import side_energy
from .facade_layout import MOST, OPEN, Side, draw_piece


@dataclass(frozen=True, slots=True)
class Search:
    """How long to search.

    population: individuals. elite: how many survive unchanged. generations: at most. patience:
    generations without progress after which to stop. enough: energy of a side that ends the
    search. least: generations before that, so that looks count too.
    """

    population: int = 100
    elite: int = 20
    generations: int = 150
    patience: int = 25
    enough: float = 1e-4
    least: int = 6


@compiled
def _draw_all(rng: np.random.Generator, side: Side, genome: Floats, counts: Integers) -> None:
    for p in range(len(side.pieces)):
        draw_piece(rng, side, p, genome, counts)


@compiled
def _tournament(rng: np.random.Generator, fitness: Floats) -> int:
    one, two = int(rng.random() * len(fitness)), int(rng.random() * len(fitness))
    return one if fitness[one] <= fitness[two] else two


@compiled
def _breed(
    rng: np.random.Generator,
    side: Side,
    parents: tuple[Floats, Integers],
    pair: tuple[int, int],
    child: tuple[Floats, Integers],
) -> None:
    """Write the crossover of two parents, mutated in one piece, into `child`."""
    genomes, counts = parents
    genome, number = child
    for p in range(len(side.pieces)):
        source = pair[0] if rng.random() < 0.5 else pair[1]
        number[p] = counts[source, p]
        for e in range(number[p]):
            for c in range(5):
                genome[p, e, c] = genomes[source, p, e, c]
    if rng.random() < 0.8:
        chosen = _open_piece(rng, side)
        if chosen >= 0:
            draw_piece(rng, side, chosen, genome, number)


@compiled
def _open_piece(rng: np.random.Generator, side: Side) -> int:
    """Return a random piece that takes elements, or −1."""
    chosen = -1
    seen = 0
    for p in range(len(side.pieces)):
        if side.room[p, OPEN] > 0.0:
            seen += 1
            if rng.random() * seen < 1.0:
                chosen = p
    return chosen


@compiled
def evolve(
    rng: np.random.Generator, side: Side, limits: Integers, enough: float
) -> tuple[Floats, Integers, float, int]:
    """Return genome, counts and energy of the best individual, and the number of generations.

    limits: population, elite, generations, patience, least. Individuals are kept sorted.
    """
    size, elite, generations, patience, least = limits
    pieces = len(side.pieces)
    genomes = np.zeros((size, pieces, MOST, 5))
    counts = np.zeros((size, pieces), dtype=np.int64)
    values, fitness = np.empty(size), np.empty(size)
    for i in range(size):
        _draw_all(rng, side, genomes[i], counts[i])
        values[i], fitness[i] = side_energy(side, genomes[i], counts[i])
    new_genomes, new_counts = np.zeros_like(genomes), np.zeros_like(counts)
    new_values, new_fitness = np.empty(size), np.empty(size)
    still = 0
    done = 0
    best = fitness.min()
    while done < generations and still < patience:
        order = np.argsort(fitness, kind="mergesort")
        if done >= least and values[order[0]] <= enough:
            break
        for i in range(size):
            if i < elite:
                k = order[i]
                new_genomes[i], new_counts[i] = genomes[k], counts[k]
                new_values[i], new_fitness[i] = values[k], fitness[k]
                continue
            pair = _tournament(rng, fitness), _tournament(rng, fitness)
            _breed(rng, side, (genomes, counts), pair, (new_genomes[i], new_counts[i]))
            new_values[i], new_fitness[i] = side_energy(side, new_genomes[i], new_counts[i])
        genomes, new_genomes = new_genomes, genomes
        counts, new_counts = new_counts, counts
        values, new_values = new_values, values
        fitness, new_fitness = new_fitness, fitness
        done += 1
        still = still + 1 if fitness.min() >= best - 1e-6 else 0
        best = min(best, fitness.min())
    winner = int(np.argmin(fitness))
    return genomes[winner].copy(), counts[winner].copy(), values[winner], done


def search_side(
    side: Side, search: Search, least: float = 0.0, *, rng: np.random.Generator
) -> tuple[Floats, Integers, float]:
    """Return genome, counts and energy of the best layout found for a side.

    least: a lower bound of the energy, near which the search may stop.
    """
    limits = np.array(
        [search.population, search.elite, search.generations, search.patience, search.least]
    )
    genome, counts, value, _ = evolve(rng, side, limits, least + search.enough)
    return genome, counts, float(value)
