"""Trains a policy for SmartRelocation-v0 on a CPU in minutes: imitation of the oracle, then PPO;
reports regret.

    python docs/examples/train_policy.py --out policy.npz            # train, save, evaluate
    python docs/examples/train_policy.py --evaluate policy.npz       # load, evaluate

Plain JAX: the network is two dense layers over the window the agent sees, Adam a dozen lines.
Levels are drawn inside jit (`envs.sample_levels`), the oracle (`srt_jax.solve`) tells the best
return of each, so that regret is known.
"""

import argparse
import time
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from srt_jax import envs, solve

HIDDEN, GAMMA, LAMBDA, CLIP, ENTROPY = 256, 0.995, 0.95, 0.2, 0.003
NUM_ENVS, HORIZON, EPOCHS, BATCHES = 64, 64, 3, 8
SCALE = 0.1  # rewards are about 10; the critic likes 1


def begin_network(key: jax.Array, num_inputs: int) -> dict[str, jax.Array]:
    """Returns the parameters: two hidden layers, a head for 16 actions and one for the value."""
    sizes = {
        "one": (num_inputs, HIDDEN),
        "two": (HIDDEN, HIDDEN),
        "actor": (HIDDEN, envs.NUM_ACTIONS),
        "critic": (HIDDEN, 1),
    }
    weights = {}
    for (name, shape), one in zip(sizes.items(), jax.random.split(key, len(sizes)), strict=True):
        gain = 0.01 if name in ("actor", "critic") else 2**0.5
        weights |= {
            f"{name}_w": gain * jax.random.normal(one, shape) / shape[0] ** 0.5,
            f"{name}_b": jnp.zeros(shape[1]),
        }
    return weights


def network(weights: dict[str, jax.Array], seen: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Returns the log-probability of each action and the value of what is seen: [..., 16] and
    [...].
    """
    x = seen.reshape(*seen.shape[:-3], -1)
    for name in ("one", "two"):
        x = jnp.tanh(x @ weights[f"{name}_w"] + weights[f"{name}_b"])
    logits = x @ weights["actor_w"] + weights["actor_b"]
    return jax.nn.log_softmax(logits), (x @ weights["critic_w"] + weights["critic_b"])[..., 0]


def sampled_action(weights: dict[str, jax.Array], key: jax.Array, seen: jax.Array) -> jax.Array:
    """The policy: an action drawn by its probability."""
    return jax.random.categorical(key, network(weights, seen)[0]).astype(jnp.int32)


def adam(weights: Any, slopes: Any, state: Any, rate: float) -> tuple[Any, Any]:
    """Returns the weights after one step of Adam (Kingma & Ba 2015), and Adam's own state."""
    first, second, count = state
    count += 1
    norm = jnp.sqrt(sum(jnp.sum(slope**2) for slope in jax.tree.leaves(slopes)))
    slopes = jax.tree.map(lambda slope: slope * jnp.minimum(1.0, 1.0 / (norm + 1e-8)), slopes)
    first = jax.tree.map(lambda m, slope: 0.9 * m + 0.1 * slope, first, slopes)
    second = jax.tree.map(lambda v, slope: 0.999 * v + 0.001 * slope**2, second, slopes)

    def moved(w, m, v):
        return w - rate * (m / (1 - 0.9**count)) / (jnp.sqrt(v / (1 - 0.999**count)) + 1e-8)

    return jax.tree.map(moved, weights, first, second), (first, second, count)


def begin_adam(weights: Any) -> Any:
    """Returns Adam's state before the first step."""
    zeros = jax.tree.map(jnp.zeros_like, weights)
    return zeros, zeros, jnp.float32(0)


def shown(env: envs.SmartRelocation, params: envs.EnvParams) -> tuple[jax.Array, jax.Array]:
    """Returns what the oracle sees and does on every level, one after the other: observations and
    actions.
    """
    actions = envs.oracle_actions(solve(envs.to_tasks(params.levels), max_destroyed=32))

    @jax.jit
    def walk(level, actions):
        def step(state, action):
            _, after, *_ = env.step_env(jax.random.key(0), state, jnp.maximum(action, 0), params)
            return after, env.get_obs(state, params)

        return jax.lax.scan(step, env.reset_to(level, params)[1], actions)[1]

    seen = jax.vmap(walk)(jnp.arange(len(actions), dtype=jnp.int32), jnp.asarray(actions))
    is_real = actions.reshape(-1) >= 0
    return seen.reshape(-1, *seen.shape[2:])[is_real], jnp.asarray(actions.reshape(-1)[is_real])


def imitate(weights: Any, seen: jax.Array, actions: jax.Array, *, steps: int, seed: int) -> Any:
    """Returns the weights after `steps` batches of 256 shown actions."""

    @jax.jit
    def improve(carry, key):
        weights, state = carry
        which = jax.random.randint(key, (256,), 0, len(actions))

        def loss(weights):
            return -jnp.take_along_axis(
                network(weights, seen[which])[0], actions[which][:, None], axis=1
            ).mean()

        value, slopes = jax.value_and_grad(loss)(weights)
        return adam(weights, slopes, state, 1e-3), value

    (weights, _), _ = jax.lax.scan(
        improve, (weights, begin_adam(weights)), jax.random.split(jax.random.key(seed), steps)
    )
    return weights


def make_update(env: envs.SmartRelocation):
    """Returns the jitted step of PPO (Schulman et al. 2017): play HORIZON steps, then improve by
    EPOCHS x BATCHES batches.
    """

    def play(weights, params, states, key):
        def step(carry, key):
            states, seen = carry
            key_act, key_step = jax.random.split(key)
            logs, values = network(weights, seen)
            actions = jax.random.categorical(key_act, logs).astype(jnp.int32)
            chosen = jnp.take_along_axis(logs, actions[:, None], axis=1)[:, 0]
            keys = jax.random.split(key_step, len(actions))
            after, states, reward, ended, cut, info = jax.vmap(env.step, in_axes=(0, 0, 0, None))(
                keys, states, actions, params
            )
            # time that is up is no end: its value counts
            following = network(weights, info["final_observation"])[1]
            kept = (seen, actions, chosen, values, SCALE * reward, following * ~ended, ended | cut)
            return (states, after), kept

        seen = jax.vmap(env.get_obs, in_axes=(0, None))(states, params)
        (states, _), kept = jax.lax.scan(step, (states, seen), jax.random.split(key, HORIZON))
        return states, kept

    def advantages(kept):
        *_, values, rewards, following, is_over = kept

        def back(later, now):
            value, reward, next_value, over = now
            gain = (
                reward + GAMMA * next_value - value + GAMMA * LAMBDA * jnp.where(over, 0.0, later)
            )
            return gain, gain

        return jax.lax.scan(
            back, jnp.zeros(values.shape[1]), (values, rewards, following, is_over), reverse=True
        )[1]

    def loss(weights, batch):
        seen, actions, old, gains, targets = batch
        logs, values = network(weights, seen)
        ratio = jnp.exp(jnp.take_along_axis(logs, actions[:, None], axis=1)[:, 0] - old)
        gains = (gains - gains.mean()) / (gains.std() + 1e-6)
        actor = -jnp.minimum(ratio * gains, jnp.clip(ratio, 1 - CLIP, 1 + CLIP) * gains).mean()
        return (
            actor
            + 0.5 * ((values - targets) ** 2).mean()
            + ENTROPY * (jnp.exp(logs) * logs).sum(axis=-1).mean()
        )

    @jax.jit
    def update(weights, state, params, states, key, rate):
        key_play, key_mix = jax.random.split(key)
        states, kept = play(weights, params, states, key_play)
        gains = advantages(kept)
        seen, actions, chosen, values, *_ = kept
        data = jax.tree.map(
            lambda x: x.reshape(-1, *x.shape[2:]), (seen, actions, chosen, gains, gains + values)
        )

        def epoch(carry, key):
            mixed = jax.random.permutation(key, NUM_ENVS * HORIZON).reshape(BATCHES, -1)

            def batch(carry, which):
                slopes = jax.grad(loss)(carry[0], jax.tree.map(lambda x: x[which], data))
                return adam(carry[0], slopes, carry[1], rate), None

            return jax.lax.scan(batch, carry, mixed)[0], None

        (weights, state), _ = jax.lax.scan(
            epoch, (weights, state), jax.random.split(key_mix, EPOCHS)
        )
        return weights, state, states

    return update


def save(path: str, weights: dict[str, jax.Array]) -> None:
    """Writes the parameters as an .npz of plain arrays."""
    np.savez(path, **{name: np.asarray(value) for name, value in weights.items()})


def load(path: str) -> dict[str, jax.Array]:
    """Returns the parameters that `save` wrote."""
    with np.load(path) as data:
        return {name: jnp.asarray(data[name]) for name in data.files}


def held_out(kind: str, count: int) -> envs.Levels:
    """Returns levels no training sees, with their oracle."""
    return envs.with_oracle(envs.sample_levels(jax.random.key(2**31 - 1), count=count, kind=kind))


def message(
    name: str, env: envs.SmartRelocation, params: envs.EnvParams, policy: Any
) -> envs.Evaluation:
    """Evaluates a policy on every level and prints a line."""
    result = envs.evaluate(env, params, policy, jax.random.key(7))
    print(f"{name:12s}{result.summary()}", flush=True)
    return result


def train(
    *,
    kind: str,
    seed: int = 0,
    num_levels: int = 512,
    num_held_out: int = 256,
    imitation: int = 2000,
    updates: int = 300,
) -> tuple[dict[str, jax.Array], dict[str, envs.Evaluation]]:
    """Returns the trained parameters, and how random, imitating and trained policies do on held-out
    levels.
    """
    env, test = envs.make(levels=held_out(kind, num_held_out))
    levels = envs.with_oracle(envs.sample_levels(jax.random.key(seed), count=num_levels, kind=kind))
    params = envs.EnvParams(levels=levels)
    results = {
        "random": message("random", env, test, lambda key, seen: env.action_space().sample(key))
    }
    weights = begin_network(jax.random.key(seed), int(np.prod(env.observation_space(params).shape)))
    weights = imitate(weights, *shown(env, params), steps=imitation, seed=seed)
    results["imitation"] = message(
        "imitation", env, test, lambda key, seen: sampled_action(weights, key, seen)
    )
    update, state = make_update(env), begin_adam(weights)
    states = jax.vmap(env.reset, in_axes=(0, None))(
        jax.random.split(jax.random.key(seed + 1), NUM_ENVS), params
    )[1]
    trained = weights
    for index in range(updates):
        key = jax.random.fold_in(jax.random.key(seed + 2), index)
        if index % 10 == 0:  # a fresh pool now and then: nothing to learn by heart
            params = params.replace(levels=envs.sample_levels(key, count=num_levels, kind=kind))
            states = jax.vmap(env.reset, in_axes=(0, None))(
                jax.random.split(key, NUM_ENVS), params
            )[1]
        rate = 3e-4 * (1 - index / updates)
        trained, state, states = update(trained, state, params, states, key, rate)
    results["trained"] = message(
        "trained", env, test, lambda key, seen: sampled_action(trained, key, seen)
    )
    return trained, results


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", default="policy.npz", help="where the parameters go")
    parser.add_argument(
        "--evaluate", metavar="FILE", help="evaluate these parameters, train nothing"
    )
    parser.add_argument("--kind", default="rooms", choices=["rooms", "walls", "fences"])
    parser.add_argument(
        "--updates", type=int, default=300, help=f"of PPO, {NUM_ENVS * HORIZON} steps each"
    )
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(arguments)
    if options.evaluate:
        weights = load(options.evaluate)
        env, params = envs.make(levels=held_out(options.kind, 256))
        message("loaded", env, params, lambda key, seen: sampled_action(weights, key, seen))
        return
    begin = time.perf_counter()
    weights, _ = train(kind=options.kind, seed=options.seed, updates=options.updates)
    save(options.out, weights)
    print(f"{options.out} written after {time.perf_counter() - begin:.0f} s")


if __name__ == "__main__":
    main()
