"""python benchmarks/kernels.py [--quick] [--json]: the kernels beside their native peers, as
`srt-jax bench kernels`.
"""

from srt_jax.bench.kernels import main

if __name__ == "__main__":
    main()
