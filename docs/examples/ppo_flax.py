"""PPO for SmartRelocation-v0 in 150 lines on flax and optax: all of training is one jitted call.

    python docs/examples/ppo_flax.py                   # two minutes on two cores: 95 % success
    python docs/examples/ppo_flax.py --updates 20      # a first look

Needs `pip install flax optax`. Schulman et al. 2017, arXiv:1707.06347; advantages as in Schulman
et al. 2016, arXiv:1506.02438. `train_policy.py` imitates the oracle first and needs neither.
"""

import argparse
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from srt_jax import envs

try:
    import flax.linen as nn
    import optax
except ImportError as error:
    raise SystemExit(f"{error.name} is not installed: pip install flax optax") from error

NUM_ENVS, HORIZON, EPOCHS, BATCHES = 64, 64, 3, 8
GAMMA, LAMBDA, CLIP, ENTROPY, RATE = 0.99, 0.95, 0.2, 0.01, 5e-4
SCALE = 0.1  # rewards are about 10; the critic likes 1


class ActorCritic(nn.Module):
    """Two dense layers over the window around the agent, then the actions' logits and a value."""

    @nn.compact
    def __call__(self, seen: jax.Array) -> tuple[jax.Array, jax.Array]:
        x = seen.reshape(*seen.shape[:-3], -1)
        for _ in range(2):
            x = nn.tanh(nn.Dense(128)(x))
        small = nn.initializers.orthogonal(0.01)
        logits = nn.Dense(envs.NUM_ACTIONS, kernel_init=small)(x)
        return jax.nn.log_softmax(logits), nn.Dense(1)(x)[..., 0]


class Step(NamedTuple):
    """What is kept of each step, [HORIZON, NUM_ENVS, ...]."""

    seen: jax.Array
    action: jax.Array
    log: jax.Array
    value: jax.Array
    reward: jax.Array
    next_value: jax.Array
    is_over: jax.Array


def taken(logs: jax.Array, actions: jax.Array) -> jax.Array:
    """Returns the log-probability of the actions taken."""
    return jnp.take_along_axis(logs, actions[..., None], axis=-1)[..., 0]


def advantages(steps: Step) -> jax.Array:
    """Returns how much better each action was than expected (generalised advantage estimates)."""

    def back(later: jax.Array, now: Step) -> tuple[jax.Array, jax.Array]:
        gain = now.reward + GAMMA * now.next_value - now.value
        gain += GAMMA * LAMBDA * jnp.where(now.is_over, 0.0, later)
        return gain, gain

    return jax.lax.scan(back, jnp.zeros(steps.value.shape[1]), steps, reverse=True)[1]


def train(
    params: envs.EnvParams, env: envs.SmartRelocation, *, updates: int, seed: int = 0
) -> tuple[Any, jax.Array]:
    """Returns the weights, and the mean reward a step of each update: float32 [updates]."""
    network = ActorCritic()
    many = jax.vmap(env.step, in_axes=(0, 0, 0, None))
    num_steps = updates * EPOCHS * BATCHES
    optimizer = optax.chain(
        optax.clip_by_global_norm(0.5), optax.adam(optax.linear_schedule(RATE, 0.0, num_steps))
    )

    def play(weights: Any, carry: tuple, key: jax.Array) -> tuple[tuple, Step]:
        seen, states = carry
        key_act, key_step = jax.random.split(key)
        logs, value = network.apply(weights, seen)
        action = jax.random.categorical(key_act, logs).astype(jnp.int32)
        keys = jax.random.split(key_step, NUM_ENVS)
        after, states, reward, ended, truncated, info = many(keys, states, action, params)
        # Time that is up is no end: what would have come counts.
        next_value = network.apply(weights, info["final_observation"])[1] * ~ended
        kept = Step(
            seen, action, taken(logs, action), value, SCALE * reward, next_value, ended | truncated
        )
        return (after, states), kept

    def loss(weights: Any, batch: tuple[Step, jax.Array]) -> jax.Array:
        steps, gains = batch
        logs, value = network.apply(weights, steps.seen)
        ratio = jnp.exp(taken(logs, steps.action) - steps.log)
        scaled = (gains - gains.mean()) / (gains.std() + 1e-6)
        actor = jnp.minimum(ratio * scaled, jnp.clip(ratio, 1 - CLIP, 1 + CLIP) * scaled).mean()
        critic = ((value - steps.value - gains) ** 2).mean()
        entropy = -(jnp.exp(logs) * logs).sum(axis=-1).mean()
        return 0.5 * critic - actor - ENTROPY * entropy

    def update(carry: tuple, key: jax.Array) -> tuple[tuple, jax.Array]:
        weights, state, begun = carry
        key_play, key_mix = jax.random.split(key)
        begun, steps = jax.lax.scan(
            lambda c, k: play(weights, c, k), begun, jax.random.split(key_play, HORIZON)
        )
        data = jax.tree.map(lambda x: x.reshape(-1, *x.shape[2:]), (steps, advantages(steps)))

        def improve(carry: tuple, which: jax.Array) -> tuple[tuple, None]:
            weights, state = carry
            slopes = jax.grad(loss)(weights, jax.tree.map(lambda x: x[which], data))
            changes, state = optimizer.update(slopes, state, weights)
            return (optax.apply_updates(weights, changes), state), None

        keys = jax.random.split(key_mix, EPOCHS)
        order = jax.vmap(lambda k: jax.random.permutation(k, NUM_ENVS * HORIZON))(keys)
        order = order.reshape(EPOCHS * BATCHES, -1)
        (weights, state), _ = jax.lax.scan(improve, (weights, state), order)
        return (weights, state, begun), steps.reward.mean() / SCALE

    @jax.jit
    def whole(key: jax.Array) -> tuple[Any, jax.Array]:
        key_begin, key_net, key_train = jax.random.split(key, 3)
        keys = jax.random.split(key_begin, NUM_ENVS)
        begun = jax.vmap(env.reset, in_axes=(0, None))(keys, params)
        weights = network.init(key_net, begun[0])
        carry = (weights, optimizer.init(weights), begun)
        (weights, *_), rewards = jax.lax.scan(update, carry, jax.random.split(key_train, updates))
        return weights, rewards

    return whole(jax.random.key(seed))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--updates", type=int, default=150, help=f"of {NUM_ENVS * HORIZON} steps")
    options = parser.parse_args()
    env, params = envs.make(levels=envs.sample_levels(jax.random.key(0), count=1024, size=12))
    # At the full price nobody who explores at random learns that destroying may pay.
    params = params.replace(removal_weight=0.1, max_steps_in_episode=100)
    weights, rewards = train(params, env, updates=options.updates)
    print(f"reward a step: {rewards[0]:.3f} at first, {rewards[-1]:.3f} at last")
    unseen = envs.with_oracle(envs.sample_levels(jax.random.key(1), count=128, size=12))
    result = envs.evaluate(
        env,
        params.replace(levels=unseen),
        lambda key, seen: jax.random.categorical(key, ActorCritic().apply(weights, seen)[0]),
        jax.random.key(2),
    )
    print(result.summary())


if __name__ == "__main__":
    main()
