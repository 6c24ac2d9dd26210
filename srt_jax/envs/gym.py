"""SmartRelocation-v0 with the face of Gymnasium; importing this registers it there.

gymnasium.make("srt_jax.envs.gym:SmartRelocation-v0") gives one environment, and
gymnasium.make_vec("srt_jax.envs.gym:SmartRelocation-v0", num_envs=1024) as many in one call
(`srt_jax.envs.gym_vector`). Both take observation="window" or "map", radius=4, levels=...,
render_mode=None or "rgb_array", and instead of the first three env and params of `envs.make`.
"""

import dataclasses
import functools
from typing import Any

import jax
import numpy as np

from sign_model.foundation.extras import install_command
from srt_jax.engine.forks import refuse_fork
from srt_jax.envs.relocation import EnvParams, SmartRelocation
from srt_jax.envs.rules import NUM_ACTIONS, EnvState
from srt_jax.types import Array

try:
    import gymnasium
    from gymnasium.envs.registration import EnvSpec
except ImportError as error:
    raise ImportError(
        f"Gymnasium is not installed: {install_command('envs', 'gymnasium')}"
    ) from error

NAME = "SmartRelocation-v0"


class Specified:
    """What has a spec whose `max_episode_steps` is that of the parameters."""

    params: EnvParams
    _spec: EnvSpec | None = None

    @property
    def spec(self) -> EnvSpec | None:  # pyright: ignore
        """What Gymnasium makes it from."""
        return self._spec

    @spec.setter
    def spec(self, value: EnvSpec | None) -> None:
        # gymnasium.make sets a spec without steps: it counts them only for a wrapper of its own.
        if value is not None and value.max_episode_steps is None:
            most = int(self.params.max_steps_in_episode)
            value = dataclasses.replace(value, max_episode_steps=most)
        self._spec = value


class GymnasiumEnv(Specified, gymnasium.Env):
    """One environment, stepped from Python; episodes end and are reset by the caller, as Gymnasium
    wants it. It can be pickled and copied, in the middle of an episode too.

    Args:
      env, params: from `envs.make`; by default a SmartRelocation of the default options on the
        default levels.
      render_mode: None or "rgb_array".
      options: instead of `env` those of `SmartRelocation` (observation, radius), and instead of
        `params` levels.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 8}  # noqa: RUF012  Gymnasium's own form

    def __init__(
        self,
        env: SmartRelocation | None = None,
        params: EnvParams | None = None,
        *,
        render_mode: str | None = None,
        **options: Any,
    ):
        check_render_mode(render_mode)
        self.env, self.params = made(env, params, options)
        self.render_mode = render_mode
        self.action_space = gymnasium.spaces.Discrete(NUM_ACTIONS)
        self.observation_space = observation_box(self.env, self.params)
        self.spec = spec_of(self.env, self.params)
        self.state: Any = None
        self._key: Any = None  # uint32 [2], the words of a key: unlike a key they can be pickled

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Returns observation and info of a new episode; options {"level": number} asks for one
        level of the pool. Without a seed the first reset takes one at random.
        """
        refuse_fork()
        super().reset(seed=seed)
        if seed is not None or self._key is None:
            self._key = _key_of(word_of(self.np_random, seed))
        level = np.int32(-1 if options is None or "level" not in options else options["level"])
        if level != -1:
            check_levels(level, self.params)
        self._key, seen, self.state = _reset(self.env, self._key, level, self.params)
        return np.array(seen), {"level": int(self.state.level)}

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Returns observation, reward, terminated, truncated and info, as
        `SmartRelocation.step_env` tells them.
        """
        if self.state is None:
            raise ValueError("step was called before reset: call reset first")
        if not self.action_space.contains(action):
            raise ValueError(f"action must be a whole number 0..{NUM_ACTIONS - 1}, got {action!r}")
        refuse_fork()
        self.state, seen, told = _step(self.env, self.state, np.int32(action), self.params)
        seen, (reward, terminated, truncated, info) = jax.device_get((seen, told))
        details = {name: value.item() for name, value in info.items()}
        return np.array(seen), float(reward), bool(terminated), bool(truncated), details

    def render(self) -> Any:
        """Returns a picture, uint8 [rows, cols, 3]; None where no render_mode was given."""
        return self.env.render(self.state, self.params) if self.render_mode else None


@jax.jit
def _key_of(word: Array) -> Array:
    return jax.random.key_data(jax.random.key(word))


# One program serves all environments of the same options.
@functools.partial(jax.jit, static_argnums=0)
def _reset(env: SmartRelocation, key: Array, level: Array, params: EnvParams) -> tuple:
    key, state = begun(env, key, level, params)
    return key, env.get_obs(state, params), state


def begun(
    env: SmartRelocation, key: Array, level: Array, params: EnvParams
) -> tuple[Array, EnvState]:
    """Returns the words of the next key and the state of a new episode: on that level, or where it
    is -1 on one drawn by the key. To be traced.
    """
    following, used = jax.random.split(jax.random.wrap_key_data(key))
    drawn = env.reset_env(used, params)[1].level
    state = env.reset_to(jax.numpy.where(level < 0, drawn, level), params)[1]
    return jax.random.key_data(following), state


@functools.partial(jax.jit, static_argnums=0)
def _step(env: SmartRelocation, state: EnvState, action: Array, params: EnvParams) -> tuple:
    state, *told = moved(env, state, action, params)
    return state, env.get_obs(state, params), told


def moved(env: SmartRelocation, state: EnvState, action: Array, params: EnvParams) -> tuple:
    """Returns state, reward, terminated, truncated and info of a step, without its observation. To
    be traced.
    """
    _, state, reward, terminated, info = env.step_env(jax.random.key(0), state, action, params)
    return state, reward, terminated, env.is_truncated(state, params), info | {"level": state.level}


def word_of(rng: np.random.Generator, seed: int | None) -> np.uint32:
    """Returns the seed as the word a key is made of, or without one a random word."""
    return np.uint32((int(rng.integers(2**32)) if seed is None else seed) % 2**32)


def made(
    env: SmartRelocation | None, params: EnvParams | None, options: dict[str, Any]
) -> tuple[SmartRelocation, EnvParams]:
    """Returns environment and parameters, those given or made of the options.

    Raises:
      TypeError: an option that there is not, or one beside what it would make.
    """
    known = {"observation": env, "radius": env, "levels": params}
    for name in options:
        if name not in known:
            raise TypeError(
                f"SmartRelocation-v0 has no option {name!r}: it takes env, params, render_mode,"
                f" {', '.join(known)}; or write envs.as_gymnasium(*envs.make(...))"
            )
        if known[name] is not None:
            raise TypeError(
                f"{name} was given beside env or params, which have their own: give one of them"
            )
    of_env = {name: value for name, value in options.items() if name != "levels"}
    env = env or SmartRelocation(**of_env)
    if params is None:
        levels = options.get("levels")
        params = env.default_params if levels is None else EnvParams(levels=levels)
    return env, params


def check_render_mode(render_mode: str | None) -> None:
    """Raises ValueError where there is no such mode."""
    if render_mode not in (None, "rgb_array"):
        raise ValueError(f"render_mode must be None or 'rgb_array', got {render_mode!r}")


def check_levels(levels: Any, params: EnvParams) -> None:
    """Raises ValueError where a number is of no level of the pool."""
    number = params.levels.start.shape[0]
    if np.any((np.asarray(levels) < 0) | (np.asarray(levels) >= number)):
        raise ValueError(f"level must be 0..{number - 1}, a level of the pool, got {levels}")


def observation_box(env: SmartRelocation, params: EnvParams) -> Any:
    """Returns Gymnasium's space of one observation."""
    low, high = env.observation_bounds(params)
    return gymnasium.spaces.Box(low, high, dtype=np.float32)


def spec_of(env: SmartRelocation, params: EnvParams, **options: Any) -> EnvSpec:
    """Returns a spec that makes the environment again."""
    kwargs = {"env": env, "params": params, **options}
    return dataclasses.replace(gymnasium.spec(NAME), kwargs=kwargs)


if NAME not in gymnasium.registry:
    gymnasium.register(
        NAME,
        entry_point=f"{__name__}:GymnasiumEnv",
        vector_entry_point="srt_jax.envs.gym_vector:GymnasiumVectorEnv",
    )
