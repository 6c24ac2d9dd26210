"""The environment SmartRelocation-v0, with the methods and results of gymnax 1.0, and needing none
of gymnax.
"""

import dataclasses
import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from srt_jax.engine.arguments import require_key
from srt_jax.envs.levels import Levels, make_levels
from srt_jax.envs.observe import NUM_PLANES, action_mask, observation_bounds, observation_of
from srt_jax.envs.render import render
from srt_jax.envs.rules import NUM_ACTIONS, EnvState, act, no_words
from srt_jax.envs.spaces import spaces
from srt_jax.instances.generate import generate
from srt_jax.types import Array, Record, record


@record
class EnvParams(Record):
    """What may change without compiling again. The reward of a step is

        goal_reward * [in the goal] - step_cost * length - removal_weight * removal - wasted_cost *
        [nothing changed]

    Attributes:
      levels: the pool from which every reset draws.
      step_cost: float32 [], per cell side walked.
      removal_weight: float32 [], per unit of removal cost.
      wasted_cost: float32 [], for an action without effect.
      goal_reward: float32 [], for reaching the goal.
      max_steps_in_episode: int32 [], after so many steps an episode is truncated.

    As set, walking round costs less than destroying on maps up to about 16 x 16, so that the
    oracle, which removes the least and then walks the shortest, has (nearly) the greatest return
    there is; that of mode "shortest" has it on maps of any size (`with_oracle`).

    Examples:
      >>> import jax
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax import envs
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> levels = envs.make_levels([srt_jax.make_task(free, (2, 0), (2, 6))])
      >>> env, params = envs.make(levels=levels)
      >>> params.replace(step_cost=0.1).step_cost
      0.1
    """

    levels: Levels
    step_cost: Array = 0.01
    removal_weight: Array = 1.0
    wasted_cost: Array = 0.01
    goal_reward: Array = 10.0
    max_steps_in_episode: Array = 200


@dataclasses.dataclass(frozen=True)
class SmartRelocation:
    """An agent walks to a goal that obstacles may cut off, and destroys what it must. Actions:
    `srt_jax.envs.rules`.

    Static options; everything else travels in `EnvParams`.

    Attributes:
      observation: "window" (the agent in its centre) or "map".
      radius: of the window: 2 radius + 1 cells a side.

    Examples:
      >>> import jax
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax import envs
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> levels = envs.make_levels([srt_jax.make_task(free, (2, 0), (2, 6))])
      >>> env, params = envs.make(levels=levels)
      >>> observation, state = env.reset(jax.random.key(0), params)
      >>> observation.shape, env.num_actions
      ((9, 9, 6), 16)
      >>> observation, state, reward, terminated, truncated, info = env.step(
      ...     jax.random.key(1), state, 4, params)  # one cell to the east
      >>> state.cell.tolist()
      [2, 1]
    """

    observation: str = "window"
    radius: int = 4

    def __post_init__(self) -> None:
        if self.observation not in NUM_PLANES:
            raise ValueError(
                f"observation must be one of {', '.join(NUM_PLANES)}, got {self.observation!r}"
            )
        if self.radius < 1:
            raise ValueError(f"radius must be at least 1, got {self.radius}")

    @property
    def name(self) -> str:
        """The environment's name and version."""
        return "SmartRelocation-v0"

    @property
    def num_actions(self) -> int:
        """How many actions there are."""
        return NUM_ACTIONS

    @property
    def default_params(self) -> EnvParams:
        """64 levels of rooms, 16 x 16, solved by the oracle on first use (some seconds)."""
        return _default_params()

    @functools.partial(jax.jit, static_argnames=("self",))
    def reset(self, key: Array, params: EnvParams | None = None) -> tuple[Array, EnvState]:
        """Returns the first observation and state of an episode on a level drawn by `key`."""
        return self.reset_env(key, self._params_or_default(params))

    @functools.partial(jax.jit, static_argnames=("self",))
    def step(
        self, key: Array, state: EnvState, action: Array, params: EnvParams | None = None
    ) -> tuple:
        """Returns (observation, state, reward, terminated, truncated, info), all of the next
        episode where this one ended.

        Where an episode ends, observation and state are those of a fresh reset by `key`, and
        info["final_observation"] is what was seen last; the other entries are of the step itself:
        terminated, truncated, discount (0 where terminated), success, length, removal, and regret,
        the oracle's score less the episode's so far (NaN on levels without oracle).
        """
        params = self._params_or_default(params)
        stepped, reward, terminated, info = self._move(state, action, params)
        truncated = self.is_truncated(stepped, params)
        is_over = jnp.asarray(terminated | truncated)
        fresh = self._fresh(key, params)
        following = jax.tree.map(lambda new, old: jnp.where(is_over, new, old), fresh, stepped)
        info |= {
            "terminated": terminated,
            "truncated": truncated,
            "final_observation": self.get_obs(stepped, params),
        }
        return self.get_obs(following, params), following, reward, terminated, truncated, info

    def step_env(self, key: Array, state: EnvState, action: Array, params: EnvParams) -> tuple:
        """Returns (observation, state, reward, terminated, info) without resetting; `key` is not
        used: steps are certain.
        """
        del key
        stepped, reward, terminated, info = self._move(state, action, params)
        return self.get_obs(stepped, params), stepped, reward, terminated, info

    def reset_env(self, key: Array, params: EnvParams) -> tuple[Array, EnvState]:
        """`reset`, not jitted."""
        state = self._fresh(key, params)
        return self.get_obs(state, params), state

    def reset_to(self, level: Array, params: EnvParams) -> tuple[Array, EnvState]:
        """Returns the first observation and state on that level of the pool: int32 []."""
        state = _begun(jnp.asarray(level, jnp.int32), params)
        return self.get_obs(state, params), state

    def get_obs(self, state: EnvState, params: EnvParams, key: Array | None = None) -> Array:
        """Returns what the agent sees, float32 [rows, cols, planes] (`srt_jax.envs.observe`)."""
        del key
        return observation_of(params.levels, state, self.observation, self.radius)

    def observe(
        self, key: Array, state: EnvState, action: Array | None, params: EnvParams
    ) -> Array:
        """`get_obs` by gymnax's other name."""
        del key, action
        return self.get_obs(state, params)

    def action_mask(self, state: EnvState, params: EnvParams) -> Array:
        """Returns which actions change something: bool [16]."""
        return action_mask(params.levels, state)

    def is_terminated(self, state: EnvState, params: EnvParams) -> Array:
        """Returns whether the agent is in the goal."""
        return (state.cell == params.levels.goal[state.level]).all()

    is_terminal = is_terminated

    def is_truncated(self, state: EnvState, params: EnvParams) -> Array:
        """Returns whether time is up."""
        return state.time >= jnp.asarray(params.max_steps_in_episode, jnp.int32)

    def discount(self, state: EnvState, params: EnvParams) -> Array:
        """Returns 0 in the goal, else 1: float32 []."""
        return jnp.where(self.is_terminated(state, params), jnp.float32(0), jnp.float32(1))

    def action_space(self, params: EnvParams | None = None) -> Any:
        """Returns the space of actions: whole numbers 0..15."""
        del params
        return spaces().Discrete(NUM_ACTIONS)

    def observation_space(self, params: EnvParams) -> Any:
        """Returns the space of observations: float32 [rows, cols, planes], with finite bounds."""
        low, high = self.observation_bounds(params)
        return spaces().Box(low, high, low.shape, jnp.float32)

    def observation_bounds(self, params: EnvParams) -> tuple[Any, Any]:
        """Returns the least and the greatest observation: float32 [rows, cols, planes] each."""
        sides = (
            params.levels.labels.shape[-2:]
            if self.observation == "map"
            else (2 * self.radius + 1,) * 2
        )
        shape = (*sides, NUM_PLANES[self.observation])
        return observation_bounds(params.levels, self.observation, shape)

    def state_space(self, params: EnvParams) -> Any:
        """Returns the space of states, by field."""
        N, _, H, W = params.levels.labels.shape
        kinds, endless = spaces(), float("inf")
        words = no_words(params.levels.price.shape[1]).shape
        return kinds.Dict(
            {
                "level": kinds.Discrete(N),
                "cell": kinds.Box(0, max(H, W) - 1, (2,), jnp.int32),
                "gone": kinds.Box(np.uint32(0), np.uint32(2**32 - 1), words, jnp.uint32),
                "time": kinds.Box(0, 2**31 - 1, (), jnp.int32),
                "length": kinds.Box(0, endless, (), jnp.float32),
                "removal": kinds.Box(0, endless, (), jnp.float32),
                "score": kinds.Box(-endless, endless, (), jnp.float32),
            }
        )

    def render(self, state: EnvState, params: EnvParams) -> np.ndarray:
        """Returns a picture, uint8 [rows, cols, 3] (`srt_jax.envs.render`)."""
        return render(state, params.levels)

    def _params_or_default(self, params: EnvParams | None) -> EnvParams:
        return self.default_params if params is None else params

    def _move(
        self, state: EnvState, action: Array, params: EnvParams
    ) -> tuple[EnvState, Array, Array, dict[str, Array]]:
        """Returns the next state, its reward, whether it is the goal, and the entries of info."""
        _check(state, action)
        effect = act(params.levels, state, action)
        is_there = (effect.cell == params.levels.goal[state.level]).all()
        reward = (
            jnp.where(is_there, _single(params.goal_reward), jnp.float32(0))
            - _single(params.step_cost) * effect.length
            - _single(params.removal_weight) * effect.removal
            - jnp.where(effect.is_wasted, _single(params.wasted_cost), jnp.float32(0))
        )
        stepped = state.replace(
            cell=effect.cell,
            gone=effect.gone,
            time=state.time + 1,
            length=state.length + effect.length,
            removal=state.removal + effect.removal,
            score=state.score + reward,
        )
        info = {
            "discount": jnp.where(is_there, jnp.float32(0), jnp.float32(1)),
            "success": is_there,
            "length": stepped.length,
            "removal": stepped.removal,
            "regret": oracle_score(params)[state.level] - stepped.score,
        }
        return stepped, reward, is_there, info

    def _fresh(self, key: Array, params: EnvParams) -> EnvState:
        require_key(key)
        N = params.levels.start.shape[0]
        # even but for N parts in 2**32
        drawn = jax.random.bits(key, (), jnp.uint32) % jnp.uint32(N)
        return _begun(drawn.astype(jnp.int32), params)


def _check(state: EnvState, action: Array) -> None:
    if not jnp.issubdtype(jnp.result_type(action), jnp.integer):
        raise TypeError(
            f"action must be a whole number 0..{NUM_ACTIONS - 1}, got {jnp.result_type(action)}"
        )
    if jnp.ndim(action) or jnp.ndim(state.cell) != 1:
        raise ValueError(
            "step takes one state and one action, got state.cell of shape"
            f" {list(jnp.shape(state.cell))} and action of shape {list(jnp.shape(action))}: for"
            " many write jax.vmap(env.step, in_axes=(0, 0, 0, None))"
        )


def oracle_score(params: EnvParams) -> Array:
    """Returns the sum of rewards the oracle gets on each level: float32 [N]; NaN where it was not
    run.
    """
    levels = params.levels
    reward, step_cost, weight = (
        _single(x) for x in (params.goal_reward, params.step_cost, params.removal_weight)
    )
    return reward - step_cost * levels.length - weight * levels.removal


def _single(value: Array | float) -> Array:
    """Returns a parameter as float32, whatever `jax_enable_x64` has made of the caller's number."""
    return jnp.asarray(value, jnp.float32)


def _begun(level: Array, params: EnvParams) -> EnvState:
    nothing = jnp.float32(0)
    gone = no_words(params.levels.price.shape[1])
    start = params.levels.start[level]
    return EnvState(
        level=level,
        cell=start,
        gone=gone,
        time=jnp.int32(0),
        length=nothing,
        removal=nothing,
        score=nothing,
    )


@functools.cache
def _default_params() -> EnvParams:
    with jax.ensure_compile_time_eval():  # may be called first inside a jit
        return EnvParams(
            levels=make_levels(
                [task for _, task, _ in generate("rooms", count=80, size=16, seed=0)]
            )
        )
