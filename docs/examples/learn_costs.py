"""Learns what it costs to cross each kind of ground from paths that were shown, through the
gradient of least costs.

A map is a picture: every kind of ground has a colour, and the camera is noisy. A walker who knows
what each kind costs shows the cheapest paths. The learner sees pictures and paths only. It guesses
a cost for every cell from the colours round it, and is told how much dearer the path shown is, at
these costs, than the path it would have taken itself:

    loss = log(cost of the path shown) - log(least cost),

which is 0 where the path shown is the cheapest, and does not change when all costs grow alike.
`srt_jax.path_cost` gives the least cost and its exact gradient; `srt_jax.perturbed` makes it the
mean over uncertain costs, so that paths shown must win by a margin.

    python docs/examples/learn_costs.py --out learned_costs

takes less than a minute on a CPU. It prints how much dearer the learner's paths are, at the true
costs, on maps never seen, and writes parameters.npz and (with matplotlib) learned_costs.png.
"""

import argparse
import pathlib
import sys
import time
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

import srt_jax

COLOURS = np.array(
    [[0.4, 0.8, 0.3], [0.8, 0.7, 0.4], [0.1, 0.4, 0.1], [0.3, 0.4, 0.9]], np.float32
)  # meadow, sand, wood, water
TRUE_COSTS = np.array([1.0, 2.0, 4.0, 8.0], np.float32)
NOISE = 0.1  # of the camera, standard deviation per colour
HIDDEN = 16


def make_maps(rng: np.random.Generator, count: int, side: int) -> dict[str, np.ndarray]:
    """Returns pictures [B, H, W, 3], true costs [B, H, W], rocks, starts and goals, and the paths
    shown, as masks of moves.
    """
    kinds = np.stack([_patches(rng, side) for _ in range(count)])
    free = rng.random(kinds.shape) > 0.08
    starts = np.stack(
        [rng.integers(0, side, count), rng.integers(0, side // 8, count)], axis=1
    ).astype(np.int32)
    goals = np.stack(
        [rng.integers(0, side, count), rng.integers(side - side // 8, side, count)], axis=1
    ).astype(np.int32)
    every = np.arange(count)
    free[every, starts[:, 0], starts[:, 1]] = free[every, goals[:, 0], goals[:, 1]] = True
    picture = (COLOURS[kinds] + rng.normal(0, NOISE, (*kinds.shape, 3))).astype(np.float32)
    costs = TRUE_COSTS[kinds]
    maps = {"picture": picture, "costs": costs, "free": free, "start": starts, "goal": goals}
    least = srt_jax.path_cost(free, starts, goals, costs)
    some = np.flatnonzero(np.isfinite(least))
    maps = {name: array[some] for name, array in maps.items()} | {"least": np.asarray(least)[some]}
    return maps | {"shown": np.asarray(paths(maps, maps["costs"]))}


def _patches(rng: np.random.Generator, side: int) -> np.ndarray:
    """Kinds of ground, int [side, side]: each cell is of the kind of the nearest of some random
    points.
    """
    points, kinds = rng.integers(0, side, (side, 2)), rng.integers(0, len(COLOURS), side)
    rows, cols = np.mgrid[:side, :side]
    return kinds[
        ((rows[..., None] - points[:, 0]) ** 2 + (cols[..., None] - points[:, 1]) ** 2).argmin(
            axis=-1
        )
    ]


@jax.jit
def paths(maps: dict[str, np.ndarray], costs: jax.Array) -> jax.Array:
    """Returns the cheapest path of each map at `costs`: for each cell the length walked in it,
    float32 [B, H, W].

    That is the gradient of the least cost; the costs of any path p add up to the sum of p times the
    costs.
    """

    def total(costs: jax.Array) -> jax.Array:
        return srt_jax.path_cost(maps["free"], maps["start"], maps["goal"], costs).sum()

    return jax.grad(total)(costs)


def new_parameters(key: jax.Array) -> dict[str, jax.Array]:
    """Two layers, each over the 3 x 3 cells round a cell."""
    first, second = jax.random.split(key)
    return {
        "first": 0.2 * jax.random.normal(first, (3, 3, 3, HIDDEN)),
        "first_bias": jnp.zeros(HIDDEN),
        "second": 0.1 * jax.random.normal(second, (3, 3, HIDDEN, 1)),
        "second_bias": jnp.zeros(1),
    }


def predicted_costs(parameters: dict[str, jax.Array], picture: jax.Array) -> jax.Array:
    """Returns a positive cost for every cell: float32 [B, H, W]."""

    def layer(values: jax.Array, name: str) -> jax.Array:
        kernel, bias = parameters[name], parameters[name + "_bias"]
        out = jax.lax.conv_general_dilated(
            values, kernel, (1, 1), "SAME", dimension_numbers=("NHWC", "HWIO", "NHWC")
        )
        return out + bias.reshape(1, 1, 1, -1)

    return jnp.exp(layer(jax.nn.relu(layer(picture, "first")), "second")[..., 0].clip(-4, 4))


def loss(parameters: dict[str, jax.Array], maps: dict[str, jax.Array], key: jax.Array) -> jax.Array:
    """Returns how much dearer the paths shown are than the least perturbed cost: the mean logarithm
    of the ratio.
    """
    costs = predicted_costs(parameters, maps["picture"])

    def least(costs: jax.Array) -> jax.Array:
        return srt_jax.path_cost(maps["free"], maps["start"], maps["goal"], costs)

    smooth = srt_jax.perturbed(least, num_samples=4, temperature=0.3, pathwise=True)(key, costs)
    return (jnp.log((maps["shown"] * costs).sum(axis=(1, 2))) - jnp.log(smooth)).mean()


def adam_step(state: tuple, gradient: dict[str, jax.Array], *, rate: jax.Array) -> tuple:
    """Returns (parameters, first moments, second moments, steps) after one step (Kingma & Ba
    2015).
    """
    parameters, mean, square, count = state
    count = count + 1
    mean = jax.tree.map(lambda m, g: 0.9 * m + 0.1 * g, mean, gradient)
    square = jax.tree.map(lambda s, g: 0.999 * s + 0.001 * g * g, square, gradient)

    def moved(p: jax.Array, m: jax.Array, s: jax.Array) -> jax.Array:
        return p - rate * (m / (1 - 0.9**count)) / (jnp.sqrt(s / (1 - 0.999**count)) + 1e-8)

    return jax.tree.map(moved, parameters, mean, square), mean, square, count


def regret(parameters: dict[str, jax.Array], maps: dict[str, np.ndarray]) -> float:
    """Returns by how much the learner's paths are dearer than the best, at the true costs: the mean
    ratio less 1.
    """
    taken = paths(maps, predicted_costs(parameters, maps["picture"]))
    return float(((taken * maps["costs"]).sum(axis=(1, 2)) / maps["least"]).mean() - 1)


def train(
    train_maps: dict,
    test_maps: dict,
    *,
    steps: int,
    batch: int,
    report: Callable[[str], None] = print,
) -> tuple[dict, list]:
    """Returns the parameters learned, and the regrets on unseen maps: before, and after every tenth
    of the steps.
    """
    state = (new_parameters(jax.random.key(0)), None, None, jnp.float32(0))
    state = (state[0], *(jax.tree.map(jnp.zeros_like, state[0]) for _ in range(2)), state[3])
    rng, regrets = np.random.default_rng(1), []
    begin = time.perf_counter()

    @jax.jit
    def step(state: tuple, maps: dict, key: jax.Array, rate: jax.Array) -> tuple:
        value, gradient = jax.value_and_grad(loss)(state[0], maps, key)
        return adam_step(state, gradient, rate=rate), value

    for number in range(steps + 1):
        if number % max(1, steps // 10) == 0 or number == steps:
            regrets.append(regret(state[0], test_maps))
            seconds = time.perf_counter() - begin
            report(
                f"step {number:4}  {seconds:6.1f} s  regret on {len(test_maps['least'])} unseen"
                f" maps {regrets[-1]:7.2%}"
            )
        some = rng.permutation(len(train_maps["least"]))[:batch]
        maps = {name: array[some] for name, array in train_maps.items()}
        if number < steps:
            state, _ = step(
                state, maps, jax.random.key(number), np.float32(0.01 * (1 - number / steps))
            )
    return state[0], regrets


def draw(parameters: dict, maps: dict, path: pathlib.Path) -> None:
    """Writes a picture of one unseen map: the camera's, the true costs with the best path, the
    learned with the learner's.
    """
    from matplotlib.figure import Figure

    learned = np.asarray(predicted_costs(parameters, maps["picture"]))
    taken = np.asarray(paths(maps, learned))
    figure = Figure(figsize=(12, 4.2), layout="constrained")
    axes = figure.subplots(1, 3)
    axes[0].imshow(maps["picture"][0].clip(0, 1))
    axes[0].set_title("what the camera saw")
    for axis, costs, path_of, title in (
        (axes[1], maps["costs"][0], maps["shown"][0], "true costs, the walker's path"),
        (
            axes[2],
            learned[0] * (maps["costs"][0].mean() / learned[0].mean()),
            taken[0],
            "learned costs, the learner's path",
        ),
    ):
        axis.imshow(
            np.where(maps["free"][0], costs, np.nan), cmap="viridis", norm="log", vmin=0.5, vmax=10
        )
        axis.scatter(*np.argwhere(path_of > 0).T[::-1], s=9, c="red")
        axis.set_title(title)
    for axis in axes:
        axis.set_axis_off()
    figure.savefig(path, dpi=100)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("learned_costs"))
    parser.add_argument("--maps", type=int, default=256, help="maps with paths shown (default 256)")
    parser.add_argument("--side", type=int, default=32, help="side of a map in cells (default 32)")
    parser.add_argument("--steps", type=int, default=400, help="training steps (default 400)")
    options = parser.parse_args(argv)
    rng = np.random.default_rng(0)
    train_maps, test_maps = (make_maps(rng, count, options.side) for count in (options.maps, 64))
    parameters, regrets = train(train_maps, test_maps, steps=options.steps, batch=16)
    print(
        f"regret on unseen maps: {regrets[0]:.2%} before, {regrets[-1]:.2%} after {options.steps}"
        " steps"
    )
    options.out.mkdir(parents=True, exist_ok=True)
    np.savez(
        options.out / "parameters.npz",
        **{name: np.asarray(value) for name, value in parameters.items()},
    )
    try:
        draw(parameters, test_maps, options.out / "learned_costs.png")
    except ImportError:
        print("matplotlib is not installed: no picture (pip install matplotlib)")
    print(f"wrote {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
