"""What repeated noisy evaluations make one believe of designs: running means."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import N_DESIGNS


class RunningMeans:
    """The mean of all values told for every design, and how well it is known.

    Attributes
    ----------
    counts : ndarray of int64, shape (6561,)
        How many values were told.
    means : ndarray, shape (6561,)
        NaN where none was told.

    Source
    ------
    B. P. Welford, *Note on a method for calculating corrected sums of squares and products*,
    Technometrics 4(3), 1962.
    """

    def __init__(self) -> None:
        self.counts = np.zeros(N_DESIGNS, dtype=np.int64)
        self.means = np.full(N_DESIGNS, np.nan)
        self._squares = np.zeros(N_DESIGNS)  # sum of squared deviations from the mean
        self._travelled = np.zeros((N_DESIGNS, 3))  # sum of displacements
        self._n_travelled = np.zeros(N_DESIGNS, dtype=np.int64)

    def add(
        self,
        indices: NDArray[np.int64],
        values: NDArray[np.float64],
        displacement: NDArray[np.float64],
    ) -> None:
        """Take in values of designs given by their numbers; one may occur repeatedly.

        Parameters
        ----------
        indices, values : shape (n,)
        displacement : ndarray, shape (n, 3)
            Voxel widths; NaN where the design diverged.
        """
        travelled = ~np.isnan(displacement[:, 0])
        np.add.at(self._travelled, indices[travelled], displacement[travelled])
        np.add.at(self._n_travelled, indices[travelled], 1)
        for i, value in zip(indices.tolist(), values.tolist(), strict=True):
            self.counts[i] += 1
            if self.counts[i] == 1:
                self.means[i] = value
                continue
            before = value - self.means[i]
            self.means[i] += before / self.counts[i]
            self._squares[i] += before * (value - self.means[i])

    def displacements(self, indices: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return mean displacements, shape (n, 3), voxel widths; NaN where all diverged."""
        counts = self._n_travelled[indices][:, np.newaxis]
        mean: NDArray[np.float64] = self._travelled[indices] / np.where(counts > 0, counts, np.nan)
        return mean

    def standard_errors(self, indices: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the standard errors of means, estimated from the values' spread.

        Returns
        -------
        ndarray, shape (n,)
            Voxel widths; NaN where fewer than two values were told.
        """
        counts = self.counts[indices]
        freedom = np.where(counts > 1, counts - 1.0, np.nan)
        errors: NDArray[np.float64] = np.sqrt(self._squares[indices] / (freedom * counts))
        return errors
