"""How good a policy is: every level once, beside the oracle."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from srt_jax.engine.arguments import require_key
from srt_jax.envs.relocation import EnvParams, SmartRelocation, oracle_score
from srt_jax.envs.rules import EnvState
from srt_jax.types import Array

Policy = Callable[[Array, Array], Array]
"""(key, observation) -> action, int32 []; jittable."""


class Evaluation(NamedTuple):
    """Per level of the pool: NumPy arrays [N].

    Attributes:
      success: bool [N], whether the goal was reached in time.
      score: float32 [N], sum of rewards.
      length: float32 [N], way walked in cell sides.
      removal: float32 [N], cost of what was destroyed.
      regret: float32 [N], the oracle's score less that one.
      removal_regret, length_regret: float32 [N], removal and length less the oracle's; NaN without
        success.

    Examples:
      >>> import jax
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax import envs
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> levels = envs.make_levels([srt_jax.make_task(free, (2, 0), (2, 6))])
      >>> env, params = envs.make(levels=levels)
      >>> result = envs.evaluate(env, params, lambda key, observation: 4, jax.random.key(1))
      >>> result.success.tolist(), result.length.tolist()  # two cells up to the wall
      ([False], [2.0])
    """

    success: np.ndarray
    score: np.ndarray
    length: np.ndarray
    removal: np.ndarray
    regret: np.ndarray
    removal_regret: np.ndarray
    length_regret: np.ndarray

    def __repr__(self) -> str:
        """What it says in a line."""
        return f"Evaluation({len(self.success)} levels: {self.summary()})"

    def summary(self) -> str:
        """Returns one line: share of successes, mean score and regret; the successes' mean regrets
        in removal and length.
        """
        text = (
            f"success {self.success.mean():.0%}, score {self.score.mean():.2f}, regret"
            f" {self.regret.mean():.2f}"
        )
        if not self.success.any():
            return text
        return (
            f"{text}; of the successes: removal +{np.nanmean(self.removal_regret):.2f}, "
            + f"length +{np.nanmean(self.length_regret):.2f}"
        )


def evaluate(env: SmartRelocation, params: EnvParams, policy: Policy, key: Array) -> Evaluation:
    """Returns how the policy does from the start of every level, until the goal or the end of time
    (host; jits inside).

    Args:
      env, params: from `make`; the levels of `params` carry their oracle (`with_oracle`).
      policy: (key, observation) -> action, int32 []; runs under jit and vmap.
      key: JAX random key [].

    Returns:
      Evaluation, arrays [N] over the levels.

    Examples:
      >>> import jax
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax import envs
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> levels = envs.make_levels([srt_jax.make_task(free, (2, 0), (2, 6))])
      >>> env, params = envs.make(levels=levels)
      >>> result = envs.evaluate(env, params, lambda key, observation: 4, jax.random.key(1))
      >>> result.success.tolist()  # walks east up to the wall and stays there
      [False]
    """
    require_key(key)
    scores = jax.tree.map(np.asarray, _play(env, params, policy, key))
    success, score, length, removal = scores
    levels = jax.tree.map(np.asarray, params.levels)
    return Evaluation(
        success=success,
        score=score,
        length=length,
        removal=removal,
        regret=np.asarray(oracle_score(params)) - score,
        removal_regret=np.where(success, removal - levels.removal, np.float32(np.nan)),
        length_regret=np.where(success, length - levels.length, np.float32(np.nan)),
    )


class _Episodes(NamedTuple):
    """One episode a level. key: for the steps to come. states: [N]. is_over: bool [N]."""

    key: Array
    states: EnvState
    is_over: Array


def _play(env: SmartRelocation, params: EnvParams, policy: Policy, key: Array) -> tuple[Array, ...]:
    @jax.jit
    def play(params: EnvParams, key: Array) -> tuple[Array, ...]:
        number = params.levels.start.shape[0]
        states = jax.vmap(env.reset_to, in_axes=(0, None))(
            jnp.arange(number, dtype=jnp.int32), params
        )[1]

        def step(episodes: _Episodes) -> _Episodes:
            key, used = jax.random.split(episodes.key)
            states, is_done = episodes.states, episodes.is_over
            seen = jax.vmap(env.get_obs, in_axes=(0, None))(states, params)
            actions = jax.vmap(policy)(jax.random.split(used, number), seen)
            new = jax.vmap(env.step_env, in_axes=(None, 0, 0, None))(used, states, actions, params)[
                1
            ]
            # An episode that is over keeps its last state.
            kept = jax.tree.map(
                lambda a, b: jnp.where(is_done.reshape(-1, *[1] * (a.ndim - 1)), a, b), states, new
            )
            return _Episodes(key, kept, jax.vmap(is_over, in_axes=(0, None))(kept, params))

        def is_over(state, params):
            return env.is_terminated(state, params) | env.is_truncated(state, params)

        # Ends: every episode is over, at the latest when it is truncated.
        begin = _Episodes(key, states, jnp.zeros(number, bool))
        states = jax.lax.while_loop(lambda now: ~now.is_over.all(), step, begin).states
        success = jax.vmap(env.is_terminated, in_axes=(0, None))(states, params)
        return success, states.score, states.length, states.removal

    return play(params, key)
