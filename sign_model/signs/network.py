"""What is derived from the matrices and never stored: the three networks, and which signs are
procedural (PY16 §2, §3.1).
"""

import jax
import jax.numpy as jnp
import numpy as np

from sign_model.ground.records import Array
from sign_model.signs.matrix import ColumnKind, Component, Matrices


@jax.jit
def network(matrices: Matrices, component: Component) -> Array:
    """Returns the network on one component: s -> t where t is a feature of a matrix of s; all False
    where there is none.

    W_p for images, W_m for significances, W_a for personal meanings (PY16 §3.1).

    Args:
      matrices: one table; batches through `jax.vmap`.
      component: which network.

    Returns:
      bool [S, S], (from, to).
    """
    num_signs = matrices.is_sign.shape[0]
    is_link = (matrices.feature >= 0) & (matrices.component == component)[:, None]
    # Whatever is no link points one past the end, where the update is dropped.
    target = jnp.where(is_link, matrices.feature, num_signs)
    return (
        jnp.zeros((num_signs, num_signs), bool)
        .at[matrices.owner[:, None], target]
        .set(True, mode="drop")
    )


def networks(matrices: Matrices) -> Array:
    """Returns the three networks (W_p, W_m, W_a) as bool [3, S, S]."""
    return jnp.stack([network(matrices, component) for component in Component])


def roles(matrices: Matrices) -> Array:
    """Returns the significances that follow from images: s -> t where the image of t requires s
    (PY16 §3.1).

    The converse of W_p: what a sign is good for, as far as the images tell. bool [S, S], (from,
    to).
    """
    return network(matrices, Component.IMAGE).T


def precedence(
    matrices: Matrices, sign: int, component: Component
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Returns which features of a sign always precede which others, and whether no two of its
    matrices disagree (host).

    f precedes g when in every matrix of the component both occur and every f comes strictly before
    every g. A deleted feature counts as a feature of its own, the absence. Two matrices disagree
    where one puts f strictly before g and the other, which has both, does not.

    Args:
      sign: its number.
      component: whose matrices are compared.

    Returns:
      features: int32 [U], ascending; a feature f that is deleted stands as -1 - f.
      precedes: bool [U, U], (earlier, later); all False where the component has no matrix.
      is_consistent: True where no two matrices disagree.
    """
    first, last, features = _spans(matrices, sign, component)
    occurs = first <= last
    before = (last[:, :, None] < first[:, None, :]) & occurs[:, :, None] & occurs[:, None, :]
    has_both = occurs[:, :, None] & occurs[:, None, :]
    precedes = np.asarray(before.all(axis=0))
    disagrees = before.any(axis=0) & (has_both & ~before).any(axis=0)
    return features, precedes, not disagrees.any()


def is_procedural(
    matrices: Matrices, sign: int, component: Component, *, whole: bool = True
) -> bool:
    """Returns whether a sign mediates a process: its matrices share a strict order of columns;
    False without matrices.

    PY16 §3.1: "there exists the feature set that always precedes another set". With `whole` the
    shared order must be the order of all columns, so that no two matrices may disagree on any pair
    of features: the paper's "face" is then no process, for its left eye comes first in one matrix
    and last in another. Without `whole` a part suffices (nose, then mouth).
    """
    _, precedes, is_consistent = precedence(matrices, sign, component)
    return bool(precedes.any() and (is_consistent or not whole))


def _spans(
    matrices: Matrices, sign: int, component: Component
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the first and last column of each feature per matrix, int [M, U]; first > last where
    it does not occur.
    """
    slots = np.flatnonzero(
        (np.asarray(matrices.owner) == sign) & (np.asarray(matrices.component) == component)
    )
    feature, bits, kind = (
        np.asarray(part)[slots] for part in (matrices.feature, matrices.bits, matrices.kind)
    )
    signed = np.where(
        (kind == ColumnKind.DELETES)[:, None, :], -1 - feature[:, :, None], feature[:, :, None]
    )
    features = np.unique(signed[bits])
    num_columns = kind.shape[1]
    first = np.full((len(slots), len(features)), num_columns, np.int32)
    last = np.full((len(slots), len(features)), -1, np.int32)
    slot, row, moment = np.nonzero(bits)
    place = np.searchsorted(features, signed[slot, row, moment])
    np.minimum.at(first, (slot, place), moment)
    np.maximum.at(last, (slot, place), moment)
    return first, last, features
