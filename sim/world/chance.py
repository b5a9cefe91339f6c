"""Random numbers that are functions of a seed and of two whole numbers: nothing is kept from one to the next.

A number asked for again is the same again. One in the middle of a long row costs no more than the first. The words are
mixed by multiplications and shifts of 32 bits (see `mixed`), computed in 64 so that compiled code and plain Python
agree.
"""

import math

from ...model.runtime.compiled import compiled, inlined

WORD = 0xFFFFFFFF
FIRST, SECOND = 0x7FEB352D, 0x846CA68B
GOLDEN = 0x9E3779B9
"""2^32 over the golden ratio, whose multiples are far apart: the streams of one seed begin there."""
STEP = 2.0**-32


@inlined
def mixed(word):
    """Return a word of 32 bits in which every bit of `word`, of 32 bits too, changes half of the bits on average."""
    word = ((word ^ (word >> 16)) * FIRST) & WORD
    word = ((word ^ (word >> 15)) * SECOND) & WORD
    return word ^ (word >> 16)


@compiled
def word_of(seed, stream, first, second):
    """Return the random word, 0 to 2^32 - 1, of two whole numbers of up to 63 bits and a sign.

    Args:
        seed: 0 to 2^32 - 1.
        stream: which of the independent rows of this seed.
        first, second: the place in the row.
    """
    one, other = int(first), int(second)
    word = mixed(seed ^ ((stream * GOLDEN) & WORD))
    word = mixed(mixed(word ^ (one & WORD)) ^ ((one >> 32) & WORD))
    return mixed(mixed(word ^ (other & WORD)) ^ ((other >> 32) & WORD))


@compiled
def uniform(seed, stream, first, second):
    """Return the random number, above 0 and below 1, of two whole numbers: see `word_of`."""
    return (word_of(seed, stream, first, second) + 0.5) * STEP


@compiled
def normal(seed, stream, first, second):
    """Return the random number of two whole numbers, normally distributed with mean 0 and sigma 1.

    The method is Box and Muller's, from two words: no number is more than 6.8 sigma from 0.
    """
    word = word_of(seed, stream, first, second)
    other = mixed(word ^ GOLDEN)
    return math.sqrt(-2.0 * math.log((word + 0.5) * STEP)) * math.cos(math.tau * other * STEP)
