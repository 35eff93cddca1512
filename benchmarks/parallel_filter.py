"""CPU time of the parallel filter against SciPy's forward-backward filter, on the same columns in one run.

python benchmarks/parallel_filter.py
"""

import time

import numpy as np
from scipy.signal import butter, sosfiltfilt

from identify.signals import parallel_filter, zero_phase

CASES = [
    (26_000, 120, 1e-3, 45.0),
    (26_000, 120, 1e-3, 17.0),
    (26_000, 8, 1e-3, 45.0),
    (26_000, 120, 2e-4, 17.0),
]


def main() -> None:
    """Print a table: rows, columns, sampling, cut-off, ns for a row of a column, ratio, largest
    difference."""
    rng = np.random.default_rng(0)
    print("rows    columns  f_s/Hz  f_c/Hz   ours/ns  scipy/ns  ratio  difference")
    for rows, k, period, cutoff in CASES:
        columns = rng.standard_normal((rows, k))
        factor = parallel_filter.decimation_factor(cutoff, period)
        count = (rows - 1) // factor + 1
        zero_phase.impulse_response(cutoff, period)
        start = time.process_time()
        ours = parallel_filter.decimate(columns, 0, count, factor, cutoff, period)
        between = time.process_time()
        filtered = sosfiltfilt(butter(4, 2 * cutoff * period, output="sos"), columns, axis=0)[::factor]
        end = time.process_time()
        edge = zero_phase.memory(cutoff, period) // factor + 1
        difference = np.abs(ours - filtered)[edge:-edge].max()
        mine, theirs = (between - start) / columns.size * 1e9, (end - between) / columns.size * 1e9
        figures = f"{mine:<8.1f} {theirs:<9.1f} {theirs / mine:<6.1f} {difference:.1e}"
        print(f"{rows:<7} {k:<8} {1 / period:<7.0f} {cutoff:<8.0f} {figures}")


if __name__ == "__main__":
    main()
