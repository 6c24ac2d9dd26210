"""The option `toll`, checked: what one unit of removal cost is worth in cell sides."""

import jax
import jax.numpy as jnp
import numpy as np

from srt_jax.engine.arguments import is_traced
from srt_jax.types import Array


def toll_of_each(toll: float | Array, batch: tuple[int, ...], mode: str) -> Array:
    """Returns the toll of every task of a batch, folded: float32 [B], on the host unless traced.

    Raises:
      ValueError: in mode "shortest", a toll that is negative or not finite (where its value is
        known), or of a shape that does not fit the batch.
    """
    count = int(np.prod(batch))
    if mode != "shortest":
        return np.zeros(count, np.float32)
    xp = jnp if is_traced(toll) and isinstance(toll, jax.Array) else np
    with np.errstate(over="ignore"):  # what is too large becomes infinite, which is refused
        given = xp.asarray(toll, np.float32)
    if given.shape not in ((), batch):
        raise ValueError(
            f"toll must be a number, or float32 of shape {list(batch)}, one for each task, got"
            f" {list(given.shape)}"
        )
    if isinstance(given, np.ndarray) and not (np.isfinite(given) & (given >= 0)).all():
        wrong = given.reshape(-1)[~(np.isfinite(given) & (given >= 0)).reshape(-1)][0]
        raise ValueError(
            f"toll is {wrong}: it must be finite and not negative, a number of cell sides for one"
            " unit of removal cost"
        )
    return xp.broadcast_to(given, batch).reshape(count)
