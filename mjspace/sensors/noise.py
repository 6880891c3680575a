"""Random streams without memory: every number is a function of seed, member, stream and index."""

import hashlib
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
from numpy.random import Generator, Philox, SeedSequence

from mjspace.contract import Array

_BLOCK = 256  # samples drawn at once: a generator costs about as much to set up as these to draw


def stream_of(name: str) -> int:
    """Return the stream of the sensor of that name: the same in every process and version."""
    return int.from_bytes(hashlib.blake2b(name.encode(), digest_size=8).digest())


def normals(
    seed: int, members: Sequence[int], stream: tuple[int, ...], width: int
) -> Callable[[int], Array]:
    """Return sample(index): independent standard normal numbers, shape (len(members), width).

    A member's numbers do not depend on who flies beside it nor on what was drawn before, so a
    flight may be replayed alone and from any instant. The counter-based generator is Philox
    (Salmon et al. 2011, "Parallel random numbers: as easy as 1, 2, 3"); each block of indices has
    its own key, hashed from (seed, member, stream, block). The arrays returned are read-only.
    """

    @lru_cache(maxsize=1)
    def block(number: int) -> Array:
        drawn = np.empty((_BLOCK, len(members), width))
        for row, member in enumerate(members):
            key = SeedSequence(seed, spawn_key=(member, *stream, number))
            drawn[:, row] = Generator(Philox(key)).standard_normal((_BLOCK, width))
        drawn.setflags(write=False)
        return drawn

    def sample(index: int) -> Array:
        drawn: Array = block(index // _BLOCK)[index % _BLOCK]
        return drawn

    return sample
