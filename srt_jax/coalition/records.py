"""The answers about a coalition, each array with its shape and dtype: A agents, M obstacles, K
obstacles that may be destroyed, N cells a route may have.
"""

import enum

from srt_jax.types import Array, Record, record


class Help(enum.IntEnum):
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

    meaning: str

    def __new__(cls, value: int, meaning: str) -> "Help":
        member = int.__new__(cls, value)
        member._value_ = value
        member.meaning = meaning
        return member


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
    """

    reached: Array
    alone: Array
    destroys: Array
    firm: Array
    help: Array
