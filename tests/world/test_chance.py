"""Random numbers that are functions of their place: the same words in plain integers, and their distribution."""

import numpy as np
import pytest
import scipy

from hardwall.sim.world.chance import normal, uniform, word_of

MANY = 20_000
PLACES = [(0, 0), (1, 0), (-1, 0), (0, 1), (2**40 + 3, -7), (-(2**62), 2**62), (np.int64(5), np.int64(-5))]


def mixed(word: int) -> int:
    word = (word ^ word >> 16) * 0x7FEB352D % 2**32
    word = (word ^ word >> 15) * 0x846CA68B % 2**32
    return word ^ word >> 16


def plain(seed: int, stream: int, *place: int) -> int:
    """Return the word by exact integers, a half of a number after the other."""
    word = mixed(seed ^ stream * 0x9E3779B9 % 2**32)
    for number in map(int, place):
        for half in (number % 2**32, (number >> 32) % 2**32):
            word = mixed(word ^ half)
    return word


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("seed", [0, 1, 2**32 - 1])
def test_words_are_those_of_exact_integers(seed, place):
    for stream in (1, 2, 9):
        assert word_of(seed, stream, *place) == plain(seed, stream, *place)


def test_a_place_has_the_same_number_whenever_it_is_asked_for():
    forwards = [normal(3, 1, number, 0) for number in range(50)]
    assert [normal(3, 1, number, 0) for number in reversed(range(50))] == forwards[::-1]


@pytest.mark.parametrize("first", [0, -MANY // 2, 2**45])
def test_numbers_in_a_row_are_normal_and_independent(first):
    drawn = np.array([normal(1, 1, first + number, 0) for number in range(MANY)])
    assert scipy.stats.kstest(drawn, "norm").pvalue > 1e-3
    for lag in (1, 2, 3, 4, 16):
        assert abs(np.corrcoef(drawn[lag:], drawn[:-lag])[0, 1]) < 4.5 / MANY**0.5


def test_seeds_and_streams_are_independent():
    rows = [
        [uniform(seed, stream, number, 0) for number in range(MANY // 4)] for seed in (1, 2, 3) for stream in (1, 2)
    ]
    both = np.corrcoef(rows) - np.eye(len(rows))
    assert np.abs(both).max() < 4.5 / (MANY // 4) ** 0.5
    assert all(scipy.stats.kstest(row, "uniform").pvalue > 1e-4 for row in rows)
