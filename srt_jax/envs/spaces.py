"""Spaces with the face of gymnax's; gymnax's own where the caller has loaded it, as its wrappers
ask for its classes.
"""

import sys
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from srt_jax.types import Array


class Discrete:
    """The whole numbers 0..n-1."""

    def __init__(self, n: int):
        self.n, self.shape, self.dtype = n, (), jnp.int32

    def __repr__(self) -> str:
        return f"Discrete({self.n})"

    def sample(self, key: Array) -> Array:
        """Returns one of them, each as likely."""
        return jax.random.randint(key, (), 0, self.n, jnp.int32)

    def contains(self, x: Array) -> Array:
        """Returns whether `x` is one of them."""
        x = jnp.asarray(x)
        return (x >= 0) & (x < self.n)


class Box:
    """Arrays of one shape with entries between two bounds."""

    def __init__(self, low: float, high: float, shape: tuple[int, ...], dtype: Any = jnp.float32):
        self.low, self.high, self.shape, self.dtype = low, high, shape, dtype

    def __repr__(self) -> str:
        return f"Box({self.low}, {self.high}, {self.shape}, {np.dtype(self.dtype)})"

    def sample(self, key: Array) -> Array:
        """Returns an array drawn evenly between the bounds."""
        return jax.random.uniform(key, self.shape, jnp.float32, self.low, self.high).astype(
            self.dtype
        )

    def contains(self, x: Array) -> Array:
        """Returns whether every entry of `x` lies within the bounds."""
        return ((x >= self.low) & (x <= self.high)).all()


class Dict:
    """A record of spaces by the names of its fields."""

    def __init__(self, spaces: dict[str, Any]):
        self.spaces, self.num_spaces = spaces, len(spaces)

    def __repr__(self) -> str:
        return f"Dict({self.spaces})"

    def sample(self, key: Array) -> dict[str, Array]:
        """Returns a sample of each."""
        keys = jax.random.split(key, self.num_spaces)
        return {name: space.sample(one) for (name, space), one in zip(self.spaces.items(), keys)}

    def contains(self, x: Any) -> Array:
        """Returns whether every field lies in its space."""
        return jnp.array(
            [space.contains(getattr(x, name)) for name, space in self.spaces.items()]
        ).all()


def spaces() -> Any:
    """Returns the module to take the classes from: gymnax's where it is loaded, else this one."""
    return sys.modules.get("gymnax.environments.spaces", sys.modules[__name__])
