"""SmartRelocation-v0 with the face of Gymnasium; importing this registers it there.

gymnasium.make("srt_jax.envs.gym:SmartRelocation-v0")
"""

from typing import Any

import jax
import numpy as np

from srt_jax.envs.relocation import EnvParams, SmartRelocation
from srt_jax.envs.rules import NUM_ACTIONS

try:
    import gymnasium
except ImportError as error:
    raise ImportError("Gymnasium is not installed: pip install 'srt-jax[envs]'") from error


class GymnasiumEnv(gymnasium.Env):
    """One environment, stepped from Python; episodes end and are reset by the caller, as Gymnasium
    wants it.

    Args:
      env, params: by default a SmartRelocation of the default options on the default levels.
      render_mode: None or "rgb_array".
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 8}  # noqa: RUF012  Gymnasium's own form

    def __init__(
        self,
        env: SmartRelocation | None = None,
        params: EnvParams | None = None,
        *,
        render_mode: str | None = None,
    ):
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f"render_mode must be None or 'rgb_array', got {render_mode!r}")
        self.env = env or SmartRelocation()
        self.params = params or self.env.default_params
        self.render_mode = render_mode
        self.action_space = gymnasium.spaces.Discrete(NUM_ACTIONS)
        shape = self.env.observation_space(self.params).shape
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, shape, np.float32)
        self._step, self._key = jax.jit(self.env.step_env), jax.random.key(0)
        self._reset, self._reset_to = jax.jit(self.env.reset_env), jax.jit(self.env.reset_to)
        self.state: Any = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Returns observation and info of a new episode; options {"level": number} asks for one
        level of the pool.
        """
        super().reset(seed=seed)
        if seed is not None:
            self._key = jax.random.key(seed)
        self._key, used = jax.random.split(self._key)
        if options and "level" in options:
            seen, self.state = self._reset_to(np.int32(options["level"]), self.params)
        else:
            seen, self.state = self._reset(used, self.params)
        return np.asarray(seen), {"level": int(self.state.level)}

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Returns observation, reward, terminated, truncated and info, as
        `SmartRelocation.step_env` tells them.
        """
        if self.state is None:
            raise ValueError("step was called before reset: call reset first")
        if not self.action_space.contains(action):
            raise ValueError(f"action must be a whole number 0..{NUM_ACTIONS - 1}, got {action!r}")
        seen, self.state, reward, terminated, info = self._step(
            self._key, self.state, np.int32(action), self.params
        )
        truncated = bool(self.env.is_truncated(self.state, self.params))
        details = {name: value.item() for name, value in info.items()} | {
            "level": int(self.state.level)
        }
        return np.asarray(seen), float(reward), bool(terminated), truncated, details

    def render(self) -> Any:
        """Returns a picture, uint8 [rows, cols, 3]; None where no render_mode was given."""
        return self.env.render(self.state, self.params) if self.render_mode else None


if "SmartRelocation-v0" not in gymnasium.registry:
    gymnasium.register("SmartRelocation-v0", entry_point=f"{__name__}:GymnasiumEnv")
