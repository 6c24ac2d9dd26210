"""What is derived from the prediction matrices and never stored: the three semantic networks W_p,
W_m and W_a, and which signs are procedural (PY16 §2, §3.1).
"""

import jax
import jax.numpy as jnp
import numpy as np

from sign_model.foundation.records import Array
from sign_model.signs.matrix import ColumnKind, Component, Matrices


@jax.jit
def network(matrices: Matrices, component: Component) -> Array:
    """Returns the network on one component: s -> t if t is a feature of a matrix of s; all False
    without matrices.

    W_p for images, W_m for significances, W_a for personal meanings (PY16 §3.1).

    Args:
      matrices: one table; use `jax.vmap` for batches.
      component: which network.

    Returns:
      bool [S, S], (from, to).
    """
    num_signs = matrices.is_sign.shape[0]
    is_link = (matrices.feature >= 0) & (matrices.component == component)[:, None]
    # Rows that are no link point one past the end, where the update is dropped.
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
    """Returns the significances that follow from images, bool [S, S], (from, to): s -> t if the
    image of t requires s (PY16 §3.1).

    The converse of W_p: the roles of a sign, as far as they follow from images.
    """
    return network(matrices, Component.IMAGE).T


def precedence(
    matrices: Matrices, sign: int, component: Component
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Returns which features of a sign always precede which others, and whether its matrices agree
    (host).

    f precedes g if both occur in every matrix of the component, and every f comes strictly before
    every g. A deleted feature counts as a separate feature, its absence. Two matrices disagree if
    both contain f and g, and one has f strictly before g and the other does not.

    Args:
      matrices: one table.
      sign: its number.
      component: whose matrices are compared.

    Returns:
      features: int32 [U], ascending; the absence of a feature f is -1 - f.
      precedes: bool [U, U], (earlier, later); all False if the component has no matrix.
      is_consistent: True if no two matrices disagree.
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
    """Returns whether a sign is procedural: its matrices share a strict order of columns, so it
    mediates a deterministic process or an action; False without matrices.

    PY16 §3.1: "there exists the feature set that always precedes another set". With `whole` the
    shared order must be the order of all columns, so no two matrices may disagree on any pair of
    features: the paper's "face" is then not procedural, because its left eye comes first in one
    matrix and last in another. Without `whole` a part of the order suffices (nose, then mouth).
    """
    _, precedes, is_consistent = precedence(matrices, sign, component)
    return bool(precedes.any() and (is_consistent or not whole))


def _spans(
    matrices: Matrices, sign: int, component: Component
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the first and the last column of each feature in each matrix, int [M, U] each, and
    the features, int [U]; first > last where a feature does not occur.
    """
    # The matrices of the component; features of DELETES columns become absences, -1 - f.
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

    # The least and the greatest column of each feature.
    num_columns = kind.shape[1]
    first = np.full((len(slots), len(features)), num_columns, np.int32)
    last = np.full((len(slots), len(features)), -1, np.int32)
    slot, row, moment = np.nonzero(bits)
    place = np.searchsorted(features, signed[slot, row, moment])
    np.minimum.at(first, (slot, place), moment)
    np.maximum.at(last, (slot, place), moment)
    return first, last, features
