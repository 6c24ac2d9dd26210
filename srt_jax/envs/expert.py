"""The oracle's answers as actions, to imitate and to prove that the actions suffice."""

import numpy as np

from srt_jax.engine.entrance import require_solution, require_values
from srt_jax.moves import MOVES
from srt_jax.types import Solution


def oracle_actions(solution: Solution) -> np.ndarray:
    """Returns the actions that carry out each solution of a batch: int32 [B, T], -1 after the last
    (host). Of a single solution int32 [T].

    Without a route there are none.

    Before the move from cell i to cell i + 1 comes one destroying where the solution destroys from
    cell i.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax import envs
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> batch = srt_jax.stack([srt_jax.make_task(free, (2, 0), (2, 6))])
      >>> envs.oracle_actions(srt_jax.solve(batch)).tolist()  # 4 moves east, 12 destroys
      [[4, 4, 12, 4, 4, 4, 4]]
    """
    require_solution("oracle_actions", solution)
    require_values("oracle_actions", solution)
    rank = np.ndim(solution.status)
    if rank > 1:
        raise ValueError(
            f"oracle_actions takes one solution or a batch with one batch dimension, got {rank}"
        )
    if not rank:
        fields = {name: getattr(solution, name) for name in ("cells", "num_cells", "destroyed_at")}
        whole = solution.replace(**{name: np.asarray(a)[None] for name, a in fields.items()})
        return _actions_of(whole)[0]
    return _actions_of(solution)


def _actions_of(solution: Solution) -> np.ndarray:
    """`oracle_actions` of a batch."""
    number = {move: index for index, move in enumerate(MOVES)}
    rows = []
    for cells, count, at in zip(
        np.asarray(solution.cells),
        np.asarray(solution.num_cells),
        np.asarray(solution.destroyed_at),
    ):
        row: list[int] = []
        moves = np.diff(cells[: min(int(count), len(cells))], axis=0) if count <= len(cells) else []
        for index, move in enumerate(moves):
            action = number[int(move[0]), int(move[1])]
            row += [len(MOVES) + action, action] if index in at else [action]
        rows.append(row)
    actions = np.full((len(rows), max(1, *map(len, rows)) if rows else 1), -1, np.int32)
    for index, row in enumerate(rows):
        actions[index, : len(row)] = row
    return actions
