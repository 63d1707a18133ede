"""Noise of the controls: Nav2's own numbers, or those of the run's generator.

Sets of noise are ``(blocks, time_steps, samples)`` float32, the samples innermost; see
:mod:`controllers.mppi.kernels.rollout` for why.
"""

from __future__ import annotations

import functools
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from controllers.mppi.kernels.rollout import BLOCK
from controllers.mppi.params import MppiParams

BANK_SIZE = 8
"""Number of sets of ``numpy`` noise that are used in turn with ``regenerate_noises``."""

MT_SIZE = 624
MT_INIT = 1812433253
MINSTD_MULTIPLIER = np.uint64(16807)
MINSTD_MODULUS = np.uint64(2**31 - 1)
BELOW_ONE = np.float32(1.0 - 2.0**-24)


class Noise(NamedTuple):
    """One set of noise.

    Args:
        v: ``(blocks, time_steps, samples)`` m/s.
        w: The same, rad/s.
        longest: Largest sum of ``|v|`` over the steps of a sample, m/s.
        fastest: Largest ``|w|``, rad/s.
    """

    v: NDArray[np.float32]
    w: NDArray[np.float32]
    longest: float
    fastest: float


class NoiseSource(Protocol):
    """Where sets of noise come from."""

    def sample(self) -> Noise:
        """Return the next set."""
        ...


class Layout:
    """How a batch of trajectories is cut into blocks.

    Args:
        batch_size: Number of trajectories.
        time_steps: Number of points of each.

    Attributes:
        blocks, samples: Number of blocks, and of samples in each; the last block is padded.
    """

    def __init__(self, batch_size: int, time_steps: int) -> None:
        self.batch_size, self.time_steps = batch_size, time_steps
        self.blocks, self.samples = -(-batch_size // BLOCK), BLOCK

    def pack(self, v: NDArray[np.float32], w: NDArray[np.float32]) -> Noise:
        """Turn two ``(batch_size, time_steps)`` arrays into a set of noise, padded with 0."""
        longest = float(np.abs(v).sum(axis=1, dtype=np.float64).max())
        return Noise(self._pack(v), self._pack(w), longest, float(np.abs(w).max()))

    def _pack(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        padded = np.zeros((self.blocks * self.samples, self.time_steps), dtype=np.float32)
        padded[: self.batch_size] = values
        cut = padded.reshape(self.blocks, self.samples, self.time_steps)
        return np.ascontiguousarray(cut.transpose(0, 2, 1))

    def flat(self, scores: NDArray[np.float32]) -> NDArray[np.float32]:
        """Turn ``(..., blocks, samples)`` scores into a ``(..., batch_size)`` copy."""
        return scores.reshape(*scores.shape[:-2], -1)[..., : self.batch_size].copy()


class NumpyNoise:
    """Noise of the run's own generator.

    Args:
        layout: Layout of the batch.
        stds: Standard deviations of v and w, m/s and rad/s.
        rng: The run's generator.
    """

    def __init__(self, layout: Layout, stds: tuple[float, float], rng: np.random.Generator) -> None:
        self._layout, self._stds, self._rng = layout, stds, rng

    def sample(self) -> Noise:
        """Return the next set."""
        shape = (2, self._layout.batch_size, self._layout.time_steps)
        v, w = self._rng.standard_normal(shape, dtype=np.float32)
        return self._layout.pack(v * np.float32(self._stds[0]), w * np.float32(self._stds[1]))


class NoiseBank:
    """Uses a few sets of another source in turn, which costs less than new samples.

    Args:
        source: The other source.
        size: How many of its sets are kept.
    """

    def __init__(self, source: NoiseSource, size: int = BANK_SIZE) -> None:
        self._source, self._size = source, size
        self._sets: list[Noise] = []
        self._next = 0

    def sample(self) -> Noise:
        """Return the next set."""
        if len(self._sets) < self._size:
            self._sets.append(self._source.sample())
        sampled = self._sets[self._next]
        self._next = (self._next + 1) % self._size
        return sampled


class Nav2Noise:
    """The numbers of Nav2 itself: one std::mt19937 through libstdc++'s ``normal_distribution<float>``.

    In Nav2 the generator belongs to the process, here to the run.

    Args:
        layout: Layout of the batch.
        stds: Standard deviations of v and w, m/s and rad/s.
        seed: Seed of the generator; 5489 is the default of std::mt19937.
    """

    def __init__(self, layout: Layout, stds: tuple[float, float], seed: int = 5489) -> None:
        self._layout, self._stds = layout, stds
        self._bits = np.random.MT19937()
        self._bits.state = {"bit_generator": "MT19937", "state": {"key": _mt19937_key(seed), "pos": MT_SIZE}}

    def sample(self) -> Noise:
        """Return the next set."""
        v, w = (self._normals(np.float32(std)) for std in self._stds)
        return self._layout.pack(v, w)

    def _normals(self, std: np.float32) -> NDArray[np.float32]:
        """Sample one ``(batch_size, time_steps)`` array."""
        count = self._layout.batch_size * self._layout.time_steps
        pairs = np.empty((0, 2), dtype=np.float32)
        needed = -(-count // 2)
        while len(pairs) < needed:
            pairs = np.concatenate([pairs, _polar_pairs(self._uniforms(2 * (needed - len(pairs))))])
        return self._laid_out(pairs.reshape(-1)[:count] * std)

    def _uniforms(self, count: int) -> NDArray[np.float32]:
        """Return the next numbers in [0, 1)."""
        words = np.asarray(self._bits.random_raw(count)).astype(np.uint32)
        return _below_one(words.astype(np.float32) * np.float32(2.0**-32))

    def _laid_out(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Fill the array trajectory after trajectory."""
        return values.reshape(self._layout.batch_size, self._layout.time_steps)


class LyricalNoise(Nav2Noise):
    """The numbers of Lyrical: std::minstd_rand0 through the same distribution, time step after time step.

    Args:
        layout: Layout of the batch.
        stds: Standard deviations of v and w, m/s and rad/s.
        seed: Seed of the generator; 1 is the default of std::minstd_rand0.
    """

    def __init__(self, layout: Layout, stds: tuple[float, float], seed: int = 1) -> None:
        self._layout, self._stds = layout, stds
        self._state = np.uint64(seed % int(MINSTD_MODULUS) or 1)

    def _uniforms(self, count: int) -> NDArray[np.float32]:
        """Return the next numbers in [0, 1)."""
        states = self._state * _minstd_powers((count - 1).bit_length())[:count] % MINSTD_MODULUS
        self._state = states[-1]
        return _below_one((states - np.uint64(1)).astype(np.float32) * np.float32(2.0**-31))

    def _laid_out(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Fill the array time step after time step."""
        return values.reshape(self._layout.time_steps, self._layout.batch_size).T


def _below_one(uniform: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return numbers in [0, 1], with the largest number below 1 for 1."""
    below: NDArray[np.float32] = np.minimum(uniform, BELOW_ONE)
    return below


def _polar_pairs(uniform: NDArray[np.float32]) -> NDArray[np.float32]:
    """Turn numbers in [0, 1) into pairs of standard normals by the polar method, in libstdc++'s order: y before x."""
    x, y = (np.float32(2.0) * uniform - np.float32(1.0)).reshape(-1, 2).T
    square = x * x + y * y
    inside = (square <= 1.0) & (square != 0.0)
    x, y, square = x[inside], y[inside], square[inside]
    scale = np.sqrt(np.float32(-2.0) * np.log(square) / square)
    return np.stack([y * scale, x * scale], axis=1)


@functools.cache
def _minstd_powers(doublings: int) -> NDArray[np.uint64]:
    """Return the first ``2^doublings`` powers of the multiplier of std::minstd_rand0."""
    if doublings == 0:
        return np.array([MINSTD_MULTIPLIER])
    powers = _minstd_powers(doublings - 1)
    return np.concatenate([powers, powers * powers[-1] % MINSTD_MODULUS])


def make_source(params: MppiParams, rng: np.random.Generator) -> NoiseSource:
    """Make the source that ``noise`` and ``regenerate_noises`` ask for; ``rng`` is the run's generator.

    Without ``regenerate_noises``, Nav2 samples twice as it starts, and uses the second set.
    """
    layout, stds = Layout(params.batch_size, params.time_steps), (params.vx_std, params.wz_std)
    if params.noise == "nav2":
        kind = LyricalNoise if params.release == "lyrical" else Nav2Noise
        source = kind(layout, stds, params.noise_seed)
        if not params.regenerate_noises:
            source.sample()
        return source
    fresh = NumpyNoise(layout, stds, rng)
    return NoiseBank(fresh) if params.regenerate_noises else fresh


def _mt19937_key(seed: int) -> NDArray[np.uint32]:
    """State of a std::mt19937 seeded with one number (Matsumoto and Nishimura's ``init_genrand``)."""
    key = [seed]
    for i in range(1, MT_SIZE):
        key.append((MT_INIT * (key[-1] ^ (key[-1] >> 30)) + i) & 0xFFFFFFFF)
    return np.array(key, dtype=np.uint32)
