"""Many environments with the face of Gymnasium's VectorEnv, all stepped in one jitted call."""

import functools
from typing import Any

import gymnasium
import jax
import jax.numpy as jnp
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from srt_jax.engine.forks import refuse_fork
from srt_jax.envs import gym
from srt_jax.envs.relocation import EnvParams, SmartRelocation
from srt_jax.envs.rules import NUM_ACTIONS, EnvState
from srt_jax.types import Array


class GymnasiumVectorEnv(gym.Specified, VectorEnv):
    """`num_envs` environments. What reset and step return is, bit for bit, what Gymnasium's
    SyncVectorEnv returns of as many `GymnasiumEnv`, in each of its autoreset modes.

    Args:
      env, params: from `envs.make`; by default a SmartRelocation of the default options on the
        default levels.
      num_envs: how many.
      render_mode: None or "rgb_array".
      autoreset_mode: "NextStep": where an episode has ended, the next step ignores the action and
        returns a new episode's first observation with reward 0; "SameStep": the step that ends an
        episode returns the next one's first observation, and infos["final_obs"] and
        infos["final_info"] what ended; "Disabled": the caller resets, by reset(options={
        "reset_mask": bool [num_envs]}).
      max_episode_steps: after so many steps an episode is truncated; by default as `params` say.
      options: instead of `env` those of `SmartRelocation` (observation, radius), and instead of
        `params` levels.
    """

    def __init__(
        self,
        env: SmartRelocation | None = None,
        params: EnvParams | None = None,
        *,
        num_envs: int = 1,
        render_mode: str | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
        **options: Any,
    ):
        gym.check_render_mode(render_mode)
        if num_envs < 1:
            raise ValueError(f"num_envs must be at least 1, got {num_envs}")
        self.env, self.params = gym.made(env, params, options)
        if max_episode_steps is not None:
            self.params = self.params.replace(max_steps_in_episode=max_episode_steps)
        self.num_envs, self.render_mode = num_envs, render_mode
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = gym.GymnasiumEnv.metadata | {"autoreset_mode": self.autoreset_mode}
        self.spec = gym.spec_of(self.env, self.params, num_envs=num_envs)
        self.single_action_space = gymnasium.spaces.Discrete(NUM_ACTIONS)
        self.single_observation_space = gym.observation_box(self.env, self.params)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.states: Any = None
        self._keys: Any = None  # uint32 [num_envs, 2], the words of a key each
        self._is_over = np.zeros(num_envs, bool)

    def reset(  # pyright: ignore
        self, *, seed: Any = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Returns observations [num_envs, ...] and infos of new episodes.

        Args:
          seed: a number, to which each environment adds its own; or a number, or None, for each.
          options: {"level": number, or one for each} asks for levels of the pool; {"reset_mask":
            bool [num_envs]} resets these only.
        """
        refuse_fork()
        mask = self._mask_of(options)
        self._seed(seed, mask)
        # The level of each, -1 for one to be drawn.
        levels = np.full(self.num_envs, -1, np.int32)
        if options and "level" in options:
            gym.check_levels(options["level"], self.params)
            levels[:] = options["level"]
        self._keys, self.states, seen = _reset(
            self.env, self._keys, self.states, mask, levels, self.params
        )
        self._is_over = self._is_over & ~mask
        return np.array(seen), _masked({"level": np.asarray(self.states.level)}, mask)

    def step(
        self, actions: Any
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Returns observations [num_envs, ...], rewards, terminations, truncations [num_envs] and
        infos.
        """
        if self.states is None:
            raise ValueError("step was called before reset: call reset first")
        refuse_fork()
        actions, was_over = self._checked(actions), self._is_over
        if self.autoreset_mode is AutoresetMode.DISABLED and was_over.any():
            raise ValueError(
                f"the episode of environment {int(was_over.argmax())} is over: reset it first,"
                ' reset(options={"reset_mask": terminations | truncations})'
            )
        # All in one call; what goes to the host is copied, as callers write into it.
        self._keys, self.states, out = _step(
            self.env,
            self.autoreset_mode is AutoresetMode.SAME_STEP,
            self._keys,
            self.states,
            was_over,
            actions,
            self.params,
        )
        seen, final, rewards, ended, truncated, info, levels = jax.tree.map(np.array, out)
        self._is_over = ended | truncated
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            infos = _final(final, info, self._is_over) if self._is_over.any() else {}
            infos |= _masked(info, ~self._is_over)
            self._is_over = np.zeros_like(self._is_over)
        else:
            infos = _masked(info, ~was_over)
        infos |= _masked({"level": levels}, np.ones(self.num_envs, bool))
        return seen, rewards.astype(np.float64), ended, truncated, infos

    def render(self) -> tuple[np.ndarray, ...] | None:
        """Returns a picture of each, uint8 [rows, cols, 3]; None where no render_mode was given."""
        if self.render_mode is None:
            return None
        states = jax.tree.map(np.asarray, self.states)
        return tuple(
            self.env.render(jax.tree.map(lambda array, i=i: array[i], states), self.params)
            for i in range(self.num_envs)
        )

    def _mask_of(self, options: dict[str, Any] | None) -> np.ndarray:
        """Returns which environments a reset is for."""
        everything = np.ones(self.num_envs, bool)
        mask = np.asarray((options or {}).get("reset_mask", everything))
        if mask.dtype != bool or mask.shape != (self.num_envs,) or not mask.any():
            raise ValueError(
                f"reset_mask must be bool [{self.num_envs}] and somewhere True, got {mask.dtype}"
                f" {list(mask.shape)}"
            )
        if self.states is None and not mask.all():
            raise ValueError("the first reset is of all environments: leave reset_mask out")
        return mask

    def _seed(self, seed: Any, mask: np.ndarray) -> None:
        """Gives the environments to be reset the keys of their seeds; without seeds they go on with
        their own.
        """
        if isinstance(seed, int | np.integer):
            super().reset(seed=int(seed))
            seed = [int(seed) + i for i in range(self.num_envs)]
        seeds = [None] * self.num_envs if seed is None else list(seed)
        if len(seeds) != self.num_envs:
            raise ValueError(f"seed must have {self.num_envs} entries, got {len(seeds)}")
        is_new = np.array([one is not None for one in seeds]) & mask
        if self._keys is None:
            is_new = mask
        if is_new.any():
            words = np.array([gym.word_of(self.np_random, one) for one in seeds])
            fresh = np.asarray(_keys_of(words))
            old = fresh if self._keys is None else np.asarray(self._keys)
            self._keys = np.where(is_new[:, None], fresh, old)

    def _checked(self, actions: Any) -> np.ndarray:
        actions = np.asarray(actions)
        if actions.shape != (self.num_envs,) or not np.issubdtype(actions.dtype, np.integer):
            raise ValueError(
                f"actions must be whole numbers [{self.num_envs}], got {actions.dtype}"
                f" {list(actions.shape)}"
            )
        if ((actions < 0) | (actions >= NUM_ACTIONS)).any():
            wrong = int(((actions < 0) | (actions >= NUM_ACTIONS)).argmax())
            raise ValueError(
                f"actions must be 0..{NUM_ACTIONS - 1}, got {actions[wrong]} for environment"
                f" {wrong}"
            )
        return actions.astype(np.int32)


def _masked(info: dict[str, np.ndarray], mask: np.ndarray) -> dict[str, Any]:
    """Returns infos as Gymnasium stacks them: an array each, 0 where an environment tells nothing,
    and under the name with an underscore which do.
    """
    infos: dict[str, Any] = {}
    if mask.any():
        for name, array in info.items():
            wide = np.result_type(
                array, {"f": np.float64, "i": np.int64}.get(array.dtype.kind, bool)
            )
            told = np.where(mask, array.astype(wide), np.zeros(1, wide))
            infos |= {name: told, f"_{name}": mask.copy()}
    return infos


def _final(seen: np.ndarray, info: dict[str, np.ndarray], is_over: np.ndarray) -> dict[str, Any]:
    """Returns what the episodes that ended have seen last and told."""
    observations = np.full(len(is_over), None, object)
    for index in np.flatnonzero(is_over):
        observations[index] = seen[index]
    return {
        "final_obs": observations,
        "_final_obs": is_over.copy(),
        "final_info": _masked(info, is_over),
        "_final_info": is_over.copy(),
    }


@jax.jit
def _keys_of(words: Array) -> Array:
    return jax.random.key_data(jax.vmap(jax.random.key)(words))


def _begun(
    env: SmartRelocation, keys: Array, states: EnvState, mask: Array, levels: Array, params: Any
) -> tuple[Array, EnvState]:
    """Returns keys and states with new episodes where the mask is True."""
    fresh = jax.vmap(lambda key, level: gym.begun(env, key, level, params))(keys, levels)
    return _chosen(mask, fresh, (keys, states))


def _chosen(mask: Array, there: Any, else_: Any) -> Any:
    """Returns the rows of one tree where the mask is True, else those of the other."""
    return jax.tree.map(
        lambda a, b: jnp.where(mask.reshape(-1, *[1] * (a.ndim - 1)), a, b), there, else_
    )


def _seen(env: SmartRelocation, states: EnvState, params: EnvParams) -> Array:
    return jax.vmap(env.get_obs, in_axes=(0, None))(states, params)


@functools.partial(jax.jit, static_argnums=0)
def _reset(
    env: SmartRelocation, keys: Array, states: Any, mask: Array, levels: Array, params: EnvParams
) -> tuple[Array, EnvState, Array]:
    if states is None:  # the first time
        states = jax.vmap(lambda level: env.reset_to(level, params)[1])(jnp.zeros_like(levels))
    keys, states = _begun(env, keys, states, mask, levels, params)
    return keys, states, _seen(env, states, params)


@functools.partial(jax.jit, static_argnums=(0, 1))
def _step(
    env: SmartRelocation,
    is_same_step: bool,
    keys: Array,
    states: EnvState,
    was_over: Array,
    actions: Array,
    params: EnvParams,
) -> tuple:
    """Steps all, or resets those that were over; in the same step, resets those that are now."""
    step = jax.vmap(lambda state, action: gym.moved(env, state, action, params))
    stepped, rewards, ended, truncated, info = step(states, actions)
    info = info if is_same_step else {name: info[name] for name in info if name != "level"}
    is_new = (ended | truncated) if is_same_step else was_over

    # Splitting keys is a third of a step, and most steps end no episode of a small batch.
    anyone = jnp.full(is_new.shape, -1, jnp.int32)
    keys, following = jax.lax.cond(
        is_new.any(),
        lambda: _begun(env, keys, stepped, is_new, anyone, params),
        lambda: (keys, stepped),
    )
    seen = _seen(env, following, params)
    final = None
    if is_same_step:
        final = jax.lax.cond(is_new.any(), lambda: _seen(env, stepped, params), lambda: seen)
    else:
        rewards = jnp.where(was_over, jnp.float32(0), rewards)
        ended, truncated = ended & ~was_over, truncated & ~was_over
    out = (seen, final, rewards, ended, truncated, info, following.level)
    return keys, following, out
