"""Single entries read and written inside a loop, so that the arrays it carries stay in place.

A loop over single cells (a queue, say) can be nearly as fast as native code, on two conditions.
- The arrays that the loop carries must stay in place. XLA copies an array, whole and at every step,
  if a fused computation reads it and need not come before the write. A read through `read_apart` is
  done once, and the value written depends on what it returns.
- XLA repeats a chain of scalar reads in every computation that uses its end. `marks.apart` around
  one link of the chain prevents that.
"""

from jax import lax

from sign_model.foundation.marks import apart
from srt_jax.types import Array


def read(array: Array, index: Array) -> Array:
    """Returns array[index], index uint32: a signed one would be tested for being negative."""
    return lax.dynamic_slice(array, (index,), (1,))[0]


read_apart = apart(read)
"""`read`, computed once and not again wherever its result is used."""


def write(array: Array, value: Array, index: Array) -> Array:
    """Returns `array` with `value` at `index`, uint32."""
    return lax.dynamic_update_slice(array, value[None].astype(array.dtype), (index,))
