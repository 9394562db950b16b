"""The ideal filters of a chain: what can be said about it before anything is rounded."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from sosmith.gen.chain.ideal import ExactChain, alias_map, bands, chain_gain, frequencies, stage_gain

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ChainFilter:
    """The ideal filters of a chain in series, from `ChainSpecification.filter` or `Chain.filter`.

    Frequencies are those of sines at the highest rate, in Hz: at the input, unless stages interpolate. One of up to
    half the input's rate is filtered as it is, and others are images of it.

    Examples
    --------
    >>> import sosmith
    >>> ideal = sosmith.ChainSpecification.load({
    ...     "name": "slow",
    ...     "sample_rate": 8000,
    ...     "input": {"x": {"bits": 8, "range": [-1.0, 1.0], "signed": True}},
    ...     "stage": [{"name": "mean", "kind": "cic", "order": 1, "decimate": 4}],
    ...     "output": {"bits": 8, "range": [-1.0, 1.0], "signed": True},
    ... }).filter
    >>> ideal.bands
    [(1000.0, 4000.0, 'aliasing')]
    >>> abs(ideal.frequency_response([0.0, 1000.0])).round(3).tolist()
    [1.0, 0.653]
    """

    chain: ExactChain = field(repr=False)
    """The chain in the form of the inner packages."""

    @property
    def bands(self) -> list[tuple[float, float, str]]:
        """Where a sine comes out at another frequency than it went in: from, to, and "aliasing" or "image"."""
        return bands(self.chain)

    def frequencies(self, points: int = 400) -> Floats:
        """Return frequencies in Hz for a picture, evenly spaced on a logarithmic axis, up to half the highest rate."""
        return frequencies(self.chain, points)

    def frequency_response(self, f: npt.ArrayLike) -> npt.NDArray[np.complex128]:
        """Return the complex gain from sines at the input to the sines at the output, an array of the shape of `f`."""
        return chain_gain(self.chain, np.asarray(f, dtype=np.float64))

    def stage_gains(self, f: npt.ArrayLike) -> dict[str, Floats]:
        """Return the magnitude of the gain of each stage that has one, by its name: all but a polynomial."""
        at = np.asarray(f, dtype=np.float64)
        return {stage.spec.name: stage_gain(stage, at) for stage in self.chain.stages if stage.parts}

    def aliases(self, points: int = 400) -> tuple[Floats, Floats, Floats] | None:
        """Return what comes out at which frequency: frequencies in Hz, gain of what stays there, largest of aliases.

        None for a chain that does not decimate, or that interpolates too. `points` may be fewer where the factor is
        large. The largest gains are those of aliases of just these frequencies; `Chain.folding` has proven ones.
        """
        return alias_map(self.chain, points)

    def __repr__(self) -> str:
        return f"<sosmith.ChainFilter: {' -> '.join(stage.spec.name for stage in self.chain.stages)}>"
