"""The answers about a coalition, each array with its shape and dtype: A agents, M obstacles, K
obstacles that may be destroyed, N cells a route may have.
"""

from sign_model.foundation.meanings import WithMeaning
from srt_jax.types import Array, Record, record


class Help(WithMeaning):
    """What one agent needs to reach its goal.

    Examples:
      >>> from srt_jax.coalition import Help
      >>> Help(1).name, Help(1).meaning
      ('WITH_HELP', 'reaches its goal after others have destroyed something for it')
    """

    ALONE = 0, "reaches its goal without the others"
    WITH_HELP = 1, "reaches its goal after others have destroyed something for it"
    NEVER = 2, "cannot reach its goal, whatever the agents destroy"
    HELPER = 3, "has no goal, and may help the others"
    START_BLOCKED = 4, "stands outside the map or inside an obstacle, and does nothing"


@record
class CoalitionReach(Record):
    """What the agents of a coalition can reach, for one task or each task of a batch.

    Attributes:
      reached: bool [..., A, H, W], the cells that agent a can reach after the agents have destroyed
        all they can; all False where its start is blocked.
      alone: bool [..., A, H, W], the same if agent a is the only one.
      destroys: bool [..., A, M], whether agent a can ever destroy obstacle i: it is able to, and
        with the others' help it comes beside it.
      firm: bool [..., M], what nobody can ever destroy. The proof: with everything else gone, no
        agent able to destroy a firm obstacle comes beside it.
      help: int32 [..., A], a `Help`.

    Examples:
      >>> import numpy as np
      >>> from srt_jax.coalition import Help, coalition_reach, make_coalition
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge, which only the second agent can destroy
      >>> task = make_coalition(free, [(2, 0), (2, 6)], [(0, 6), None], able=[(), (0,)])
      >>> reach = coalition_reach(task)
      >>> reach.destroys.tolist(), reach.firm.tolist()
      ([[False], [True]], [False])
      >>> reach.reached.sum((1, 2)).tolist(), Help(int(reach.help[0])).name
      ([35, 35], 'WITH_HELP')
    """

    reached: Array
    alone: Array
    destroys: Array
    firm: Array
    help: Array


@record
class CoalitionSolution(Record):
    """The answer to a coalition's task, or to each task of a batch.

    Attributes:
      status: int32 [...], a `Status` of the whole task: SOLVED and PATH_EXISTS mean that every
        agent with a goal reaches it.
      help: int32 [..., A], a `Help`.
      removal_cost: float32 [...], total removal cost of `destroyed`, the exact sum rounded down;
        inf without an answer.
      removal_bound: float32 [...], proven lower bound on the total removal cost of any answer; inf
        where none exists. Equal to `removal_cost`: no set is cheaper by a step of float32.
      destroyed: int32 [..., K], ids in the order of the plan, -1 after the last.
      num_destroyed: int32 [...]; more than K (status BUDGET_SPENT): the answer needs so many.
      destroyed_by: int32 [..., K], the agent that destroys each, -1 padded.
      destroyed_at: int32 [..., K], index into that agent's `cells` of the cell from which it does,
        an 8-neighbour of the obstacle; -1 padded.
      after: bool [..., K, K], whether destroying k has to wait for j: the agent passes j on its way
        there, or destroys j itself before. The plan's partial order is the closure of this.
      cells: int32 [..., A, N, 2], each agent's route, start first, -1 after its end. An agent waits
        on it where an obstacle in its way is not gone yet.
      num_cells: int32 [..., A]; more than N (status BUDGET_SPENT): the route did not fit.
      needed: int32 [..., A, K], the index into the agent's `cells` from which the k-th obstacle has
        to be gone, -1 where its route meets none of its cells.
      cost: float32 [..., A], length of each route in cell sides.
      finish: float32 [..., A], when each agent has done its part, in the time it takes to walk a
        cell side, waiting included; destroying takes no time.
      firm: bool [..., M], what nobody can ever destroy: the proof where status is UNSOLVABLE or
        GOAL_BLOCKED (`CoalitionReach`).

    Examples:
      >>> import numpy as np
      >>> from srt_jax.coalition import make_coalition, solve_coalition
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge, which only the second agent can destroy
      >>> task = make_coalition(free, [(2, 0), (2, 6)], [(0, 6), None], able=[(), (0,)])
      >>> solution = solve_coalition(task)
      >>> solution.destroyed[0].item(), solution.destroyed_by[0].item()
      (0, 1)
      >>> solution.cells[1, : int(solution.num_cells[1])].tolist()  # it walks up to the wall
      [[2, 6], [2, 5], [2, 4]]
      >>> solution.needed[0, 0].item()  # the first agent waits at index 2 of its route for that
      2
    """

    status: Array
    help: Array
    removal_cost: Array
    removal_bound: Array
    destroyed: Array
    num_destroyed: Array
    destroyed_by: Array
    destroyed_at: Array
    after: Array
    cells: Array
    num_cells: Array
    needed: Array
    cost: Array
    finish: Array
    firm: Array
