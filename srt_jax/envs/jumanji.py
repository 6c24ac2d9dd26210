"""SmartRelocation-v0 with the face of jumanji."""

import functools
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from sign_model.foundation.extras import install_command
from srt_jax.envs.relocation import EnvParams, SmartRelocation
from srt_jax.envs.rules import NUM_ACTIONS, EnvState
from srt_jax.types import Array, Record, record

try:
    from jumanji import specs
    from jumanji.env import Environment
    from jumanji.types import StepType, TimeStep, restart
except ImportError as error:
    raise ImportError(
        f"jumanji is not installed: {install_command('jumanji', 'jumanji')}"
    ) from error


@record
class JumanjiState(Record):
    """The environment's state, with the key that jumanji's wrappers reset by."""

    inner: EnvState
    key: Array


class Observation(NamedTuple):
    """planes: float32 [rows, cols, planes] (`srt_jax.envs.observe`); action_mask: bool [16], which
    actions change something.
    """

    planes: Array
    action_mask: Array


class JumanjiEnv(Environment):
    """Reset and step in jumanji's form; a truncated episode ends with discount 1. `extras` holds
    `SmartRelocation`'s info.

    Args:
      env, params: by default a SmartRelocation of the default options on the default levels.
    """

    def __init__(self, env: SmartRelocation | None = None, params: EnvParams | None = None):
        self.env = env or SmartRelocation()
        self.params = params or self.env.default_params
        super().__init__()

    def reset(self, key: Array) -> tuple[Any, Any]:
        """Returns state and first time step of an episode on a level drawn by `key`."""
        key, used = jax.random.split(key)
        planes, inner = self.env.reset_env(used, self.params)
        nothing = {name: jnp.zeros((), jnp.float32) for name in ("length", "removal", "regret")}
        return JumanjiState(inner=inner, key=key), restart(
            self._observation(planes, inner), nothing | {"success": jnp.bool_(False)}
        )

    def step(self, state: Any, action: Array) -> tuple[Any, Any]:
        """Returns the next state and time step, LAST in the goal or where time is up."""
        planes, inner, reward, terminated, info = self.env.step_env(
            state.key, state.inner, action, self.params
        )
        is_over = terminated | self.env.is_truncated(inner, self.params)
        step = TimeStep(
            step_type=jnp.where(is_over, StepType.LAST, StepType.MID),
            reward=reward,
            discount=info.pop("discount"),
            observation=self._observation(planes, inner),
            extras=info,
        )
        return state.replace(inner=inner), step

    @functools.cached_property
    def observation_spec(self) -> Any:
        """The spec of `Observation`."""
        shape = self.env.observation_space(self.params).shape
        planes = specs.Array(shape, np.dtype(np.float32), "planes")
        mask = specs.BoundedArray((NUM_ACTIONS,), np.dtype(bool), False, True, "action_mask")
        return specs.Spec(Observation, "ObservationSpec", planes=planes, action_mask=mask)

    @functools.cached_property
    def action_spec(self) -> Any:
        """Whole numbers 0..15."""
        return specs.DiscreteArray(NUM_ACTIONS, name="action")

    def render(self, state: Any) -> np.ndarray:
        """Returns a picture, uint8 [rows, cols, 3]."""
        return self.env.render(state.inner, self.params)

    def _observation(self, planes: Array, inner: EnvState) -> Observation:
        return Observation(planes, self.env.action_mask(inner, self.params))
