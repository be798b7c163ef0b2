"""Voices, how far they are from one another, and a split that holds out distant ones.

Many of eSpeak's voices are near copies of each other. Who holds out voices at random tests on
voices that were as good as heard. Here a voice is *near* another if what the encoder makes of their
digits differs by less than a bound, and no training voice may be near a test voice.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gnm_env.checks import real, whole
from gnm_env.speech.encoder import STEP, envelopes
from gnm_env.speech.espeak import ACCENTS, espeak

DIGITS = ("zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")
FRAMES = 16
"""Moments of a word at which portraits are compared."""


def all_voices() -> list[str]:
    """Every accent of English with every variant, as "accent+variant"."""
    return [f"{accent}+{variant}" for accent in ACCENTS for variant in espeak().variants()]


def portrait(voice: str) -> NDArray[np.float32]:
    """What the encoder hears of a voice: its ten digits, each stretched to 16 moments.

    Returns log envelopes in 0 … 1, (10 · 16 · 24,).
    """
    said = espeak().say(" ".join(DIGITS), voice)
    envelope = envelopes(said.sound, said.rate)
    ends = np.append(said.onsets[1:], len(envelope) * STEP)
    words = []
    for onset, end in zip(said.onsets, ends, strict=True):
        moments = np.linspace(onset, end, FRAMES, endpoint=False) / STEP
        words.append(envelope[np.minimum(moments.astype(int), len(envelope) - 1)])
    return np.concatenate(words).ravel().astype(np.float32)


def distances(portraits: ArrayLike) -> NDArray[np.float64]:
    """Root mean square difference of each two portraits, (voices, voices), in units of 30 dB."""
    held = np.asarray(portraits, np.float64)
    squares = np.sum(held**2, axis=1)
    mean = (squares[:, None] + squares - 2.0 * held @ held.T) / held.shape[1]
    return np.asarray(np.sqrt(np.maximum(mean, 0.0)))


def clusters(distance: NDArray[np.float64], bound: float) -> NDArray[np.int64]:
    """The cluster of each voice, (voices,): complete linkage, so none is wider than `bound`."""
    from scipy.cluster.hierarchy import fcluster, linkage
    from scipy.spatial.distance import squareform

    off = distance - np.diag(np.diag(distance))
    tree = linkage(squareform((off + off.T) / 2, checks=False), "complete")
    return np.asarray(fcluster(tree, bound, "distance"), np.int64) - 1


class VoiceSplit(NamedTuple):
    """Numbers of voices; no voice is in two of them."""

    train: NDArray[np.int64]
    test: NDArray[np.int64]
    """Each at least the bound away from every training voice."""
    near: NDArray[np.int64]
    """The control: held out at random, as near to training voices as such voices are."""
    dropped: NDArray[np.int64]
    """Too near to a test voice to be trained on."""


def split_voices(
    distance: NDArray[np.float64], *, n_test: int, n_near: int, bound: float, seed: int
) -> VoiceSplit:
    """Draw test voices from different clusters, drop who is near them, and hold out a control.

    Args:
        distance: (voices, voices), see `distances`.
        n_test, n_near: number of test voices and of voices of the control.
        bound: least distance of a training voice from a test voice.
        seed: of the draws.

    Raises ValueError if there are not enough clusters or voices for it.
    """
    n_test, n_near = whole("n_test", n_test, low=1), whole("n_near", n_near, low=1)
    bound = real("bound", bound, above=0.0)
    rng = np.random.default_rng(whole("seed", seed, low=0))
    cluster = clusters(distance, bound)
    n_clusters = int(cluster.max()) + 1
    if n_clusters <= n_test:
        raise ValueError(
            f"n_test must be below the number of clusters, {n_clusters} at bound = {bound:g}, "
            f"got {n_test}: lower the bound or test fewer voices"
        )
    chosen = rng.permutation(n_clusters)[:n_test]
    test = np.array([rng.choice(np.flatnonzero(cluster == c)) for c in chosen])
    is_near = distance[:, test].min(axis=1) < bound
    dropped = np.setdiff1d(np.flatnonzero(is_near), test)
    left = rng.permutation(np.flatnonzero(~is_near))
    if len(left) <= n_near:
        raise ValueError(
            f"only {len(left)} voices are {bound:g} away from all test voices: lower the bound, "
            "or test fewer voices"
        )
    return VoiceSplit(np.sort(left[n_near:]), np.sort(test), np.sort(left[:n_near]), dropped)
