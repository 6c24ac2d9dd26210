"""Learning environments: smart relocation as SmartRelocation-v0, in gymnax's form, with the exact
oracle beside every level.

`make()` gives the environment and its parameters; levels come from tasks (`make_levels`) or are
sampled inside jit (`sample_levels`). `as_gymnasium`, `as_gymnasium_vector` and `as_jumanji` are
adapters for those libraries, where they are installed.
"""

from typing import Any

from srt_jax.envs.evaluate import Evaluation, evaluate
from srt_jax.envs.expert import oracle_actions
from srt_jax.envs.levels import Levels, make_levels, to_tasks, with_oracle
from srt_jax.envs.observe import action_mask
from srt_jax.envs.relocation import EnvParams, SmartRelocation
from srt_jax.envs.render import render
from srt_jax.envs.rules import NUM_ACTIONS, EnvState
from srt_jax.envs.sample import sample_levels

ID = "SmartRelocation-v0"
"""The name and version of the environment, for `make`."""

__all__ = [
    "ID",
    "NUM_ACTIONS",
    "EnvParams",
    "EnvState",
    "Evaluation",
    "Levels",
    "SmartRelocation",
    "action_mask",
    "as_gymnasium",
    "as_gymnasium_vector",
    "as_jumanji",
    "evaluate",
    "make",
    "make_levels",
    "oracle_actions",
    "render",
    "sample_levels",
    "to_tasks",
    "with_oracle",
]


def make(
    name: str = ID, *, levels: Levels | None = None, **options: Any
) -> tuple[SmartRelocation, EnvParams]:
    """Returns the environment and its parameters, as `gymnax.make` does.

    Args:
      name: "SmartRelocation-v0".
      levels: from `make_levels` or `sample_levels`; by default 64 levels of rooms, 16 x 16, with
        their oracle.
      options: of `SmartRelocation`: observation, radius.

    Raises:
      ValueError: another name.
      TypeError: levels are no `Levels`.

    Examples:
      >>> import jax
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax import envs
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> levels = envs.make_levels([srt_jax.make_task(free, (2, 0), (2, 6))])
      >>> env, params = envs.make(levels=levels)
      >>> env.num_actions, params.max_steps_in_episode
      (16, 200)
    """
    if levels is not None and not isinstance(levels, Levels):
        raise TypeError(
            f"levels must be Levels, got {type(levels).__name__}: write envs.make_levels(tasks)"
        )
    if name != ID:
        raise ValueError(f"no environment is called {name!r}: the one there is is {ID!r}")
    env = SmartRelocation(**options)
    return env, env.default_params if levels is None else EnvParams(levels=levels)


def as_gymnasium(
    env: SmartRelocation | None = None, params: EnvParams | None = None, **options: Any
) -> Any:
    """Returns a `gymnasium.Env`; ImportError with the install command where Gymnasium is missing.
    Options: render_mode; without env and params observation, radius and levels (`envs.gym`). It can
    be pickled, hence AsyncVectorEnv([...], context="spawn") works; a process forked after JAX has
    started refuses to step.

    Examples:
      >>> import jax
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax import envs
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> levels = envs.make_levels([srt_jax.make_task(free, (2, 0), (2, 6))])
      >>> env, params = envs.make(levels=levels)
      >>> gym_env = envs.as_gymnasium(env, params)  # doctest: +SKIP
      >>> observation, info = gym_env.reset(seed=0)  # doctest: +SKIP
    """
    from srt_jax.envs.gym import GymnasiumEnv

    return GymnasiumEnv(env, params, **options)


def as_gymnasium_vector(
    env: SmartRelocation | None = None,
    params: EnvParams | None = None,
    *,
    num_envs: int,
    **options: Any,
) -> Any:
    """Returns a `gymnasium.vector.VectorEnv` of many environments, stepped in one jitted call;
    ImportError with the install command where Gymnasium is missing. See `envs.gym_vector`.

    Args:
      env, params: from `make`.
      num_envs: how many; thousands cost little more than one.
      options: render_mode; autoreset_mode, "NextStep", "SameStep" or "Disabled" as Gymnasium
        defines them; max_episode_steps; without env and params observation, radius and levels.

    Examples:
      >>> import jax
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax import envs
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> levels = envs.make_levels([srt_jax.make_task(free, (2, 0), (2, 6))])
      >>> env, params = envs.make(levels=levels)
      >>> many = envs.as_gymnasium_vector(env, params, num_envs=8)  # doctest: +SKIP
      >>> observations, infos = many.reset(seed=0)  # doctest: +SKIP
    """
    from srt_jax.envs.gym_vector import GymnasiumVectorEnv

    return GymnasiumVectorEnv(env, params, num_envs=num_envs, **options)


def as_jumanji(env: SmartRelocation | None = None, params: EnvParams | None = None) -> Any:
    """Returns a `jumanji.Environment`; ImportError with the install command where jumanji is
    missing. See `envs.jumanji`.

    Examples:
      >>> import jax
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax import envs
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> levels = envs.make_levels([srt_jax.make_task(free, (2, 0), (2, 6))])
      >>> env, params = envs.make(levels=levels)
      >>> jumanji_env = envs.as_jumanji(env, params)  # doctest: +SKIP
      >>> state, timestep = jumanji_env.reset(jax.random.key(0))  # doctest: +SKIP
    """
    from srt_jax.envs.jumanji import JumanjiEnv

    return JumanjiEnv(env, params)
