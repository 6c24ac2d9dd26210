"""python benchmarks/solve.py [--quick]: whole answers beside their native peers, as `srt-jax
bench solve`.
"""

import sys

from srt_jax.bench import solve

if __name__ == "__main__":
    print(solve.table(solve.run(quick="--quick" in sys.argv[1:])))
