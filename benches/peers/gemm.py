#!/usr/bin/env python3
"""Rate of the BLAS matrix product of numpy, in GF/s, as JSON: the floor of every factorisation. Threads: OPENBLAS_NUM_THREADS."""

import json
import time

import numpy as np

SIZE, REPEATS = 3000, 5


def main():
    rates = {}
    for name, kind in (("f64", np.float64), ("f32", np.float32)):
        a, b = (np.random.default_rng(seed).standard_normal((SIZE, SIZE)).astype(kind) for seed in (1, 2))
        found = []
        for _ in range(REPEATS):
            began = time.perf_counter()
            a @ b
            found.append(2 * SIZE ** 3 / (time.perf_counter() - began) / 1e9)
        rates[name] = max(found)
    print(json.dumps(rates))


if __name__ == "__main__":
    main()
